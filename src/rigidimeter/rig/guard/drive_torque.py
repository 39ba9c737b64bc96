"""Whether the torque sensor agrees with the torque that the drive itself reports.

The torque M of the drive on the joint is that of its motor less what its own inertia and friction
take. With T as the drive reports it, at the joint, and a what its scale is wrong by,

    M = a T + α T' − J_d θ'' − F_c sgn θ' − D θ' + c

α is a times the delay of T that its stamp does not know, c the zero of both torques. Nothing is
assumed of the joint or of whoever pulls at it. Both sides pass L⁴ with L = w/(s + w) and w = 2π ·
5 Hz, on means of a few ticks, and are put to the time of M by their stamps: a filtered y that is
older by τ becomes y + τ y'. With m the filtered right side, d = L⁴ M − m is the difference.

A drive at rest, or one that has just turned back, may hold any friction between −F_c and F_c. There
the friction is taken for 0, and e is what of d is beyond u F_c, with u the filtered share of such
time. Over the last half second

    size    the mean of |e|                      an offset, noise, clipping, a sensor that is dead
    slope   Σ e m / √(n Σ m²)                    a gain: with e = (g − 1) m it is g − 1 times the
                                                 root mean square of m

may each be 4 times the scatter of e that `commission` measured: a constant part, of friction that
varies with the angle, and a share of the drive's own torques. A slope scatters by no more than e,
and by as much where the subject's torque goes with the error.

The model is `commission`'s. Without it, or where the drive never reported a torque, nothing is
found; where it no longer does for `WINDOW_S`, that is the same cause. A step only adds, multiplies,
divides, compares and takes square roots; it knows nothing of the controller. The window is written
in place: a state is used once.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.settings import Settings
from rigidimeter.rig.guard.causes import Cause
from rigidimeter.rig.guard.torque_answer import (
    FILTER_RAD_S,
    MAX_FILLED,
    NOTHING_YET,
    Filtered,
    lowpassed,
    mean_of_ticks,
)

WINDOW_S = 0.5
SETTLED_S = 0.35
"""A filter that began while the joint moved has then forgotten it but for 0.5 %."""

SLIPS_RAD_S = 0.02
"""A drive that moves more slowly may stick."""

PRESLIDING_RAD = 0.006
"""A drive that turned back slips after so much, whatever its friction was before."""

TIMES_SCATTER = 4.0
LEAST_SHARE = 0.005
"""Of the drive's own torques, four times which is 2 %: a motor's torque constant falls by 0.1 % a
kelvin, and a motor that works warms by 20."""

_NO_CAUSE = int(Cause.NONE)


class DriveModel(NamedTuple):
    """What `commission` found of the drive's side: a, α/a, J_d, F_c, D and c, and the scatter of e.

    The scatter is `scatter_nm` and `scatter_share` of the drive's own torques. Where `scatter_nm`
    is infinite the law is off.
    """

    scale: float = 1.0
    late_s: float = 0.0
    inertia_kg_m2: float = 0.0
    friction_nm: float = 0.0
    damping_nm_s_rad: float = 0.0
    zero_nm: float = 0.0
    scatter_nm: float = math.inf
    scatter_share: float = 0.0


class DriveTorqueLimits(NamedTuple):
    """The model of the drive's side, and which ticks make a step; `window_steps` make a window."""

    model: DriveModel
    interval_s: float
    mean_of_ticks: int
    step_s: float
    window_steps: int


class Terms(NamedTuple):
    """The filtered signals, all at the torque's time; `unknown` is u."""

    torque_nm: float = 0.0
    drive_nm: float = 0.0
    drive_nm_per_s: float = 0.0
    acceleration_rad_s2: float = 0.0
    sign: float = 0.0
    velocity_rad_s: float = 0.0
    unknown: float = 1.0


