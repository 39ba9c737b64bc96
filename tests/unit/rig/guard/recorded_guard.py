"""The guard over what was recorded: the same samples, the same limits or others.

With the limits of the session the commands are those that were recorded, to the bit, wherever the
drive takes a velocity as it is and does not round it. With other limits they are what the guard
would have sent had the controller asked for the same: in a new session it would have asked for
something else as soon as one command differed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.rig.guard import (
    Cause,
    ConsistencyLimits,
    GuardLimits,
    GuardState,
    Reaction,
    consistency_state,
    consistency_step,
    guard_state,
    guard_step,
    released,
)

_INPUTS = (
    *("velocity_request_rad_s", "torque_nm", "angle_rad", "velocity_rad_s"),
    *("motion_time_s", "torque_time_s", "perturbation_nm"),
)

_FOUND_HERE = {
    *(Cause.TORQUE_NOT_FINITE, Cause.MOTION_NOT_FINITE, Cause.COMMAND_NOT_FINITE),
    *(Cause.POSITION_LIMIT_EXCEEDED, Cause.MOTION_STALE, Cause.TORQUE_STALE, Cause.STAMP_AHEAD),
    *(Cause.OVERSPEED, Cause.NOT_FOLLOWING, Cause.TORQUE_TOO_HIGH, Cause.ENERGY_HIGH),
    *(Cause.TORQUE_HIGH, Cause.POWER_HIGH, Cause.HELD_AT_LIMIT),
    *(Cause.MOVED_AT_REST, Cause.VELOCITY_WRONG, Cause.SELDOM_FRESH),
    *(Cause.TORQUE_SILENT, Cause.TORQUE_SIGN),
}
"""What `watch` and `consistency` find themselves, so that other limits may find it elsewhere or not
at all."""


class Replayed(NamedTuple):
    """What the guard says to each recorded tick; named as in the record."""

    velocity_command_rad_s: NDArray[np.float64]
    limited: NDArray[np.int8]
    cause: NDArray[np.int8]
    reaction: NDArray[np.int8]


def replay(
    limits: GuardLimits,
    tick_rate_hz: float,
    columns: Mapping[str, NDArray[Any]],
    agreement: ConsistencyLimits | None = None,
) -> Replayed:
    """Run the guard over the columns of a recorded session, from its first tick on.

    A cause that the guard does not find itself, as a drive's fault, is reported to it while the
    record holds it. Where the record's cause goes, the operator went on: so does the guard if it,
    too, held the joint at rest.

    Parameters
    ----------
    limits : GuardLimits
        For the session's tick: `guard_limits(settings)`.
    tick_rate_hz : float
        Of the session.
    columns : mapping
        As `recording.read_samples` gives them: tick, velocity_request_rad_s, torque_nm, angle_rad,
        velocity_rad_s, motion_time_s, torque_time_s, perturbation_nm
        and cause.
    agreement : ConsistencyLimits, optional
        For the session's tick: `consistency_limits(settings)`; without them nothing is found that
        needs time to show.
    """
    agreement = agreement or ConsistencyLimits(limits.interval_s)
    agreed = consistency_state(agreement)
    ticks, recorded = columns["tick"].tolist(), columns["cause"].tolist()
    elapsed = np.diff(columns["tick"], prepend=columns["tick"][:1]).tolist()
    inputs = zip(*(columns[name].tolist() for name in _INPUTS), strict=True)
    said = Replayed(np.empty(len(ticks)), *(np.empty(len(ticks), np.int8) for _ in range(3)))
    state, before = guard_state(limits), int(Cause.NONE)
    rows = enumerate(zip(ticks, elapsed, recorded, inputs, strict=True))
    for k, (tick, passed, cause, values) in rows:
        request, torque_nm, angle, velocity, motion_s, torque_s, perturbation_nm = values
        if cause == Cause.NONE != before and _is_held_at_rest(state):
            state = released(state)
        due_s = tick / tick_rate_hz
        measured = torque_nm, angle, velocity, due_s - motion_s, due_s - torque_s
        agreed, apart = consistency_step(
            agreement, agreed, state.velocity_rad_s, perturbation_nm, *measured, passed
        )
        state, said.velocity_command_rad_s[k], said.limited[k] = guard_step(
            limits,
            state,
            request,
            *measured,
            int(Cause.NONE) if cause in _FOUND_HERE else cause,
            passed,
            apart,
        )
        said.cause[k], said.reaction[k] = state.cause, state.reaction
        before = cause
    return said


def _is_held_at_rest(state: GuardState) -> bool:
    return state.reaction == Reaction.HOLD and state.velocity_rad_s == 0.0
