"""How the joint moved: in a way that tells J, B and K apart, by the perturbation, or by itself.

**Excitation.** Acceleration and angle of a motion at a single frequency ω are in proportion,
θ'' = −ω² θ, so J and K trade against each other; of a drift, or of a push in one direction,
velocity and angle are alike too. What the regressors have in common shows in the condition number
of the columns scaled to unit length: it is 1 where nothing, and infinite where everything is
shared. Coherence is the share of a signal's power, line by line, that follows the perturbation
linearly.

Checks see the lines of the epoch through the band that signals in time pass (`signals.band_hz`,
`zero_phase_band`), and signals in time of few samples, where the window is whole.

**The subject's own torque.** Once J, B and K are known, so is the torque that the joint does not
explain (Eq. 5) at the lines of the epoch:

    M_sub = J θ'' + B θ' + K θ − M_meas

By Parseval's theorem its mean square, weighted by the square of the window, is Σ |M_sub|² over the
lines times 2/(n Σ w²). Least squares makes it as small as it can, so that part of a large M_sub
hides in J, B and K: what is seen here is the least of it.

A tremor is a line of M_sub between 4 and 12 Hz. Parkinsonian tremor lies at 4 to 6 Hz and wanders
by some tenths of a Hz, so the power is summed over 1 Hz. A reflex or noise lies above the
perturbation's whole band; a tremor stands out of its neighbours. Where the loop is known, J, B and
K are freed first of the part that least squares takes for the joint.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.activity import CHECK
from rigidimeter.analysis.estimation.checks import Pull, at_least, at_most, found, half_widths
from rigidimeter.analysis.estimation.drive import since_ticks
from rigidimeter.analysis.estimation.grid import SAME_TIME, Array, Complex, Grid, grid_of
from rigidimeter.analysis.estimation.observation import Observation
from rigidimeter.analysis.estimation.scores import strongest_line
from rigidimeter.analysis.estimation.signals import band_hz, kinematics, sampled, values_at
from rigidimeter.analysis.estimation.solve import shortest
from rigidimeter.analysis.estimation.stretches import fitted_channels, motion_channels, rest_of
from rigidimeter.core.findings import UNKNOWN_EFFECT, Effect, Fact, Finding
from rigidimeter.core.records import PARAMETERS, Channel, Epoch, Fit
from rigidimeter.core.settings import DiagnosticsSettings
from rigidimeter.core.words import number

OUTSIDE = 0.05
"""Half of 10 %: the middle of the velocity's power is between what is left at both ends."""

TAPERED_LINES = 1.5
"""The equivalent noise bandwidth of Hann's window, in lines."""

SEGMENTS = 8
"""Stretches, half overlapping, over which a coherence is averaged: 4 s each in an epoch of 18 s.

Signals that have nothing to do with each other then still show about 0.2.
"""

LONGEST_LAG_S, POINTS_PER_CYCLE = 1.0, 8
"""Of residual and perturbation; points of their correlation to a cycle of the highest line."""

WHOLE = 0.999
"""Of the window: what is below is an end, or beside what is left out."""


COURSE = 3
"""Degree of the polynomial in time that is no movement, but where the joint went to rest."""

WIDTH_HZ = 1.0
STANDS_OUT = 3.0
"""The power of the line over that 1 Hz beside it, and over the median, at least."""


def hertz(grid: Grid) -> Array:
    """Return the frequencies of the lines."""
    return np.asarray(grid.line / grid.duration_s)


def gain(grid: Grid, band: tuple[float, float]) -> Array:
    """Return that of `signals.zero_phase_band` at the lines."""
    low, high = (edge / hertz(grid) for edge in band)
    return np.asarray(1.0 / ((1.0 + low**4) * (1.0 + high**-8.0)))


def checked_lines(seen: Observation) -> Observation:
    """Return torque and motion through the band of the checks, as far as that passes anything."""
    band = band_hz(seen.epoch, seen.settings.estimation)
    part = seen.part(slice(int(np.searchsorted(hertz(seen.grid), 2.0 * band[1]))))
    share = gain(part.grid, band)
    return replace(
        part,
        torque_nm=share * part.torque_nm,
        motion=share[:, None] * part.motion,
        terms_nm=np.asarray(share * part.terms_nm),
    )


def in_band(seen: Observation, frequency_hz: Array) -> NDArray[np.bool_]:
    """Return which frequencies are in the band of the checks, as far as there are lines."""
    low_hz, high_hz = band_hz(seen.epoch, seen.settings.estimation)
    most_hz = min(high_hz, seen.grid.band_hz[1])
    return np.asarray((frequency_hz >= low_hz) & (frequency_hz <= most_hz))


