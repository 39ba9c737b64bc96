from __future__ import annotations

import functools
import gc
import json
import os
import shutil
import sys
from collections import Counter
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any, NamedTuple

# Tests run side by side, and a second thread of BLAS mostly waits for the first. NumPy reads this
# when it is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import hypothesis
import pytest
import typer
import typer.testing
from tests.lateness import PRESENT, LatenessProbe, run_beside_probe, unjudged

from rigidimeter.cli.main import main
from rigidimeter.core.settings import parse_settings

pytest_plugins = ["pytester", "tests.browser", "tests.small_study"]

Simulate = Callable[..., Path]

RIG_250_HZ = {
    "tick_rate_hz": 250.0,
    "torque": {"rate_hz": 250.0},
    "motion": {"rate_hz": 250.0},
}
"""The standard rig at a quarter of its rate, which is simulated and estimated in a quarter."""

# The same examples in every run, however long they take: a failure is the change's, not the day's.
hypothesis.settings.register_profile(
    "fixed",
    derandomize=True,
    deadline=None,
    suppress_health_check=[hypothesis.HealthCheck.too_slow],
)
hypothesis.settings.load_profile("fixed")


@pytest.fixture(scope="session")
def simulated_sessions(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Run a virtual session of some settings and name, once."""
    folder = tmp_path_factory.mktemp("sessions")
    done: dict[str, Path] = {}

    def run(values: dict[str, Any], name: str) -> Path:
        key = json.dumps([values, name])
        # Not before: the process that starts the others would wait for it, and never use it.
        from tests.replayed import assert_folder_replayed

        from rigidimeter.virtual import run_virtual_session

        if key not in done:
            done[key] = folder / str(len(done))
            run_virtual_session(parse_settings(values), done[key])
            assert_folder_replayed(done[key])
        return done[key]

    return run


@pytest.fixture
def simulate(tmp_path: Path, simulated_sessions: Callable[..., Path]) -> Simulate:
    """Return a folder with a virtual session; sessions of two names are run one by one.

    The rig has 250 ticks a second if no other is given.
    """

    def run(
        *, task: str = "prbs", epochs: int = 1, seed: int = 1, name: str = "session", **tables: Any
    ) -> Path:
        values = {
            "seed": seed,
            "protocol": {
                "blocks": [{"task": task, "epochs": epochs}],
                "rests_s": [1.0],
                "return_s": 1.0,
            },
            "rig": RIG_250_HZ,
            **tables,
        }
        return Path(shutil.copytree(simulated_sessions(values, name), tmp_path / name))

    return run


class Ran(NamedTuple):
    status: int
    out: str
    err: str


# Made anew for each call, the tree of all commands takes longer than most of what is tested.
typer.main.get_command = typer.testing._get_command = functools.cache(typer.main.get_command)


@pytest.fixture
def rigidimeter(monkeypatch, capsys) -> Callable[..., Ran]:
    """Run a command line in this process and return its status and what it printed."""
    monkeypatch.setattr(
        "rigidimeter.core.extensions._loaded", {}
    )  # of --load: a batch depends on it

    def run(*arguments: object) -> Ran:
        monkeypatch.setattr(sys, "argv", ["rigidimeter", *map(str, arguments)])
        capsys.readouterr()
        try:
            main()
            status = 0
        except SystemExit as stop:
            status = stop.code if isinstance(stop.code, int) else 0
        return Ran(status, *capsys.readouterr())

    return run


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the figures of a report, which take most of its time, where words are read."""
    monkeypatch.setattr("rigidimeter.analysis.report.page.svg_text", lambda *_: "<svg/>")


REALTIME = {
    # What is commissioned must not be later than a tick of 4 ms.
    "tests/wire/test_commission": {"priority": 50, "resolves_s": 0.02},
    "tests/wire/test_daily_check": {"priority": 50, "resolves_s": 0.02},
    "tests/wire/": {"priority": 10},
    "tests/faults/test_faults_processes": {},  # true processes, as in life
    "tests/faults/test_faults_": {"priority": 10, "resolves_s": 0.02},
    "tests/faults/test_realtime_": {"resolves_s": 0.2},
    "tests/console/": {"resolves_s": 0.2, "ordinary_probe": True},
    "tests/faults/test_session_ends": {"resolves_s": 0.5},  # its processes wait 1 s for each other
}
"""What keeps real time, the first that fits: priority and what can be resolved, see `lateness`."""


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection() -> Generator[None, object, object]:
    """Nothing of what is imported and collected is garbage: the collector need not look for it."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what keeps real time: other work on the same processors would make it late."""
    for item in items:
        case = getattr(item, "callspec", None)
        if case is not None and case.params.get("rig") == "virtual":
            continue  # on a simulated clock
        for part, options in REALTIME.items():
            if part in item.path.as_posix():
                if "ascii" in item.nodeid:
                    # The kernel passes on a pseudo-terminal's bytes at an ordinary priority.
                    options = {**options, "ordinary_probe": True, "resolves_s": 0.05}
                item.add_marker(pytest.mark.realtime(**options))
                break


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    return run_beside_probe(item, nextitem)


@pytest.fixture
def lateness() -> LatenessProbe:
    """Give the probe that runs beside this test."""
    return PRESENT[0]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--unjudged", metavar="FILE", help="write the tests that were not judged here")


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Count what was skipped by its reasons; name the tests that a busy machine did not judge."""
    skipped = terminalreporter.stats.get("skipped", [])
    lines = unjudged(skipped)
    reasons = Counter(
        report.longrepr[2].removeprefix("Skipped: ")
        for report in skipped
        if not unjudged([report])  # its reason is a page
    )
    for reason, count in reasons.items():
        terminalreporter.write_line(f"SKIPPED {count}: {reason}")
    if file := config.getoption("--unjudged"):
        Path(file).write_text("".join(f"{line}\n" for line in lines), "utf-8")
    elif lines:
        terminalreporter.section("not judged")
        terminalreporter.write("".join(f"{line}\n" for line in lines))
