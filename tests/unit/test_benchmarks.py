"""Every benchmark runs to its end, in its smallest form; the numbers that it prints are no test."""

import importlib
import re
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from benchmarks import batch, between_samples
from benchmarks.loop import late_and_missed
from benchmarks.quiet import Beside, Others, quiet_words, ratio_words
from benchmarks.scenarios.__main__ import PAGE
from benchmarks.scenarios.page import measured, table

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"

SMALLEST = {
    "__main__": "--quick",
    "accuracy": "--share 0 --only rates",
    "active_stretches": "--epochs 1 --only fitted",
    "archive": "--epochs 8",
    "between_samples": "PI",
    "calibration": "0.001",
    "checks_cost": "--epochs 1 --repeats 1",
    "cpu_commands": "--command estimate --repeats 1 --study {study}",
    "day_tests": "2 1 3 days each\nplan 1",
    "estimation_cost": "--repeats 1 --only one memory --memory 1",
    "false_alarms": "--hours 1e-5",
    "drive_torque": "--hours 1e-5",
    "file_faults": "--files 8",
    "house": "--trip design",
    "reading": "--rows 3000",
    "held_at_limit": "--hours 1e-5",
    "joint_impedance.__main__": "\n--packages lstsq --only relaxed --recordings 1",
    "joint_impedance.score": "{results}/lstsq.csv",
    "late_drive": "1",
    "model_terms": "--epochs 1 --only relaxed",
    "null_studies": "--studies 1 --processes 1",
    "scenarios.__main__": "--only relaxed --recordings 1 --methods bandlimited",
    "tick": "--repeats 1",
    "torque_channel": "--repeats 1",
    "torque_sign": "--epochs 1 --sizes small",
    "untrue": "",
    "verdicts": "run {folder}/studies --studies 1 --seconds 0.01\ntable {folder}/studies\n"
    "days --studies 1 --only 4",
}
"""Arguments by module, a line for each run."""

REAL_TIME = {"loop", "console", "page", "emg"}
"""Those that keep real time or need a browser: `tests.faults.test_realtime_benchmarks`."""


def smaller(name: str, module: ModuleType, folder: Path) -> Mapping[str, Any]:
    """Return what a module is to do less of than its arguments can say, and where to write."""
    if name == "between_samples":
        page = folder / "page.md"
        page.write_text("<!-- measured: begin --><!-- measured: end -->", "utf-8")
        return {"TABLE": page, "FIRST_HZ": (100.0,), "FILTERS_HZ": (0.0,)}
    if name == "joint_impedance.__main__":
        return {"PAGE": folder / "page.md"}
    if name == "estimation_cost":
        return {
            "RECORDINGS": dict([*module.RECORDINGS.items()][:1]),
            "kept_apart_mb": module.kept_mb,
            "FIRST": 1,
        }
    if name == "late_drive":
        some = {key: module.RECORDED[key] for key in list(module.RECORDED)[:1]}
        return {"EPOCHS": 2, "LIMBS": {"human": (*module.RIGS,)[1:]}, "RECORDED": some}
    if name == "active_stretches":
        return {"SUBJECTS": dict([*module.SUBJECTS.items()][:1])}
    if name == "archive":
        return {"apart": module.measured}
    if name in ("drive_torque", "false_alarms"):
        (kind, *_), compiled = module.kinds(), module.compiled
        return {"kinds": lambda: [kind], "compiled": lambda: interpreted(compiled)}
    if name == "held_at_limit":
        (row, *_), compiled = module.rows(False), module.compiled
        return {"rows": lambda _: [row], "compiled": lambda: interpreted(compiled)}
    if name == "torque_sign":
        one = dict([*module.SUBJECTS.items()][:1])
        return {"RATES": module.RATES[:1], "SUBJECTS": one, "MOMENTS_S": module.MOMENTS_S[:1]}
    if name == "untrue":
        return {"CASES": dict([*module.CASES.items()][:1]), "SEEDS": 1}
    return {"DAYS": 2} if name == "verdicts" else {}


