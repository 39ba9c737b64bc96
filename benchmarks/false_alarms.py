"""How often the guard's laws of consistency stop a rig that is in order, in simulated hours.

PRBS epochs of every kind of subject run on the compiled batch, with two sizes of joint, at 1000
ticks/s with the torque sensor at 1000 and at the paper's 100 samples/s, and at 100 and 50 ticks/s.
What is recorded then passes `rig.guard.consistency`, compiled with what it calls from their own
sources. Epochs start from rest, so each one also is a beginning. A cause of the guard's own limits
(torque, power, energy, a second at the position limit) that ends an epoch early is counted apart:
it is no false alarm. `not following` is the guard's own too, and counts as one.

    kind       the subject
    relaxed    a voluntary torque of 0.05 N·m (SD)
    pushing    1 N·m (SD), 0.3 to 4 Hz
    tremor     3 N·m at 4, 5, 6, 8 and 12 Hz in turn
    hanging    next to no stiffness or damping
    rigid      ten times the stiffness, six times the damping
    heavy      three times the inertia, as with a heavier cuff, and hanging
    resisting  3.5 N·m (SD), so 5 N·m and more for a seventh of the time, 0.05 to 1 Hz; the limits
               of torque, power and energy are raised, or they would end most epochs

    python -m benchmarks.false_alarms --hours 100
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.rig.guard import (
    Cause,
    ConsistencyLimits,
    ConsistencyState,
    agreement,
    consistency,
    consistency_limits,
    consistency_state,
    consistency_step,
    torque_answer,
    torque_sign,
    watch,
    wild_torque,
)
from rigidimeter.virtual.batch import Batch, enum_numbers, simulate_chunks, with_helpers

SIZES: dict[str, dict[str, Any]] = {
    "small": {
        "joint": (0.0045, 0.1368, 1.751),
        "controller": {},
        "prbs": {},
    },
    "human elbow": {
        "joint": (0.07, 1.0, 10.0),
        "controller": {"inertia_kg_m2": 0.15, "damping_nm_s_rad": 3.0},
        "prbs": {"amplitude_nm": 2.0},
    },
}
KINDS: dict[str, tuple[tuple[float, float, float], dict[str, float]]] = {
    "relaxed": ((1.0, 1.0, 1.0), {"voluntary_sd_nm": 0.05}),
    "pushing": ((1.0, 1.0, 1.0), {"voluntary_sd_nm": 1.0}),
    "tremor": ((1.0, 1.0, 1.0), {"tremor_amplitude_nm": 3.0}),
    "hanging": ((1.0, 0.15, 0.03), {}),
    "rigid": ((1.0, 6.0, 10.0), {}),
    "heavy": ((3.0, 0.15, 0.03), {}),
    "resisting": (
        (1.0, 1.0, 1.0),
        {"voluntary_sd_nm": 3.5, "voluntary_low_hz": 0.05, "voluntary_high_hz": 1.0},
    ),
}
RESISTED = {
    "torque_limit_nm": 25.0,
    "torque_stop_nm": 30.0,
    "power_limit_w": 100.0,
    "energy_limit_j": 60.0,
}
RATES: tuple[tuple[float, float, dict[str, Any], dict[str, Any]], ...] = (
    (1000.0, 1000.0, {}, {}),
    (1000.0, 100.0, {}, {}),
    (100.0, 100.0, {"reaction_time_s": 0.05}, {}),
    (50.0, 50.0, {"reaction_time_s": 0.1}, {"torque_cutoff_hz": 10.0}),
)
"""Ticks/s, torques/s, and what such ticks need of guard and controller."""

OWN = {
    *(Cause.NONE, Cause.TORQUE_HIGH, Cause.TORQUE_TOO_HIGH, Cause.POWER_HIGH, Cause.ENERGY_HIGH),
    Cause.HELD_AT_LIMIT,
}
"""What may end an epoch without being a false alarm."""


class Kind(NamedTuple):
    """One line of the table."""

    size: str
    name: str
    tick_rate_hz: float
    torque_rate_hz: float
    settings: Settings


class Counted(NamedTuple):
    """What came of one kind."""

    hours: float
    epochs: int
    stopped: int
    alarms: Counter[str]


def kinds() -> Iterator[Kind]:
    """Yield every combination of size, kind and rate; tremor in five frequencies."""
    for size, given in SIZES.items():
        for name, (factors, subject) in KINDS.items():
            joint = [value * factor for value, factor in zip(given["joint"], factors, strict=True)]
            values = dict(
                zip(("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad"), joint, strict=True)
            )
            spread = {f"{what}_cv_percent": 20.0 for what in ("inertia", "damping", "stiffness")}
            for tick_hz, torque_hz, guard, controller in RATES:
                frequencies = (4.0, 5.0, 6.0, 8.0, 12.0) if name == "tremor" else (5.0,)
                for frequency_hz in frequencies:
                    whole = {**values, **spread, **subject, "tremor_frequency_hz": frequency_hz}
                    settings = parse_settings(
                        {
                            "subject": {"OFF": whole},
                            "controller": {**given["controller"], **controller},
                            "prbs": given["prbs"],
                            "guard": {**guard, **(RESISTED if name == "resisting" else {})},
                            "rig": {
                                "tick_rate_hz": tick_hz,
                                "torque": {"rate_hz": torque_hz},
                                "motion": {"rate_hz": tick_hz},
                            },
                        }
                    )
                    label = f"{name} {frequency_hz:g} Hz" if name == "tremor" else name
                    yield Kind(size, label, tick_hz, torque_hz, settings)


def first_cause(
    limits: ConsistencyLimits,
    state: ConsistencyState,
    perturbation_nm: NDArray[np.float64],
    torque_nm: NDArray[np.float64],
    angle_rad: NDArray[np.float64],
    velocity_rad_s: NDArray[np.float64],
    command_rad_s: NDArray[np.float64],
    age_s: NDArray[np.float64],
    torque_age_s: NDArray[np.float64],
) -> tuple[int, int]:
    """Return the first cause that the laws find in one epoch, and its tick."""
    sent = 0.0
    for k in range(torque_nm.shape[0]):
        state, cause = consistency_step(
            limits,
            state,
            sent,
            perturbation_nm[k],
            torque_nm[k],
            angle_rad[k],
            velocity_rad_s[k],
            age_s[k],
            torque_age_s[k],
            1,
        )
        if cause != 0:
            return cause, k
        sent = command_rad_s[k]
    return 0, torque_nm.shape[0]


def compiled() -> Callable[..., tuple[int, int]]:
    """Return `first_cause`, compiled from the sources of the steps."""
    from numba import njit

    def made(function: Callable[..., Any], **helpers: Any) -> Any:
        return njit(with_helpers(function, helpers), error_model="numpy", nogil=True)

    causes = enum_numbers(Cause)
    solved_for = made(torque_sign.solved_for)
    sign = made(
        torque_sign.sign_is_wrong,
        difference_columns=made(torque_sign.difference_columns),
        explained_answer=made(torque_sign.explained_answer, solved_for=solved_for),
        whitened=made(torque_sign.whitened, solved_for=solved_for),
        without=made(torque_sign.without),
        fits_better=made(
            torque_sign.fits_better,
            left_by_each_sign=made(torque_sign.left_by_each_sign, solved=made(torque_sign.solved)),
        ),
    )
    one_step = made(
        torque_answer.one_step,
        Cause=causes,
        lowpassed=made(torque_answer.lowpassed),
        store_row=made(torque_answer.store_row),
        a_window_shows_the_wrong_sign=made(
            torque_answer.a_window_shows_the_wrong_sign, sign_is_wrong=sign
        ),
    )
    means = made(
        agreement.means_step,
        Cause=causes,
        answer_step=made(torque_answer.answer_step, one_step=one_step),
        energy_after=made(watch.energy_after),
    )
    ended = made(consistency.ended, means_step=means)
    wild = made(wild_torque.wild_step, Cause=causes, median=made(wild_torque.median))
    step = made(consistency.consistency_step, Cause=causes, ended=ended, wild_step=wild)

    return made(first_cause, consistency_step=step)


def count(kind: Kind, wanted_s: float, seed: int, find: Callable[..., tuple[int, int]]) -> Counted:
    """Simulate a kind for so long, as ticks that were run, and count what stopped it."""
    limits = consistency_limits(kind.settings)
    rate_hz, epoch_s = kind.settings.rig.tick_rate_hz, kind.settings.prbs.duration_s
    alarms: Counter[str] = Counter()
    epochs = ticks = stopped = 0
    while ticks < wanted_s * rate_hz:
        more = math.ceil((wanted_s - ticks / rate_hz) / epoch_s)
        for batch in simulate_chunks(kind.settings, more, seed=seed, first=epochs, workers=2):
            epochs += len(batch)
            for i in range(len(batch)):
                n = int(batch.ticks[i])
                own = Cause(int(batch.cause[i]))
                cause, at = find(limits, consistency_state(limits), *epoch_columns(batch, i, n))
                found = Cause(int(cause))
                if own is not Cause.NONE and at >= n - 1:
                    found = own  # what the guard itself finds at a tick goes before it
                ticks += min(at + 1, n)
                stopped += found in OWN and found is not Cause.NONE
                if found not in OWN:
                    alarms[found.name] += 1
    return Counted(ticks / rate_hz / 3600.0, epochs, stopped, alarms)


def epoch_columns(batch: Batch, i: int, n: int) -> tuple[NDArray[np.float64], ...]:
    """Return the columns of one epoch as `first_cause` takes them."""
    time_s = batch.time_s[:n]
    columns = (
        batch.perturbation_nm[i, :n],
        batch.torque_nm[i, :n],
        batch.angle_rad[i, :n],
        batch.velocity_rad_s[i, :n],
        batch.velocity_command_rad_s[i, :n],
        time_s - batch.motion_time_s[i, :n],
        time_s - batch.torque_time_s[i, :n],
    )
    return tuple(np.array(column, dtype=np.float64) for column in columns)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--hours", type=float, default=1.0, help="simulated, over all kinds")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rows = list(kinds())
    find, began_s = compiled(), time.monotonic()
    total = Counter[str]()
    hours = 0.0
    print("| size | subject | ticks/s | torques/s | hours | epochs | ended by a limit | alarms |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for number, kind in enumerate(rows):
        wanted = given.hours * 3600.0 / len(rows)
        counted = count(kind, wanted, given.seed + number, find)
        alarms = ", ".join(f"{n} {name}" for name, n in sorted(counted.alarms.items())) or "0"
        print(
            f"| {kind.size} | {kind.name} | {kind.tick_rate_hz:g} | {kind.torque_rate_hz:g} "
            f"| {counted.hours:.2f} | {counted.epochs} | {counted.stopped} | {alarms} |",
            flush=True,
        )
        hours += counted.hours
        total += counted.alarms
    print(f"\n{sum(total.values())} false alarms in {hours:.1f} hours", end="; ")
    print(f"{time.monotonic() - began_s:.0f} s")


if __name__ == "__main__":
    main()
