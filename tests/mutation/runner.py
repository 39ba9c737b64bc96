"""Run the tests of a module against a mutant of it, in a child process that has it in place.

The child is forked with the heavy libraries already imported, so that a mutant costs a fraction of
a second. Each module is looked at by the tests that know it alone: those of the guard, and those of
how a driver stops.
"""

from __future__ import annotations

import importlib
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

import pytest
from tests.mutation.mutants import Mutant

__all__ = ["survivors"]

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src"
ROOMS = ("rigidimeter.guard", "rigidimeter.devices")
"""Imported anew for each mutant: the guard and what uses it."""

GUARD, DEVICES = ROOT / "tests/unit/guard", ROOT / "tests/unit/devices"
TESTS = {
    "guard/watch.py": (GUARD / "test_watch.py", GUARD / "test_step.py"),
    "devices/cia402/drive.py": (DEVICES / "test_stop_paths.py",),
    "devices/ascii/drive.py": (DEVICES / "test_stop_paths.py",),
    "devices/composed.py": (DEVICES / "test_composed.py",),
    "devices/enable_line.py": (DEVICES / "test_enable_line.py",),
}
"""Where they are not the file of the guard's tests with the module's name."""

LONGEST_S = 60
"""A mutant that takes longer goes round for ever: that is seen, too."""

HEAVY = (
    "can",
    "canopen",
    "scipy.signal",
    "rigidimeter.settings",
    "rigidimeter.dynamics",
    "rigidimeter.experiment",
)


class _InPlace(MetaPathFinder, Loader):
    """Finds the mutant where the module would be."""

    def __init__(self, mutant: Mutant) -> None:
        parts = mutant.path.relative_to(SOURCE).with_suffix("").parts
        self._name = ".".join(parts)
        self._code = compile(mutant.source, str(mutant.path), "exec")

    def find_spec(self, fullname: str, *_: object) -> ModuleSpec | None:
        return ModuleSpec(fullname, self) if fullname == self._name else None

    def exec_module(self, module: ModuleType) -> None:
        exec(self._code, module.__dict__)


def survivors(mutants: Sequence[Mutant], workers: int = 2) -> Iterator[Mutant]:
    """Yield each mutant that no test saw."""
    for name in HEAVY:
        importlib.import_module(name)
    waiting, running = list(reversed(mutants)), {}
    while waiting or running:
        while waiting and len(running) < workers:
            mutant = waiting.pop()
            running[_child(mutant)] = mutant
        pid, status = os.wait()
        mutant = running.pop(pid)
        if os.waitstatus_to_exitcode(status) == 0:
            yield mutant


def _child(mutant: Mutant) -> int:
    """Fork a process that ends with 0 if no test fails."""
    sys.stdout.flush()
    pid = os.fork()
    if pid:
        return pid
    status = 1
    try:
        signal.alarm(LONGEST_S)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        status = _tested(mutant)
    finally:
        os._exit(status)


def _tested(mutant: Mutant) -> int:
    """Return 0 if every test passes with the mutant in place."""
    for name in [name for name in sys.modules if name.startswith(ROOMS)]:
        del sys.modules[name]
    sys.meta_path.insert(0, _InPlace(mutant))
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # each costs a mutant time
    options = ["-x", "-q", "-p", "no:cacheprovider", "--noconftest", "--assert=plain"]
    module = mutant.path.relative_to(SOURCE / "rigidimeter").as_posix()
    tests = TESTS.get(module, (GUARD / f"test_{mutant.path.stem}.py",))
    return int(pytest.main([*options, *map(str, tests)]))
