"""The last word before the wire: position, speed and acceleration limits, and a latch.

The guard knows nothing of the controller. Whatever velocity is asked for, it sends one that

- is finite,
- changes by at most a·Δt a tick,
- is at most the speed limit,
- lets the joint stop before the position limit: v ≤ √(2 a d), less what one tick covers, with d
  the distance left.

The distance left is not counted from the last reading, which is old and does not show what the
drive has been told but has not done yet. It is counted from where the joint would come to rest if
the command became zero at once: the reading, plus what was in flight when it was taken (a first
order memory of what was sent, as long as the reaction time), plus what has been sent since.

The position limit wins over the acceleration limit; it only ever makes the speed toward the limit
smaller. A number that is not finite, or an angle beyond the limit, latches: the velocity is ramped
to zero and stays there until a new state is made. The first cause is kept.

Like the control steps, a step only adds, multiplies, compares and takes square roots.
"""

from __future__ import annotations

import math
from enum import IntEnum
from math import isfinite
from typing import NamedTuple

__all__ = ["Cause", "GuardLimits", "GuardState", "Limited", "guard_step"]


class Cause(IntEnum):
    """Why the guard latched; the first cause is kept."""

    NONE = 0
    TORQUE_NOT_FINITE = 1
    MOTION_NOT_FINITE = 2
    COMMAND_NOT_FINITE = 3
    POSITION_LIMIT_EXCEEDED = 4

    @property
    def sentence(self) -> str:
        """What happened, in words."""
        return _SENTENCES[self]


_SENTENCES = {
    Cause.NONE: "no fault",
    Cause.TORQUE_NOT_FINITE: "the torque sensor gave a number that is not finite",
    Cause.MOTION_NOT_FINITE: "the angle or velocity reading was not finite",
    Cause.COMMAND_NOT_FINITE: "the controller asked for a velocity that is not finite",
    Cause.POSITION_LIMIT_EXCEEDED: "the angle was beyond the position limit",
}


class Limited(IntEnum):
    """Which limit changed the command of a tick; the gravest one is named."""

    NOT = 0
    ACCELERATION = 1
    SPEED = 2
    POSITION = 3
    LATCHED = 4


_NO_CAUSE, _NOT_LIMITED = int(Cause.NONE), int(Limited.NOT)


class GuardLimits(NamedTuple):
    """Limits, symmetric about the initial position.

    `reaction_time_s` is what passes between a command and the reading that shows its motion: drive
    lag, encoder latency and one tick. `tolerance_rad` is how far beyond the position limit a
    reading may be before it counts as a fault: sensor noise at the limit is none.
    """

    position_rad: float
    speed_rad_s: float
    acceleration_rad_s2: float
    reaction_time_s: float
    interval_s: float
    tolerance_rad: float = 0.01


class GuardState(NamedTuple):
    """What the guard remembers.

    The velocity last sent, where the joint would come to rest, what of the motion is in flight, the
    stamp of the last reading, and the first cause.
    """

    velocity_rad_s: float = 0.0
    rest_angle_rad: float = 0.0
    in_flight_rad: float = 0.0
    reading_time_s: float = -math.inf
    cause: int = _NO_CAUSE


def guard_step(
    limits: GuardLimits,
    state: GuardState,
    requested_rad_s: float,
    torque_nm: float,
    angle_rad: float,
    velocity_rad_s: float,
    reading_time_s: float,
) -> tuple[GuardState, float, int]:
    """Limit one velocity command.

    Parameters
    ----------
    limits : GuardLimits
    state : GuardState
    requested_rad_s : float
        What the controller asks for.
    torque_nm, angle_rad, velocity_rad_s : float
        The newest readings, checked for being finite.
    reading_time_s : float
        Stamp of the motion reading; a new stamp means a new reading.

    Returns
    -------
    state : GuardState
    sent_rad_s : float
        What may go to the drive.
    limited : int
        A `Limited` value.
    """
    dt = limits.interval_s
    sent_before, rest_angle, in_flight, last_time_s, cause = state
    rest_angle += sent_before * dt
    tau = limits.reaction_time_s
    in_flight = in_flight * (tau / (tau + dt)) + sent_before * dt
    motion_finite = isfinite(angle_rad) and isfinite(velocity_rad_s)
    if cause == _NO_CAUSE:
        if not isfinite(torque_nm):
            cause = int(Cause.TORQUE_NOT_FINITE)
        elif not motion_finite:
            cause = int(Cause.MOTION_NOT_FINITE)
        elif not isfinite(requested_rad_s):
            cause = int(Cause.COMMAND_NOT_FINITE)
        elif abs(angle_rad) > limits.position_rad + limits.tolerance_rad:
            cause = int(Cause.POSITION_LIMIT_EXCEEDED)
    if motion_finite and reading_time_s != last_time_s:
        rest_angle = angle_rad + in_flight
    sent, limited = requested_rad_s, _NOT_LIMITED
    if cause != _NO_CAUSE:
        sent, limited = 0.0, int(Limited.LATCHED)

    change = limits.acceleration_rad_s2 * dt
    if sent > sent_before + change:
        sent, limited = sent_before + change, max(limited, int(Limited.ACCELERATION))
    elif sent < sent_before - change:
        sent, limited = sent_before - change, max(limited, int(Limited.ACCELERATION))
    if abs(sent) > limits.speed_rad_s:
        sent, limited = math.copysign(limits.speed_rad_s, sent), max(limited, int(Limited.SPEED))

    # Toward the nearer limit, no faster than can still be stopped in the distance left.
    left = limits.position_rad - rest_angle if sent > 0 else limits.position_rad + rest_angle
    fastest = _stoppable_speed(limits.acceleration_rad_s2, dt, left)
    if abs(sent) > fastest:
        sent, limited = math.copysign(fastest, sent), max(limited, int(Limited.POSITION))
    return GuardState(sent, rest_angle, in_flight, reading_time_s, cause), sent, limited


def _stoppable_speed(acceleration: float, interval_s: float, distance_rad: float) -> float:
    """Return the largest v with v Δt + v²/(2a) ≤ d; 0 when there is no distance left."""
    if distance_rad <= 0.0:
        return 0.0
    root = math.sqrt(interval_s * interval_s + 2.0 * distance_rad / acceleration)
    return acceleration * (root - interval_s)
