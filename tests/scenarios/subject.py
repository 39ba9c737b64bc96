"""What the subject does of itself in an epoch, and how its joint changes: the courses of `motion`.

Each is drawn from the generator that is passed in, by a recipe of its own: noise is band-limited in
the spectrum, not filtered, and phases wander as a random walk.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray
from tests.scenarios.motion import (
    ADDED,
    COGWHEEL,
    COURSE_HZ,
    DAMPING,
    IMPOSED,
    REST,
    STIFFNESS,
    SUBJECT,
    resting,
)

Array = NDArray[np.float64]
WANDER_RAD2_S = 1.0
"""How fast tremor and cogwheel lose their phase."""


@dataclass(frozen=True)
class Subject:
    """Sizes of what happens in every epoch; zero leaves it out.

    Attributes
    ----------
    voluntary_nm : float
        SD of torque between the frequencies of `voluntary_hz`.
    voluntary_skirts : bool
        Whether a Butterworth band-pass of second order limits it; else it has none outside.
    bursts_nm : float
        Height of pushes either way, one about every 3 s, lasting 0.3 to 1 s.
    tremor_nm, tremor_hz : float, (float, float)
        Amplitude; the frequency is drawn for each epoch between the two.
    cogwheel_hz : (float, float)
        Of the bursts whose height is `Joint.cogwheel_nm`.
    posture_rad : float
        How far the rest angle drifts from the beginning to the end, wandering as much besides.
    stiffness : {"constant", "step", "drift", "phase"}
        How K goes during the epoch: steps in the middle or drifts from 1 − depth to 1 + depth
        times its mean, or follows the phase of the imposed movement.
    stiffness_depth : float
    between : tuple of float
        Factors of K in the epochs of a recording, in turn.
    tool_kg_m2 : tuple of float
        What the joint carries in the epochs of a recording, in turn.
    imposed_rad, imposed_hz : float
        A sinusoidal movement that the rig adds.
    sensor_drift_nm, lateral_nm : float
        What reaches the torque reading beside the torque: a drift over the epoch, and an SD from
        forces that the subject exerts sideways.
    """

    voluntary_nm: float = 0.0
    voluntary_hz: tuple[float, float] = (0.3, 4.0)
    voluntary_skirts: bool = False
    bursts_nm: float = 0.0
    tremor_nm: float = 0.0
    tremor_hz: tuple[float, float] = (4.0, 7.0)
    cogwheel_hz: tuple[float, float] = (6.0, 8.0)
    posture_rad: float = 0.0
    stiffness: Literal["constant", "step", "drift", "phase"] = "constant"
    stiffness_depth: float = 0.0
    damping_depth: float = 0.0
    between: tuple[float, ...] = (1.0,)
    tool_kg_m2: tuple[float, ...] = (0.0,)
    imposed_rad: float = 0.0
    imposed_hz: float = 0.5
    sensor_drift_nm: float = 0.0
    lateral_nm: float = 0.0


def courses(subject: Subject, duration_s: float, number: int, rng: np.random.Generator) -> Array:
    """Draw what happens in epoch `number` of a recording."""
    found = resting(duration_s)
    n = found.shape[1]
    time_s = np.arange(n) / COURSE_HZ
    if subject.voluntary_nm > 0:
        noise = skirted_noise if subject.voluntary_skirts else band_noise
        found[SUBJECT] += subject.voluntary_nm * noise(n, subject.voluntary_hz, rng)
    if subject.bursts_nm > 0:
        found[SUBJECT] += subject.bursts_nm * _bursts(time_s, rng)
    if subject.tremor_nm > 0:
        found[SUBJECT] += subject.tremor_nm * np.sin(_phase(n, subject.tremor_hz, rng))
    found[COGWHEEL] = np.maximum(np.sin(_phase(n, subject.cogwheel_hz, rng)), 0.0)
    if subject.posture_rad > 0:
        way = rng.choice([-1.0, 1.0]) * time_s / duration_s
        found[REST] = subject.posture_rad * (way + 0.5 * band_noise(n, (0.0, 0.1), rng))
        found[REST] -= found[REST, 0]
    found[STIFFNESS] = _stiffness(subject, time_s, duration_s)
    found[STIFFNESS] *= subject.between[number % len(subject.between)]
    omega = 2 * np.pi * subject.imposed_hz
    found[DAMPING] += subject.damping_depth * np.sin(omega * time_s)
    # From rest: the first second of it is faded in.
    found[IMPOSED] = subject.imposed_rad * omega * np.cos(omega * time_s) * np.minimum(time_s, 1.0)
    if subject.sensor_drift_nm > 0:
        way = rng.choice([-1.0, 1.0]) * time_s / duration_s
        found[ADDED] += subject.sensor_drift_nm * (way + 0.2 * band_noise(n, (0.0, 0.1), rng))
    if subject.lateral_nm > 0:
        found[ADDED] += subject.lateral_nm * band_noise(n, (0.3, 4.0), rng)
    return found


def band_noise(n: int, band_hz: tuple[float, float], rng: np.random.Generator) -> Array:
    """Return Gaussian noise of unit variance with power between two frequencies alone."""
    longer = 2 * n  # a period of its own would make the ends meet
    frequency = np.fft.rfftfreq(longer, 1 / COURSE_HZ)
    inside = (frequency > max(band_hz[0], 0.0)) & (frequency <= band_hz[1])
    lines = np.zeros(frequency.size, dtype=complex)
    count = int(np.count_nonzero(inside))
    lines[inside] = rng.standard_normal(count) + 1j * rng.standard_normal(count)
    return np.asarray(np.fft.irfft(lines, longer)[:n] * longer / (2 * np.sqrt(count)))


def skirted_noise(n: int, band_hz: tuple[float, float], rng: np.random.Generator) -> Array:
    """Return Gaussian noise of unit variance through a Butterworth band-pass of second order."""
    sos = scipy.signal.butter(2, band_hz, "bandpass", fs=COURSE_HZ, output="sos")
    settled = round(10 * COURSE_HZ)
    gain = np.sqrt(np.mean(np.abs(scipy.signal.sosfreqz(sos, 2**17)[1]) ** 2))
    white = rng.standard_normal(settled + n)
    return np.asarray(scipy.signal.sosfilt(sos, white)[settled:] / gain)


def _phase(n: int, frequency_hz: tuple[float, float], rng: np.random.Generator) -> Array:
    step = 2 * np.pi * rng.uniform(*frequency_hz) / COURSE_HZ
    walk = np.sqrt(WANDER_RAD2_S / COURSE_HZ) * rng.standard_normal(n)
    return np.asarray(rng.uniform(0, 2 * np.pi) + np.cumsum(step + walk))


def _bursts(time_s: Array, rng: np.random.Generator) -> Array:
    found = np.zeros(time_s.size)
    start_s = rng.exponential(3.0)
    while start_s < time_s[-1]:
        length_s = rng.uniform(0.3, 1.0)
        inside = (time_s >= start_s) & (time_s < start_s + length_s)
        shape = 0.5 * (1 - np.cos(2 * np.pi * (time_s[inside] - start_s) / length_s))
        found[inside] += rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.0) * shape
        start_s += rng.exponential(3.0)
    return found


def _stiffness(subject: Subject, time_s: Array, duration_s: float) -> Array:
    depth = subject.stiffness_depth
    if subject.stiffness == "step":
        return np.where(time_s < duration_s / 2, 1.0 - depth, 1.0 + depth)
    if subject.stiffness == "drift":
        return np.asarray(1.0 + depth * (2.0 * time_s / duration_s - 1.0))
    if subject.stiffness == "phase":
        return np.asarray(1.0 + depth * np.sin(2 * np.pi * subject.imposed_hz * time_s))
    return np.ones(time_s.size)
