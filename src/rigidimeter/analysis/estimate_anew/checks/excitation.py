"""Whether the joint moved in a way that can tell J, B and K apart.

Acceleration and angle of a motion at a single frequency ω are in proportion, θ'' = −ω² θ, so J and
K trade against each other; of a drift, or of a push in one direction, velocity and angle
are alike too. What the regressors have in common shows in the condition number of the columns
scaled to unit length: it is 1 where nothing, and infinite where everything is shared.

Coherence is the share of a signal's power, line by line, that follows the perturbation linearly.

All but the shares of power are made of the lines of the epoch, weighted as `signals.band_hz` and
`zero_phase_band` would have them; `shown` are they in time, in N·m, rad and s, of few samples.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view

from rigidimeter.analysis.estimate_anew.checks import Pull, at_least, at_most, found
from rigidimeter.analysis.estimate_anew.grid import SAME_TIME, Array, Complex
from rigidimeter.analysis.estimate_anew.observation import Observation
from rigidimeter.analysis.estimate_anew.scores import line_shares
from rigidimeter.analysis.estimate_anew.signals import (
    Signals,
    band_hz,
    grid_rate_hz,
    held_at,
    lines_inside,
    power_lines,
    uniform_grid,
    values_at,
)
from rigidimeter.analysis.estimate_anew.stretches import motion_channels, moves
from rigidimeter.core.findings import Fact, Finding
from rigidimeter.core.records import Epoch, Fit
from rigidimeter.core.settings import DiagnosticsSettings, EstimationSettings

OUTSIDE = 0.05
"""Half of 10 %: the middle of the velocity's power is between what is left at both ends."""

TAPERED_LINES = 1.5
"""The equivalent noise bandwidth of Hann's window, in lines."""

SEGMENTS = 8
"""Stretches, half overlapping, over which a coherence is averaged: 4 s each in an epoch of 18 s.

Signals that have nothing to do with each other then still show about 0.2.
"""

WHOLE = 0.999
"""Of the window: what is below is an end, or beside what is left out."""


def excitation(observation: Observation, fit: Fit, pull: Pull) -> list[Finding]:
    """Return what an epoch shows of the motion that J, B and K are made of.

    Parameters
    ----------
    observation : Observation
        The epoch at its lines.
    fit : Fit
    pull : Pull
        What torque of the subject does to the fit.
    """
    epoch, settings = observation.epoch, observation.settings
    checks, seen = settings.diagnostics, checked_lines(observation)
    findings = conditioning(seen, checks) + imposed_sinusoid(epoch, checks)
    findings += band_share(epoch, settings.estimation, checks)
    if moves(epoch.channels.get("perturbation_nm")):
        findings += coherence(seen, fit, pull)
    return [replace(one, condition=epoch.condition) for one in findings]


def checked_lines(observation: Observation) -> Observation:
    """Return torque and motion at the lines through the band that signals in time pass."""
    _, high_hz = _band_hz(observation)
    most = 2 * high_hz * observation.grid.duration_s
    part = observation.part(slice(int(np.searchsorted(observation.grid.line, most))))
    share = gain(part)
    return replace(part, torque_nm=share * part.torque_nm, motion=share[:, None] * part.motion)


def _band_hz(seen: Observation) -> tuple[float, float]:
    """Return the band for signals in time, as far as there are lines."""
    low_hz, high_hz = band_hz(seen.epoch, seen.settings.estimation)
    return low_hz, min(high_hz, seen.grid.band_hz[1])


def gain(seen: Observation) -> Array:
    """Return that of `signals.zero_phase_band`, shape (m,)."""
    low_hz, high_hz = band_hz(seen.epoch, seen.settings.estimation)
    frequency_hz = seen.grid.line / seen.grid.duration_s
    return 1 / ((1 + (low_hz / frequency_hz) ** 4) * (1 + (frequency_hz / high_hz) ** 8))


def in_time(seen: Observation, lines: Complex) -> tuple[Array, float]:
    """Return signals of lines, shape (k, m), where the window is whole: (k, n), and their rate."""
    few = seen.grid.in_time(lines)
    count, samples = few.shape[-1], seen.grid.time_s.size
    place = (np.arange(count) * (samples / count)).astype(np.intp)
    kept = seen.grid.window[0][place] > WHOLE
    return few[:, kept] * (math.sqrt(2 * count) / samples), count / seen.grid.duration_s


def shown(seen: Observation) -> Signals:
    """Return torque and motion of an epoch in time, of few samples."""
    lines = np.concatenate([seen.torque_nm[None], seen.motion.T])
    (torque, a, v, x), rate_hz = in_time(seen, lines)
    return Signals(np.arange(torque.size) / rate_hz, torque, a, v, x, rate_hz, _band_hz(seen))


def perturbation_lines(observation: Observation) -> Complex:
    """Return the perturbation, held from one tick to the next, at the lines."""
    held = held_at(observation.epoch.channels["perturbation_nm"], observation.grid.time_s)
    return np.asarray(observation.grid.lines(held)[0])


def by_push(fit: Fit, pull: Pull, settings: DiagnosticsSettings, **facts: Fact) -> dict[str, Any]:
    """Return what a finding says of torque of the subject's own: its harm, effect and facts."""
    harmless, why = pull.harmless(fit, settings)
    return {"harmless": harmless, "effect": pull.effect(fit), "facts": facts | why}