class StepsState(NamedTuple):
    """What is remembered from one mean of a few ticks to the next.

    `window` has |e|, e m, m² and the square of the drive's own torques, of each of the last steps,
    at `place` the newest; `size_nm`, `slope_nm2`, `model_nm2` and `own_nm2` are their means.
    `settled_s` is for how long the filters have run.
    """

    window: NDArray[np.float64]
    torque: Filtered = NOTHING_YET
    drive: Filtered = NOTHING_YET
    angle: Filtered = NOTHING_YET
    sign: Filtered = NOTHING_YET
    unknown: Filtered = NOTHING_YET
    terms: Terms = Terms()
    settled_s: float = 0.0
    place: int = 0
    size_nm: float = 0.0
    slope_nm2: float = 0.0
    model_nm2: float = 0.0
    own_nm2: float = 0.0


class DriveTorqueState(NamedTuple):
    """What is remembered from tick to tick.

    The drive has gone `way_rad` in the direction `toward` since it last turned back or was slow.
    The others are of the ticks since the last step: how many passed and were read, and sums. `sign`
    and `unknown` count the ticks in which the friction was known and was not.
    """

    steps: StepsState
    toward: float = 0.0
    way_rad: float = 0.0
    ticks: int = 0
    readings: int = 0
    torque_nm: float = 0.0
    drive_nm: float = 0.0
    angle_rad: float = 0.0
    sign: float = 0.0
    unknown: float = 0.0
    drive_before_s: float = 0.0
    angle_before_s: float = 0.0


def drive_torque_limits(settings: Settings, model: DriveModel | None = None) -> DriveTorqueLimits:
    """Return the limits for the loop's tick; without a model the law is off."""
    rate_hz = settings.rig.tick_rate_hz
    ticks = mean_of_ticks(rate_hz)
    step_s = ticks / rate_hz
    return DriveTorqueLimits(
        DriveModel() if model is None else model,
        1.0 / rate_hz,
        ticks,
        step_s,
        round(WINDOW_S / step_s),
    )


def zeroed(
    limits: DriveTorqueLimits, state: DriveTorqueState, bias_nm: float
) -> tuple[DriveTorqueLimits, DriveTorqueState]:
    """Return both after the torque sensor was zeroed: M is less by the bias from now on.

    So is what the filters hold of it: they would take a third of a second to forget the bias, and
    the law would find it meanwhile.
    """
    model, steps = limits.model, state.steps
    one, two, three, four, five = steps.torque
    less = one - bias_nm, two - bias_nm, three - bias_nm, four - bias_nm, five - bias_nm
    return (
        limits._replace(model=model._replace(zero_nm=model.zero_nm - bias_nm)),
        state._replace(
            steps=steps._replace(torque=less),
            torque_nm=state.torque_nm - state.readings * bias_nm,
        ),
    )


def drive_torque_state(limits: DriveTorqueLimits) -> DriveTorqueState:
    """Return the state before the first tick."""
    return DriveTorqueState(StepsState(np.zeros((limits.window_steps, 4))))


