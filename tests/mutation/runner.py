"""Run a module's own tests against a mutant, in a child process that has it in place.

The child is forked with the heavy libraries already imported, so that a mutant costs a fraction of
a second. Each module is looked at by the fast tests that know it best, the quickest first.
"""

from __future__ import annotations

import importlib
import os
import resource
import signal
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

import pytest
from tests.mutation.mutants import PACKAGE, Mutant

__all__ = ["TESTS", "seen_by", "tests_of"]

ROOT = Path(__file__).parents[2]
NAME = PACKAGE.name
UNIT = "tests/unit"

_RUN = tuple(
    f"rig/acquisition/test_{name}.py"
    for name in (
        *("tick", "late_ticks", "ramp", "modes", "session_run", "session_end", "zeroing"),
        *("controller_run", "orders", "loop_and_session", "stop_report", "compared_torques"),
    )
)
_STEP = tuple(f"rig/guard/test_{name}.py" for name in ("step", "position_limit", "following"))
TESTS = {
    "model/controller.py": (
        *("model/test_admittance.py", "model/test_filters.py", "model/test_tracking.py"),
    ),
    "rig/guard/causes.py": ("rig/guard/test_causes.py",),
    "rig/guard/agreement.py": (
        "rig/guard/test_agreement_memories.py",
        "rig/guard/test_consistency.py",
    ),
    "rig/guard/consistency.py": (
        *(
            "rig/guard/test_rest.py",
            "rig/guard/test_late_means.py",
            "rig/guard/test_consistency.py",
        ),
    ),
    "rig/guard/contact.py": ("rig/guard/test_contact.py", "rig/guard/test_position_limit.py"),
    "rig/guard/drive_torque.py": ("rig/guard/test_drive_torque.py",),
    "rig/guard/wild_torque.py": ("rig/guard/test_wild_torque.py",),
    "rig/guard/limits.py": ("rig/guard/test_limits.py",),
    "rig/guard/step.py": _STEP,
    "rig/guard/torque_answer.py": (
        *("rig/guard/test_answer_window.py", "rig/guard/test_torque_answer.py"),
        "rig/guard/test_consistency.py",
    ),
    "rig/guard/torque_sign.py": (
        *(
            "rig/guard/test_torque_sign.py",
            "rig/guard/test_sign_edges.py",
            "rig/guard/test_torque_answer.py",
        ),
    ),
    "rig/guard/watch.py": ("rig/guard/test_watch.py", *_STEP),
    "rig/acquisition/control_modes.py": ("rig/acquisition/test_modes.py", *_RUN),
    "rig/acquisition/controller_run.py": ("rig/acquisition/test_controller_run.py", *_RUN),
    "rig/acquisition/run_states.py": (
        "rig/acquisition/test_states.py",
        "rig/acquisition/test_session_run.py",
    ),
    "rig/acquisition/session_run.py": ("rig/acquisition/test_session_run.py", *_RUN),
    "rig/acquisition/session_end.py": ("rig/acquisition/test_session_end.py", *_RUN),
    "rig/acquisition/zeroing.py": (
        "rig/acquisition/test_zeroing.py",
        "rig/acquisition/test_session_run.py",
    ),
    "rig/acquisition/supervision.py": (
        *("rig/acquisition/test_session_run.py", "rig/acquisition/test_stop_report.py"),
    ),
    "rig/acquisition/tick.py": _RUN,
    "rig/acquisition/decision.py": _RUN,
    "rig/acquisition/stop_report.py": (
        *("rig/acquisition/test_stop_numbers.py", "rig/acquisition/test_stop_report.py"),
    ),
    "rig/acquisition/stop_remedies.py": ("rig/acquisition/test_stop_report.py",),
    "rig/acquisition/processes/ring_writer.py": (
        *("rig/acquisition/test_ring_writer.py", "rig/acquisition/test_shared_status.py"),
    ),
    "rig/devices/ascii/drive.py": ("rig/devices/test_serial_stop_paths.py",),
    "rig/devices/cia402/drive.py": ("rig/devices/test_stop_paths.py",),
    "rig/devices/composed.py": ("rig/devices/test_composed.py",),
    "rig/devices/enable_line.py": ("rig/devices/test_enable_line.py",),
}
"""Of each module, below `tests/unit`."""

