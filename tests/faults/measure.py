"""Measure every fault's reaction and write the tables of three pages.

    python -m tests.faults.measure              runs the tests, about four minutes
    python -m tests.faults.measure LINES.jsonl  takes what a run noted
    python -m tests.faults.measure --pause      only whoever leads a session is gone, two minutes

The faults go to `faults.md`, in short to `hazards.md`, every case to `guard-laws.md`; only what
stands between the two marks of a page is replaced. So is, between two others of `faults.md`, what
follows when whoever leads a session is gone, at twenty random moments of it; a simulated clock
gives the same numbers each time.
"""

from __future__ import annotations

import json
import os
import platform
import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Any

from tests.docs.measured import MARKS, between_the_marks, folded
from tests.faults.closed_pages import HOW, closed, moments, pause_table
from tests.faults.rigs import RIGS
from tests.faults.torque_faults import table as torque_faults

ROOT = Path(__file__).parents[2]
HAZARDS = ROOT / "docs" / "reference" / "hazards.md"
FAULTS_PAGE = ROOT / "docs" / "development" / "faults.md"
GUARD_LAWS = ROOT / "docs" / "development" / "guard-laws.md"
BEGIN, END = (mark.format(what="measured") for mark in MARKS)

FAULTS: dict[int, tuple[str, str, str]] = {
    1: ("NaN or Inf in torque, angle, parameter, perturbation or command",
        "guard, before the filter's state; settings and drivers refuse it", "S1"),
    2: ("sensor packets stop, or come late", "guard: age of the torque above `stale_s`", "S1"),
    3: ("packets flow, sequence or value frozen", "RDT driver: nothing fresh for `frozen_s`", "S1"),
    4: ("saturation bit or serious status", "RDT driver: the status word", "S1"),
    5: ("lost, repeated, reordered, short, damaged packets; counters that start again; backlog",
        "RDT driver: more than `tolerated_packets` in `packet_window_s`", "counted, then S1"),
    6: ("units or calibration changed on reconnect; bias under load",
        "RDT driver: the page; session: zeroing", "no run"),
    7: ("drive fault, emergency message, unexpected state or mode, a second node of the same id",
        "drive driver: status word, mode, emergency", "S1"),
    8: ("drive's heartbeat or measurements lost",
        "drive driver: `lost_s`; guard: `stale_s`", "S1, enable contact opened"),
    9: ("loop killed, stopped, hung", "the drive's own watchdog", "the drive stops itself"),
    10: ("restart with a stale target", "enable reads the target back", "no motion"),
    11: ("deadlines missed", "loop: lateness of each tick", "S1"),
    12: ("wall clock jumps an hour", "none needed: monotonic time only", "no effect"),
    13: ("running at the position limit at full speed", "guard: v ≤ √(2·a·d)",
         "limited; the epoch is excluded"),
    14: ("limit exceeded, encoder jump or sign flip", "guard: position, expected angle", "S1"),
    15: ("motion is not what was commanded; overspeed", "guard: expected angle, speed",
         "S1, then without power"),
    16: ("spasm, tremor: torque, power, energy", "guard: torque, power, energy in 1 s",
         "SH or S1 by limit"),
    17: ("contact oscillation", "guard: energy in 1 s, power, torque", "SH or S1"),
    18: ("emergency stop pressed, released", "a flag the loop reads each tick", "S0"),
    19: ("console lost or frozen", "loop: the console's heartbeat, and whether it lives", "S1"),
    20: ("exception, signal (INT, TERM, HUP, QUIT), failure half-way through enable",
         "session: shutdown sequence", "S1; every shutdown step attempted"),
    21: ("disk full, recorder hangs", "loop: recorder's heartbeat, backlog of samples", "S1"),
    22: ("parameters changed while running", "session: bounds", "bounded, no bump, logged"),
    23: ("two faults at once, a fault while stopping", "guard: latch",
         "first cause, stronger stop"),
    24: ("motion that nobody commanded, 2 to 4.5 deg/s: running, holding, zeroing",
         "guard: expected angle, rest; zeroing", "S1, no run"),
    25: ("velocity reported as 0, twice its size or with the wrong sign, in a tremor",
         "guard: velocity against the change of the angle", "S1"),
    26: ("torque with the wrong sign, gain 0, a last bit that toggles, a constant axis, 1 s late",
         "guard: does the torque answer the motion", "S1"),
    27: ("torque pauses for 95 ms of every 100, 30 of every 60",
         "guard: share of the time with an old reading", "S1"),
    28: ("an offset drives the arm to its position limit again and again",
         "guard: time at the limit, arrivals there", "SH"),
    29: ("one torque of twenty is zero, above half the torque limit",
         "guard: single samples far from those around them", "SH"),
}  # fmt: skip
"""Fault, what detects it, reaction: S0, S1 and SH as in the document."""