def in_time(grid: Grid, lines: Complex) -> tuple[Array, Array, float]:
    """Return signals of lines, shape (k, m), where the window is whole: times, (k, n), rate."""
    few = grid.in_time(lines)
    count, samples = few.shape[-1], grid.time_s.size
    place = (np.arange(count) * (samples / count)).astype(np.intp)
    place, kept = grid.time_s[place], grid.window[0][place] > WHOLE
    return place[kept], few[:, kept] * (math.sqrt(2 * count) / samples), count / grid.duration_s


def held_lines(channel: Channel, grid: Grid) -> tuple[Complex, float]:
    """Return what was held from one tick to the next at the lines, and its mean age in s."""
    place = sampled(channel, grid.time_s, SAME_TIME)
    if place is not None:
        return np.asarray(grid.lines(channel.values[place])[0]), 0.0
    tick, after_s = since_ticks(channel, grid.time_s, 0.0)
    return np.asarray(grid.lines(channel.values[tick])[0]), float(np.mean(after_s))


def perturbation_lines(seen: Observation) -> Complex:
    """Return the perturbation at the lines."""
    return held_lines(seen.epoch.channels["perturbation_nm"], seen.grid)[0]


def excitation(observation: Observation, fit: Fit, pull: Pull) -> list[Finding]:
    """Return what the motion that J, B and K are made of shows of itself."""
    findings = conditioning(checked_lines(observation))
    return findings + imposed_sinusoid(observation) + band_share(observation)


def conditioning(seen: Observation) -> list[Finding]:
    """Return whether the regressors can be told apart, and if not which two and because of what."""
    settings, gram = seen.settings.diagnostics, (seen.motion.conj().T @ seen.motion).real
    lengths, most = np.sqrt(np.diag(gram)), settings.max_condition_number
    if not np.all(lengths > 0):
        return [found("conditioning", settings, math.inf, most, variant="at_rest")]
    power, directions = np.linalg.eigh(gram / np.outer(lengths, lengths))
    # The weakest direction adds and subtracts what cannot be told apart.
    first, second = sorted(np.argsort(np.abs(directions[:, 0]))[-2:])
    running = np.cumsum(np.abs(seen.motion[:, 1]) ** 2)
    ends = np.searchsorted(running / running[-1], [OUTSIDE, 1.0 - OUTSIDE])
    low_hz, high_hz = hertz(seen.grid)[ends].tolist()
    facts: dict[str, Fact] = {"first": "JBK"[first], "second": "JBK"[second]}
    facts |= {"low_hz": low_hz, "high_hz": high_hz}
    value = math.sqrt(power[-1] / power[0]) if power[0] > 0 else math.inf
    return at_most("conditioning", settings, value, most, facts=facts)


