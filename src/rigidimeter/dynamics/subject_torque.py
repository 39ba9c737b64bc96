"""What the virtual subject does: voluntary torque, tremor, and a joint that varies by epoch."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.settings import SubjectSettings

__all__ = ["SubjectTorque", "draw_joint"]

TREMOR_PHASE_DIFFUSION_RAD2_S = 1.0
"""How fast the tremor loses its phase: a line about 0.16 Hz wide, so that it is no pure tone."""


def draw_joint(subject: SubjectSettings, rng: np.random.Generator) -> JointDynamics:
    """Draw the joint of one epoch, log-normal about the medians.

    A coefficient of variation c gives the standard deviation √(ln(1 + c²)) of the logarithm.
    """

    def drawn(median: float, cv_percent: float) -> float:
        spread = math.sqrt(math.log1p((cv_percent / 100.0) ** 2))
        return median * math.exp(spread * rng.standard_normal())

    return JointDynamics(
        drawn(subject.inertia_kg_m2, subject.inertia_cv_percent),
        drawn(subject.damping_nm_s_rad, subject.damping_cv_percent),
        drawn(subject.stiffness_nm_rad, subject.stiffness_cv_percent),
    )


@lru_cache(maxsize=32)
def _band(low_hz: float, high_hz: float, rate_hz: float) -> tuple[NDArray[np.float64], float]:
    """Return the band-pass as sections, and the energy of its impulse response."""
    sos = scipy.signal.butter(2, [low_hz, high_hz], "bandpass", fs=rate_hz, output="sos")
    impulse = np.zeros(int(10.0 * rate_hz / low_hz))
    impulse[0] = 1.0
    response = scipy.signal.sosfilt(sos, impulse)
    return sos, float(response @ response)


class SubjectTorque:
    """Voluntary torque M_sub in N·m, drawn in blocks at the tick rate.

    Band-limited Gaussian noise of the given standard deviation plus a tremor of constant amplitude
    whose phase wanders.

    Parameters
    ----------
    subject : SubjectSettings
    rate_hz : float
        Tick rate.
    rng : numpy.random.Generator
    """

    def __init__(self, subject: SubjectSettings, rate_hz: float, rng: np.random.Generator) -> None:
        self._subject = subject
        self._rate_hz = rate_hz
        self._rng = rng
        low_hz = subject.voluntary_low_hz
        high_hz = min(subject.voluntary_high_hz, 0.45 * rate_hz)
        self._sos, energy = _band(low_hz, high_hz, rate_hz)
        self._memory = np.zeros((self._sos.shape[0], 2))
        self._phase_rad = rng.uniform(0.0, 2.0 * math.pi)
        # White noise of unit variance leaves the filter with the energy of its impulse response.
        self._gain = subject.voluntary_sd_nm / math.sqrt(energy)
        self.block(round(3.0 * rate_hz / low_hz))  # let the filter settle

    def block(self, n: int) -> NDArray[np.float64]:
        """Return the next `n` ticks of torque."""
        torque = np.zeros(n)
        if self._subject.voluntary_sd_nm > 0.0:
            noise, self._memory = scipy.signal.sosfilt(
                self._sos, self._rng.standard_normal(n), zi=self._memory
            )
            torque += self._gain * noise
        if self._subject.tremor_amplitude_nm > 0.0:
            step = 2.0 * math.pi * self._subject.tremor_frequency_hz / self._rate_hz
            wander = math.sqrt(TREMOR_PHASE_DIFFUSION_RAD2_S / self._rate_hz)
            phase = self._phase_rad + np.cumsum(step + wander * self._rng.standard_normal(n))
            self._phase_rad = float(phase[-1] % (2.0 * math.pi))
            torque += self._subject.tremor_amplitude_nm * np.sin(phase)
        return torque