IN_SHORT: tuple[tuple[str, str, tuple[int, ...]], ...] = (
    ("emergency stop pressed", "S0", (18,)),
    ("a value that is no number; sensor or drive reports an error", "S1", (1, 4, 7)),
    ("sensor frozen, silent or late", "S1", (2, 3, 5, 27)),
    ("drive silent", "S1, enable contact opened", (8,)),
    ("computer hangs, or the program is killed", "the drive's own watchdog", (9,)),
    ("ticks too late", "S1", (11,)),
    ("the angle jumps, or the motion is not as commanded", "S1", (14, 15)),
    ("slow motion that nobody commanded", "S1", (24,)),
    ("velocity that is not the angle's", "S1", (25,)),
    ("torque of the wrong sign, gain 0, or 1 s late; relaxed subject", "S1", (26,)),
    ("spasm, tremor, oscillation: torque, power, energy", "SH or S1 by limit", (16, 17)),
    ("operator's page or console lost", "S1", (19,)),
    ("disk full, recorder lost", "S1", (21,)),
    ("the arm runs into the position limit", "limited; the epoch is excluded", (13,)),
)
"""What fails, as a user names it, the reaction, and the faults of the long table."""

VIRTUAL_CANNOT = "the simulated rig runs in the loop's process"
NOT_CARRIED = {
    (5, "virtual"): "no packets",
    (9, "virtual"): VIRTUAL_CANNOT,
    (24, "rdt_ascii"): "a move that ended is held in position",
    **{(fault, rig): "the law is the same" for fault in (28, 29) for rig in RIGS[1:]},
}
"""Why a rig cannot have a fault."""


def measure() -> Path:
    """Run all the tests of the faults; return where they noted what they measured."""
    path = Path(tempfile.mkdtemp()) / "measured.jsonl"
    tests = sorted(str(p) for p in Path(__file__).parent.glob("test_faults_*.py"))
    ran = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-m", "slow or not slow", *tests],
        cwd=ROOT,
        env={**os.environ, "RIGIDIMETER_MEASURED": str(path)},
        check=False,
    )
    if ran.returncode:
        sys.exit("a test failed: nothing was written")
    return path


