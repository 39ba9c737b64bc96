"""What the guard allows, in SI units, and the state it starts from."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.settings import GAP_S, Settings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.rig.guard.causes import Cause, Reaction
from rigidimeter.rig.guard.contact import ContactState, contact_state, forgotten

OVERSPEED = 1.25
"""A joint this much above the speed limit is out of the drive's control."""

UNDONE = 0.1
"""The part of the reaction time by which a second-order drive is still off where the reaction time
is the least that the settings allow: its response overshoots, so it is no mixture of delays."""

AT_LIMIT_S, AT_LIMIT_OF_S = 1.0, 5.0
"""A joint that is driven against the position limit for so long, of so long, is not being measured.
Whoever pushes it for a moment, or a perturbation that asks for more, turns back before."""

ARRIVALS_S, APART_S = 10.0, 0.2
"""Nor is one that comes to the limit for the third time within so long, where what comes within
`APART_S` of an arrival is the same one."""

_NO_CAUSE, _NO_REACTION = int(Cause.NONE), int(Reaction.NONE)


class GuardLimits(NamedTuple):
    """Limits, in SI units; angles are from the initial position.

    `position_rad` holds to both sides, `lowest_rad` and `highest_rad` cut it (see `within_range`).
    `reaction_time_s` is how long the drive may take to have done what it was told, and how far the
    stamp of a reading may be wrong. `gap_s` is how late a step may come without the position limit
    being crossed. `tolerance_rad` is how far beyond the position limit a reading may be before it
    counts as a fault: sensor noise at the limit is none. `stale_s` is how old a reading may be.
    `following_rad` is how far the angle may be outside of where the commands can have brought it,
    `drift_rad_s` how fast that place may follow the angle. `at_limit_s` is how much of the last
    `at_limit_of_s` the position limit may hold the command back, `arrivals_s` how long three
    arrivals there must take at least, `apart_s` how long after one the next counts. `arrival_rad_s`
    bounds the speed at which the hardest braking begins.
    """

    position_rad: float
    speed_rad_s: float
    acceleration_rad_s2: float
    reaction_time_s: float
    interval_s: float
    gap_s: float = 0.0
    tolerance_rad: float = 0.01
    overspeed_rad_s: float = math.inf
    stale_s: float = 0.5
    torque_nm: float = math.inf
    torque_stop_nm: float = math.inf
    power_w: float = math.inf
    energy_j: float = math.inf
    following_rad: float = math.inf
    drift_rad_s: float = 0.0
    at_limit_s: float = math.inf
    at_limit_of_s: float = 0.0
    arrivals_s: float = 0.0
    apart_s: float = 0.0
    arrival_rad_s: float = math.inf
    lowest_rad: float = -math.inf
    highest_rad: float = math.inf

    @property
    def extent_rad(self) -> tuple[float, float]:
        """The two angles between which the joint is kept."""
        low = max(self.lowest_rad, -self.position_rad)
        return low, min(self.highest_rad, self.position_rad)


class GuardState(NamedTuple):
    """What the guard remembers.

    `sent_rad` is a ring of the running sum of what was sent, one entry a tick, `newest` the place
    of the newest. It reaches back as far as a reading that is not stale and the reaction time. What
    lies before the first tick is zero: nothing was sent. The ring is written in place: a state is
    used once. `angle_rad` is the last reading that was a number, `age_s` how old it is,
    `origin_rad` where the running sum began on the angle's scale (NaN before the first reading),
    `energy_j` what went to and fro within the last second. `cause` is the first one, `reaction` the
    strongest. `contact` is how long and how often the position limit has held the command back.
    """

    sent_rad: NDArray[np.float64]
    contact: ContactState
    newest: int = 0
    velocity_rad_s: float = 0.0
    angle_rad: float = 0.0
    age_s: float = 0.0
    origin_rad: float = math.nan
    energy_j: float = 0.0
    cause: int = _NO_CAUSE
    reaction: int = _NO_REACTION


def guard_limits(settings: Settings) -> GuardLimits:
    """Return the guard's limits for the loop's tick."""
    guard, motion = settings.guard, settings.rig.motion
    interval_s = 1.0 / settings.rig.tick_rate_hz
    speed_deg_s = guard.speed_limit_deg_s
    # A coarse reading is off by half its resolution; so is the one the angle is counted from.
    following_deg = guard.following_limit_deg + motion.angle_resolution_deg
    following_deg += UNDONE * guard.reaction_time_s * speed_deg_s
    return GuardLimits(
        position_rad=rad_from_deg(guard.position_limit_deg),
        speed_rad_s=rad_from_deg(speed_deg_s),
        acceleration_rad_s2=rad_from_deg(guard.acceleration_limit_deg_s2),
        reaction_time_s=guard.reaction_time_s,
        interval_s=interval_s,
        gap_s=max(GAP_S, interval_s),
        overspeed_rad_s=rad_from_deg(
            OVERSPEED * speed_deg_s + 0.5 * motion.velocity_resolution_deg_s
        ),
        stale_s=guard.stale_s,
        torque_nm=guard.torque_limit_nm,
        torque_stop_nm=guard.torque_stop_nm,
        power_w=guard.power_limit_w,
        energy_j=guard.energy_limit_j,
        following_rad=rad_from_deg(following_deg),
        drift_rad_s=rad_from_deg(guard.drift_limit_deg_s),
        at_limit_s=AT_LIMIT_S,
        at_limit_of_s=AT_LIMIT_OF_S,
        arrivals_s=ARRIVALS_S,
        apart_s=APART_S,
        arrival_rad_s=rad_from_deg(guard.arrival_speed_deg_s),
    )


def within_range(limits: GuardLimits, lowest_rad: float, highest_rad: float) -> GuardLimits:
    """Return the limits cut by the range of motion of the person, from the initial position."""
    return limits._replace(lowest_rad=lowest_rad, highest_rad=highest_rad)


def guard_state(limits: GuardLimits) -> GuardState:
    """Return the state of a guard at rest that has seen nothing wrong."""
    memory_s = limits.stale_s + limits.reaction_time_s
    sent_rad = np.zeros(math.ceil(memory_s / limits.interval_s) + 2)
    return GuardState(sent_rad, contact_state(limits.interval_s, limits.at_limit_of_s))


def released(state: GuardState) -> GuardState:
    """Return the state after a hold that the operator has ended.

    What was sent is still remembered: the drive may still be doing it. What counts against the
    position limit begins anew.

    Raises
    ------
    ValueError
        If the guard has stopped the rig rather than held it, or is not at rest yet.
    """
    if state.reaction > Reaction.HOLD or state.velocity_rad_s != 0.0:
        raise ValueError("only a guard that holds the joint at rest can be released")
    contact = forgotten(state.contact)
    return state._replace(contact=contact, cause=_NO_CAUSE, reaction=_NO_REACTION)
