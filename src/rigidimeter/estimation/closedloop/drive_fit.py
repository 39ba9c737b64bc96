"""The drive between command and motion, identified from the recording itself.

    v'' + 2 ζ ω v' + ω² v = ω² c      c held from tick to tick

Command and velocity are known almost without noise, so bandwidth, damping and delay follow from
them closely. They matter for what sampling hides: a drive that is told a staircase ripples between
the ticks, and a torque sampled at the tick sees the ripple at its edge, an acceleration smaller by
(ω Δt)²/12 than the samples of the velocity suggest: 0.8 % for 50 Hz at 1 kHz, and all of that would
be taken from J.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import lfilter

from rigidimeter.estimation.signals import Array
from rigidimeter.records import Channel, Epoch

__all__ = ["DriveModel", "Driven", "fit_drive"]

Complex = NDArray[np.complex128]

LARGEST_MISFIT = 0.005
"""Above this share of the velocity's standard deviation the drive is not of second order."""

LARGEST_RATIO = 0.08
"""Ticks per period of the drive's bandwidth beyond which a command in a foreign file is rather one
that was logged more slowly than it was sent: its stairs would then be too long."""

EVEN = 0.01
"""A stamp this share of an interval away from a tick is that tick."""


@dataclass(frozen=True)
class Driven:
    """Angle, velocity and acceleration that a command causes, from rest, at given times."""

    angle_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array


@dataclass(frozen=True)
class DriveModel:
    """A velocity-controlled drive of second order with a pure delay."""

    bandwidth_hz: float
    damping_ratio: float
    delay_s: float = 0.0

    def transfer(self, z: Complex, interval_s: float) -> tuple[Complex, Complex, Complex]:
        """Return acceleration, velocity and angle per held command at z, at the ticks."""
        m11, m12, m21, m22, n1, n2 = _step(self, np.array(interval_s))
        b1, b2 = 1 - m11, -m21
        determinant = (z - m11) * (z - m22) - m12 * m21
        velocity = ((z - m22) * b1 + m12 * b2) / determinant
        acceleration = (m21 * b1 + (z - m11) * b2) / determinant
        angle = (interval_s - n1 + n1 * velocity + n2 * acceleration) / (z - 1)
        late = z ** (-self.delay_s / interval_s)
        return acceleration * late, velocity * late, angle * late

    def sampled_derivative(self, omega_rad_s: Array, interval_s: float) -> Complex:
        """Return the acceleration at the ticks over the derivative of the velocity's samples.

        1 − (ω_n Δt)²/12 at low frequency: the command's stairs hold the acceleration at the ticks
        below its mean.
        """
        z = np.exp(1j * omega_rad_s * interval_s)
        acceleration, velocity, _ = self.transfer(z, interval_s)
        return np.asarray(acceleration / (1j * omega_rad_s * velocity))

    def driven(self, command: Channel, time_s: Array) -> Driven:
        """Return the motion under a recorded command at any times, exact between ticks too."""
        # From the first tick on: on a clock that counts from 1970 a delay is below the rounding.
        origin_s = command.time_s[0]
        ticks_s, sent = command.time_s - origin_s, command.values
        interval_s = 1.0 / command.mean_rate_hz
        m11, m12, m21, m22, n1, n2 = (float(c) for c in _step(self, np.array(interval_s)))
        b1, b2 = 1 - m11, -m21
        denominator = [1.0, -(m11 + m22), m11 * m22 - m12 * m21]
        velocity = lfilter([0.0, b1, m12 * b2 - m22 * b1], denominator, sent)
        acceleration = lfilter([0.0, b2, m21 * b1 - m11 * b2], denominator, sent)
        steps = sent * interval_s + n1 * (velocity - sent) + n2 * acceleration
        angle = np.concatenate(([0.0], np.cumsum(steps[:-1])))
        then_s = (time_s - origin_s) - self.delay_s
        # A stamp that is a rounding error early belongs to the tick it names.
        k = np.searchsorted(ticks_s, then_s + EVEN * interval_s, side="right") - 1
        k = np.clip(k, 0, sent.size - 1)
        elapsed_s = np.maximum(then_s - ticks_s[k], 0.0)
        elapsed_s[elapsed_s < EVEN * interval_s] = 0.0
        if not np.any(elapsed_s):
            return Driven(angle[k], velocity[k], acceleration[k])
        p11, p12, p21, p22, q1, q2 = _step(self, elapsed_s)
        c, v, a = sent[k], velocity[k], acceleration[k]
        lag = v - c
        return Driven(
            angle[k] + c * elapsed_s + q1 * lag + q2 * a,
            c + p11 * lag + p12 * a,
            p21 * lag + p22 * a,
        )


