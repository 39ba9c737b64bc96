"""One PRBS epoch of the virtual rig, from rest, as one function of numbers and arrays.

Tick for tick it does what `acquisition.loop.ControlLoop.perturb` does on a
`device.simulated.SimulatedRig`:

    read:     drive_step, then the samples taken since the last tick, then those that have arrived
    control:  biquad_step on the torque, admittance_step
    guard:    guard_step; what it lets pass is the drive's command until the next tick

The steps are those functions themselves. Nothing here is compiled: `compiled` does that, and what
is below runs in the interpreter just as well, with the same bits.
"""

from __future__ import annotations

import math
from math import isfinite, isnan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.model import (
    Admittance,
    Biquad,
    BiquadState,
    Drive,
    DriveState,
    admittance_step,
    arm_torque_nm,
    between,
    biquad_step,
    drive_step,
    moment,
    quantised,
)
from rigidimeter.rig.guard import GuardLimits, GuardState, Limited, guard_step

NOW, BEFORE = -1, -2
"""In `Sampling.part`: taken at this tick, at the tick before; else a row of `parts`."""

POSITION_LIMITED = int(Limited.POSITION)

Floats = NDArray[np.float64]
Integers = NDArray[np.int32]
Counts = NDArray[np.uint32]


class Coefficients(NamedTuple):
    """Of controller, guard, drive and sensors."""

    lowpass: Biquad
    admittance: Admittance
    limits: GuardLimits
    drive: Drive
    tick_rate_hz: float
    torque_resolution_nm: float
    angle_resolution_rad: float
    velocity_resolution_rad_s: float


class Joint(NamedTuple):
    """J, B, K of the epoch."""

    inertia_kg_m2: float
    damping_nm_s_rad: float
    stiffness_nm_rad: float


class Sampling(NamedTuple):
    """When one sensor samples and when the loop learns of it; no state of the rig changes it.

    `taken`, `newest`, `seen_s` and `age_s` have one entry a tick: how many samples have been taken,
    which is the newest that has arrived, its stamp, and how old that is. `part` and `left` have one
    entry a sample: where in its tick it was taken (`NOW`, `BEFORE` or a row of `parts`), and the
    part of that tick left. A row of `parts` holds the coefficients of a `Drive` for the part of a
    tick. What is never negative is said to be so: no index is then counted from an array's end.
    """

    taken: Counts
    newest: Counts
    seen_s: Floats
    age_s: Floats
    part: Integers
    left: Floats
    parts: Floats


class EpochColumns(NamedTuple):
    """What is recorded, one entry a tick; written in place."""

    torque_nm: Floats
    angle_rad: Floats
    velocity_rad_s: Floats
    velocity_request_rad_s: Floats
    velocity_command_rad_s: Floats
    limited: NDArray[np.int8]


def run_epoch(
    coefficients: Coefficients,
    joint: Joint,
    perturbation_nm: Floats,
    voluntary_nm: Floats,
    noise_nm: Floats,
    torque: Sampling,
    motion: Sampling,
    filtered: BiquadState,
    guard: GuardState,
    state: DriveState,
    columns: EpochColumns,
) -> tuple[int, int, float, int]:
    """Run one epoch until the perturbation ends or the guard latches.

    Returns
    -------
    ticks : int
        How many entries of each column were written.
    cause : int
        A `rig.guard.Cause` value.
    limit_time_s : float
        When the position limit first held the command back; NaN if it never did.
    limited_ticks : int
        How many commands the guard changed.
    """
    lowpass, admittance, limits, whole_tick, rate_hz, torque_step, angle_step, velocity_step = (
        coefficients
    )
    J, B, K = joint
    # Arrays are named once, before the first tick: each look into a tuple would count references.
    torque_taken, torque_newest, _, torque_age_s, torque_part, torque_left, torque_parts = torque
    motion_taken, motion_newest, _, motion_age_s, motion_part, _, motion_parts = motion
    out_torque, out_angle, out_velocity, out_request, out_command, out_limited = columns
    torques = np.empty(torque_part.shape[0])
    angles, velocities = np.empty(motion_part.shape[0]), np.empty(motion_part.shape[0])
    next_torque = next_motion = limited_ticks = 0
    limit_time_s = math.nan
    command = voluntary = 0.0
    cause = guard.cause
    ticks = perturbation_nm.shape[0]
    for tick in range(perturbation_nm.shape[0]):
        before, voluntary_before = state, voluntary
        if tick > 0:
            voluntary = voluntary_nm[tick]
            state = drive_step(whole_tick, before, command)

        while next_torque < torque_taken[tick]:
            angle, velocity, acceleration = _state_at(
                torque_part[next_torque], torque_parts, state, before, command
            )
            acting = between(voluntary, voluntary_before, torque_left[next_torque])
            measured = noise_nm[next_torque] + arm_torque_nm(
                J, B, K, angle, velocity, acceleration, acting
            )
            torques[next_torque] = quantised(measured, torque_step)
            next_torque += 1
        while next_motion < motion_taken[tick]:
            angle, velocity, _ = _state_at(
                motion_part[next_motion], motion_parts, state, before, command
            )
            angles[next_motion] = quantised(angle, angle_step)
            velocities[next_motion] = quantised(velocity, velocity_step)
            next_motion += 1

        torque_nm = torques[torque_newest[tick]]
        seen = motion_newest[tick]
        angle, velocity = angles[seen], velocities[seen]
        smooth_nm = torque_nm
        if isfinite(torque_nm):
            filtered, smooth_nm = biquad_step(lowpass, filtered, torque_nm)
        request = admittance_step(
            admittance, guard.velocity_rad_s, perturbation_nm[tick], smooth_nm
        )
        guard, command, limited = guard_step(
            limits,
            guard,
            request,
            torque_nm,
            angle,
            velocity,
            motion_age_s[tick],
            torque_age_s[tick],
        )
        if limited:
            limited_ticks += 1
            if limited == POSITION_LIMITED and isnan(limit_time_s):
                limit_time_s = tick / rate_hz
        out_torque[tick] = torque_nm
        out_angle[tick] = angle
        out_velocity[tick] = velocity
        out_request[tick] = request
        out_command[tick] = command
        out_limited[tick] = limited
        cause = guard.cause
        if cause:
            ticks = tick + 1
            break
    return ticks, cause, limit_time_s, limited_ticks


def _state_at(
    part: int, parts: Floats, state: DriveState, before: DriveState, command_rad_s: float
) -> DriveState:
    """Return the state when a sample was taken: at this tick, at the one before, or between."""
    if part == NOW:
        return state
    if part == BEFORE:
        return before
    length = Drive(
        parts[part, 0],
        parts[part, 1],
        parts[part, 2],
        parts[part, 3],
        parts[part, 4],
        parts[part, 5],
        parts[part, 6],
    )
    return drive_step(length, before, command_rad_s)


def moments(
    taken_s: Floats, now_s: Floats, interval_s: float, elapsed_s: Floats, left: Floats
) -> None:
    """Write, for each sample, where in the interval that ends at `now_s` it was taken."""
    for k in range(taken_s.shape[0]):
        elapsed_s[k], left[k] = moment(taken_s[k], now_s[k], interval_s)