def interpreted(compiled: Callable[[], Any]) -> Any:
    """Return the guard's laws as they are put together; to compile them takes half a minute."""
    with patch("numba.njit", lambda function, **_: function):
        return compiled()


def modules() -> Iterator[str]:
    """Yield the benchmarks that can be run."""
    for path in sorted(BENCHMARKS.rglob("*.py")):
        if path.name == "__main__.py" or '__name__ == "__main__"' in path.read_text("utf-8"):
            yield ".".join(path.relative_to(BENCHMARKS).with_suffix("").parts)


def test_every_benchmark_is_here() -> None:
    in_the_table = {"batch", "online"}  # rows of `python -m benchmarks`
    assert set(modules()) == SMALLEST.keys() | REAL_TIME | in_the_table


@pytest.mark.parametrize("name", SMALLEST)
def test_it_runs_to_its_end(
    name: str,
    tmp_path: Path,
    scored_study: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    module = importlib.import_module(f"benchmarks.{name}")
    for what, value in smaller(name, module, tmp_path).items():
        monkeypatch.setattr(module, what, value)
    monkeypatch.setattr(batch, "apart", batch.measured_run)
    for line in (
        SMALLEST[name]
        .format(
            folder=tmp_path, study=scored_study, results=BENCHMARKS / "joint_impedance" / "results"
        )
        .split("\n")
    ):
        monkeypatch.setattr(sys, "argv", [name, *shlex.split(line)])
        module.main()
    assert re.search(r"\d", capsys.readouterr().out)


def test_ticks_of_cyclictest_are_counted_as_ours() -> None:
    """At 1 kHz: 0.4 and 0.6 ms late miss none, 1 ms the next tick, 3.4 ms the next three."""
    counts = np.bincount([400, 600, 1000, 1999, 3400, 3400], minlength=5000)
    assert late_and_missed(counts, 1000.0) == (5, 1 + 1 + 3 + 3)
    assert late_and_missed(counts, 100.0) == (0, 0)


def test_a_machine_is_quiet_by_others_load_and_cyclictest():
    quiet, busy, late = Beside(2.0, 40.0), Beside(30.0, 40.0), Beside(2.0, 90.0, 3)
    assert quiet_words([quiet, quiet]).startswith("The machine was quiet: ")
    assert "was not quiet: other programs took at most 30 %" in quiet_words([quiet, busy])
    assert "cyclictest woke up 3 times more than half" in quiet_words([quiet, late])
    assert "was not quiet" in quiet_words([quiet, late])
    assert "cyclictest is not installed" in quiet_words([Beside(1.0)])


def test_others_take_what_is_busy_and_not_ours(monkeypatch):
    """Of 10 s of each processor, 4 s were busy in all, and 1 s of these ours."""
    times = iter([(0.0, 100.0, 5.0), (10.0, 104.0, 6.0)])
    monkeypatch.setattr(Others, "_now", staticmethod(lambda: next(times)))
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    assert Others().percent() == pytest.approx(15.0)


def test_a_ratio_has_the_interval_of_its_runs():
    """Logarithms -0.1, 0 and 0.1: their standard error is 0.0577, and t 4.303."""
    assert ratio_words(np.exp([0.9, 1.0, 1.1]), np.exp([1.0] * 3)) == "1.00 (0.78 to 1.28)"
    assert ratio_words([3.0], [2.0]) == "1.50"


def test_a_table_is_written_as_it_stands_in_its_page() -> None:
    page = between_samples.TABLE.read_text("utf-8")
    assert between_samples.written(between_samples.read(page)) in page
    of_scenarios = PAGE.read_text("utf-8")
    header, rule = table({})
    assert "\n".join(["<details><summary>The table</summary>", "", header, rule]) in of_scenarios
    assert measured({}).strip().startswith("<details>")
