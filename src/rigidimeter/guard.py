"""The last word before the wire: position, speed and acceleration limits, and a latch.

The guard knows nothing of the controller. Whatever velocity is asked for, it sends one that

- is finite,
- changes by at most a·Δt a tick,
- is at most the speed limit,
- lets the joint stop before the position limit: v ≤ √(2 a d), less what one tick covers, with d
  the distance left.

The distance left is not counted from the last reading, which is old and does not show what the
drive has been told but has not done yet. It is counted from the farthest point at which the joint
could come to rest if the command became zero at once: the reading, plus the largest part of what
was sent since the reading was taken, less the reaction time, that may still be on its way. A drive
that follows its command after any delay up to the reaction time, or after a mixture of such delays,
is covered; one that overshoots its command passes by what it overshoots.

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

import numpy as np
from numpy.typing import NDArray

from rigidimeter.settings import Settings
from rigidimeter.units import rad_from_deg

__all__ = [
    "Cause",
    "GuardLimits",
    "GuardState",
    "Limited",
    "guard_limits",
    "guard_state",
    "guard_step",
    "why_ended",
]

MEMORY_S = 0.5
"""How far back the guard remembers what was sent; a reading older than that is no reading."""


class Cause(IntEnum):
    """Why the guard latched; the first cause is kept."""

    NONE = 0
    TORQUE_NOT_FINITE = 1
    MOTION_NOT_FINITE = 2
    COMMAND_NOT_FINITE = 3
    POSITION_LIMIT_EXCEEDED = 4
    MOTION_STALE = 5

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
    Cause.MOTION_STALE: "no angle reading arrived for half a second",
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

    `reaction_time_s` is how long the drive may take to have done what it was told, and how far the
    stamp of a reading may be wrong. `tolerance_rad` is how far beyond the position limit a
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

    `sent_rad` is a ring of the running sum of what was sent, one entry a tick, `newest` the place
    of the newest. What lies before the first tick is zero: nothing was sent. The ring is written in
    place: a state is used once. `angle_rad` is the last reading that was a number, `age_s` how old
    it is.
    """

    sent_rad: NDArray[np.float64]
    newest: int = 0
    velocity_rad_s: float = 0.0
    angle_rad: float = 0.0
    age_s: float = 0.0
    cause: int = _NO_CAUSE


def guard_limits(settings: Settings) -> GuardLimits:
    """Return the guard's limits in radians for the loop's tick."""
    guard = settings.guard
    return GuardLimits(
        position_rad=rad_from_deg(guard.position_limit_deg),
        speed_rad_s=rad_from_deg(guard.speed_limit_deg_s),
        acceleration_rad_s2=rad_from_deg(guard.acceleration_limit_deg_s2),
        reaction_time_s=guard.reaction_time_s,
        interval_s=1.0 / settings.rig.tick_rate_hz,
    )


def why_ended(settings: Settings, cause: Cause, limit_time_s: float) -> str:
    """Return why an epoch does not count for what the guard did in it; empty where it counts.

    `limit_time_s` is when the position limit first held the command back, NaN if it never did.
    """
    if cause is not Cause.NONE:
        return f"the guard stopped the rig: {cause.sentence}"
    if not math.isnan(limit_time_s):
        return (
            f"the arm came to the position limit of ±{settings.guard.position_limit_deg:g} deg "
            f"at {limit_time_s:.3f} s"
        )
    return ""


def guard_state(limits: GuardLimits) -> GuardState:
    """Return the state of a guard at rest that has seen nothing wrong."""
    return GuardState(np.zeros(math.ceil(MEMORY_S / limits.interval_s) + 1))


def guard_step(
    limits: GuardLimits,
    state: GuardState,
    requested_rad_s: float,
    torque_nm: float,
    angle_rad: float,
    velocity_rad_s: float,
    age_s: float,
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
    age_s : float
        How long ago the motion reading was taken.

    Returns
    -------
    state : GuardState
    sent_rad_s : float
        What may go to the drive.
    limited : int
        A `Limited` value.
    """
    dt = limits.interval_s
    ring, before, sent_before, angle, age, cause = state
    size = ring.shape[0]
    newest = before + 1 if before + 1 < size else 0
    ring[newest] = ring[before] + sent_before * dt
    age += dt
    motion_finite = isfinite(angle_rad) and isfinite(velocity_rad_s) and isfinite(age_s)
    if motion_finite:
        angle, age = angle_rad, age_s
    if cause == _NO_CAUSE:
        if not isfinite(torque_nm):
            cause = int(Cause.TORQUE_NOT_FINITE)
        elif not motion_finite:
            cause = int(Cause.MOTION_NOT_FINITE)
        elif not isfinite(requested_rad_s):
            cause = int(Cause.COMMAND_NOT_FINITE)
        elif abs(angle) > limits.position_rad + limits.tolerance_rad:
            cause = int(Cause.POSITION_LIMIT_EXCEEDED)
        elif age > MEMORY_S:
            cause = int(Cause.MOTION_STALE)
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
    toward = 1.0 if sent > 0 else -1.0
    left = limits.position_rad - toward * angle
    reach_s = max(age, 0.0) + limits.reaction_time_s
    # Far from the limit the search is spared: at full speed, after all that can be in flight and
    # two ticks more, the joint could still stop.
    speed = limits.speed_rad_s
    stopping = speed * speed / (2.0 * limits.acceleration_rad_s2)
    if left < speed * (reach_s + 2.0 * dt) + stopping:
        back = min(math.ceil(reach_s / dt), size - 1)
        left -= _farthest_in_flight(ring, newest, back, toward)
        fastest = _stoppable_speed(limits.acceleration_rad_s2, dt, left)
        if abs(sent) > fastest:
            sent, limited = math.copysign(fastest, sent), max(limited, int(Limited.POSITION))
    return GuardState(ring, newest, sent, angle, age, cause), sent, limited


def _farthest_in_flight(ring: NDArray[np.float64], newest: int, back: int, toward: float) -> float:
    """Return the most, toward a limit, that was sent in any stretch up to now, at most `back`."""
    now = ring[newest]
    farthest = 0.0
    for k in range(1, back + 1):  # a place below zero counts from the ring's end
        farthest = max(farthest, toward * (now - ring[newest - k]))
    return float(farthest)


def _stoppable_speed(acceleration: float, interval_s: float, distance_rad: float) -> float:
    """Return the largest v with v Δt + v²/(2a) ≤ d; 0 when there is no distance left."""
    if distance_rad <= 0.0:
        return 0.0
    root = math.sqrt(interval_s * interval_s + 2.0 * distance_rad / acceleration)
    return acceleration * (root - interval_s)