def drive_torque_step(
    limits: DriveTorqueLimits,
    state: DriveTorqueState,
    torque_nm: float,
    torque_age_s: float,
    angle_rad: float,
    velocity_rad_s: float,
    motion_age_s: float,
    drive_nm: float,
    drive_age_s: float,
    elapsed_ticks: int = 1,
) -> tuple[DriveTorqueState, int]:
    """Look at one tick; return the state after it and a `Cause`, 0 if the torques agree.

    Parameters
    ----------
    limits : DriveTorqueLimits
    state : DriveTorqueState
    torque_nm, angle_rad, velocity_rad_s, drive_nm : float
        The newest readings; `drive_nm` is T. One that is not finite is left out.
    torque_age_s, motion_age_s, drive_age_s : float
        How long ago each was taken.
    elapsed_ticks : int
        Ticks since the step before.
    """
    cause = _NO_CAUSE
    if limits.model.scatter_nm == math.inf:
        return state, cause
    if elapsed_ticks > limits.mean_of_ticks and state.readings > 0:
        state, cause = means_ended(
            limits, state
        )  # the gap is no part of a mean with what was before
    steps, toward, way_rad, ticks, readings = state[:5]
    torque, drive, angle, sign, unknown, drive_before_s, angle_before_s = state[5:]
    elapsed_ticks = max(elapsed_ticks, 1)
    ticks += elapsed_ticks
    one_sum = torque_nm + angle_rad + velocity_rad_s + drive_nm
    one_sum += torque_age_s + motion_age_s + drive_age_s
    if one_sum - one_sum == 0.0:  # not so where one of them is infinite or no number
        readings += 1
        torque += torque_nm
        drive += drive_nm
        angle += angle_rad
        drive_before_s += drive_age_s - torque_age_s
        angle_before_s += motion_age_s - torque_age_s
        direction = 0.0
        if velocity_rad_s > SLIPS_RAD_S:
            direction = 1.0
        elif velocity_rad_s < -SLIPS_RAD_S:
            direction = -1.0
        if direction != toward:
            toward, way_rad = direction, 0.0
        way_rad += abs(velocity_rad_s) * elapsed_ticks * limits.interval_s
        if direction != 0.0 and way_rad > PRESLIDING_RAD:
            sign += direction
        else:
            unknown += 1.0
    after = DriveTorqueState(
        steps,
        toward,
        way_rad,
        ticks,
        readings,
        torque,
        drive,
        angle,
        sign,
        unknown,
        drive_before_s,
        angle_before_s,
    )
    if ticks >= limits.mean_of_ticks and readings > 0:
        after, of_this = means_ended(limits, after)
        if cause == _NO_CAUSE:
            cause = of_this
    elif readings == 0 and steps.settled_s > 0.0 and ticks * limits.interval_s > WINDOW_S:
        cause = int(Cause.TORQUE_DISAGREES)
    return after, cause


def means_ended(limits: DriveTorqueLimits, state: DriveTorqueState) -> tuple[DriveTorqueState, int]:
    """Look at the mean of the ticks since the last one; return the state and a `Cause`.

    Steps that are missing, where ticks were late, are filled in on a line to the new mean, as the
    drive went on at its last velocity. After a longer gap the filters begin anew.
    """
    steps, toward, way_rad, ticks, readings = state[:5]
    share = 1.0 / readings
    torque, drive, angle = state.torque_nm * share, state.drive_nm * share, state.angle_rad * share
    sign, unknown = state.sign * share, state.unknown * share
    drive_before_s, angle_before_s = state.drive_before_s * share, state.angle_before_s * share
    missing = max(int(ticks * limits.interval_s / limits.step_s + 0.5), 1)
    cause, elapsed_s = _NO_CAUSE, ticks * limits.interval_s
    if missing > MAX_FILLED or steps.settled_s == 0.0:
        steps = begun(steps, torque, drive, angle, sign, unknown)
        missing, elapsed_s = 1, limits.step_s  # what the filters have seen
    torque_0, drive_0, angle_0 = steps.torque[0], steps.drive[0], steps.angle[0]
    for k in range(1, missing + 1):
        part = k / missing
        steps, found = one_step(
            limits,
            steps,
            torque_0 + part * (torque - torque_0),
            drive_0 + part * (drive - drive_0),
            angle_0 + part * (angle - angle_0),
            sign,
            unknown,
            drive_before_s,
            angle_before_s,
            elapsed_s / missing,
        )
        if cause == _NO_CAUSE:
            cause = found
    # Every field: compiled code knows no defaults.
    return DriveTorqueState(steps, toward, way_rad, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), cause


def begun(
    steps: StepsState, torque_nm: float, drive_nm: float, angle_rad: float, sign: float, u: float
) -> StepsState:
    """Return the state in which every filter begins with what it is given, and the window anew."""
    steps.window[:] = 0.0
    return StepsState(
        steps.window,
        (torque_nm, torque_nm, torque_nm, torque_nm, torque_nm),
        (drive_nm, drive_nm, drive_nm, drive_nm, drive_nm),
        (angle_rad, angle_rad, angle_rad, angle_rad, angle_rad),
        (sign, sign, sign, sign, sign),
        (u, u, u, u, u),
        steps.terms,
        0.0,
        0,
        0.0,
        0.0,
        0.0,
        0.0,
    )


