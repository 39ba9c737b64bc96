"""Kill, stop and end the processes of a session at random moments; print what came of it.

    python -m tests.faults.kills --kills 100 --seed 1

Half of the sessions are on the virtual rig, half on RDT and CANopen devices emulated in a process
of their own. The arm swings at up to 126 deg/s. After a random time one signal (KILL, STOP, TERM,
QUIT) goes to the console, the loop, the recorder, a pair of them, or all: 28 cases in random order.
What was stopped is continued once all the others have ended or four seconds are over: a process
that wakes must not command. What is left in memory is brought in by `rigidimeter recover`.

The samples that the loop made are counted in its ring, which outlives its name in a mapping here.
Those are lost that are in no file in the end; how many `recover` brought in is named. The arm's
rest is that of the emulated arm. On the virtual rig it is the last command of zero in the record;
there is none where the loop was killed or stopped, since its process has the arm in it. The status
is 1 if more than 0.1 s were lost, the arm still moved, a command followed the end, or anything was
left.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import can
import numpy as np
from tests.faults.running_session import alive
from tests.faults.session import VIRTUAL, settings_for
from tests.faults.written_ring import Ring
from tests.wire.rig_process import RigProcess

from rigidimeter.core.session import read_events, read_samples
from rigidimeter.rig.acquisition import replay_session
from rigidimeter.rig.guard import Cause

ROOT = Path(__file__).parents[2]
SIGNALS = (signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM, signal.SIGQUIT)
SINGLE = ("CONSOLE", "LOOP", "RECORDER")
TARGETS = (*((one,) for one in SINGLE), *itertools.combinations(SINGLE, 2), SINGLE)
CASES = tuple(itertools.product(SIGNALS, TARGETS))
MOVES_RAD_S = 0.02
TRIES = 50
"""A session that ended before the signal is replaced by so many others."""
STOPPED_S = 4.0
"""What was stopped is continued after that time, if it has not been ended."""
ALL_OVER_S = 30.0
WATCH_S = 0.3
"""For so long the bus and the arm are watched after the last process has ended."""
SERVOS_OWN = {0x081, 0x181, 0x281, 0x381, 0x481, 0x581, 0x701}
"""What the emulated servo itself sends; all else on the bus is of the session."""


@dataclass
class Killed:
    """What came of one session. Times are since the signal; NaN where there is none."""

    rig: str
    case: str
    rest_s: float = math.nan
    ended_s: float = math.nan
    made: int = 0
    in_files: int = 0
    brought_in: int = 0
    commands_after: int = 0
    left: list[str] = field(default_factory=list)
    wrong: str = ""

    @property
    def lost_s(self) -> float:
        return (self.made - self.in_files) / settings_for("cia402").rig.tick_rate_hz

    @property
    def bad(self) -> bool:
        return self.lost_s > 0.1 or bool(self.commands_after or self.left or self.wrong)


class EndedItselfError(Exception):
    """The session had ended before the signal: on a busy machine the emulated devices are late."""


def start(rig: Path, folder: Path) -> tuple[subprocess.Popen[bytes], dict[str, int], Ring]:
    """Start a session; return it, its processes and its ring once the arm is about to move."""
    with folder.with_name("said").open("wb") as said_file:
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.faults.session", str(rig), str(folder), "usual"],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=said_file,
            start_new_session=True,
        )
    assert process.stdout is not None
    line = process.stdout.readline() if select.select([process.stdout], [], [], 60.0)[0] else b""
    said = folder.with_name("said").read_text()
    assert line, f"the session did not start: {said}"
    first = json.loads(line)
    if "MEMORY" not in first:  # it is how the session ended
        process.wait()
        process.stdout.close()
        raise EndedItselfError(line.decode())
    stem = first.pop("MEMORY")
    return process, {role: pid for role, pid in first.items() if pid}, Ring(stem)


@contextmanager
def watched_bus(bench: RigProcess | None) -> Iterator[can.BusABC | None]:
    if bench is None:
        yield None
        return
    bus = can.Bus(**bench.ready["bus"])
    try:
        yield bus
    finally:
        bus.shutdown()


def one_kill(
    bench: RigProcess | None, number: int, roles: tuple[str, ...], wait_s: float, folder: Path
) -> Killed:
    """Run one session to its end."""
    whom = "group" if roles == SINGLE else " + ".join(roles).lower()
    name = f"{signal.Signals(number).name[3:]} {whom}"
    found = Killed("virtual" if bench is None else "RDT + CANopen", name)
    process, pids, ring = start(VIRTUAL if bench is None else bench.rig, folder)
    try:
        time.sleep(wait_s)
        at_s, newest = time.monotonic(), ring.newest()
        session_s = float(newest["time_s"])
        if newest["cause"]:
            raise EndedItselfError(Cause(int(newest["cause"])).sentence)
        for role in roles:
            with suppress(ProcessLookupError):
                os.kill(pids[role], number)
        stopped = [pids[role] for role in roles] if number == signal.SIGSTOP else []
        moved_s = _until_over(found, process, pids, stopped, bench, at_s)
        found.left += [f"process {role}" for role, pid in pids.items() if alive(pid)]
        # Nobody listens before this, so nothing older is in the socket.
        with watched_bus(bench) as bus:
            written = ring.written
            time.sleep(WATCH_S)
            found.commands_after = ring.written - written + _commands(bus)
        if bench is not None:
            found.rest_s = moved_s - at_s if moved_s else 0.0
            if abs(bench.state()["velocity_rad_s"]) > MOVES_RAD_S:
                found.wrong = "the arm still moves"
        _look_at_record(found, folder, ring)
        if bench is None:
            _rest_of_record(
                found,
                folder,
                session_s,
                killed="LOOP" in roles and number in (signal.SIGKILL, signal.SIGSTOP),
            )
        found.left += [path.name for path in ring.left()]
    finally:
        for pid in pids.values():
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()
        for path in ring.left():
            path.unlink(missing_ok=True)
    return found


def _until_over(
    found: Killed,
    process: subprocess.Popen[bytes],
    pids: dict[str, int],
    stopped: list[int],
    bench: RigProcess | None,
    at_s: float,
) -> float:
    """Wait until all processes have ended; return when the arm was last seen to move."""
    moved_s = 0.0
    while (now_s := time.monotonic()) < at_s + ALL_OVER_S:
        process.poll()
        if bench is not None and abs(bench.state()["velocity_rad_s"]) > MOVES_RAD_S:
            moved_s = time.monotonic()
        living = [pid for pid in pids.values() if alive(pid)]
        if not living:
            found.ended_s = now_s - at_s
            break
        others = set(pids.values()) - set(stopped)
        if stopped and (now_s - at_s > STOPPED_S or (others and not others & set(living))):
            for pid in stopped:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGCONT)
            stopped = []
        time.sleep(0.002)
    return moved_s


def _commands(bus: can.BusABC | None) -> int:
    """Return how many frames on the bus were not the servo's own."""
    count = 0
    while bus is not None and (frame := bus.recv(0.0)) is not None:
        count += frame.arbitration_id not in SERVOS_OWN
    return count


