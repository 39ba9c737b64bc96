"""How soon the guard finds a torque sensor whose sign is wrong, and how far the arm goes wrong.

The loop runs the simulated rig, as fast as it goes, under a PRBS perturbation; from some moment on
the sensor's torque has the opposite sign. A twin with the same random numbers keeps the right sign:
where the two arms are apart, the motion is wrong. Each row is of `MOMENTS_S` and of some epochs.

    python -m benchmarks.torque_sign
    python -m benchmarks.torque_sign --late
    python -m benchmarks.torque_sign --ratios

The second is of a small joint on a computer that stands still now and then, at random moments: what
becomes of a wrong sign, and whether a right one is called wrong. The third prints what bounds all
that: which ratio S/N of the perturbation's answer to all other torque a window needs
(`rig.commissioning.wrong_sign`), and which one it has while the sign is right.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections import Counter
from collections.abc import Callable
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
import scipy
from numpy.typing import NDArray

from benchmarks.false_alarms import RATES, SIZES
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import prbs_nm
from rigidimeter.rig.acquisition import Clock, ControlLoop, SimulatedClock, perturb
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.rig.devices.base import Reading
from rigidimeter.rig.guard import (
    BEFORE,
    INSTRUMENTS,
    PASSES,
    Cause,
    difference_columns,
    explained_answer,
    torque_answer,
    whitened,
)

MOMENTS_S = (0.0, 1.0, 1.37, 2.05, 3.13)
"""When the sign turns; at 0 it was wrong from the start."""

WANTED_S, WANTED_DEG = 0.5, 5.0
"""The sign is to be found before so much time or so much wrong motion, whichever is later."""

LONGEST_S = 4.0
"""So long after it the epoch ends."""

SUBJECTS: dict[str, tuple[tuple[float, float, float], dict[str, float]]] = {
    "relaxed, no torque of its own": ((1.0, 1.0, 1.0), {}),
    "relaxed, 0.05 N·m (SD)": ((1.0, 1.0, 1.0), {"voluntary_sd_nm": 0.05}),
    "0.2 N·m (SD)": ((1.0, 1.0, 1.0), {"voluntary_sd_nm": 0.2}),
    "1 N·m (SD)": ((1.0, 1.0, 1.0), {"voluntary_sd_nm": 1.0}),
    "hanging": ((1.0, 0.15, 0.03), {}),
}


RATIOS = (18.0, 8.0, 1.4, 0.7, 0.2)
"""S/N of a small joint whose subject has a torque of 0.05, 0.2 and 1 N·m (SD) of its own."""

LAG_S = 0.05
"""By so much the filters of a row are late, at 8 Hz, and the joint."""

LATE_S = 12.0
"""So long is an epoch in which the sign is right."""

SHORTEST_S = 0.005
GAPS = ((0.0, 0.0), (1.0, 0.039), (5.0, 0.039), (20.0, 0.039), (5.0, 0.2))
"""How many times a second the computer stands still, and for how long at most."""

LATE_SUBJECTS = ("relaxed, no torque of its own", "relaxed, 0.05 N·m (SD)", "1 N·m (SD)")


class TurnedRig(SimulatedRig):
    """The simulated rig whose torque has the wrong sign from one of its ticks on."""

    turned_at = math.inf

    def read(self, elapsed_ticks: int = 1) -> Reading:
        """Return the reading, its torque perhaps turned."""
        reading = super().read(elapsed_ticks)
        if self._tick > self.turned_at:
            return reading._replace(torque_nm=-reading.torque_nm)
        return reading


class TurnedEpoch(NamedTuple):
    """What ended an epoch, when, and the angle at each tick."""

    cause: Cause
    ended_s: float
    angle_deg: NDArray[np.float64]


def turned_epoch(
    settings: Settings,
    condition: str,
    seed: int,
    turned_s: float,
    longest_s: float,
    clock: Clock | None = None,
) -> TurnedEpoch:
    """Run one PRBS epoch from rest on the virtual rig, its torque turned from `turned_s` on.

    No tick is late unless the clock is.
    """
    rate_hz = settings.rig.tick_rate_hz
    rig = TurnedRig(settings.rig, settings.subject[condition], np.random.default_rng(seed))
    rig.turned_at = turned_s * rate_hz
    angles: list[float] = []
    clock = clock or SimulatedClock()
    loop = ControlLoop(settings, rig, clock, lambda s: angles.append(s.angle_rad))
    rig.enable()
    perturb(loop, 0, prbs_nm(settings.prbs, rate_hz)[: round(longest_s * rate_hz)].tolist())
    return TurnedEpoch(loop.cause, loop.tick / rate_hz, np.degrees(angles))


def made(
    size: str,
    of: tuple[tuple[float, float, float], dict[str, float]],
    tick_hz: float,
    torque_hz: float,
    guard: dict[str, Any],
    controller: dict[str, Any],
) -> Settings:
    """Return the settings of one row."""
    values, (factors, subject) = SIZES[size], of
    names = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
    joint = (v * f for v, f in zip(values["joint"], factors, strict=True))
    return parse_settings(
        {
            "subject": {"OFF": {**dict(zip(names, joint, strict=True)), **subject}},
            "controller": {**values["controller"], **controller},
            "prbs": values["prbs"],
            "guard": guard,
            "rig": {
                "tick_rate_hz": tick_hz,
                "torque": {"rate_hz": torque_hz},
                "motion": {"rate_hz": tick_hz},
            },
        }
    )


def row(settings: Settings, epochs: int) -> str:
    """Return what became of one subject, as columns of the table."""
    found_s: list[float] = []
    wrong_deg: list[float] = []
    others: Counter[str] = Counter()
    for moment_s in MOMENTS_S:
        for seed in range(epochs):
            turned = turned_epoch(settings, "OFF", seed, moment_s, moment_s + LONGEST_S)
            twin = turned_epoch(settings, "OFF", seed, math.inf, turned.ended_s)
            n = min(len(turned.angle_deg), len(twin.angle_deg))
            if turned.cause is Cause.TORQUE_SIGN:
                found_s.append(turned.ended_s - moment_s)
                wrong_deg.append(float(abs(turned.angle_deg[:n] - twin.angle_deg[:n]).max()))
            else:
                others[turned.cause.name.lower().replace("_", " ")] += 1
    rest = ", ".join(f"{n} {name}" for name, n in sorted(others.items())) or "–"
    if not found_s:
        return f"0 | – | – | 0 | {rest}"
    within_s, deg = np.array(found_s), np.array(wrong_deg)
    early = np.count_nonzero((within_s <= WANTED_S) | (deg <= WANTED_DEG))
    return (
        f"{len(found_s)} | {np.median(within_s):.2f} ({within_s.min():.2f}–{within_s.max():.2f}) "
        f"| {np.median(deg):.0f} ({deg.max():.0f}) | {early} | {rest}"
    )


class StandingStill:
    """A clock of a computer that stands still at random moments, so often a second and so long."""

    def __init__(self, per_s: float, longest_s: float, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self._gaps: list[tuple[float, float]] = []
        began_s = 0.0
        while per_s > 0.0 and began_s < LATE_S:
            began_s += rng.exponential(1.0 / per_s)
            ended_s = began_s + rng.uniform(SHORTEST_S, longest_s)
            self._gaps.append((began_s, ended_s))
            began_s = ended_s
        self._gaps.reverse()

    def wait_until(self, deadline_s: float) -> float:
        """Return the deadline, or the end of the gap in which it lies."""
        while self._gaps and self._gaps[-1][1] <= deadline_s:
            self._gaps.pop()
        if self._gaps and self._gaps[-1][0] <= deadline_s:
            return self._gaps[-1][1]
        return deadline_s


def late_row(settings: Settings, epochs: int, per_s: float, longest_s: float) -> str:
    """Return how epochs end in which the sign turns at 0 and 1.37 s, and in which it is right."""
    found_s: list[float] = []
    others: Counter[str] = Counter()
    falsely: Counter[str] = Counter()
    for seed in range(epochs):
        for moment_s in (0.0, 1.37, math.inf):
            clock = StandingStill(per_s, longest_s, 1000 + seed)
            until_s = min(moment_s + LONGEST_S, LATE_S)
            ended = turned_epoch(settings, "OFF", seed, moment_s, until_s, clock)
            if moment_s == math.inf:
                falsely[ended.cause.name.lower().replace("_", " ")] += 1
            elif ended.cause is Cause.TORQUE_SIGN:
                found_s.append(ended.ended_s - moment_s)
            else:
                others[ended.cause.name.lower().replace("_", " ")] += 1
    after = f"{np.median(found_s):.2f} (to {max(found_s):.2f})" if found_s else "–"
    del falsely["none"]
    rest, stopped = (
        ", ".join(f"{n} {name}" for name, n in sorted(ends.items())) or "–"
        for ends in (others, falsely)
    )
    return f"{len(found_s)} | {after} | {rest} | {stopped}"


def print_late(epochs: int) -> None:
    """Print what becomes of a small joint's sign while ticks are late."""
    of = f"of {2 * epochs}"
    print(
        f"| ticks/s | subject | gaps/s | found {of} | after s | else | right: {epochs}, stopped |"
    )
    print("| --- " * 7 + "|")
    for tick_hz, torque_hz, guard, controller in RATES:
        if torque_hz == tick_hz:
            for name in LATE_SUBJECTS:
                settings = made("small", SUBJECTS[name], tick_hz, torque_hz, guard, controller)
                for per_s, longest_s in GAPS:
                    columns = late_row(settings, epochs, per_s, longest_s)
                    gaps = f"{per_s:g} to {1e3 * longest_s:g} ms"
                    print(f"| {tick_hz:g} | {name} | {gaps} | {columns} |", flush=True)


