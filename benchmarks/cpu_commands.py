"""What the commands cost in CPU time, beside another source tree, in one run.

The study is the virtual one of the paper's size, made once, by the other tree if there is one: what
an older version recorded is read by both. Each command runs by turns from both
trees, on a fresh copy of the study, so that no run finds what another one kept. CPU time is user
and system time of the process and its children.

    python -m benchmarks.cpu_commands --against ../other/src
    python -m benchmarks.cpu_commands --against ../other/src --command compare --repeats 5
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

SOURCE = Path(__file__).parents[1] / "src"
COMMANDS = ("compare", "estimate", "report", "reproduce")


class Cost(NamedTuple):
    """CPU and wall time of one run, in s."""

    cpu_s: float
    wall_s: float


def run(source: Path, folder: Path, *arguments: object) -> Cost:
    """Run a command of a source tree in a folder and return what it cost.

    Raises
    ------
    SystemExit
        If it fails; says what it printed.
    """
    log = folder / "printed.txt"
    command = [sys.executable, "-m", "rigidimeter", *map(str, arguments)]
    start_s = time.perf_counter()
    with log.open("w", encoding="utf-8") as printed:
        process = subprocess.Popen(
            command,
            cwd=folder,
            env=os.environ | {"PYTHONPATH": str(source)},
            stdin=subprocess.DEVNULL,
            stdout=printed,
            stderr=subprocess.STDOUT,
        )
        _, status, usage = os.wait4(process.pid, 0)
    wall_s = time.perf_counter() - start_s
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        shown = " ".join(map(str, arguments))
        raise SystemExit(f"rigidimeter {shown} of {source}: {log.read_text(encoding='utf-8')}")
    return Cost(usage.ru_utime + usage.ru_stime, wall_s)


def measured(command: str, source: Path, study: Path) -> Cost:
    """Run one of the commands on a fresh copy of the study."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        if command == "reproduce":
            return run(source, folder, "reproduce", "--out", "paper")
        copy = folder / "study"
        shutil.copytree(study, copy, ignore=shutil.ignore_patterns("analysis"))
        arguments: dict[str, list[object]] = {
            "compare": ["compare", "study", "--json", "comparison.json"],
            "estimate": [
                "estimate",
                *(path.relative_to(folder) for path in sorted((copy / "sessions").iterdir())),
                *("--json", "estimates.json"),
            ],
            "report": ["report", "study", "--out", "report"],
        }
        return run(source, folder, *arguments[command])


def made(study: Path, source: Path) -> Path:
    """Return the study; the tree makes it if it is not there."""
    study = study.resolve()
    if not (study / "study.toml").is_file():
        study.parent.mkdir(parents=True, exist_ok=True)
        cost = run(source, study.parent, "study", "simulate", "--out", study.name)
        print(f"study simulate: {cost.cpu_s:.1f} s CPU, {cost.wall_s:.1f} s", flush=True)
    return study


def by_turns(command: str, sources: Sequence[Path], study: Path, repeats: int) -> list[Cost]:
    """Return the median cost of a command for each tree; who begins changes every time."""
    costs: list[list[Cost]] = [[] for _ in sources]
    for repeat in range(repeats):
        turns = list(zip(costs, sources, strict=True))
        for each, source in turns if repeat % 2 == 0 else turns[::-1]:
            each.append(measured(command, source, study))
    return [
        Cost(
            statistics.median(cost.cpu_s for cost in each),
            statistics.median(cost.wall_s for cost in each),
        )
        for each in costs
    ]


def _lines(command: str, found: Sequence[Cost]) -> str:
    here = found[0]
    line = f"{command:<12} {here.cpu_s:8.1f} {here.wall_s:8.1f}"
    if len(found) == 1:
        return line
    there = found[1]
    ratios = f"{here.cpu_s / there.cpu_s:8.2f} {here.wall_s / there.wall_s:8.2f}"
    return f"{line} {there.cpu_s:8.1f} {there.wall_s:8.1f} {ratios}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, and print medians and ratios."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.cpu_commands", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--against", type=Path, metavar="SRC", help="another tree's src folder")
    parser.add_argument("--source", type=Path, metavar="SRC", help="in place of the working tree")
    parser.add_argument("--repeats", type=int, default=3, metavar="N", help="of each command")
    parser.add_argument(
        "--command", action="append", choices=COMMANDS, help="this command; repeatable"
    )
    parser.add_argument(
        "--study", type=Path, metavar="DIR", help="reuse this study, or make it here and keep it"
    )
    options = parser.parse_args(arguments)
    ours = (options.source or SOURCE).resolve()
    sources = [ours] if options.against is None else [ours, options.against.resolve()]
    for source in sources:
        if not (source / "rigidimeter").is_dir():
            raise SystemExit(f"{source}: there is no rigidimeter in it; name a src folder")
    with tempfile.TemporaryDirectory() as temporary:
        commands = options.command or COMMANDS
        study = options.study or Path(temporary) / "study"
        if commands != ["reproduce"]:
            study = made(study, sources[-1])
            for source in sources:  # compile what is not compiled yet
                run(source, Path(temporary), "estimate", next((study / "sessions").iterdir()))
        head = f"{'command':<12} {'CPU s':>8} {'wall s':>8}"
        if len(sources) > 1:
            head += f" {'other':>8} {'wall s':>8} {'CPU ×':>8} {'wall ×':>8}"
        print(head, flush=True)
        for command in commands:
            print(_lines(command, by_turns(command, sources, study, options.repeats)), flush=True)


if __name__ == "__main__":
    main()