def _look_at_record(found: Killed, folder: Path, ring: Ring) -> None:
    """Close the record as a user would, and compare it with what the loop made."""
    path = folder / "samples.arrows"
    before = read_samples(path)["tick"].size
    if _closings(folder) == 0 or ring.left():
        command = [sys.executable, "-m", "rigidimeter", "recover", str(folder)]
        recovered = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        if recovered.returncode:
            found.wrong = recovered.stderr.strip()
    ticks = read_samples(path)["tick"]
    found.made, found.in_files = ring.written, ticks.size
    found.brought_in = ticks.size - before
    if np.unique(ticks).size != ticks.size:
        found.wrong = "samples are there twice"
    again = replay_session(folder)
    if again.differences or again.left_out:
        found.wrong = f"replayed: {again.left_out}{'; '.join(map(str, again.differences))}"
    if _closings(folder) != 1:
        found.wrong = f"the record has {_closings(folder)} ends"


def _closings(folder: Path) -> int:
    events, _ = read_events(folder / "events.jsonl")
    return [event["event"] for event in events].count("session_ended")


def _rest_of_record(found: Killed, folder: Path, session_s: float, *, killed: bool) -> None:
    """Take from the record when rest was commanded; a killed loop has taken its arm with it."""
    samples = read_samples(folder / "samples.arrows")
    moving = np.flatnonzero(samples["velocity_command_rad_s"])
    last = int(moving[-1]) if moving.size else 0
    if last + 1 < samples["time_s"].size:
        found.rest_s = float(samples["time_s"][last + 1]) - session_s
    elif not killed:
        found.wrong = "the arm moves at the record's end"