def fit_drive(epoch: Epoch, start: DriveModel) -> DriveModel | None:
    """Identify the drive from command and velocity; None where it does not explain the velocity.

    Parameters
    ----------
    epoch : Epoch
    start : DriveModel
        Where the search starts.

    Returns
    -------
    DriveModel or None
        None if command or velocity was not recorded, if what the fit leaves exceeds 0.5 % of the
        velocity's standard deviation, or if the command seems to have been logged more slowly than
        it was sent: then nothing is known of what happens between the ticks.
    """
    command = epoch.channels.get("velocity_command_rad_s")
    velocity = epoch.channels.get("velocity_rad_s")
    if command is None or velocity is None or len(command) < 100:
        return None
    tick_s = 1.0 / command.mean_rate_hz
    if np.ptp(np.diff(command.time_s)) > 0.5 * tick_s:
        return None  # ticks that were missed would be taken for a slower drive
    fastest_hz = 0.45 / tick_s
    if not 0.5 < start.bandwidth_hz < fastest_hz:
        return None
    inside = (velocity.time_s >= command.time_s[0]) & (velocity.time_s <= command.time_s[-1])
    time_s, measured = velocity.time_s[inside], velocity.values[inside]
    scale = float(np.std(measured))
    if time_s.size < 50 or scale == 0.0:
        return None

    def model(x: Array) -> DriveModel:
        return DriveModel(math.exp(x[0]), float(x[1]), float(x[2]))

    def misfit(x: Array) -> Array:
        left = model(x).driven(command, time_s).velocity_rad_s - measured
        return np.asarray(left / scale, dtype=np.float64)

    # From between two ticks, where a stamp that is nearly a tick's is not yet taken for it.
    delay_s = max(start.delay_s, 0.5 * tick_s)
    found = least_squares(
        misfit,
        [math.log(start.bandwidth_hz), start.damping_ratio, delay_s],
        bounds=([math.log(0.5), 0.05, 0.0], [math.log(fastest_hz), 0.999, 0.1]),
        x_scale=[0.1, 0.1, tick_s],
    )
    fitted = model(found.x)
    at_bound = fitted.damping_ratio > 0.99 or fitted.bandwidth_hz > 0.98 * fastest_hz
    if at_bound or float(np.sqrt(np.mean(found.fun**2))) > LARGEST_MISFIT:
        return None
    # A session records what was sent at every tick; of another file that is not known.
    if epoch.excitation_hz is None and fitted.bandwidth_hz * tick_s > LARGEST_RATIO:
        return None
    return fitted


def _step(drive: DriveModel, interval_s: Array) -> tuple[Array, ...]:
    """Return the coefficients of `dynamics.velocity_drive` for intervals of any shape."""
    omega = 2 * math.pi * drive.bandwidth_hz
    sigma = drive.damping_ratio * omega
    omega_d = omega * math.sqrt(1 - drive.damping_ratio**2)
    decay = np.exp(-sigma * interval_s)
    cosine, sine = decay * np.cos(omega_d * interval_s), decay * np.sin(omega_d * interval_s)
    sine = sine / omega_d
    m11, m12 = cosine + sigma * sine, sine
    m21, m22 = -omega * omega * sine, cosine - sigma * sine
    n1 = (2 * sigma * (1 - m11) - m21) / omega**2
    n2 = (1 - m22 - 2 * sigma * m12) / omega**2
    return m11, m12, m21, m22, n1, n2