def one_step(
    limits: DriveTorqueLimits,
    state: StepsState,
    torque_nm: float,
    drive_nm: float,
    angle_rad: float,
    sign_known: float,
    not_known: float,
    drive_before_s: float,
    angle_before_s: float,
    elapsed_s: float,
) -> tuple[StepsState, int]:
    """Take one step; `drive_before_s` is by how much T was taken before the torque."""
    window, torque, drive, angle, sign, unknown, _, settled_s, place = state[:9]
    size, slope, square, own = state[9:]
    w = FILTER_RAD_S
    half = 0.5 * w * elapsed_s
    blend = half / (1.0 + half)
    torque = lowpassed(blend, torque, torque_nm)
    drive = lowpassed(blend, drive, drive_nm)
    angle = lowpassed(blend, angle, angle_rad)
    sign = lowpassed(blend, sign, sign_known)
    unknown = lowpassed(blend, unknown, not_known)
    drive_per_s = w * (drive[3] - drive[4])
    _, once, twice, thrice, last = angle
    velocity = w * (thrice - last)
    acceleration = w * w * (twice - 2.0 * thrice + last)
    jerk = w * w * w * (once - 3.0 * (twice - thrice) - last)
    terms = Terms(
        torque[4],
        drive[4] + drive_before_s * drive_per_s,
        drive_per_s,
        acceleration + angle_before_s * jerk,
        sign[4] + angle_before_s * w * (sign[3] - sign[4]),
        velocity + angle_before_s * acceleration,
        unknown[4],
    )
    settled_s += elapsed_s
    cause = _NO_CAUSE
    if settled_s > SETTLED_S:
        model = limits.model
        by_drive_nm = from_drive(model, terms)
        e = beyond(model, terms, by_drive_nm)
        turned_nm, inertial_nm = (
            model.scale * terms.drive_nm,
            model.inertia_kg_m2 * terms.acceleration_rad_s2,
        )
        place = place + 1 if place + 1 < limits.window_steps else 0
        row = window[place]
        share = 1.0 / limits.window_steps
        drives_nm2 = turned_nm * turned_nm + inertial_nm * inertial_nm
        size += (abs(e) - float(row[0])) * share
        slope += (e * by_drive_nm - float(row[1])) * share
        square += (by_drive_nm * by_drive_nm - float(row[2])) * share
        own += (drives_nm2 - float(row[3])) * share
        row[0], row[1], row[2] = abs(e), e * by_drive_nm, by_drive_nm * by_drive_nm
        row[3] = drives_nm2
        most = allowed_nm(model, own)
        # Not so of what is no number, either.
        if not (size <= most and slope * slope <= most * most * square):
            cause = int(Cause.TORQUE_DISAGREES)
    after = StepsState(
        window,
        torque,
        drive,
        angle,
        sign,
        unknown,
        terms,
        settled_s,
        place,
        size,
        slope,
        square,
        own,
    )
    return after, cause


def allowed_nm(model: DriveModel, own_nm2: float) -> float:
    """Return what either statistic may be, with the drive's own torques of that mean square."""
    share = max(model.scatter_share, LEAST_SHARE)
    return TIMES_SCATTER * (model.scatter_nm + share * math.sqrt(max(own_nm2, 0.0)))


def from_drive(model: DriveModel, terms: Terms) -> float:
    """Return m, the torque on the joint as the drive's own torque shows it."""
    return (
        model.scale * terms.drive_nm
        + model.late_s * model.scale * terms.drive_nm_per_s
        - model.inertia_kg_m2 * terms.acceleration_rad_s2
        - model.friction_nm * terms.sign
        - model.damping_nm_s_rad * terms.velocity_rad_s
        + model.zero_nm
    )


def beyond(model: DriveModel, terms: Terms, by_drive_nm: float) -> float:
    """Return e: what of the difference no friction of a drive that may stick explains."""
    difference = terms.torque_nm - by_drive_nm
    allowed = terms.unknown * model.friction_nm
    if difference > allowed:
        return difference - allowed
    if difference < -allowed:
        return difference + allowed
    return 0.0