def table(notes: list[dict[str, Any]]) -> str:
    """Return the table, one row a fault, the slowest case of each rig."""
    of: dict[tuple[int, str], list[dict[str, Any]]] = defaultdict(list)
    for note in notes:
        of[note["fault"], note["rig"]].append(note)
    lines = [
        "| # | Fault | Detected by | Reaction | Virtual | RDT + CANopen | RDT + ASCII | Tests |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for number, (fault, detected, reaction) in FAULTS.items():
        cells = [_cell(number, rig, of[number, rig]) for rig in RIGS]
        found = (note["test"] for rig in RIGS for note in of[number, rig])
        tests = "<br>".join(f"`{name.split('::')[1]}`" for name in dict.fromkeys(found))
        lines.append(
            f"| {number} | {fault} | {detected} | {reaction} | {' | '.join(cells)} | {tests} |"
        )
    return "\n".join(lines)


def _cell(number: int, rig: str, notes: list[dict[str, Any]]) -> str:
    """Return what a rig needed at most, by kind of time."""
    if not notes:
        return f"– ({NOT_CARRIED.get((number, rig), 'not tried')})"
    parts = []
    for name, word in (
        ("detected_s", "named"),
        ("power_off_s", "power off"),
        ("zero_s", "zero sent"),
        ("rest_s", "at rest"),
        ("opened_s", "contact"),
    ):
        times = [note[name] for note in notes if note.get(name) is not None]
        if times:
            parts.append(f"{word} {_ms(min(times), max(times))}")
    return "<br>".join(parts) or "<br>".join(dict.fromkeys(note["case"] for note in notes))


def in_short(long_table: str) -> str:
    """Return the table for users: of several faults the slowest, over RDT and CANopen."""
    of = {}
    for line in long_table.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if cells[0].isdigit():
            of[int(cells[0])] = cells[5]
    lines = ["| what fails | reaction | at rest within |", "| --- | --- | ---: |"]
    for words, reaction, faults in IN_SHORT:
        found = [re.search(r"at rest (?:\d+–)?(\d+) ms", of[fault]) for fault in faults]
        slowest = max((int(rest[1]) for rest in found if rest), default=None)
        rest = of[faults[0]] if slowest is None else f"{slowest} ms"
        lines.append(f"| {words} | {reaction} | {rest} |")
    return "\n".join(lines)


def _ms(least: float, most: float) -> str:
    # Where the fault's own time is nominal, a sample may seem to come before it.
    low, high = max(0, round(1e3 * least)), max(0, round(1e3 * most))
    return f"{high} ms" if low == high else f"{low}–{high} ms"


def cases(notes: list[dict[str, Any]]) -> str:
    """Return every case on a line of its own."""
    lines = [
        "| # | Case | Rig | Bound | Named | At rest |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    order = {rig: k for k, rig in enumerate(RIGS)}
    for note in sorted(notes, key=lambda n: (n["fault"], order[n["rig"]], n["case"])):
        times = [note.get(name) for name in ("bound_s", "detected_s", "rest_s")]
        shown = ["" if t is None else f"{1e3 * t:.0f} ms" for t in times]
        lines.append(f"| {note['fault']} | {note['case']} | {note['rig']} | {' | '.join(shown)} |")
    return "\n".join(lines)


def _folded(lines: str) -> str:
    return "\n".join(folded(lines.splitlines()))


def measure_pauses() -> None:
    """Write, and print, what follows when whoever leads a session is gone."""
    cases = []
    for how in HOW:
        for phase, at_s in moments():
            with tempfile.TemporaryDirectory() as folder:
                cases.append(closed(Path(folder), how, phase, at_s))
    found = pause_table(cases)
    print(found)
    between_the_marks(FAULTS_PAGE, _folded(found), "operator gone")


def main() -> None:
    """Write the tables into the pages."""
    measure_pauses()
    if sys.argv[1:] == ["--pause"]:
        return
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else measure()
    notes = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    missing = sorted(set(FAULTS) - {note["fault"] for note in notes})
    if missing:
        sys.exit(f"nothing was measured of fault {missing[0]}")
    load = os.getloadavg()[0]
    python = f"Python {platform.python_version()}, {os.cpu_count()} processors, load {load:.1f}"
    measured = f"Measured with {python}; {len(notes)} cases."
    between_the_marks(FAULTS_PAGE, f"{measured}\n\n{_folded(table(notes))}")
    between_the_marks(HAZARDS, in_short(table(notes)))
    between_the_marks(GUARD_LAWS, _folded(cases(notes)))
    between_the_marks(GUARD_LAWS, _folded(torque_faults()), "torque faults")


if __name__ == "__main__":
    main()