_WATCHED = ("rig/acquisition/test_watched_processes.py",)
BY_HAND = {
    "rig/acquisition/processes/end_signals.py": ("rig/acquisition/test_signals.py",),
    "rig/acquisition/processes/loop_process.py": _WATCHED,
    "rig/acquisition/processes/recorder.py": ("rig/acquisition/test_ring_recovery.py",),
    "rig/acquisition/processes/recorder_process.py": _WATCHED,
    "rig/acquisition/processes/supervisor.py": _WATCHED,
    "rig/console/page/server_state.py": ("rig/console/page/test_presence.py",),
    "rig/console/page/live_socket.py": ("rig/console/page/test_live_socket.py",),
    "rig/console/page/access.py": ("rig/console/page/test_access.py",),
    "rig/console/page/page_token.py": ("rig/console/page/test_page_token.py",),
    "rig/console/stop_keys.py": ("rig/console/test_stop_keys.py",),
    "rig/console/alarms.py": ("rig/console/test_alarms.py",),
}
"""The same of modules in which only the faults made by hand are looked for."""

CPU_S, WALL_S = 30, 600
"""A mutant that takes more goes round for ever, or waits for ever: that is seen, too."""

MEMORY_BYTES, FILE_BYTES = 4 << 30, 100 << 20
"""What a mutant that records for ever may fill."""

KEPT = f"{NAME}.core"
"""The island that knows no mutated module: a child takes it as it is."""

HEAVY = ("can", "canopen", "numpy", "scipy.signal", "pyarrow", "hypothesis", f"{KEPT}.settings")


class _InPlace(MetaPathFinder, Loader):
    """Finds the mutant where the module would be."""

    def __init__(self, mutant: Mutant) -> None:
        parts = mutant.path.relative_to(PACKAGE.parent).with_suffix("").parts
        self._name = ".".join(parts)
        self._code = compile(mutant.source, str(mutant.path), "exec")

    def find_spec(self, fullname: str, *_: object) -> ModuleSpec | None:
        return ModuleSpec(fullname, self) if fullname == self._name else None

    def exec_module(self, module: ModuleType) -> None:
        exec(self._code, module.__dict__)


class _First:
    """Keeps the name of the first test that fails, or of the file that cannot be imported."""

    name = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self.name = self.name or report.nodeid

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self.name = self.name or f"{report.nodeid} (import)"


def tests_of(path: Path) -> tuple[str, ...]:
    """Return the files of the tests of a module, as pytest takes them."""
    name = path.relative_to(PACKAGE).as_posix()
    return tuple(f"{UNIT}/{test}" for test in {**TESTS, **BY_HAND}[name])


def seen_by(
    mutants: Sequence[Mutant],
    workers: int = 2,
    tests: Mapping[Path, Sequence[str]] | None = None,
) -> Iterator[tuple[Mutant, str]]:
    """Yield each mutant with the test that saw it, empty if none did; `tests` are by module."""
    for name in HEAVY:
        importlib.import_module(name)
    waiting, running = list(reversed(mutants)), {}
    with tempfile.TemporaryDirectory() as scratch:
        while waiting or running:
            while waiting and len(running) < workers:
                mutant = waiting.pop()
                its_own = tests[mutant.path] if tests else tests_of(mutant.path)
                pid, answer = _child(mutant, its_own, Path(scratch) / str(len(waiting)))
                running[pid] = mutant, answer
            pid, status = os.wait()
            mutant, answer = running.pop(pid)
            with os.fdopen(answer) as file:
                test = file.read()
            code = os.waitstatus_to_exitcode(status)
            yield mutant, "" if code == 0 else test or f"no end: {code}"


def _child(mutant: Mutant, tests: Sequence[str], scratch: Path) -> tuple[int, int]:
    """Fork a process that ends with 0 if no test fails, and tells which did."""
    sys.stdout.flush()
    answer, tell = os.pipe()
    pid = os.fork()
    if pid:
        os.close(tell)
        return pid, answer
    status = 1
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
        resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_BYTES, FILE_BYTES))
        signal.alarm(WALL_S)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        status, name = _tested(mutant, tests, scratch)
        os.write(tell, name.encode())
    finally:
        os._exit(status)


def _tested(mutant: Mutant, tests: Sequence[str], scratch: Path) -> tuple[int, str]:
    """Return 0 if every test passes with the mutant in place, else the first that does not."""
    for name in [name for name in sys.modules if name.startswith(NAME)]:
        if not name.startswith(KEPT):
            del sys.modules[name]
    sys.meta_path.insert(0, _InPlace(mutant))
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # each costs a mutant time
    options = ["-x", "-q", "-p", "no:cacheprovider", "--noconftest", "--assert=plain"]
    options += ["-m", "not slow and not realtime", "--basetemp", str(scratch)]
    first = _First()
    os.chdir(ROOT)
    return int(pytest.main([*options, *dict.fromkeys(tests)], [first])), first.name
