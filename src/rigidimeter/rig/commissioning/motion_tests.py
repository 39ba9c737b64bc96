"""What a rig shows while it moves by a known little: directions, scales, delays, bandwidth.

The motions go through loop and guard without any feedback, so what was commanded is known. First a
move of a fraction of a degree: a scale that is wrong by 57 shows there, and nothing larger is
tried. Then the swing, slow and known; then small quick steps of the velocity, pseudo-random, for
delay and bandwidth.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from rigidimeter.core.settings import Settings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.model import minimum_jerk
from rigidimeter.rig.commissioning.checks import (
    RigCheck,
    above,
    below,
    impossible,
    within_tolerance,
    yes,
)
from rigidimeter.rig.commissioning.response import (
    ArmFit,
    Following,
    fit_arm,
    following,
    velocity_per_angle,
)
from rigidimeter.rig.commissioning.trials import Array, Readings, TrialResult, stopped_for
from rigidimeter.rig.guard import SETTLED, Cause

ANGLE_PER_COMMAND, COMPLETED = "angle per command", "motions were completed"
VELOCITY_PER_ANGLE = "velocity per change of angle"
SMALL_MOVE_PERCENT = 30.0
EXPLAINED = 0.5
"""A torque of which an arm explains less than this share shows no arm."""

ANOTHER = 0.3
"""By this share of what the settings say, a bandwidth is that of another drive."""

PEAK = 1.875
"""Of a minimum-jerk motion, over its mean speed."""

# Quick enough to show the drive's bandwidth, slow enough for a loop of 50 ticks/s.
STEP_S = 0.04
STEPS = [1.0 if sign == "+" else -1.0 for sign in "+++++--++-+--+----+-+-+++-++---"]
"""A maximal-length sequence of 31; it is followed by its opposite, so that the arm comes back."""


def swing(settings: Settings, amplitude_deg: float, speed_deg_s: float, cycles: int) -> Array:
    """Return velocities in rad/s, one a tick: to +A, to −A, and back, at most at this speed."""
    tick_s = 1.0 / settings.rig.tick_rate_hz
    amplitude_rad, speed_rad_s = rad_from_deg(amplitude_deg), rad_from_deg(speed_deg_s)
    twice = 2 * amplitude_rad
    distances = (amplitude_rad, *((-twice, twice) * cycles), -amplitude_rad)
    return np.concatenate([smooth_motion(distance, speed_rad_s, tick_s) for distance in distances])


def steps(settings: Settings, step_deg_s: float | None = None) -> Array:
    """Return pseudo-random velocity steps in rad/s, one a tick, that end where they began.

    They are of `commissioning.step_deg_s` if no other size is given.
    """
    ticks = max(1, round(STEP_S * settings.rig.tick_rate_hz))
    once = np.repeat(np.array(STEPS), ticks)
    pair = np.concatenate([once, -once])
    limits = settings.commissioning
    times = max(1, round(limits.steps_s * settings.rig.tick_rate_hz / len(pair)))
    step_deg_s = limits.step_deg_s if step_deg_s is None else step_deg_s
    return rad_from_deg(step_deg_s) * np.tile(pair, times)


def small_move_check(result: TrialResult, settings: Settings) -> RigCheck:
    """Check direction and rough scale of the first motion, and its velocity if that ended it."""
    found = following(result.readings, settings.rig.drive_damping_ratio)
    check = within_tolerance(
        ANGLE_PER_COMMAND, found.scale, "1", 1.0, SMALL_MOVE_PERCENT, _SCALE_REMEDY
    )
    if result.cause is Cause.VELOCITY_WRONG and check.passed:
        apart = _velocity_check(result.readings, settings)
        if not apart.passed:
            return apart
        words = stopped_for(result.cause)
        return yes(apart.name, False, words, apart.limit, _VELOCITY_REMEDY)
    if result.cause is Cause.VELOCITY_WRONG:  # the angle agrees with neither command nor velocity
        return check
    if result.cause is Cause.NONE:
        return check
    if result.cause not in _NOT_AS_COMMANDED:  # a motion cut short tells nothing of the scale
        return yes(ANGLE_PER_COMMAND, False, stopped_for(result.cause), check.limit, _REASON_REMEDY)
    if check.passed:
        return yes(ANGLE_PER_COMMAND, False, stopped_for(result.cause), check.limit, _SCALE_REMEDY)
    return check


def swing_checks(result: TrialResult, settings: Settings) -> tuple[list[RigCheck], Following]:
    """Check directions and scales over the slow motion."""
    readings, percent = result.readings, settings.commissioning.scale_tolerance_percent
    found = following(readings, settings.rig.drive_damping_ratio)
    checks = [
        yes(
            COMPLETED,
            result.cause is Cause.NONE,
            "yes" if result.cause is Cause.NONE else stopped_for(result.cause),
            "yes",
            _REASON_REMEDY,
        ),
        within_tolerance(ANGLE_PER_COMMAND, found.scale, "1", 1.0, percent, _SCALE_REMEDY),
        _velocity_check(readings, settings),
        below(
            "following error",
            math.degrees(found.worst_rad),
            "deg",
            settings.guard.following_limit_deg,
            "tune the drive's loop, or check for slip and for a limit inside the drive",
        ),
    ]
    return checks, found


def _velocity_check(readings: Readings, settings: Settings) -> RigCheck:
    percent = settings.commissioning.scale_tolerance_percent
    found = velocity_per_angle(readings)
    return within_tolerance(VELOCITY_PER_ANGLE, found, "1", 1.0, percent, _VELOCITY_REMEDY)


def torque_sign(
    readings: Readings, damping_ratio: float, drive_scale: float
) -> tuple[RigCheck, float]:
    """Check that the torque is that of a joint that resists; return the work done on it in J."""
    name, limit = "torque against motion", "that of a joint that resists"
    seen = fit_arm(readings, math.inf, damping_ratio, drive_scale)
    angle, torque = readings.angle_rad, readings.torque_nm
    work_j = float(np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(angle)))
    if seen.explained < EXPLAINED:
        why = (
            f"the motion explains {100 * max(seen.explained, 0.0):.0f} % of the torque; fasten a "
            "spring or a relaxed arm's weight to the joint, and let nobody push"
        )
        return impossible(name, limit, why), work_j
    remedy = (
        f"the {seen.strongest} is negative, so torque and angle have opposite signs: turn the "
        "sign of the one that is wrong in the rig file; with it the loop would run away"
    )
    words = (
        f"J {seen.inertia_kg_m2:.3g} kg·m², B {seen.damping_nm_s_rad:.3g} N·m·s/rad, "
        f"K {seen.stiffness_nm_rad:.3g} N·m/rad, work {1000 * work_j:.3g} mJ"
    )
    return yes(name, seen.strongest_is_positive, words, limit, remedy), work_j


def step_checks(
    result: TrialResult, settings: Settings
) -> tuple[list[RigCheck], Following, ArmFit]:
    """Check delays and bandwidth by the quick steps."""
    readings, guard = result.readings, settings.guard
    ratio = settings.rig.drive_damping_ratio
    # A quicker drive, of which the guard expects no inertia at the ticks, looks like a delay.
    highest_hz = 1.001 * SETTLED * settings.rig.tick_rate_hz / (2.0 * math.pi * ratio)
    found = following(readings, ratio, highest_hz)
    seen = fit_arm(readings, found.bandwidth_hz, ratio, found.scale, resists=True)
    # As the settings count it: twice the mean lag of a second-order drive, and what goes before.
    lag_s = 2.0 * ratio / (math.pi * found.bandwidth_hz) + found.delay_s
    bandwidth = above(
        "bandwidth of the drive",
        found.bandwidth_hz,
        "Hz",
        1.0,
        "tune the drive; the arm follows the loop no faster than this",
    )
    stated_hz = min(settings.rig.drive_bandwidth_hz, highest_hz)
    if bandwidth.passed and abs(found.bandwidth_hz - stated_hz) > ANOTHER * stated_hz:
        why = f"rig.drive_bandwidth_hz = {settings.rig.drive_bandwidth_hz:g} Hz is not this drive's"
        bandwidth = replace(bandwidth, remedy=f"{why}; `run` uses what was measured")
    checks = [
        bandwidth,
        below(
            "delay from command to motion",
            lag_s + 1.0 / settings.rig.tick_rate_hz,
            "s",
            guard.reaction_time_s,
            "raise guard.reaction_time_s to this, so that the guard brakes early enough, or make "
            "the drive faster",
        ),
    ]
    name = "delay from command to torque"
    limit = "known"
    if seen.explained < EXPLAINED:
        why = "no arm shows in the torque; fasten a spring or a relaxed arm's weight to the joint"
        checks.append(impossible(name, limit, why))
    else:
        checks.append(RigCheck(name, seen.delay_s, "s", limit, "passed"))
    return checks, found, seen


def drift_check(readings: Readings, limit_deg: float) -> RigCheck:
    """Check that the joint stood still when power came."""
    angle = readings.angle_rad[np.isfinite(readings.angle_rad)]
    moved = math.degrees(float(np.max(np.abs(angle)))) if len(angle) else math.inf
    return below(
        "motion when enabled",
        moved,
        "deg",
        limit_deg,
        "the drive must come up at rest: check for an old target, or an offset of its input",
    )


_REASON_REMEDY = "remove the reason and try again"
_VELOCITY_REMEDY = "sign or units of the velocity in the rig file are not those of the angle"
_NOT_AS_COMMANDED = (Cause.POSITION_LIMIT_EXCEEDED, Cause.NOT_FOLLOWING, Cause.OVERSPEED)
"""What the guard stops for where sign or scale are wrong."""
_SCALE_REMEDY = (
    "sign, counts per turn, gear ratio or velocity units in the rig file are wrong; "
    "-1 is a wrong sign, 57.3 and 0.0175 are degrees for radians"
)


def smooth_motion(distance_rad: float, speed_rad_s: float, tick_s: float) -> Array:
    """Return velocities of a smooth motion over a distance, one a tick; they add up to it."""
    n = max(2, math.ceil(PEAK * abs(distance_rad) / speed_rad_s / tick_s))
    places = np.array(
        [minimum_jerk(-distance_rad, n * tick_s, k * tick_s)[0] for k in range(n + 1)]
    )
    return np.diff(places) / tick_s
