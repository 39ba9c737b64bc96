"""What is asked of the joint at each tick: to give way, to follow, to return, to stand still.

The parameters that may change meanwhile are few and bounded, and a change never makes the loop less
stable. A heavier or more damped admittance is more stable, a lighter one less. The margin was
checked for the protocol's own values, so they are the lower bound. The perturbation may only become
smaller. A change makes no bump: the velocity, the controller's only memory, stays as it is, and
what follows is limited by the guard like anything else.

The ramp to rest comes last: the velocity becomes zero within the acceleration limit, whatever
fails.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from rigidimeter.core.settings import LONGEST_STEP, ControllerSettings, Settings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.model import admittance_step, minimum_jerk, tracking_step
from rigidimeter.rig.acquisition.decision import STALLED
from rigidimeter.rig.acquisition.run_states import Order
from rigidimeter.rig.acquisition.tick import (
    REST,
    ControlLoop,
    TickResult,
    run_tick,
    run_ticks,
    set_admittance,
    ticks_late,
)
from rigidimeter.rig.devices.base import Reading
from rigidimeter.rig.guard import released

LARGEST_FACTOR = 10.0
"""A parameter may grow to so many times the protocol's value."""

PEAK_OVER_MEAN = 15.0 / 8.0
"""Of the speed of a minimum-jerk motion."""

ROUNDING = 1e-9
"""Of a tick: what floats may add to a whole number of them."""

SPARE_TICKS = 10
"""A ramp to rest may take so many ticks more than the speed and the acceleration limit say."""


def skip_passed_ticks(loop: ControlLoop) -> None:
    """Leave out the ticks that went by while the rig was enabled, which takes its time."""
    while (late := ticks_late(loop)) > 0:
        loop.rig.read(late)
        loop.tick += late


def release(loop: ControlLoop) -> None:
    """Let the loop go on after a hold; see `guard.released`."""
    loop.guard, loop.stop = released(loop.guard), None


def perturb(loop: ControlLoop, epoch: int, perturbation_nm: Sequence[float]) -> TickResult:
    """Let the subject move freely while the torque perturbation runs, one value a tick."""

    def command(_: Reading, torque_nm: float, k: int) -> tuple[float, float, float]:
        value = loop.perturbation_scale * perturbation_nm[k]
        step = loop.admittances[min(loop.elapsed_ticks, LONGEST_STEP) - 1]
        velocity = loop.guard.velocity_rad_s
        return admittance_step(step, velocity, value, torque_nm), value, math.nan

    return run_ticks(loop, epoch, len(perturbation_nm), command)


def follow(
    loop: ControlLoop, epoch: int, angle_rad: Sequence[float], velocity_rad_s: Sequence[float]
) -> TickResult:
    """Impose a position, one value a tick."""

    def command(reading: Reading, _: float, k: int) -> tuple[float, float, float]:
        target = angle_rad[k]
        # The reading is compared with where the target was when it was taken.
        then = angle_rad[min(max(k - _age_ticks(loop, reading), 0), len(angle_rad) - 1)]
        gain = loop.tracking_gain_per_s
        return tracking_step(gain, then, velocity_rad_s[k], reading.angle_rad), 0.0, target

    return run_ticks(loop, epoch, len(angle_rad), command)


def return_speed_rad_s(settings: Settings) -> float:
    """Return the peak speed of a return: its own limit, or the guard's, which holds it back."""
    slower = min(settings.protocol.return_speed_deg_s, settings.guard.speed_limit_deg_s)
    return rad_from_deg(slower)


def return_duration_s(angle_rad: float, return_s: float, speed_rad_s: float) -> float:
    """Return how long the way back takes: T = max(`return_s`, 15/8 |θ₀| / `speed_rad_s`).

    The peak speed of a minimum-jerk motion is 15/8 of its mean speed (Flash and Hogan 1985).
    """
    return max(return_s, PEAK_OVER_MEAN * abs(angle_rad) / speed_rad_s)


def go_back(loop: ControlLoop, duration_s: float, speed_rad_s: float) -> TickResult:
    """Return to the initial position by a minimum-jerk motion, never faster than `speed_rad_s`."""
    start_rad = loop.angle_rad
    # The ticks are whole ones, and not fewer than the time asks for.
    ticks = math.ceil(duration_s * loop.rate_hz - ROUNDING)
    return _led(loop, ticks, ticks * loop.interval_s, start_rad, speed_rad_s)


def rest(loop: ControlLoop, duration_s: float, speed_rad_s: float) -> TickResult:
    """Keep the joint at the initial position, by at most `speed_rad_s`."""
    return _led(loop, round(duration_s * loop.rate_hz), 0.0, 0.0, speed_rad_s)