def table(results: list[Killed]) -> str:
    """Return a row for each rig and case."""
    of: dict[tuple[str, str], list[Killed]] = defaultdict(list)
    for result in results:
        of[result.rig, result.case].append(result)
        of[result.rig, "all"].append(result)
    lines = [
        "| rig | signal | sessions | at rest, s | all ended, s | lost, s | brought in | "
        "commands after | left |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for rig, case in sorted(of, key=lambda key: (key[0], key[1] == "all", key[1])):
        some = of[rig, case]
        rests = [one.rest_s for one in some if not math.isnan(one.rest_s)]
        ends = [one.ended_s for one in some if not math.isnan(one.ended_s)]
        cells = [
            f"{max(rests):.2f}" if rests else "–",
            f"{max(ends):.2f}" if ends else "–",
            f"{max(one.lost_s for one in some):.3f}",
            str(sum(one.brought_in for one in some)),
            str(sum(one.commands_after for one in some)),
            ", ".join(left for one in some for left in one.left) or "nothing",
        ]
        lines.append(f"| {rig} | {case} | {len(some)} | {' | '.join(cells)} |")
    return "\n".join(lines)


def drawn(rng: np.random.Generator) -> Iterator[tuple[int, tuple[str, ...]]]:
    """Yield cases in random order, each once before any comes again."""
    while True:
        for k in rng.permutation(len(CASES)):
            number, roles = CASES[k]
            yield int(number), roles


def run(kills: int, seed: int, rigs: tuple[str, ...] = ("virtual", "canopen")) -> list[Killed]:
    """Run so many sessions, and say of each what came of it."""
    results: list[Killed] = []
    rng = np.random.default_rng(seed)
    cases = {rig: drawn(rng) for rig in rigs}
    for k in range(kills):
        rig = rigs[k % len(rigs)]
        number, roles = next(cases[rig])
        wait_s = float(rng.uniform(0.2, 1.5))
        result = tried(rig, number, roles, wait_s)
        results.append(result)
        print(f"{k + 1:4d} {'BAD ' if result.bad else ''}{result}", file=sys.stderr, flush=True)
    return results


def tried(rig: str, number: int, roles: tuple[str, ...], wait_s: float) -> Killed:
    """Run one session; another in its place if it ended before the signal."""
    for _ in range(TRIES):
        with tempfile.TemporaryDirectory() as made, ExitStack() as stack:
            bench: Any = None
            if rig == "canopen":
                bench = stack.enter_context(RigProcess(Path(made) / "RIG.toml"))
            try:
                return one_kill(bench, number, roles, wait_s, Path(made) / "s")
            except EndedItselfError as ended:
                print(f"     ended before the signal: {ended}", file=sys.stderr, flush=True)
    raise AssertionError(f"{TRIES} sessions ended before the signal: the machine is too busy")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rig", choices=("virtual", "canopen", "both"), default="both")
    chosen = parser.parse_args()
    rigs = ("virtual", "canopen") if chosen.rig == "both" else (chosen.rig,)
    results = run(chosen.kills, chosen.seed, rigs)
    print(table(results))
    bad = [result for result in results if result.bad]
    if bad:
        sys.exit("\n".join(map(str, bad)))


if __name__ == "__main__":
    main()