def ratios_needed() -> list[str]:
    """Return S/N > (f/n) (1/x − 1) of windows, by the chance α of a false alarm in a look."""
    chances = (1e-10, 1e-8, 1e-6, 1e-4)
    head = " | ".join(f"α = {chance:g}" for chance in chances)
    lines = [f"| rows | s | {head} |", "| --- " * (2 + len(chances)) + "|"]
    of_16 = (16, torque_answer.NOISE_ORDERS[0])
    for rows, order in (of_16, *zip(torque_answer.ROWS, torque_answer.NOISE_ORDERS, strict=True)):
        free = rows - INSTRUMENTS - 2 * order
        left = scipy.special.betaincinv(0.5 * free, 0.5 * INSTRUMENTS, np.array(chances))
        needed = " | ".join(f"{free / rows * (1 / x - 1):.2g}" for x in left)
        lines.append(f"| {rows} | {rows * torque_answer.ROW_S:.2f} | {needed} |")
    return lines


def needed(rows: int, instruments: int, chance: float) -> float:
    """Return the S/N times rows of a window whose noise is measured in it.

    With one instrument, the answer's known form, only one sign of it counts.
    """
    free = rows - instruments - 2 * torque_answer.NOISE_ORDERS[0]
    if free < 1:
        return math.inf
    sides = 2.0 if instruments == 1 else 1.0
    left = scipy.special.betaincinv(0.5 * free, 0.5 * instruments, sides * chance)
    return free * (1.0 / float(left) - 1.0)


