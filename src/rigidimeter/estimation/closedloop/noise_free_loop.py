"""What the closed loop does with a perturbation: the noise-free response behind the instruments.

In discrete time at the tick, with M the torque between drive and joint and d the perturbation:

    c = A(z) (d − z^(−τ) H(z) M)      admittance A, low-pass H, delay τ of the torque
    (a, v, θ) = (D_a, D_v, D_θ)(z) c  the drive, its command held for a tick
    M = J a + B v + K θ − v_d         the joint, with the subject's own torque v_d

so that d alone moves the joint by c = A d / (1 + A H z^(−τ) (J D_a + B D_v + K D_θ)). The steps are
those of `rigidimeter.control` and `rigidimeter.dynamics`, written as transfer functions.

The response from rest is found by FFT on a circle just outside the unit circle: the signal decays
by e^(−18) within the record, so that neither the integrator of the angle nor the wrap-around of the
FFT needs special care.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from rigidimeter.estimation.closedloop.drive_fit import DriveModel
from rigidimeter.estimation.signals import Array
from rigidimeter.settings import Settings

__all__ = ["LoopModel", "Response", "loop_model"]

DECAY = 18.0
"""How far the damped circle carries the record down: what wraps around is e^(−18), 2e-8."""

Complex = NDArray[np.complex128]


class Response(NamedTuple):
    """Acceleration, velocity and angle at the ticks, each of shape (n,)."""

    acceleration_rad_s2: Array
    velocity_rad_s: Array
    angle_rad: Array


@dataclass(frozen=True)
class LoopModel:
    """Controller, torque path and drive as they are believed to be.

    Instruments made from a wrong model are weaker, not wrong: whatever they are, they follow from
    the perturbation alone.

    Attributes
    ----------
    inertia_kg_m2, damping_nm_s_rad : float
        J_c and B_c of the admittance, per radian.
    torque_cutoff_hz : float
        Of the second-order low-pass in front of it.
    torque_delay_s : float
        From a torque to its use in the loop, the mean hold of a slow sensor included.
    drive : DriveModel
    """

    inertia_kg_m2: float
    damping_nm_s_rad: float
    torque_cutoff_hz: float
    torque_delay_s: float
    drive: DriveModel

    def response(
        self, perturbation_nm: Array, rate_hz: float, parameters: tuple[float, float, float]
    ) -> Response:
        """Return the motion that a perturbation causes, from rest, without noise.

        Parameters
        ----------
        perturbation_nm : array, shape (n,)
            One value a tick.
        rate_hz : float
            Ticks a second.
        parameters : (float, float, float)
            J, B and K of the joint.
        """
        (response,) = self.responses([perturbation_nm], rate_hz, parameters)
        return response

    def sensed(
        self, motion: Response, rate_hz: float, parameters: tuple[float, float, float]
    ) -> list[Array]:
        """Return how the measured torque changes with J, B and K, along a given motion.

        ∂M/∂J = S a and so on, with the sensitivity S = 1 / (1 + A H z^(−τ) Z_c): in the loop a
        stiffer joint also moves less.
        """
        n = motion.angle_rad.size
        opened = _opened(self, n, rate_hz)
        around = 1 + opened.gain(parameters)
        return [
            fft.irfft(fft.rfft(part * opened.damping, _length(n)) / around)[:n] / opened.damping
            for part in motion
        ]

    def responses(
        self, perturbations: list[Array], rate_hz: float, parameters: tuple[float, float, float]
    ) -> list[Response]:
        """Return the responses to several perturbations of one length."""
        n = perturbations[0].size
        opened = _opened(self, n, rate_hz)
        around = 1 + opened.gain(parameters)
        made = []
        for perturbation in perturbations:
            spectrum = fft.rfft(perturbation * opened.damping, _length(n))
            command = spectrum * opened.admittance / around
            parts = (
                fft.irfft(command * part, _length(n))[:n] / opened.damping for part in opened.motion
            )
            made.append(Response(*parts))
        return made


class _Opened(NamedTuple):
    """What of the loop does not change with the joint.

    The damping of a record, and at the frequencies of its FFT (D_a, D_v, D_θ), A and A H z^(−τ).
    """

    damping: Array
    motion: tuple[Complex, Complex, Complex]
    admittance: Complex
    path: Complex

    def gain(self, parameters: tuple[float, float, float]) -> Complex:
        """Return the loop gain A H z^(−τ) (J D_a + B D_v + K D_θ)."""
        J, B, K = parameters
        return self.path * (J * self.motion[0] + B * self.motion[1] + K * self.motion[2])


@lru_cache(maxsize=8)
def _opened(loop: LoopModel, n: int, rate_hz: float) -> _Opened:
    """Return the opened loop for records of `n` ticks; an estimate asks for it many times."""
    z, damping = _circle(n, rate_hz)
    interval_s = 1.0 / rate_hz
    rate = loop.damping_nm_s_rad / loop.inertia_kg_m2
    decay = np.exp(-rate * interval_s)
    gain = (
        -np.expm1(-rate * interval_s) / loop.damping_nm_s_rad
        if rate > 0
        else interval_s / loop.inertia_kg_m2
    )
    admittance = gain / (1 - decay / z)
    late = z ** (-loop.torque_delay_s * rate_hz)
    path = admittance * (_butterworth(z, loop.torque_cutoff_hz, rate_hz) * late)
    return _Opened(damping, loop.drive.transfer(z, interval_s), admittance, path)


def loop_model(settings: Settings, torque_rate_hz: float, drive: DriveModel) -> LoopModel:
    """Return the loop that settings describe, with a drive that was fitted or assumed.

    A torque sensor slower than the tick is held: on average half its interval longer.
    """
    controller, rig = settings.controller, settings.rig
    hold_s = max(1.0 / torque_rate_hz - 1.0 / rig.tick_rate_hz, 0.0) / 2
    return LoopModel(
        controller.inertia_kg_m2,
        controller.damping_nm_s_rad,
        controller.torque_cutoff_hz,
        rig.torque.latency_s + hold_s,
        drive,
    )


def _length(n: int) -> int:
    return int(fft.next_fast_len(n, real=True))


def _circle(n: int, rate_hz: float) -> tuple[Complex, Array]:
    """Return z at the frequencies of the FFT on the damped circle, and the damping of a record."""
    length = _length(n)
    radius = DECAY / length
    angle = 2 * np.pi * np.arange(length // 2 + 1) / length
    return np.exp(radius + 1j * angle), np.exp(-radius * np.arange(n))


def _butterworth(z: Complex, cutoff_hz: float, rate_hz: float) -> Complex:
    """Return the second-order low-pass of the loop at z; none where the ticks are too slow."""
    if cutoff_hz >= rate_hz / 2:
        return np.ones_like(z)
    w = np.tan(np.pi * cutoff_hz / rate_hz)
    s = (1 - 1 / z) / (1 + 1 / z) / w
    return np.asarray(1 / (s * s + np.sqrt(2) * s + 1), dtype=np.complex128)