def conditioning(seen: Observation, settings: DiagnosticsSettings) -> list[Finding]:
    """Return whether the regressors can be told apart, and if not which two and because of what."""
    most, gram = settings.max_condition_number, (seen.motion.conj().T @ seen.motion).real
    lengths = np.sqrt(np.diag(gram))
    if not np.all(lengths > 0):
        return [found("conditioning", settings, math.inf, most, variant="at_rest")]
    power, directions = np.linalg.eigh(gram / np.outer(lengths, lengths))
    # The weakest direction adds and subtracts what cannot be told apart.
    first, second = sorted(np.argsort(np.abs(directions[:, 0]))[-2:])
    running = np.cumsum(np.abs(seen.motion[:, 1]) ** 2)
    ends = np.searchsorted(running / running[-1], [OUTSIDE, 1.0 - OUTSIDE])
    low_hz, high_hz = (seen.grid.line[ends] / seen.grid.duration_s).tolist()
    facts: dict[str, Fact] = {"first": "JBK"[first], "second": "JBK"[second]}
    facts |= {"low_hz": low_hz, "high_hz": high_hz}
    value = math.sqrt(power[-1] / power[0]) if power[0] > 0 else math.inf
    return at_most("conditioning", settings, value, most, facts=facts)


def coherence(seen: Observation, fit: Fit, pull: Pull) -> list[Finding]:
    """Return how far torque and velocity follow the perturbation, by Welch's method.

    The value is the median over the lines of the band, for the weaker of the two.
    """
    settings = seen.settings.diagnostics
    lines = np.stack([perturbation_lines(seen), seen.torque_nm, seen.motion[:, 1]])
    few, rate_hz = in_time(seen, lines)
    length = scipy.fft.prev_fast_len(max(2 * few.shape[1] // (SEGMENTS + 1), 8), real=True)
    parts = sliding_window_view(few, length, axis=1)[:, :: length - length // 2]
    parts = (parts - np.mean(parts, axis=2, keepdims=True)) * scipy.signal.windows.hann(length)
    inside = lines_inside(scipy.fft.rfftfreq(length, 1.0 / rate_hz), _band_hz(seen))
    cause, *effects = scipy.fft.rfft(parts)[:, :, inside]
    of_cause, *power = (np.mean(np.abs(one) ** 2, axis=0) for one in (cause, *effects))
    both = (np.mean(cause.conj() * one, axis=0) for one in effects)
    medians = [
        float(np.median(np.abs(one) ** 2 / (of_cause * own)))
        for one, own in zip(both, power, strict=True)
    ]
    value, weaker = min(zip(medians, ("torque", "velocity"), strict=True))
    more = by_push(fit, pull, settings, signal=weaker, percent=100.0 * value)
    return at_least("coherence", settings, value, settings.min_coherence, **more)


def band_share(
    epoch: Epoch, estimation: EstimationSettings, settings: DiagnosticsSettings
) -> list[Finding]:
    """Return how much of the recorded torque and velocity lies in the band of the fit.

    Of an angle alone the differences are looked at. White noise of the samples is left out: its
    power is that above a quarter of the rate, of which lines of noise, exponentially distributed,
    have a median of ln 2 times their mean. Hum, a few of the lines, does not move that.

    The first line of a perturbation may lie less than a line above the lower edge: what the taper
    does not tell from the band is not outside it.
    """
    low_hz, high_hz = band_hz(epoch, estimation)
    torque, moving = epoch.channels["torque_nm"], motion_channels(epoch)
    rate_hz = grid_rate_hz([torque, *moving], high_hz)
    time_s = uniform_grid([torque, *moving], rate_hz)
    shares = {}
    for name, one in (("torque", torque), ("velocity", moving[0])):
        frequency, power = power_lines(values_at(one, time_s, SAME_TIME), rate_hz, tapered=True)
        power = power - np.median(power[frequency > rate_hz / 4]) / np.log(2.0)
        if one.name == "angle_rad":
            power = power * np.sin(2 * np.pi * frequency / rate_hz) ** 2
        reach_hz, total = TAPERED_LINES / 2 * float(frequency[1]), float(np.sum(power[1:]))
        inside = lines_inside(frequency, (low_hz - reach_hz, high_hz + reach_hz))
        shares[name] = min(float(np.sum(power[inside])) / total, 1.0) if total > 0 else 0.0
    weaker = min(shares, key=lambda name: shares[name])
    facts: dict[str, Fact] = {"signal": weaker, "low_hz": low_hz, "high_hz": high_hz}
    least, value = settings.min_band_share_percent, 100.0 * shares[weaker]
    return at_least("band_share", settings, value, least, facts=facts)


def imposed_sinusoid(epoch: Epoch, settings: DiagnosticsSettings) -> list[Finding]:
    """Return whether the motion is a single sinusoid, which no fit of three parameters can use."""
    shares, most = line_shares(epoch), settings.max_single_frequency_percent
    if not shares.single(most / 100.0):
        return []
    facts = {"velocity": 100.0 * shares.velocity}
    return [found("imposed_sinusoid", settings, 100.0 * shares.angle, most, facts=facts)]