def least_times(chance: float = 1e-9) -> list[str]:
    """Return when half of the wrong signs can be found, by S/N and by what a test knows.

    The logarithm of the ratio of the likelihoods of the answers ±s in white noise of known variance
    has the mean ±2 E and the variance 4 E, with E = n S/N over n rows. So half are found at
    2 √E = z, the normal quantile of the chance of a false alarm; at √E = z if the answer may have
    any size; and if it may be any combination of the instruments at E = their quantile of χ².
    """
    z = float(scipy.stats.norm.isf(chance))
    combination = float(scipy.stats.chi2.isf(chance, INSTRUMENTS))
    tests: dict[str, Callable[[int], float]] = {
        "answer and noise known": lambda _: z * z / 4.0,
        "answer's size unknown": lambda _: z * z,
        "its form as well": lambda _: combination,
        "size of answer and noise unknown": lambda rows: needed(rows, 1, chance),
        "only the perturbation known": lambda rows: needed(rows, INSTRUMENTS, chance),
    }
    lines = [f"| S/N | {' | '.join(tests)} |", "| --- " * (1 + len(tests)) + "|"]
    for ratio in RATIOS:
        rows = [
            next(n for n in itertools.count(1) if n * ratio >= test(n)) for test in tests.values()
        ]
        times = " | ".join(f"{LAG_S + n * torque_answer.ROW_S:.2f} s" for n in rows)
        lines.append(f"| {ratio:g} | {times} |")
    return lines


