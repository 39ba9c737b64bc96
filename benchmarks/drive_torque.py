"""How often the guard's law of the drive's own torque stops a rig that is in order, in hours.

For each joint, rate and drive's side `commission`'s own procedure finds the model on the virtual
rig. Then PRBS epochs of every kind of subject run on the compiled batch. From the motion and the
torque of each, the drive's side of `rigidimeter.model` makes the torque that its drive reports (one
tick late, in steps), the sensor gets its noise, and both pass the law, compiled from its source. An
epoch that a limit of the guard ended counts as long as it was.

    kind       the subject
    relaxed    a voluntary torque of 0.05 N·m (SD)
    pushing    0.5 or 1 N·m (SD), 0.3 to 4 Hz
    tremor     1 or 3 N·m at 4, 5, 6, 8 and 12 Hz in turn
    cogwheel   bursts of 1 N·m against the motion, at 6 to 8 Hz, added to a relaxed subject's torque
    hanging    next to no stiffness or damping
    rigid      ten times the stiffness, six times the damping

    python -m benchmarks.drive_torque --hours 100
    python -m benchmarks.drive_torque --hours 2 --loop  # interpreted, with rests, at 1000 ticks/s
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

from benchmarks.false_alarms import KINDS, RATES, SIZES
from rigidimeter.cli.virtual_check import measured_drive_side
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import (
    Drive,
    DriveSide,
    DriveSideState,
    DriveState,
    drive,
    drive_side,
    drive_side_step,
    drive_step,
    quantised,
    reported_torque_nm,
)
from rigidimeter.planning import prbs_nm
from rigidimeter.rig.acquisition import ControlLoop, SimulatedClock, hold, perturb
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.rig.guard import (
    Cause,
    DriveTorqueLimits,
    DriveTorqueState,
    allowed_nm,
    drive_torque,
    drive_torque_limits,
    drive_torque_state,
    drive_torque_step,
    lowpassed,
)
from rigidimeter.virtual.batch import enum_numbers, simulate_chunks, with_helpers

SIDES: dict[str, dict[str, float]] = {
    "0.05 kg·m², 0.3 N·m": {"reflected_inertia_kg_m2": 0.05, "friction_nm": 0.3},
    "1 kg·m², 3 N·m": {
        "reflected_inertia_kg_m2": 1.0,
        "friction_nm": 3.0,
        "rated_torque_nm": 30.0,
    },
}
SAME, TREMOR_HZ = (1.0, 1.0, 1.0), (4.0, 5.0, 6.0, 8.0, 12.0)
SUBJECTS: dict[str, tuple[tuple[float, float, float], dict[str, float]]] = {
    "relaxed": KINDS["relaxed"],
    "pushing 0.5 N·m": (SAME, {"voluntary_sd_nm": 0.5}),
    "pushing 1 N·m": KINDS["pushing"],
    "tremor 1 N·m": (SAME, {"tremor_amplitude_nm": 1.0}),
    "tremor 3 N·m": KINDS["tremor"],
    "cogwheel 1 N·m": KINDS["relaxed"],
    "hanging": KINDS["hanging"],
    "rigid": KINDS["rigid"],
}
COGWHEEL_NM, COGWHEEL_HZ, FRICTION_RAD_S = 1.0, (6.0, 8.0), 0.05
HELD_TICKS = {(1000.0, 100.0): 10}
"""The torque sensor of these rates gives a new sample every so many ticks."""


class Kind(NamedTuple):
    """One line of the table."""

    size: str
    subject: str
    tick_rate_hz: float
    torque_rate_hz: float
    settings: Settings


def settings_of(
    size: str,
    subject: str,
    rate: int = 0,
    side: str = "",
    frequency_hz: float = 5.0,
    **changed: Any,
) -> Settings:
    """Return the settings of a joint, a subject, one of `RATES` and a drive's side."""
    tick_hz, _, guard, controller = RATES[rate]
    given, (factors, of_subject) = SIZES[size], SUBJECTS[subject]
    joint = [value * factor for value, factor in zip(given["joint"], factors, strict=True)]
    names = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
    spread = {f"{what}_cv_percent": 20.0 for what in ("inertia", "damping", "stiffness")}
    whole = dict(zip(names, joint, strict=True)) | spread | of_subject
    return parse_settings(
        {
            "subject": {"OFF": {**whole, "tremor_frequency_hz": frequency_hz}},
            "controller": {**given["controller"], **controller},
            "prbs": given["prbs"],
            "guard": guard,
            "rig": {
                "tick_rate_hz": tick_hz,
                "torque": {"rate_hz": tick_hz},  # every tick is needed; `HELD_TICKS` holds it
                "motion": {"rate_hz": tick_hz},
                "drive_side": SIDES.get(side, {}),
            },
            **changed,
        }
    )


