"""Damaged and hostile inputs to every reader: `python -m tests.fuzz --cases 4000 --seed 1`.

Each case takes a sound input, changes it in one way, and runs the command line on it in a process
of its own, with 1 GB of address space over what the process had before and 30 s. A case fails if it
ends in a traceback or a signal, takes more time or memory, or changes a file outside its output.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import multiprocessing
import multiprocessing.connection
import os
import resource
import shutil
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tests.fuzz_inputs import CALLS, NUMBERS, OPTIONS, TARGETS, made_session, mutated, write_csv

from rigidimeter.cli.main import main as rigidimeter
from rigidimeter.documents import read_bytes, visible
from rigidimeter.errors import UserError

MEMORY_BYTES = 2**30
TIME_S = 30.0
"""Of a processor; on the wall four times as much, since other work may run on the machine."""


@dataclass(frozen=True)
class Result:
    """How a case ended: nothing in `failed` if well."""

    case: str
    failed: str
    time_s: float
    refused: bool


def prepare(case: int, seed: int, folder: Path) -> tuple[str, list[str]]:
    """Write a case into a folder; return its name and its command line."""
    rng = np.random.default_rng([seed, case])
    target = TARGETS[case % len(TARGETS)]
    target.make(folder)
    (folder / "out").mkdir()
    if case % 8 == 7:  # a number of the command line
        write_csv(folder)
        option, *values = OPTIONS[int(rng.integers(len(OPTIONS)))]
        given = [option, *values, str(rng.choice(NUMBERS))]
        return f"option {' '.join(given)[:60]}", ["estimate", "r.csv", *given]
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
        except BaseException:
            failed = "".join(traceback.format_exc(limit=-3))
        finally:
            os.chdir(back)
        recovers = command[0] == "recover"  # it adds to the folder that it is given
        if not failed and not recovers and outside(folder) != before:
            failed = "changed a file outside its output"
        label = f"case {case} of seed {seed}: {name}: {' '.join(command)}"
        return Result(label, failed, time.process_time() - start_s, status != 0)


def _child(case: int, seed: int, answer: multiprocessing.connection.Connection) -> None:
    with Path("/proc/self/statm").open() as file:
        used = int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY_BYTES,) * 2)
    resource.setrlimit(resource.RLIMIT_CPU, (int(TIME_S),) * 2)
    try:
        answer.send(run_case(case, seed))
    except MemoryError:
        answer.send(Result(f"case {case} of seed {seed}", "more than its memory", 0.0, True))


def run_apart(case: int, seed: int) -> Result:
    """Run one case in a process of its own, within the limits."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_child, args=(case, seed, theirs))
    process.start()
    theirs.close()
    label = f"case {case} of seed {seed}"
    try:
        if not ours.poll(4 * TIME_S):
            return Result(label, f"more than {4 * TIME_S:g} s", TIME_S, False)
        result: Result = ours.recv()
        return result
    except EOFError:
        process.join()
        return Result(label, f"ended by signal {-(process.exitcode or 0)}", 0.0, False)
    finally:
        process.kill()
        process.join()


def main() -> int:
    """Run cases and print what failed, and a table of how all ended."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("--cases", type=int, default=4000)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    made_session()
    ended: Counter[str] = Counter()
    slowest = 0.0
    for case in range(given.first, given.first + given.cases):
        result = run_apart(case, given.seed)
        slowest = max(slowest, result.time_s)
        ended["failed" if result.failed else "refused" if result.refused else "read"] += 1
        if result.failed:
            print(f"{result.case}\n{result.failed}\n", flush=True)
        if sum(ended.values()) % 100 == 0:
            print(f"{dict(ended)}; slowest {slowest:.1f} s", file=sys.stderr, flush=True)
    shutil.rmtree(made_session().parent)
    print(f"{given.cases} cases of seed {given.seed}: {dict(ended)}; slowest {slowest:.1f} s")
    return int(ended["failed"] > 0)


if __name__ == "__main__":
    sys.exit(main())
