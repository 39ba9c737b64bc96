"""Damaged and hostile inputs to every reader: `python -m tests.fuzz --cases 4000 --seed 1`.

Each case takes a sound input, changes it in one way, and runs the command line on it in a process
of its own, with 1 GB of address space over what the process had before and 30 s. A case fails if it
ends in a traceback or a signal, takes more time or memory, or changes a file outside its output.

The process is forked from one that has read every sound input before, and so has imported what the
commands import: a case then costs a fraction of a second.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import multiprocessing
import multiprocessing.connection
import os
import resource
import sys
import tempfile
import time
import traceback
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from tests.fuzz_damage import NUMBERS, mutated, strange
from tests.fuzz_inputs import CALLS, OPTIONS, TARGETS, Archive, columns, write_csv

from rigidimeter.cli.main import main as rigidimeter
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import read_bytes, visible

MEMORY_BYTES = 2**30
TIME_S = 30.0
"""Of a processor; on the wall four times as much, since other work may run on the machine."""
OPTION_CASES = 3
"""In each round of the targets."""
WORKERS = os.cpu_count() or 1


@dataclass(frozen=True)
class Result:
    """How a case ended: nothing in `failed` if well."""

    case: str
    failed: str
    refused: bool = False
    time_s: float = 0.0
    """Of a processor."""
    memory_bytes: int = 0
    """Address space at its most, over what the process had before."""

    @property
    def ended(self) -> str:
        return "failed" if self.failed else "refused" if self.refused else "read"


def label(case: int, seed: int) -> str:
    return f"case {case} of seed {seed}"


def kind_of(case: int) -> str:
    """Return what a case damages."""
    place = case % (len(TARGETS) + OPTION_CASES)
    return TARGETS[place].name if place < len(TARGETS) else "option"


def prepare(case: int, seed: int, folder: Path) -> tuple[str, list[str]]:
    """Write a case into a folder; return its name and its command line."""
    rng = np.random.default_rng([seed, case])
    (folder / "out").mkdir()
    name = kind_of(case)
    if name == "option":  # a number of the command line
        write_csv(folder)
        option, *values = OPTIONS[int(rng.integers(len(OPTIONS)))]
        given = [option, *values, str(rng.choice(NUMBERS))]
        return f"option {' '.join(given)[:60]}", ["estimate", "r.csv", *given]
    target = next(target for target in TARGETS if target.name == name)
    target.make(folder)
    path = folder / target.damaged
    kind = int(rng.integers(24))
    if kind == 0:
        path.unlink()
        os.mkfifo(path)
        return f"{target.name}, a pipe", [*target.command]
    if kind == 1:
        path.unlink()
        path.symlink_to("/dev/zero")
        return f"{target.name}, endless", [*target.command]
    if kind < 8 and isinstance(target, Archive):
        way, arrays = strange(columns(), rng)
        try:
            target.save(path, arrays)
        except (TypeError, ValueError):  # a format has not every type
            way = "sound"
        return f"{target.name}, {way}", [*target.command]
    way, data = mutated(read_bytes(path, 2**30), rng)
    path.write_bytes(data)
    return f"{target.name}, {way}", [*target.command]


def outside(folder: Path) -> dict[str, bytes | None]:
    """Return every file of a case that is not its output, with its bytes."""
    return {
        str(path): path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
        if not {"out", "analysis"} & set(path.relative_to(folder).parts)
    }


def run_here(command: Sequence[str]) -> tuple[int, str]:
    """Run the command line in this process; return its status and what it printed."""
    said = io.StringIO()
    before = sys.argv
    sys.argv = ["rigidimeter", *command]
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            try:
                if command[0] in CALLS:
                    CALLS[command[0]](Path(command[1]))
                else:
                    rigidimeter()
                status = 0
            except UserError as error:
                print(visible(str(error)))
                status = 1
            except SystemExit as end:
                status = end.code if isinstance(end.code, int) else 1
    finally:
        sys.argv = before
    return status, said.getvalue()


def run_case(case: int, seed: int) -> Result:
    """Run one case in this process."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as place:
        folder = Path(place)
        name, command = prepare(case, seed, folder)
        back = Path.cwd()
        os.chdir(folder)
        before = outside(folder)
        start_s = time.process_time()
        failed = ""
        status = 1
        try:
            status, said = run_here(command)
            if "\x1b" in said:
                failed = "ESC on the terminal"
            if "needs more memory" in said:
                failed = "more than its memory"
        except BaseException:
            failed = "".join(traceback.format_exc(limit=-3))
        finally:
            os.chdir(back)
        recovers = command[0] == "recover"  # it adds to the folder that it is given
        if not failed and not recovers and outside(folder) != before:
            failed = "changed a file outside its output"
        return Result(
            f"{label(case, seed)}: {name}: {' '.join(command)}",
            failed,
            status != 0,
            time.process_time() - start_s,
        )


