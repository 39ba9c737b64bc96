"""What is wrong with this tick's readings: nothing, or the first thing found.

    power             P = M_meas · v       W, into the joint where positive
    energy            E' = |P| − E/1 s     J, what went to and fro within about a second
    position error    how far the angle is outside of where the commands can have brought it

The energy counts both ways: an unstable contact with a spring sends back what it takes, and so does
a tremor. No law needs the controller.

The commands sent up to some moment add up to an angle. A drive that has done every command after
some delay, or after a mixture of delays, is at a mean of those sums, so between the least and the
largest of them over all delays it may have. How long it takes, and how fast the joint moves, makes
no difference to that: at rest the two are one, and a joint that moves is where it was told to be at
some moment of the stretch.

Each comparison is written so that a number that is not one fails it.
"""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import NDArray

from rigidimeter.rig.guard.causes import Cause
from rigidimeter.rig.guard.limits import GuardLimits


def energy_after(energy_j: float, power_w: float, elapsed_s: float) -> float:
    """Return the energy that went to and fro, after a stretch at this power.

    The memory is 1 s: after a stretch as long as that, nothing is left of what was before.
    """
    return energy_j + (abs(power_w) - energy_j) * min(elapsed_s, 1.0)


def outside(
    sent_rad: NDArray[np.float64], newest: int, first: int, last: int, moved_rad: float
) -> float:
    """Return how far `moved_rad` is above or below all sums from `first` to `last` ticks ago."""
    lowest = highest = sent_rad[newest - first]
    for k in range(first, last + 1):  # a place below zero counts from the ring's end
        lowest = min(lowest, sent_rad[newest - k])
        highest = max(highest, sent_rad[newest - k])
    return float(max(moved_rad - highest, 0.0) + min(moved_rad - lowest, 0.0))


def found_wrong(
    limits: GuardLimits,
    requested_rad_s: float,
    torque_nm: float,
    motion_finite: bool,
    angle_rad: float,
    velocity_rad_s: float,
    age_s: float,
    torque_age_s: float,
    position_error_rad: float,
    energy_j: float,
    limited_s: float,
    three_arrivals_s: float,
) -> int:
    """Return the `Cause` of the first law that is broken, 0 if none is.

    What makes the numbers themselves worthless comes first, what they say after it, and what only
    asks for a pause last.
    """
    if not isfinite(torque_nm):
        return int(Cause.TORQUE_NOT_FINITE)
    if not motion_finite:
        return int(Cause.MOTION_NOT_FINITE)
    if not isfinite(requested_rad_s):
        return int(Cause.COMMAND_NOT_FINITE)
    if not abs(angle_rad) <= limits.position_rad + limits.tolerance_rad:
        return int(Cause.POSITION_LIMIT_EXCEEDED)
    if not limits.lowest_rad <= angle_rad + limits.tolerance_rad:
        return int(Cause.POSITION_LIMIT_EXCEEDED)
    if not angle_rad - limits.tolerance_rad <= limits.highest_rad:
        return int(Cause.POSITION_LIMIT_EXCEEDED)
    if not age_s <= limits.stale_s:
        return int(Cause.MOTION_STALE)
    if not torque_age_s <= limits.stale_s:
        return int(Cause.TORQUE_STALE)
    # A stamp may be wrong by the reaction time, and a sample taken within the tick.
    if not min(age_s, torque_age_s) >= -(limits.reaction_time_s + limits.interval_s):
        return int(Cause.STAMP_AHEAD)
    if not abs(velocity_rad_s) <= limits.overspeed_rad_s:
        return int(Cause.OVERSPEED)
    if not abs(position_error_rad) <= limits.following_rad:
        return int(Cause.NOT_FOLLOWING)
    if not abs(torque_nm) <= limits.torque_stop_nm:
        return int(Cause.TORQUE_TOO_HIGH)
    if not energy_j <= limits.energy_j:
        return int(Cause.ENERGY_HIGH)
    if not abs(torque_nm) <= limits.torque_nm:
        return int(Cause.TORQUE_HIGH)
    if not abs(torque_nm * velocity_rad_s) <= limits.power_w:
        return int(Cause.POWER_HIGH)
    if not (limited_s <= limits.at_limit_s and three_arrivals_s > limits.arrivals_s):
        return int(Cause.HELD_AT_LIMIT)
    return int(Cause.NONE)
