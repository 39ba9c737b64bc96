"""Whether the joint moved in a way that can tell J, B and K apart.

Acceleration and angle of a motion at a single frequency ω are in proportion, θ'' = −ω² θ, so J and
K trade against each other; of a drift, or of a push in one direction, velocity and angle
are alike too. What the regressors have in common shows in the singular values of the columns scaled
to unit length: their ratio is 1 where nothing, and infinite where everything is shared.

Coherence is the share of a signal's power, line by line, that follows the perturbation linearly.
"""

from __future__ import annotations

import math

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view

from rigidimeter.analysis.estimation.diagnostics.check_record import (
    Check,
    Look,
    at_least,
    at_most,
    push_effect,
    push_harmless,
)
from rigidimeter.analysis.estimation.power_lines import lines_inside, power_lines
from rigidimeter.analysis.estimation.scores import line_shares
from rigidimeter.analysis.estimation.signals import Array, Signals, values_at
from rigidimeter.core.records import PARAMETERS, Channel, Epoch
from rigidimeter.core.settings import DiagnosticsSettings

MIDDLE_PERCENT = 90.0
TAPERED_LINES = 1.5
"""The equivalent noise bandwidth of Hann's window, in lines."""

SEGMENTS = 8
"""Stretches, half overlapping, over which a coherence is averaged: 4 s each in an epoch of 18 s.

Signals that have nothing to do with each other then still show about 0.2.
"""


def conditioning(signals: Signals, settings: DiagnosticsSettings) -> Look:
    """Return whether the regressors can be told apart, and if not which two and because of what."""
    solution, most = signals.solution, settings.max_condition_number
    if not np.all(solution.lengths > 0):
        return Look(math.inf, most, True, variant="at_rest")
    # The weakest direction adds and subtracts what cannot be told apart.
    first, second = sorted(np.argsort(np.abs(solution.right[-1]))[-2:])
    low_hz, high_hz = _middle_hz(signals)
    return at_most(
        solution.condition_number,
        most,
        first=PARAMETERS[first].symbol,
        second=PARAMETERS[second].symbol,
        low_hz=low_hz,
        high_hz=high_hz,
    )


def coherence(epoch: Epoch, signals: Signals, settings: DiagnosticsSettings) -> Look:
    """Return how far torque and velocity follow the perturbation, by Welch's method.

    The value is the median over the lines of the band, for the weaker of the two.
    """
    cause = perturbation_nm(epoch.channels["perturbation_nm"], signals.time_s)
    shared = _coherence(cause, np.stack([signals.torque_nm, signals.velocity_rad_s]), signals)
    medians = np.median(shared, axis=1).tolist()
    value, weaker = min(zip(medians, ("torque", "velocity"), strict=True))
    return at_least(value, settings.min_coherence, signal=weaker, percent=100.0 * value)


def _coherence(cause: Array, effects: Array, signals: Signals) -> Array:
    """Return the coherence of a cause with each effect at the lines of the band, shape (2, m).

    As `scipy.signal.coherence` has it with segments that overlap by half, but every spectrum once.
    """
    length = scipy.fft.prev_fast_len(max(2 * signals.time_s.size // (SEGMENTS + 1), 8), real=True)
    frequency = scipy.fft.rfftfreq(length, 1.0 / signals.rate_hz)
    inside = lines_inside(frequency, signals.band_hz)
    whole = np.concatenate([cause[None], effects])
    parts = sliding_window_view(whole, length, axis=1)[:, :: length - length // 2]
    parts = parts - np.mean(parts, axis=2, keepdims=True)
    spectra = scipy.fft.rfft(parts * scipy.signal.windows.hann(length, sym=False))[:, :, inside]
    power = np.mean(np.abs(spectra) ** 2, axis=1)
    together = np.mean(spectra[0].conj() * spectra[1:], axis=1)
    return np.asarray(np.abs(together) ** 2 / (power[0] * power[1:]))


def band_share(epoch: Epoch, signals: Signals, settings: DiagnosticsSettings) -> Look:
    """Return how much of the recorded torque and velocity lies in the band of the fit."""
    moving = "velocity_rad_s" if "velocity_rad_s" in epoch.channels else "angle_rad"
    shares = {
        name: _share(
            values_at(epoch.channels[one], signals.time_s), signals, slope=one == "angle_rad"
        )
        for name, one in (("torque", "torque_nm"), ("velocity", moving))
    }
    weaker = min(shares, key=lambda name: shares[name])
    low, high = signals.band_hz
    value, least = 100.0 * shares[weaker], settings.min_band_share_percent
    return at_least(value, least, signal=weaker, low_hz=low, high_hz=high)


def imposed_sinusoid(epoch: Epoch, settings: DiagnosticsSettings) -> Look:
    """Return whether the motion is a single sinusoid, which no fit of three parameters can use."""
    shares, most = line_shares(epoch), settings.max_single_frequency_percent
    facts = {"velocity": 100.0 * shares.velocity}
    return Look(100.0 * shares.angle, most, shares.single(most / 100.0), facts)


def perturbation_nm(channel: Channel, time_s: Array) -> Array:
    """Return the perturbation at the given times, held from one tick to the next."""
    # A tick of rounding must not turn a value into the one before.
    index = np.searchsorted(channel.time_s, time_s + 1e-9, side="right") - 1
    return channel.values[np.maximum(index, 0)]


def _share(values: Array, signals: Signals, *, slope: bool) -> float:
    """Return the share of the power of a signal, or of its differences, that lies in the band.

    White noise of the samples is left out: its power is that above a quarter of the rate, of which
    lines of noise, exponentially distributed, have a median of ln 2 times their mean. Hum, a few of
    the lines, does not move that.

    The first line of a perturbation may lie less than a line above the lower edge: what the taper
    does not tell from the band is not outside it.
    """
    frequency, power = power_lines(values, signals.rate_hz, tapered=True)
    power = power - np.median(power[frequency > signals.rate_hz / 4]) / np.log(2.0)
    if slope:
        power = power * np.sin(2 * np.pi * frequency / signals.rate_hz) ** 2
    reach_hz, (low_hz, high_hz) = TAPERED_LINES / 2 * float(frequency[1]), signals.band_hz
    inside = lines_inside(frequency, (low_hz - reach_hz, high_hz + reach_hz))
    total = float(np.sum(power[1:]))
    return min(float(np.sum(power[inside])) / total, 1.0) if total > 0 else 0.0


def _middle_hz(signals: Signals) -> tuple[float, float]:
    """Return between which frequencies the middle of the velocity's power lies."""
    frequency, power = power_lines(signals.velocity_rad_s, signals.rate_hz, tapered=True)
    running = np.cumsum(power) / max(float(np.sum(power)), 1e-300)
    outside = (1.0 - MIDDLE_PERCENT / 100.0) / 2.0
    low, high = np.searchsorted(running, [outside, 1.0 - outside])
    return float(frequency[low]), float(frequency[min(high, frequency.size - 1)])


EXCITATION_CHECKS = (
    Check("conditioning", (), lambda c: conditioning(c.signals, c.settings), of_fit=False),
    Check("imposed_sinusoid", (), lambda c: imposed_sinusoid(c.epoch, c.settings), of_fit=False),
    Check("band_share", (), lambda c: band_share(c.epoch, c.signals, c.settings), of_fit=False),
    Check(
        "coherence",
        ("perturbation_nm",),
        lambda c: coherence(c.epoch, c.signals, c.settings),
        of_fit=False,
        harmless=push_harmless,
        effect=push_effect,
    ),
)