def coherence(seen: Observation, cause: Complex, fit: Fit, pull: Pull) -> list[Finding]:
    """Return how far torque and velocity follow the perturbation, by Welch's method.

    The value is the median over the lines of the band, for the weaker of the two.
    """
    settings = seen.settings.diagnostics
    _, few, rate_hz = in_time(seen.grid, np.stack([cause, seen.torque_nm, seen.motion[:, 1]]))
    length = scipy.fft.prev_fast_len(max(2 * few.shape[1] // (SEGMENTS + 1), 8), real=True)
    parts = sliding_window_view(few, length, axis=1)[:, :: length - length // 2]
    parts = (parts - np.mean(parts, axis=2, keepdims=True)) * scipy.signal.windows.hann(length)
    spectra = scipy.fft.rfft(parts)[..., in_band(seen, scipy.fft.rfftfreq(length, 1.0 / rate_hz))]
    power = np.mean(np.abs(spectra) ** 2, axis=1)
    both = np.abs(np.mean(spectra[:1].conj() * spectra[1:], axis=1)) ** 2
    medians = np.median(both / (power[0] * power[1:]), axis=1).tolist()
    value, weaker = min(zip(medians, ("torque", "velocity"), strict=True))
    more = pull.told(fit, settings, signal=weaker, percent=100.0 * value)
    return at_least("coherence", settings, value, settings.min_coherence, **more)


def residual_perturbation(seen: Observation, cause: Complex, fit: Fit, pull: Pull) -> list[Finding]:
    """Return whether torque follows the perturbation that is not explained.

    The largest correlation of residual and perturbation, at any lag up to 1 s either way, times the
    residual's share of the torque: in % of the torque's standard deviation. A correlation that two
    independent signals of these spectra reach in one of 20 epochs is none: they correlate with
    variance c Σ P_a P_b / (2 Σ P_a Σ P_b) over the lines (Bartlett 1935), and as the lag runs, a
    Gaussian correlation of rms frequency ν passes ±u standard deviations 2 ν T exp(−u²/2) times on
    average (Rice 1944), which is set to 1/20.

    What the perturbation causes beyond J, B and K biases every method, so nothing is claimed of
    them where torque of the subject does not: a single epoch is no proof.
    """
    settings, grid = seen.settings.diagnostics, seen.grid
    left = seen.left(fit.value)
    a, b, of_torque = (np.abs(lines) ** 2 for lines in (left, cause, seen.torque_nm))
    power, size = a * b, math.sqrt(np.sum(a) * np.sum(b))
    if size == 0.0 or not np.any(of_torque):
        return []
    n = scipy.fft.next_fast_len(POINTS_PER_CYCLE * int(grid.line[-1]), real=True)
    lags = np.arange(n) - n // 2
    lags = lags[np.abs(lags) <= LONGEST_LAG_S * n / grid.duration_s]
    spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
    spectrum[grid.line] = left * cause.conj()
    together = scipy.fft.irfft(spectrum, n)[lags] * (n / 2 / size)
    at = int(np.argmax(np.abs(together)))
    r, lag_s = float(abs(together[at])), float(lags[at] * grid.duration_s / n)
    deviation = math.sqrt(0.5 * grid.spread * float(np.sum(power))) / size
    rms_hz = math.sqrt(float(np.average(hertz(grid) ** 2, weights=power)))
    crossings = max(4.0 * rms_hz * LONGEST_LAG_S, 0.1)
    chance = deviation * math.sqrt(2.0 * math.log(crossings / 0.05))
    value = 100.0 * r * math.sqrt(float(np.sum(a) / np.sum(of_torque)))
    if r <= chance:
        return []
    facts = {"correlation": r, "lag_s": lag_s, "chance": chance}
    more = {"facts": facts, "harmless": "chance" if pull.harmless(fit, settings)[0] else ""}
    most = settings.max_residual_perturbation_percent
    return at_most("residual_perturbation", settings, value, most, **more)


def band_share(seen: Observation) -> list[Finding]:
    """Return how much of the recorded torque and velocity lies in the band of the fit.

    Of an angle alone the differences are looked at. White noise of the samples is left out: its
    power is that above a quarter of the rate, of which lines of noise, exponentially distributed,
    have a median of ln 2 times their mean. Hum, a few of the lines, does not move that.

    The window is Hann's too, which is half a line less a quarter of each of its neighbours. The
    first line of a perturbation may lie less than a line above the lower edge: what the taper does
    not tell from the band is not outside it.
    """
    settings, grid = seen.settings.diagnostics, seen.grid
    low_hz, high_hz = band_hz(seen.epoch, seen.settings.estimation)
    frequency_hz = np.arange(1, grid.time_s.size // 2) / grid.duration_s
    reach_hz = TAPERED_LINES / 2 / grid.duration_s
    edges_hz = (low_hz - reach_hz, high_hz + reach_hz, grid.rate_hz / 4)
    first, stop, noise = np.searchsorted(frequency_hz, edges_hz)
    shares = {}
    for one in (seen.epoch.channels["torque_nm"], motion_channels(seen.epoch)[0]):
        values = values_at(one, grid.time_s, SAME_TIME)
        lines = scipy.fft.rfft((values - np.mean(values)) * grid.window[0])
        lines = (lines[1:-1] - (lines[:-2] + lines[2:]) / 2)[: frequency_hz.size]
        power = lines.real**2 + lines.imag**2
        power -= np.median(power[noise:]) / np.log(2.0)
        if one.name == "angle_rad":
            power *= np.sin(2 * np.pi * frequency_hz / grid.rate_hz) ** 2
        total, name = float(np.sum(power)), "torque" if one.name == "torque_nm" else "velocity"
        shares[name] = min(float(np.sum(power[first:stop])) / total, 1.0) if total > 0 else 0.0
    weaker = min(shares, key=lambda name: shares[name])
    facts: dict[str, Fact] = {"signal": weaker, "low_hz": low_hz, "high_hz": high_hz}
    least, value = settings.min_band_share_percent, 100.0 * shares[weaker]
    return at_least("band_share", settings, value, least, facts=facts)


def imposed_sinusoid(seen: Observation) -> list[Finding]:
    """Return whether the motion is a single sinusoid, which no fit of three parameters can use."""
    settings, power = seen.settings.diagnostics, np.abs(seen.motion[:, 2]) ** 2
    if not np.any(power):
        return []
    _, shares = strongest_line(hertz(seen.grid), power, 1.0 / seen.grid.duration_s)
    most, facts = settings.max_single_frequency_percent, {"velocity": 100.0 * shares.velocity}
    if not shares.single(most / 100.0):
        return []
    return [found("imposed_sinusoid", settings, 100.0 * shares.angle, most, facts=facts)]


def own_torque(observation: Observation, fit: Fit, pull: Pull) -> list[Finding]:
    """Return how much of the torque is the subject's own, in the voluntary band, and how often.

    A second is active if the SD of M_sub in it is above `active_torque_nm` and above
    `active_share_percent` of the SD of the torque: what is much for an elbow is little for an
    ankle.
    """
    seen, checks, bias = (
        checked_lines(_to_tremor(observation)),
        observation.settings.diagnostics,
        pull.bias,
    )
    grid, frequency_hz = seen.grid, hertz(seen.grid)
    free = 0.0 if bias is None or not np.all(np.isfinite(bias)) else bias
    own = _steady(seen, np.stack([fit.value, fit.value - free]))
    scale = 2.0 / (grid.time_s.size * grid.energy)
    power, freed = scale * np.abs(own) ** 2
    torque_sd_nm = math.sqrt(scale * np.sum(np.abs(seen.torque_nm) ** 2))
    band = low_hz, high_hz = checks.voluntary_low_hz, checks.voluntary_high_hz
    inside = (frequency_hz >= low_hz) & (frequency_hz <= high_hz)
    value, most = (
        100.0 * np.sum(power[inside]) / torque_sd_nm**2,
        checks.max_voluntary_share_percent,
    )
    sd_nm = math.sqrt(np.sum(power))
    more = pull.told(fit, checks, sd_nm=sd_nm, low_hz=low_hz, high_hz=high_hz)
    results = at_most("voluntary_torque", checks, value, most, **more)
    # The SD is that about zero, not about the second's mean: a push of a second is no offset.
    time_s, (values,), rate_hz = in_time(grid, own[:1] * gain(grid, band))
    length = max(round(rate_hz), 1)
    seconds = values[: values.size // length * length].reshape(-1, length)
    above_nm = max(checks.active_torque_nm, checks.active_share_percent / 100.0 * torque_sd_nm)
    active = np.sqrt(np.mean(seconds**2, axis=1)) > above_nm
    value = 100.0 * float(np.mean(active)) if active.size else math.nan
    first_s = float(time_s[length * np.argmax(active)]) if np.any(active) else math.nan
    more = pull.told(fit, checks, above_nm=above_nm, first_s=first_s)
    results += at_most("active_movement", checks, value, checks.max_active_percent, **more)
    return results + tremor(seen, freed, torque_sd_nm, fit, pull)


def _to_tremor(observation: Observation) -> Observation:
    """Return an epoch at lines beyond those of tremor where they are known.

    Without drive and instruments the fit ends where the samples no longer show the noise of the
    motion. That is too low for a tremor in 100 samples/s.
    """
    epoch, settings, grid = observation.epoch, observation.settings, observation.grid
    low_hz, high_hz = band_hz(epoch, settings.estimation)
    beyond_hz = min(settings.diagnostics.tremor_high_hz + WIDTH_HZ, high_hz)
    if observation.drive_known or grid.band_hz[1] >= beyond_hz - 1.0 / grid.duration_s:
        return observation
    channels, holes_s = fitted_channels(epoch), [one[:2] for one in epoch.left_out]
    grid = grid_of(channels, (low_hz, beyond_hz), settings.estimation.trim_s, holes_s)
    motion = grid.lines(kinematics(epoch, grid.time_s))[0].T
    torque_nm = grid.lines(values_at(channels[0], grid.time_s, SAME_TIME))[0]
    none = np.zeros_like(torque_nm)
    return replace(observation, grid=grid, motion=motion, torque_nm=torque_nm, terms_nm=none)


def _steady(seen: Observation, values: Array) -> Complex:
    """Return M_sub of each J, B and K, shape (k, m), without a slow course below the band.

    The window spreads that over the lines.
    """
    grid = seen.grid
    x = np.linspace(-1.0, 1.0, grid.coarse_time_s.size)
    powers = np.asarray(np.polynomial.legendre.legvander(x, COURSE)[:, 1:].T, dtype=np.float64)
    course = grid.coarse_lines(powers).T
    course *= gain(grid, band_hz(seen.epoch, seen.settings.estimation))[:, None]
    left = -np.stack([seen.left(one) for one in values])
    gram, moments = ((lines @ course.conj()).real for lines in (course.T, left))
    return np.asarray(left - shortest(gram, moments) @ course.T)


def tremor(
    seen: Observation, power: Array, torque_sd_nm: float, fit: Fit, pull: Pull
) -> list[Finding]:
    """Return the strongest line of M_sub in the tremor band, if it stands out.

    Nothing is said where the band of the checks ends below the tremor.

    Parameters
    ----------
    seen : Observation
        At the lines of the checks.
    power : array, shape (m,)
        Of M_sub, of a joint freed of the pull.
    torque_sd_nm : float
    fit : Fit
    pull : Pull
    """
    checks, frequency_hz = seen.settings.diagnostics, hertz(seen.grid)
    width = max(round(WIDTH_HZ * seen.grid.duration_s), 1)
    running = np.convolve(power, np.ones(width), "same")
    highest_hz = band_hz(seen.epoch, seen.settings.estimation)[1] - WIDTH_HZ / 2
    high_hz = min(checks.tremor_high_hz, highest_hz)
    inside = np.flatnonzero((frequency_hz >= checks.tremor_low_hz) & (frequency_hz <= high_hz))
    if inside.size < 3 * width:
        return []
    at = int(inside[np.argmax(running[inside])])
    # The end of a push at low frequency has no valley on its other side.
    beside = running[[max(at - width, 0), min(at + width, running.size - 1)]]
    stands_out = float(running[at] / max(*beside, np.median(running[inside]), 1e-300))
    if stands_out < STANDS_OUT:
        return []
    near = slice(max(at - width // 2, 0), at + width // 2 + 1)
    mean_hz = float(np.average(frequency_hz[near], weights=power[near] + 1e-300))
    shown = {"frequency_hz": mean_hz, "amplitude_nm": math.sqrt(2.0 * running[at])}
    more = pull.told(fit, checks, stands_out=stands_out, **shown)
    value = 100.0 * float(running[at]) / torque_sd_nm**2
    return at_most("tremor", checks, value, checks.max_tremor_share_percent, **more)


def emg_activity(
    epoch: Epoch, fit: Fit, with_active: Fit | None, settings: DiagnosticsSettings, pull: Pull
) -> list[Finding]:
    """Return in what share of the time a muscle was active, and what was done about it.

    Parameters
    ----------
    epoch : Epoch
        As fitted.
    fit : Fit
        With what the EMG of the epoch shows.
    with_active : Fit or None
        With the stretches that are left out for an active muscle; None where none is, or that fit
        failed. J, B and K with them are held against those without.
    settings : DiagnosticsSettings
    pull : Pull
    """
    activity = fit.activity
    if activity is None:
        return []
    value, most, variant = activity.active_percent, settings.max_emg_active_percent, ""
    active = (epoch.channels[one.channel] for one in activity.stretches)
    muscles = dict.fromkeys(one.spoken or one.name for one in active)
    more = pull.told(fit, settings)
    facts: dict[str, Fact] = {"channel": " and ".join(muscles)}
    out = [one for one in epoch.left_out if one.check == CHECK]
    if out:
        facts, more["harmless"] = facts | rest_of(epoch, out), "left_out"
        if with_active is not None:
            change, half = with_active.value - fit.value, half_widths(with_active)
            more["effect"] = Effect.of(change, with_active.value, half)
            both = [
                f"{p.symbol} {number(one)} with them and {number(other)} without"
                for p, one, other in zip(PARAMETERS, with_active.value, fit.value, strict=True)
            ]
            if np.any(moved := np.abs(change) > half):
                facts["both"] = ", ".join(itertools.compress(both, moved))
                more["harmless"], variant = "", "moved"
    elif activity.stretches and all(one.locked for one in activity.stretches):
        more["harmless"] = "locked"
    elif activity.kept:
        # What the joint was while the muscle pulled no method can tell.
        facts["why"], variant = activity.kept, "too_much"
        more |= {"harmless": "", "effect": UNKNOWN_EFFECT}
    elif value <= most:
        return []
    else:
        facts |= more["facts"]
    return [found(CHECK, settings, value, most, **{**more, "facts": facts, "variant": variant})]