def warm() -> None:
    """Read every sound input once, so that what the commands import is there before a fork."""
    back = Path.cwd()
    for target in TARGETS:
        with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
            target.make(Path(folder))
            (Path(folder) / "out").mkdir()
            os.chdir(folder)
            try:
                run_here(target.command)
            finally:
                os.chdir(back)


def _child(case: int, seed: int, answer: multiprocessing.connection.Connection) -> None:
    used = _address_space("VmSize")
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY_BYTES,) * 2)
    resource.setrlimit(resource.RLIMIT_CPU, (int(TIME_S),) * 2)
    result = run_case(case, seed)
    answer.send(replace(result, memory_bytes=_address_space("VmPeak") - used))


def _address_space(entry: str) -> int:
    status = Path("/proc/self/status").read_text()
    return int(status.partition(f"{entry}:")[2].split()[0]) * 1024


@dataclass(frozen=True)
class _Running:
    """A case that runs apart: its process, what it answers on, and when it must have ended."""

    case: int
    process: multiprocessing.process.BaseProcess
    answer: multiprocessing.connection.Connection
    end_s: float

    def result(self, seed: int) -> Result:
        """Wait for the end; return how it ended."""
        try:
            if self.answer.poll(max(0.0, self.end_s - time.monotonic())):
                found: Result = self.answer.recv()
                return found
            return Result(label(self.case, seed), f"more than {4 * TIME_S:g} s")
        except EOFError:
            self.process.join()
            status = self.process.exitcode or 0
            return Result(label(self.case, seed), f"ended by signal {-status}")
        finally:
            self.process.kill()
            self.process.join()
            self.answer.close()


def run_apart(
    cases: Sequence[int], seed: int, workers: int = WORKERS
) -> Iterator[tuple[int, Result]]:
    """Run each case in a process of its own, within the limits; yield as they end."""
    context = multiprocessing.get_context("fork")
    waiting, running = list(reversed(cases)), dict[int, _Running]()
    while waiting or running:
        while waiting and len(running) < workers:
            case = waiting.pop()
            ours, theirs = context.Pipe(duplex=False)
            process = context.Process(target=_child, args=(case, seed, theirs))
            process.start()
            theirs.close()
            running[case] = _Running(case, process, ours, time.monotonic() + 4 * TIME_S)
        first_s = min(one.end_s for one in running.values()) - time.monotonic()
        answers = [one.answer for one in running.values()]
        ready = multiprocessing.connection.wait(answers, max(0.0, first_s))
        for case, one in list(running.items()):
            if one.answer in ready or one.end_s <= time.monotonic():
                yield case, running.pop(case).result(seed)


def table_lines(found: Sequence[tuple[int, Result]]) -> list[str]:
    """Return how the cases ended: a line for each input, and one for all."""
    kinds: dict[str, list[Result]] = defaultdict(list)
    for case, result in found:
        kinds[kind_of(case)].append(result)
    lines = [f"{'input':<20} cases  read refused failed  slowest s  most MB"]
    for kind, results in [*sorted(kinds.items()), ("all", [result for _, result in found])]:
        ended = [sum(one.ended == way for one in results) for way in ("read", "refused", "failed")]
        lines.append(
            f"{kind:<20} {len(results):5d} {ended[0]:5d} {ended[1]:7d} {ended[2]:6d} "
            f"{max(one.time_s for one in results):10.1f} "
            f"{max(one.memory_bytes for one in results) / 1e6:8.0f}"
        )
    return lines


def main() -> int:
    """Run cases and print what failed, and a table of how all ended."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("--cases", type=int, default=4000)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=WORKERS)
    given = parser.parse_args()
    found = []
    with tempfile.TemporaryDirectory(prefix="fuzz-") as scratch:
        tempfile.tempdir = scratch  # also what a case leaves that is killed
        warm()
        cases = range(given.first, given.first + given.cases)
        for case, result in run_apart(cases, given.seed, given.workers):
            found.append((case, result))
            if result.failed:
                print(f"{result.case}\n{result.failed}\n", flush=True)
            if len(found) % 100 == 0:
                print(f"{len(found)} of {given.cases} cases", file=sys.stderr, flush=True)
    print(f"{given.cases} cases of seed {given.seed}:")
    print("\n".join(table_lines(found)))
    return int(any(result.failed for _, result in found))


if __name__ == "__main__":
    sys.exit(main())
