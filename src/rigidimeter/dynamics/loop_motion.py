"""The motion of the arm in the closed loop, from the perturbation and from the subject.

To a perturbation p the loop answers with the command c = A/(1 + L) p. Torque ν that is added to the
measured one is filtered and, with the sign of the measured torque, answered like a perturbation:
c = −F A/(1 + L) ν, later by the delays of the sensor. The motion follows from the command by the
drive alone, since the drive is stiff.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.fft import irfft, next_fast_len, rfftfreq
from scipy.signal import lfilter, oaconvolve

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.dynamics.loop_poles import spectral_radius
from rigidimeter.dynamics.loop_response import (
    Array,
    Complex,
    LoopModel,
    command_response,
    drive_advance,
    loop_model,
)
from rigidimeter.dynamics.noise_density import subject_density
from rigidimeter.settings import ControllerSettings, RigSettings, Settings, SubjectSettings

__all__ = ["ClosedLoopMotion", "closed_loop_motion", "motion_per_torque", "voluntary_motion_sd"]

_LINES_A_HZ = 50
"""How finely the band of voluntary torque is summed."""

_FADING = 30.0
"""Time constants after which an answer counts as gone."""

_LEAST_FADING, _MOST_FADING = 1 << 12, 1 << 20
"""In ticks."""


class ClosedLoopMotion(NamedTuple):
    """Command, and motion of the arm, at the ticks; each of shape (n,)."""

    command_rad_s: Array
    angle_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array


def closed_loop_motion(
    perturbation_nm: Array, settings: Settings, joint: JointDynamics
) -> ClosedLoopMotion:
    """Return the motion that a perturbation causes, without noise and from rest.

    The command follows from the perturbation by the closed loop's answer to a pulse of one tick;
    the motion from the command by the drive's exact steps. For a sensor slower than the loop it is
    the mean over the phases of the sensor.

    Parameters
    ----------
    perturbation_nm : array, shape (n,)
        One value a tick.
    settings : Settings
        Of which `controller` and `rig` are used.
    joint : JointDynamics
    """
    torque = np.asarray(perturbation_nm, dtype=np.float64)
    rate_hz = settings.rig.tick_rate_hz
    answer = _command_to_a_pulse(settings, joint)
    command = oaconvolve(torque, answer)[: torque.size]
    step, push = drive_advance(settings.rig, 1.0 / rate_hz)
    before = np.concatenate(([0.0], command[:-1]))  # a command moves the arm by the next tick
    # Velocity and acceleration: (zI − Φ)⁻¹ Γ of the lower two rows, as one filter each.
    a11, a12, a21, a22 = step[1, 1], step[1, 2], step[2, 1], step[2, 2]
    denominator = [1.0, -(a11 + a22), a11 * a22 - a12 * a21]
    velocity = lfilter([push[1], a12 * push[2] - a22 * push[1]], denominator, before)
    acceleration = lfilter([push[2], a21 * push[1] - a11 * push[2]], denominator, before)
    moved = step[0, 1] * velocity[:-1] + step[0, 2] * acceleration[:-1] + push[0] * command[:-1]
    angle = np.concatenate(([0.0], np.cumsum(moved)))
    return ClosedLoopMotion(command, angle, np.asarray(velocity), np.asarray(acceleration))


def voluntary_motion_sd(settings: Settings, subject: SubjectSettings) -> tuple[float, float]:
    """Return the SD of angle (rad) and velocity (rad/s) that the subject's own torque causes."""
    rate_hz = settings.rig.tick_rate_hz
    # Fine enough for the slowest pole of the loop; the last tick of the band holds no power.
    frequency = np.arange(1, round(rate_hz / 2.0 * _LINES_A_HZ)) / _LINES_A_HZ
    joint = JointDynamics(subject.inertia_kg_m2, subject.damping_nm_s_rad, subject.stiffness_nm_rad)
    density = subject_density(subject, frequency, rate_hz)
    model = loop_model(settings.controller, settings.rig, frequency)
    _, velocity, angle = motion_per_torque(model, joint)
    return (
        math.sqrt(2.0 * float(np.sum(np.abs(angle) ** 2 * density)) / _LINES_A_HZ),
        math.sqrt(2.0 * float(np.sum(np.abs(velocity) ** 2 * density)) / _LINES_A_HZ),
    )


def motion_per_torque(model: LoopModel, joint: JointDynamics) -> Complex:
    """Return acceleration, velocity and angle per N·m that is added to the measured torque."""
    command = -model.lowpass * model.read_torque * command_response(model, joint)
    with np.errstate(invalid="ignore"):
        return np.stack(
            [command * part for part in (model.acceleration, model.velocity, model.angle)]
        )


def _command_to_a_pulse(settings: Settings, joint: JointDynamics) -> Array:
    """Return the command after a pulse of 1 N·m for one tick, until it has died out."""
    radius = spectral_radius(settings, joint)
    fading = -_FADING / math.log(radius) if 0.0 < radius < 1.0 else _MOST_FADING
    # So long that the answer is gone before it comes round.
    length = next_fast_len(round(min(max(fading, _LEAST_FADING), _MOST_FADING)), real=True)
    model = _grid_model(settings.controller, settings.rig, length)
    return np.asarray(irfft(command_response(model, joint), length), dtype=np.float64)


@lru_cache(maxsize=4)
def _grid_model(controller: ControllerSettings, rig: RigSettings, length: int) -> LoopModel:
    return loop_model(controller, rig, rfftfreq(length, 1.0 / rig.tick_rate_hz))