def kinds() -> Iterator[Kind]:
    """Yield every combination of size, subject and rate; tremor in five frequencies."""
    for size in SIZES:
        for subject in SUBJECTS:
            for rate, (tick_hz, torque_hz, _, _) in enumerate(RATES):
                for frequency_hz in TREMOR_HZ if "tremor" in subject else TREMOR_HZ[:1]:
                    settings = settings_of(size, subject, rate, frequency_hz=frequency_hz)
                    label = f"{subject}, {frequency_hz:g} Hz" if "tremor" in subject else subject
                    yield Kind(size, label, tick_hz, torque_hz, settings)


def first_disagreement(
    limits: DriveTorqueLimits,
    state: DriveTorqueState,
    side: DriveSide,
    moves: Drive,
    torque_nm: NDArray[np.float64],
    sensed_nm: NDArray[np.float64],
    sensed_age_s: NDArray[np.float64],
    angle_rad: NDArray[np.float64],
    velocity_rad_s: NDArray[np.float64],
    command_rad_s: NDArray[np.float64],
    age_s: float,
) -> tuple[int, float, float]:
    """Return the tick at which the law stops the rig (-1: none), and the largest statistics."""
    moved, motor = DriveState(0.0, 0.0, 0.0), DriveSideState(0.0, 0.0, 0.0)
    reported = 0.0
    most_size = most_slope = 0.0
    command = 0.0
    for k in range(torque_nm.shape[0]):
        if k > 0:
            moved = drive_step(moves, moved, command)
        motor = drive_side_step(side, motor, moved[0], moved[2], torque_nm[k])
        now_nm = reported_torque_nm(side, motor)
        state, cause = drive_torque_step(
            limits,
            state,
            sensed_nm[k],
            sensed_age_s[k],
            angle_rad[k],
            velocity_rad_s[k],
            age_s,
            reported,
            age_s,
            1,
        )
        reported = now_nm
        command = command_rad_s[k]
        steps = state.steps
        most = allowed_nm(limits.model, steps.own_nm2)
        most_size = max(most_size, steps.size_nm / most)
        if steps.model_nm2 > 1e-9:
            most_slope = max(most_slope, abs(steps.slope_nm2) / math.sqrt(steps.model_nm2) / most)
        if cause != 0:
            return k, most_size, most_slope
    return -1, most_size, most_slope


def compiled() -> Callable[..., tuple[int, float, float]]:
    """Return `first_disagreement`, compiled from the sources of the steps."""
    from numba import njit

    def made(function: Callable[..., Any], **helpers: Any) -> Any:
        return njit(with_helpers(function, helpers), error_model="numpy", nogil=True)

    allowed, causes = made(allowed_nm), enum_numbers(Cause)
    one_step = made(
        drive_torque.one_step,
        allowed_nm=allowed,
        Cause=causes,
        lowpassed=made(lowpassed),
        from_drive=made(drive_torque.from_drive),
        beyond=made(drive_torque.beyond),
    )
    ended = made(drive_torque.means_ended, begun=made(drive_torque.begun), one_step=one_step)
    return made(
        first_disagreement,
        allowed_nm=allowed,
        drive_step=made(drive_step),
        drive_side_step=made(drive_side_step),
        reported_torque_nm=made(reported_torque_nm, quantised=made(quantised)),
        drive_torque_step=made(drive_torque_step, means_ended=ended, Cause=causes),
    )


