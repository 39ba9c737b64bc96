"""Continuous time: joint, cuff, drive and sensor by Runge–Kutta, the controller at its ticks.

One fine step is 1 / `FINE_HZ`. Commands change at fine steps alone, so that the method keeps its
fourth order, and samples are taken at fine steps, so that none is interpolated.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.signal import butter
from tests.scenarios.plant import (
    TORQUE_MOTOR,
    VELOCITY_PI,
    Controller,
    Drive,
    Joint,
    TorquePath,
)

FINE_HZ = 10_000.0
COURSE_HZ = 1000.0
SUBJECT, STIFFNESS, DAMPING, REST, COGWHEEL, IMPOSED, ADDED = range(7)
"""Rows of the courses: M_sub in N·m, factors of K and B, rest angle in rad, bursts from 0 to 1,
imposed velocity in rad/s, and what adds to the torque reading, in N·m."""
COURSES = 7
REST_STATE = 11
FRICTION_RAD_S = 0.02
"""Dry friction is c tanh(v / this)."""

Array = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def _load_nm(joint, q, w, course, reflex_nm):
    """Return the torque that limb needs at this angle and velocity without acceleration."""
    x = q - course[REST]
    elastic = x
    if joint.angle_share != 0.0:
        scale = joint.angle_scale_rad
        elastic += joint.angle_share * scale * math.log(math.cosh(x / scale))
    side = joint.damping_asymmetry if w > 0.0 else -joint.damping_asymmetry
    load = joint.stiffness_nm_rad * course[STIFFNESS] * elastic
    load += joint.damping_nm_s_rad * course[DAMPING] * (1.0 + side) * w
    load += joint.cubic_nm_rad3 * x * x * x
    if joint.coulomb_nm != 0.0:
        load += joint.coulomb_nm * math.tanh(w / FRICTION_RAD_S)
    if joint.cogwheel_nm != 0.0:
        load += joint.cogwheel_nm * course[COGWHEEL] * math.tanh(w / FRICTION_RAD_S)
    if joint.gravity_nm != 0.0:
        zeroed = joint.gravity_angle_rad
        load += joint.gravity_nm * (math.sin(zeroed + q) - math.sin(zeroed))
    return load + reflex_nm - course[SUBJECT]


@njit(cache=True, error_model="numpy")
def _stretch_nm(joint, late_rad_s):
    """Return the reflex torque that a velocity calls for."""
    above = abs(late_rad_s) - joint.reflex_threshold_rad_s
    if above <= 0.0 or (late_rad_s < 0.0 and joint.reflex_sides < 2.0):
        return 0.0
    return joint.reflex_nm_s_rad * math.copysign(above, late_rad_s)


@njit(cache=True, error_model="numpy")
def _change(joint, drive, path, x, command, course, late_rad, late_rad_s, dx):
    """Write the derivative of the state, and return the torque that acts on the limb.

    0 angle and 1 velocity of the drive; 2 its acceleration, or the integral of its error; 3 the
    motor's torque, or the position asked for; 4 angle and 5 velocity of a limb behind a cuff; 6 and
    7 the muscle of the reflex; 8 and 9 the low-pass of the sensor; 10 the lagged command.
    """
    omega = 2.0 * math.pi * drive.bandwidth_hz
    dx[10] = 0.0
    if drive.lag_s > 0.0:
        dx[10] = (command - x[10]) / drive.lag_s
        command = x[10]
    soft = joint.cuff_nm_rad > 0.0
    q, w = (x[4], x[5]) if soft else (x[0], x[1])
    reflex = 0.0
    dx[6], dx[7] = 0.0, 0.0
    if joint.reflex_nm_s_rad != 0.0 or joint.resist_nm_rad != 0.0:
        reflex = _stretch_nm(joint, late_rad_s) + joint.resist_nm_rad * late_rad
        if joint.reflex_hz > 0.0:
            rate = 2.0 * math.pi * joint.reflex_hz
            dx[6] = x[7]
            dx[7] = rate * rate * (reflex - x[6]) - 2.0 * rate * x[7]
            reflex = x[6]
    load = _load_nm(joint, q, w, course, reflex)
    torque = 0.0
    dx[4], dx[5] = 0.0, 0.0
    if soft:
        torque = joint.cuff_nm_rad * (x[0] - x[4]) + joint.cuff_nm_s_rad * (x[1] - x[5])
        dx[4] = x[5]
        dx[5] = (torque - load) / joint.inertia_kg_m2
    dx[0] = x[1]
    if drive.kind == VELOCITY_PI:
        error = command - x[1]
        mass = drive.inertia_kg_m2
        asked = mass * (2.0 * drive.damping_ratio * omega * error + omega * omega * x[2])
        dx[2] = error
        dx[3] = (asked - x[3]) / drive.current_lag_s
        rubbed = drive.friction_nm * math.tanh(x[1] / FRICTION_RAD_S)
        if soft:
            dx[1] = (x[3] - rubbed - torque) / mass
        else:
            dx[1] = (x[3] - rubbed - load) / (mass + joint.inertia_kg_m2)
    elif drive.kind == TORQUE_MOTOR:
        dx[2], dx[3] = 0.0, 0.0
        if soft:
            dx[1] = (command - torque) / drive.inertia_kg_m2
        else:
            dx[1] = (command - load) / (drive.inertia_kg_m2 + joint.inertia_kg_m2)
    else:
        dx[3] = 0.0
        if drive.kind > VELOCITY_PI:
            dx[3] = command
            command = drive.position_gain_per_s * (x[3] - x[0])
        dx[1] = x[2]
        dx[2] = omega * omega * (command - x[1]) - 2.0 * drive.damping_ratio * omega * x[2]
    if not soft:
        torque = joint.inertia_kg_m2 * dx[1] + load
    felt = torque - path.crosstalk_nm * (1.0 - math.cos(x[0]))
    felt += path.crosstalk_nm_s2_rad2 * x[1] * x[1]
    dx[8], dx[9] = 0.0, 0.0
    if path.lowpass_hz > 0.0:
        cutoff = 2.0 * math.pi * path.lowpass_hz
        dx[8] = x[9]
        dx[9] = cutoff * cutoff * (felt - x[8]) - math.sqrt(2.0) * cutoff * x[9]
        felt = x[8]
    return felt


@njit(cache=True, error_model="numpy")
def _at(courses, time_s, course):
    """Write the courses at a time, straight between their points."""
    place = min(max(time_s * COURSE_HZ, 0.0), courses.shape[1] - 1.001)
    k = int(place)
    share = place - k
    for row in range(courses.shape[0]):
        course[row] = courses[row, k] + share * (courses[row, k + 1] - courses[row, k])


@njit(cache=True, error_model="numpy")
def _late(history, place):
    """Return what a motion was at a place between fine steps; at rest before the first."""
    if place <= 0.0:
        return 0.0
    k = int(place)
    if k + 1 >= history.size:
        return history[history.size - 1]
    return history[k] + (place - k) * (history[k + 1] - history[k])


@njit(cache=True, error_model="numpy")
def _run(
    joint, drive, path, filter_b, filter_a, decay, gain, courses, asked, seen, added, x, ratio, runs
):
    """Run an epoch; see `run`. `seen` is the fine step of the newest torque sample at each tick."""
    ticks = asked.size
    steps = ticks * ratio
    h = 1.0 / FINE_HZ
    angle, velocity, torque = np.empty(steps), np.empty(steps), np.empty(steps)
    limb, limb_rad = np.zeros(steps + 1), np.zeros(steps + 1)
    commands, in_force = np.zeros(ticks), np.zeros(steps)
    tick, sent, due = 0, 0.0, 0
    course, now = np.empty(courses.shape[0]), np.empty(x.size)
    slopes = np.empty((4, x.size))
    held_b1 = held_b2 = admitted = 0.0
    behind = int(drive.delay_s * FINE_HZ + 0.5)
    late = joint.reflex_delay_s * FINE_HZ
    soft = joint.cuff_nm_rad > 0.0
    for k in range(steps):
        time_s = k * h
        limb[k], limb_rad[k] = (x[5], x[4]) if soft else (x[1], x[0])
        before = in_force[k - 1 - behind] if k - 1 - behind >= 0 else 0.0
        _at(courses, time_s, course)
        angle[k], velocity[k] = x[0], x[1]
        late_rad = _late(limb_rad[: k + 1], k - late)
        late_rad_s = _late(limb[: k + 1], k - late)
        torque[k] = _change(joint, drive, path, x, before, course, late_rad, late_rad_s, slopes[0])
        while tick < ticks and runs[tick] < 0:
            tick += 1  # missed
        if tick < ticks and runs[tick] == k:
            reading = torque[seen[tick]] + added[tick] if seen[tick] >= 0 else 0.0
            smooth = filter_b[0] * reading + held_b1
            held_b1 = filter_b[1] * reading - filter_a[1] * smooth + held_b2
            held_b2 = filter_b[2] * reading - filter_a[2] * smooth
            for _ in range(due, tick + 1):
                admitted = decay * admitted + gain * (asked[tick] - smooth)
            sent = asked[tick] if drive.kind == TORQUE_MOTOR else admitted + course[IMPOSED]
            commands[tick] = sent
            tick += 1
            due = tick
        in_force[k] = sent
        command = in_force[k - behind] if k >= behind else 0.0
        for stage in range(4):
            if stage == 0 and command == before:
                continue  # it is there already
            share = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            for i in range(x.size):
                now[i] = x[i] if stage == 0 else x[i] + share * h * slopes[stage - 1, i]
            if stage in (1, 3):
                _at(courses, time_s + share * h, course)
            _change(
                joint,
                drive,
                path,
                now,
                command,
                course,
                _late(limb_rad[: k + 1], k + share - late),
                _late(limb[: k + 1], k + share - late),
                slopes[stage],
            )
        for i in range(x.size):
            total = slopes[0, i] + 2.0 * slopes[1, i] + 2.0 * slopes[2, i] + slopes[3, i]
            x[i] += h / 6.0 * total
    return angle, velocity, torque, commands


def run(
    joint: Joint,
    drive: Drive,
    path: TorquePath,
    controller: Controller,
    courses: Array,
    perturbation_nm: Array,
    seen: NDArray[np.int64],
    added_nm: Array,
    runs: NDArray[np.int64] | None = None,
    start_rad: float = 0.0,
    start_rad_s: float = 0.0,
) -> tuple[Array, Array, Array, Array]:
    """Run an epoch and return angle, velocity and torque at fine steps, and the commands.

    Parameters
    ----------
    joint, drive, path, controller : records
    courses : array, shape (COURSES, m)
        At `COURSE_HZ`, from the beginning.
    perturbation_nm : array, shape (ticks,)
    seen : array of int, shape (ticks,)
        The fine step at which the newest torque sample of each tick was taken; −1 for none yet.
    added_nm : array, shape (ticks,)
        Noise of that sample.
    runs : array of int, shape (ticks,)
        The fine step at which each tick runs, −1 where it is missed; when it is due if not given.
    start_rad, start_rad_s : float
        Of the limb behind a cuff; everything else starts from rest.
    """
    tick_s = 1.0 / controller.tick_rate_hz
    ratio = round(FINE_HZ * tick_s)
    assert abs(ratio / FINE_HZ - tick_s) < 1e-12, "a tick must be a whole number of fine steps"
    numerator, denominator = butter(2, controller.torque_cutoff_hz, fs=controller.tick_rate_hz)
    rate = controller.damping_nm_s_rad / controller.inertia_kg_m2
    decay = math.exp(-rate * tick_s)
    state = np.zeros(REST_STATE)
    state[4], state[5] = start_rad, start_rad_s
    angle, velocity, torque, commands = _run(
        joint, drive, path, numerator, denominator, decay,
        (1.0 - decay) / controller.damping_nm_s_rad, courses, perturbation_nm, seen, added_nm,
        state, ratio, np.arange(perturbation_nm.size) * ratio if runs is None else runs,
    )  # fmt: skip
    return angle, velocity, torque, commands


def resting(duration_s: float) -> Array:
    """Return courses in which nothing happens: no torque of the subject, K and B as they are."""
    courses = np.zeros((COURSES, round(duration_s * COURSE_HZ) + 2))
    courses[[STIFFNESS, DAMPING]] = 1.0
    return courses