def _led(
    loop: ControlLoop, ticks: int, duration_s: float, start_rad: float, speed_rad_s: float
) -> TickResult:
    """Lead the joint from `start_rad` to the initial position in `duration_s`; keep it there."""
    interval_s, gain = loop.interval_s, loop.tracking_gain_per_s

    def command(reading: Reading, _: float, k: int) -> tuple[float, float, float]:
        target, velocity = minimum_jerk(start_rad, duration_s, k * interval_s)
        before_s = max(k - _age_ticks(loop, reading), 0) * interval_s
        then, _ = minimum_jerk(start_rad, duration_s, before_s)
        led = tracking_step(gain, then, velocity, reading.angle_rad)
        if abs(led) > speed_rad_s:  # not so where it is no number, which the guard names
            led = math.copysign(speed_rad_s, led)
        return led, 0.0, target

    return run_ticks(loop, REST, ticks, command)


def hold(
    loop: ControlLoop, duration_s: float, take: Callable[[Reading], None] = lambda _: None
) -> TickResult:
    """Stand still; `take` is called with every reading."""

    def command(reading: Reading, _: float, __: int) -> tuple[float, float, float]:
        take(reading)
        return 0.0, 0.0, math.nan

    return run_ticks(loop, REST, round(duration_s * loop.rate_hz), command, latched=True)


def _age_ticks(loop: ControlLoop, reading: Reading) -> int:
    """Return the age of a reading; 0 for a stamp that is no number, which the guard names."""
    age_ticks = loop.tick - reading.motion_time_s * loop.rate_hz
    return round(age_ticks) if math.isfinite(age_ticks) else 0


def change_parameter(
    loop: ControlLoop, protocol: ControllerSettings, order: Order
) -> dict[str, Any]:
    """Change a parameter within its bounds; return what happened, for the record.

    Parameters
    ----------
    loop : ControlLoop
    protocol : ControllerSettings
        The values that the protocol began with.
    order : Order
    """
    name, value = order.name, order.value
    facts: dict[str, Any] = {"name": name, "value": value if math.isfinite(value) else None}
    before = {
        "inertia_kg_m2": loop.inertia_kg_m2,
        "damping_nm_s_rad": loop.damping_nm_s_rad,
        "perturbation_scale": loop.perturbation_scale,
    }
    low, high = math.nan, math.nan  # no value lies between them: other parameters may not change
    if name == "perturbation_scale":
        low, high = 0.0, 1.0
    elif name in before:
        low = getattr(protocol, name)
        high = LARGEST_FACTOR * low
    if not low <= value <= high:
        return {**facts, "refused": f"must be between {low:g} and {high:g}"}
    if name == "perturbation_scale":
        loop.perturbation_scale = value
    else:
        now = {**before, name: value}
        set_admittance(loop, now["inertia_kg_m2"], now["damping_nm_s_rad"])
    return {**facts, "before": before[name]}


def ramp_to_rest(loop: ControlLoop) -> None:
    """Ramp the velocity to zero within the acceleration limit, however long that takes.

    A tick that fails, say because its sample cannot be recorded, does not end the ramp. It goes
    on without reading and recording, and the failure is raised after it.
    """
    try:
        # The guard takes as much off at every tick; some more for how floats are rounded.
        ticks = math.ceil(abs(loop.guard.velocity_rad_s) / _brake_rad_s(loop))
        for _ in range(ticks + SPARE_TICKS):
            if loop.guard.velocity_rad_s == 0.0:
                return
            run_tick(loop, REST, 0, lambda *_: (0.0, 0.0, math.nan))
    except BaseException:  # also when interrupted: the arm still moves
        _ramp_unrecorded(loop)
        raise


def _brake_rad_s(loop: ControlLoop) -> float:
    return loop.limits.acceleration_rad_s2 * loop.interval_s


def _ramp_unrecorded(loop: ControlLoop) -> None:
    """Only write: what else a tick does has failed."""
    # The ramp takes its time, however late the failure made it.
    late = max(ticks_late(loop), 0)
    loop.tick += late
    if max(late, loop.elapsed_ticks - 1) >= loop.stall_ticks or _was_suspended(loop):
        # As in `decide`: a drive with a watchdog has stopped, and must not be set going again.
        loop.guard = loop.guard._replace(velocity_rad_s=0.0)
        loop.rig.write(0.0)
    while (velocity := loop.guard.velocity_rad_s) != 0.0:
        velocity = math.copysign(max(abs(velocity) - _brake_rad_s(loop), 0.0), velocity)
        loop.guard = loop.guard._replace(velocity_rad_s=velocity)
        loop.clock.wait_until(loop.time_s)
        loop.rig.write(velocity)
        loop.tick += 1


def _was_suspended(loop: ControlLoop) -> bool:
    with suppress(Exception):  # it may be what has failed
        return loop.supervision.cause(loop.time_s) == STALLED
    return False