class Counted(NamedTuple):
    """Hours, stops, and how near the statistics came to their limits."""

    hours: float
    stops: int
    most_size: float
    most_slope: float


def count(
    kind: Kind, models: dict[str, Any], wanted_s: float, seed: int, find: Callable[..., Any]
) -> dict[str, Counted]:
    """Simulate a kind for so long; return what came of it with each drive's side."""
    settings = kind.settings
    rate_hz, epoch_s = kind.tick_rate_hz, settings.prbs.duration_s
    rig = settings.rig
    moves = drive(rig.drive_bandwidth_hz, rig.drive_damping_ratio, 1.0 / rate_hz)
    held = HELD_TICKS.get((kind.tick_rate_hz, kind.torque_rate_hz), 1)
    rng = np.random.default_rng(seed)
    found = {side: Counted(0.0, 0, 0.0, 0.0) for side in models}
    latency_ticks = round(rig.torque.latency_s * rate_hz)
    wanted = math.ceil(wanted_s / epoch_s)
    for batch in simulate_chunks(settings, wanted, seed=seed, first=0, workers=2):
        for i in range(len(batch)):
            n = int(batch.ticks[i])
            torque = np.array(batch.torque_nm[i, :n])
            if kind.subject.startswith("cogwheel"):
                torque += _cogwheel_nm(np.array(batch.velocity_rad_s[i, :n]), rate_hz, rng)
            sensed = torque + rig.torque.noise_sd_nm * rng.standard_normal(n)
            at = np.arange(n) // held * held
            age_s = (np.arange(n) - at) / rate_hz + rig.torque.latency_s
            true = np.concatenate([torque[latency_ticks:], torque[n - latency_ticks :]])
            readings = (
                *(true, sensed[at], age_s),
                *(np.array(batch.angle_rad[i, :n]), np.array(batch.velocity_rad_s[i, :n])),
                np.array(batch.velocity_command_rad_s[i, :n]),
            )
            for side, (limits, motor) in models.items():
                state = drive_torque_state(limits)
                tick, size, slope = find(
                    limits, state, motor, moves, *readings, rig.motion.latency_s
                )
                before = found[side]
                found[side] = Counted(
                    before.hours + (n if tick < 0 else tick + 1) / rate_hz / 3600.0,
                    before.stops + (tick >= 0),
                    max(before.most_size, size),
                    max(before.most_slope, slope),
                )
    return found