def ratios(settings: Settings, epochs: int) -> str:
    """Return S/N of the shortest window: its median, and what a tenth of the windows is below."""
    rows, order = torque_answer.ROWS[0], torque_answer.NOISE_ORDERS[0]
    free, found = rows - INSTRUMENTS - 2 * order, []

    def look(_: object, window: NDArray[np.float64], count: int) -> bool:
        half = window.shape[0] // 2
        end = count % half + half + 1
        if count >= rows:
            columns, weights = (
                difference_columns(window[end - rows - BEFORE : end]),
                np.zeros(INSTRUMENTS),
            )
            for _ in range(PASSES):
                noise, answer, weights = explained_answer(whitened(columns, weights, order))
            by_chance = noise * INSTRUMENTS / free
            found.append(max(float(answer[-1, -1]) - by_chance, 0.0) / noise * free / rows)
        return False

    with mock.patch.object(torque_answer, "a_window_shows_the_wrong_sign", look):
        for seed in range(epochs):
            turned_epoch(settings, "OFF", seed, math.inf, LONGEST_S)
    half, tenth = (float(f"{value:.2g}") for value in np.quantile(found, [0.5, 0.1]))
    return f"{half:g} ({tenth:g})"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--epochs", type=int, default=4, help="for each moment")
    parser.add_argument("--sizes", nargs="*", choices=list(SIZES), default=list(SIZES))
    parser.add_argument("--ratios", action="store_true", help="what bounds the time: S/N")
    parser.add_argument("--late", action="store_true", help="where ticks are late")
    given = parser.parse_args()
    if given.late:
        print_late(given.epochs)
        return
    if given.ratios:
        print(*ratios_needed(), "", *least_times(), "", sep="\n")
        print("| size | ticks/s | subject | S/N, median (a tenth is below) |")
        print("| --- | --- | --- | --- |")
    else:
        early = f"before {WANTED_S:g} s or {WANTED_DEG:g} deg"
        print(
            f"| size | ticks/s | subject | found | after s | wrong by deg (most) | {early} | else |"
        )
        print("| --- " * 8 + "|")
    for size in given.sizes:
        for tick_hz, torque_hz, guard, controller in RATES:
            for name, subject in SUBJECTS.items():
                settings = made(size, subject, tick_hz, torque_hz, guard, controller)
                of = f"{tick_hz:g}" if torque_hz == tick_hz else f"{tick_hz:g}, {torque_hz:g}"
                columns = (ratios if given.ratios else row)(settings, given.epochs)
                print(f"| {size} | {of} | {name} | {columns} |", flush=True)


if __name__ == "__main__":
    main()
