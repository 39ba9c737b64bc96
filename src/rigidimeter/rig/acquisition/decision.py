"""What a tick decides, from its readings to the velocity that may be sent.

The loop and the replay of a recorded session call the same function, so they cannot drift apart.
Nothing here knows of a clock, a device or a file.
"""

from __future__ import annotations

from rigidimeter.rig.guard import (
    REACTIONS,
    Cause,
    ConsistencyLimits,
    ConsistencyState,
    GuardLimits,
    GuardState,
    consistency_step,
    guard_step,
)

STALLED, _NO_CAUSE = int(Cause.STALLED), int(Cause.NONE)


def decide(
    limits: GuardLimits,
    agreement: ConsistencyLimits,
    guard: GuardState,
    consistency: ConsistencyState,
    request_rad_s: float,
    perturbation_nm: float,
    torque_nm: float,
    angle_rad: float,
    velocity_rad_s: float,
    motion_age_s: float,
    torque_age_s: float,
    reported: int,
    elapsed_ticks: int,
    apart: int = _NO_CAUSE,
) -> tuple[GuardState, ConsistencyState, float, int]:
    """Return what guard and laws of agreement remember, the velocity that may be sent, and a limit.

    Parameters
    ----------
    limits, agreement : GuardLimits, ConsistencyLimits
    guard, consistency : GuardState, ConsistencyState
        After the tick before, with the velocity in force.
    request_rad_s : float
        What the controller asks for.
    perturbation_nm, torque_nm, angle_rad, velocity_rad_s : float
    motion_age_s, torque_age_s : float
        How long before the tick's deadline the readings were taken.
    reported : int
        The `Cause` that the loop or a device reports.
    elapsed_ticks : int
        Ticks since the decision before.
    apart : int
        The `Cause` that the comparison with the drive's own torque found.
    """
    if reported == STALLED:
        # A drive with a watchdog has stopped by now, and a ramp down from the velocity before
        # would set the arm going again; one without brakes by its own ramp.
        guard = guard._replace(velocity_rad_s=0.0)
    consistency, disagreement = consistency_step(
        agreement,
        consistency,
        guard.velocity_rad_s,
        perturbation_nm,
        torque_nm,
        angle_rad,
        velocity_rad_s,
        motion_age_s,
        torque_age_s,
        elapsed_ticks,
    )
    guard, allowed_rad_s, limited = guard_step(
        limits,
        guard,
        request_rad_s,
        torque_nm,
        angle_rad,
        velocity_rad_s,
        motion_age_s,
        torque_age_s,
        reported,
        elapsed_ticks,
        disagreement if disagreement != _NO_CAUSE else apart,
    )
    return guard, consistency, allowed_rad_s, limited


def stronger(cause: int, other: int) -> int:
    """Return the cause with the stronger reaction: an emergency stop is not masked by a fault."""
    return other if REACTIONS[other] > REACTIONS[cause] else cause


def late_cause(missed_ticks: int, late_in_a_row: int, stall_ticks: float, missed_limit: int) -> int:
    """Return why to stop for a tick that came late: it alone, or as one of many in a row.

    Parameters
    ----------
    missed_ticks : int
        Whose time passed before this one ran.
    late_in_a_row : int
        Ticks after missed ones up to this one.
    stall_ticks, missed_limit : float, int
        `loop.stall_s` in ticks, and `loop.missed_in_a_row`.
    """
    if missed_ticks >= stall_ticks:
        return STALLED
    return int(Cause.DEADLINES_MISSED if late_in_a_row >= missed_limit else Cause.NONE)