def _cogwheel_nm(
    velocity_rad_s: NDArray[np.float64], rate_hz: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    n = velocity_rad_s.size
    phase = 2.0 * np.pi * rng.uniform(*COGWHEEL_HZ) * np.arange(n) / rate_hz
    phase += np.cumsum(rng.standard_normal(n)) / math.sqrt(rate_hz)
    bursts = np.maximum(np.sin(phase), 0.0)
    return np.asarray(COGWHEEL_NM * bursts * np.tanh(velocity_rad_s / FRICTION_RAD_S))


def models_of(size: str, rate: int) -> dict[str, tuple[DriveTorqueLimits, DriveSide]]:
    """Return the limits that `commission` finds for each drive's side, and the side itself."""
    found = {}
    for side in SIDES:
        settings = settings_of(size, "relaxed", rate, side)
        model = measured_drive_side(settings)
        found[side] = drive_torque_limits(settings, model), drive_side(settings.rig.drive_side)
    return found


def through_the_loop(size: str, side: str, hours: float, seed: int) -> str:
    """Run epochs and rests of every subject in turn through the whole loop; return a line.

    An epoch that another law or limit ends counts as long as it was.
    """
    model = measured_drive_side(settings_of(size, "relaxed", side=side))
    ended: Counter[str] = Counter()
    ticks = number = 0
    subjects = [name for name in SUBJECTS if not name.startswith("cogwheel")]
    while ticks < hours * 3600.0 * 1000.0:
        subject = subjects[number % len(subjects)]
        frequency_hz = TREMOR_HZ[number // len(subjects) % len(TREMOR_HZ)]
        settings = settings_of(size, subject, side=side, frequency_hz=frequency_hz)
        rng = np.random.default_rng([seed, number])
        rig = SimulatedRig(settings.rig, settings.subject["OFF"], rng)
        loop = ControlLoop(settings, rig, SimulatedClock(), lambda _: None, drive_model=model)
        rig.enable()
        hold(loop, 1.0)
        perturb(loop, 0, prbs_nm(settings.prbs, settings.rig.tick_rate_hz).tolist())
        if loop.cause is Cause.NONE:
            hold(loop, 1.0)
        ended[loop.cause.name] += 1
        ticks, number = ticks + loop.tick, number + 1
    causes = ", ".join(f"{n} {name}" for name, n in ended.most_common())
    return f"| {size} | {side} | {ticks / 3.6e6:.2f} | {number} | {causes} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--hours", type=float, default=1.0, help="simulated, over all kinds")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--loop", action="store_true", help="through the whole loop instead")
    parser.add_argument("--only", type=int, help="with --loop: one of joints and drives")
    given = parser.parse_args()
    if given.loop:
        pairs = [(size, side) for size in SIZES for side in SIDES]
        chosen = pairs if given.only is None else [pairs[given.only]]
        print("| joint | drive's side | hours | epochs | ended by |\n|" + " --- |" * 5)
        for size, side in chosen:
            print(through_the_loop(size, side, given.hours / len(pairs), given.seed), flush=True)
        return
    find, began_s, rows = compiled(), time.monotonic(), list(kinds())
    models = {(size, rate): models_of(size, rate) for size in SIZES for rate in range(len(RATES))}
    totals = {side: Counted(0.0, 0, 0.0, 0.0) for side in SIDES}
    heads = " | ".join(f"{side}: stops | size | slope" for side in SIDES)
    print(f"| size | subject | ticks/s | torques/s | hours | {heads} |")
    print(f"| --- | --- | --- | --- | --- |{' --- |' * 3 * len(SIDES)}")
    for number, kind in enumerate(rows):
        rate = next(
            k for k, row in enumerate(RATES) if row[:2] == (kind.tick_rate_hz, kind.torque_rate_hz)
        )
        wanted_s = given.hours * 3600.0 / len(rows)
        found = count(kind, models[kind.size, rate], wanted_s, given.seed + number, find)
        cells = [
            f"{one.stops} | {one.most_size:.2f} | {one.most_slope:.2f}" for one in found.values()
        ]
        hours = next(iter(found.values())).hours
        print(
            f"| {kind.size} | {kind.subject} | {kind.tick_rate_hz:g} | {kind.torque_rate_hz:g} "
            f"| {hours:.2f} | {' | '.join(cells)} |",
            flush=True,
        )
        for side, one in found.items():
            sums = totals[side]
            totals[side] = Counted(
                sums.hours + one.hours,
                sums.stops + one.stops,
                max(sums.most_size, one.most_size),
                max(sums.most_slope, one.most_slope),
            )
    for side, one in totals.items():
        print(
            f"\n{side}: {one.stops} false stops in {one.hours:.1f} hours; the statistics came to "
            f"{one.most_size:.2f} and {one.most_slope:.2f} of their limits",
            end="",
        )
    print(f"; {time.monotonic() - began_s:.0f} s")


if __name__ == "__main__":
    main()
