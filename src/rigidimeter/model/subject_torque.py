"""What the virtual subject does: voluntary torque, tremor, and a joint that varies by epoch.

The torque comes both as random numbers, block by block, and as its two-sided density in N²m²/Hz,
which integrates over −f_s/2 to f_s/2 to the variance:

- voluntary torque M_sub: Gaussian in a band, second-order Butterworth H, so that a standard
  deviation s gives s² |H|² / (f_s Σ h²) with h the impulse response;
- tremor: a line of amplitude a at f_t whose phase wanders by D rad²/s, so that its variance a²/2
  is spread over a Lorentzian of half-width D/(4π) Hz.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from rigidimeter.core.settings import SubjectSettings
from rigidimeter.model.joint import JointDynamics

TREMOR_PHASE_DIFFUSION_RAD2_S = 1.0
"""How fast the tremor loses its phase: a line about 0.16 Hz wide, so that it is no pure tone."""

_HIGHEST_OF_RATE = 0.45
"""The voluntary band ends at most at this share of the tick rate."""

BLOCK_TICKS = 5000
"""The subject's torque is drawn in blocks of this many ticks; the numbers depend on it."""


class RigStreams(NamedTuple):
    """One independent generator for each thing that is random in the virtual rig.

    With streams of their own, more jitter leaves the noise the same. Whoever draws the numbers,
    tick by tick or all beforehand, takes them from the same stream.
    """

    torque_jitter: np.random.Generator
    noise: np.random.Generator
    motion_jitter: np.random.Generator
    subject: np.random.Generator
    joint: np.random.Generator


def rig_streams(rng: np.random.Generator) -> RigStreams:
    """Return the streams of a rig; a generator gives others each time it is asked."""
    return RigStreams(*rng.spawn(len(RigStreams._fields)))


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


def one_by_one(block: Callable[[int], NDArray[np.float64]]) -> Iterator[float]:
    """Yield numbers one by one from blocks of `BLOCK_TICKS` drawn in advance."""
    while True:
        yield from block(BLOCK_TICKS).tolist()


@lru_cache(maxsize=32)
def noise_band(low_hz: float, high_hz: float, rate_hz: float) -> tuple[NDArray[np.float64], float]:
    """Return a band-pass as sections, and the energy of its impulse response.

    White noise of unit variance leaves it with that variance.
    """
    high_hz = min(high_hz, _HIGHEST_OF_RATE * rate_hz)
    sos = scipy.signal.butter(2, [low_hz, high_hz], "bandpass", fs=rate_hz, output="sos")
    impulse = np.zeros(int(10.0 * rate_hz / low_hz))
    impulse[0] = 1.0
    response = scipy.signal.sosfilt(sos, impulse)
    return sos, float(response @ response)


def subject_density(
    subject: SubjectSettings, frequency_hz: ArrayLike, tick_rate_hz: float
) -> NDArray[np.float64]:
    """Return the two-sided density of voluntary torque and tremor, in N²m²/Hz.

    Parameters
    ----------
    subject : SubjectSettings
    frequency_hz : array, shape (m,)
        From 0 to half the tick rate.
    tick_rate_hz : float
    """
    frequency = np.asarray(frequency_hz, dtype=np.float64)
    density = np.zeros(frequency.shape)
    if subject.voluntary_sd_nm > 0.0:
        sos, energy = noise_band(subject.voluntary_low_hz, subject.voluntary_high_hz, tick_rate_hz)
        power = np.abs(scipy.signal.sosfreqz(sos, frequency, fs=tick_rate_hz)[1]) ** 2
        density += subject.voluntary_sd_nm**2 * power / (energy * tick_rate_hz)
    if subject.tremor_amplitude_nm > 0.0:
        half_width = TREMOR_PHASE_DIFFUSION_RAD2_S / 2.0
        for centre_hz in (subject.tremor_frequency_hz, -subject.tremor_frequency_hz):
            away = 2.0 * np.pi * (frequency - centre_hz)
            line = 2.0 * half_width / (half_width**2 + away**2)
            density += subject.tremor_amplitude_nm**2 / 4.0 * line
    return density


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
        # A relaxed subject needs no filter, and loading `scipy.signal` for it takes a second.
        if subject.voluntary_sd_nm > 0.0:
            band_hz = subject.voluntary_low_hz, subject.voluntary_high_hz
            self._sos, energy = noise_band(*band_hz, rate_hz)
            self._memory = np.zeros((self._sos.shape[0], 2))
            # White noise of unit variance leaves it with the energy of its impulse response.
            self._gain = subject.voluntary_sd_nm / math.sqrt(energy)
        self._phase_rad = rng.uniform(0.0, 2.0 * math.pi)
        self.block(round(3.0 * rate_hz / subject.voluntary_low_hz))  # let the filter settle

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
