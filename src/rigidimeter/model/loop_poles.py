"""The closed loop as one matrix over the ticks after which the sensor's pattern repeats.

The state is the motion (v', v, θ), the last command, the two memories of the torque filter, and the
samples of the torque sensor that were taken but have not been replaced yet. One tick is: the drive
carries out the last command; a sample may be taken on the way; the newest sample that has arrived
is read, filtered, and gives the next command. Nothing is rounded to whole ticks.
"""

from __future__ import annotations

import itertools
import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rigidimeter.core.settings import RigSettings, Settings
from rigidimeter.model.controller import admittance, butterworth_lowpass
from rigidimeter.model.joint import JointDynamics
from rigidimeter.model.linear_loop import reading_pattern
from rigidimeter.model.velocity_drive import Array, drive_matrices


def spectral_radius(settings: Settings, joint: JointDynamics) -> float:
    """Return the largest modulus of the closed loop's eigenvalues, for one tick.

    Below 1 every disturbance dies out, above 1 it grows by that factor a tick. A joint without
    stiffness may drift: its angle is left out.
    """
    over_pattern: Array | None = None
    pattern_ticks = 0
    schedule = _schedule(settings.rig)
    line = 1 + max(tick.place for tick, _ in schedule)
    for (after_ticks, place), times in schedule:
        tick = _control(settings, line, place) @ _motion(settings, joint, line, after_ticks)
        ticks = np.linalg.matrix_power(tick, times)
        over_pattern = ticks if over_pattern is None else ticks @ over_pattern
        pattern_ticks += times
    if over_pattern is None:
        raise ValueError("a pattern of readings has at least one tick")
    if joint.stiffness_nm_rad == 0.0:
        over_pattern = np.delete(np.delete(over_pattern, _ANGLE, 0), _ANGLE, 1)
    largest = float(np.max(np.abs(np.linalg.eigvals(over_pattern))))
    return float(largest ** (1.0 / pattern_ticks))


class _Tick(NamedTuple):
    """What the sensor does in a tick.

    Attributes
    ----------
    after_ticks : float or None
        How far into the tick a sample is taken, in ticks; None without one.
    place : int
        How many samples ago the one that is read was taken.
    """

    after_ticks: float | None
    place: int


@lru_cache(maxsize=16)
def _schedule(rig: RigSettings) -> tuple[tuple[_Tick, int], ...]:
    """Return what the sensor does, and for how many ticks on end, until it repeats."""
    pattern, ticks_per_sample = reading_pattern(rig)
    # Sample k was taken at tick k·r − offset.
    offset = pattern[0].sample * ticks_per_sample + pattern[0].age_ticks
    newest = [math.floor((n + offset) / ticks_per_sample) for n in range(-1, len(pattern))]
    ticks = []
    for n, reading in enumerate(pattern):
        taken = newest[n + 1]
        after = float(taken * ticks_per_sample - offset - (n - 1)) if taken != newest[n] else None
        ticks.append(_Tick(after, taken - reading.sample))
    return tuple((tick, len(list(times))) for tick, times in itertools.groupby(ticks))


_ANGLE, _COMMAND, _FIRST, _SECOND, _SAMPLES = 2, 3, 4, 5, 6


def _motion(
    settings: Settings, joint: JointDynamics, line: int, after_ticks: float | None
) -> Array:
    """Return how the arm moves in a tick, with a sample so long after its start, or none."""
    rig = settings.rig
    interval_s = 1.0 / rig.tick_rate_hz
    drive = rig.drive_bandwidth_hz, rig.drive_damping_ratio
    size = _SAMPLES + line
    matrix = np.eye(size)
    matrix[:3, :3], matrix[:3, _COMMAND] = drive_matrices(*drive, interval_s)
    if after_ticks is not None:
        arm = np.array(joint.parameters)
        part, push = drive_matrices(*drive, after_ticks * interval_s)
        matrix[_SAMPLES + 1 :] = np.eye(size)[_SAMPLES : size - 1]
        matrix[_SAMPLES] = 0.0
        matrix[_SAMPLES, :3], matrix[_SAMPLES, _COMMAND] = arm @ part, float(arm @ push)
    return matrix


def _control(settings: Settings, line: int, place: int) -> Array:
    """Return how the sample at a place in the line becomes the next command."""
    controller, rate_hz = settings.controller, settings.rig.tick_rate_hz
    decay, gain = admittance(controller.inertia_kg_m2, controller.damping_nm_s_rad, 1.0 / rate_hz)
    b0, b1, b2, a1, a2 = butterworth_lowpass(controller.torque_cutoff_hz, rate_hz)
    size = _SAMPLES + line
    read, first, second = (np.eye(size)[k] for k in (_SAMPLES + place, _FIRST, _SECOND))
    smooth = b0 * read + first
    matrix = np.eye(size)
    matrix[_FIRST] = b1 * read - a1 * smooth + second
    matrix[_SECOND] = b2 * read - a2 * smooth
    matrix[_COMMAND] *= decay
    matrix[_COMMAND] -= gain * smooth
    return matrix
