"""Whether the subject moved by itself: by the torque that the joint does not explain, and by EMG.

Once J, B and K are known, so is the subject's own torque (Eq. 5) at the lines of the epoch:

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

import math
from dataclasses import replace

import numpy as np

from rigidimeter.analysis.estimate_anew.activity import CHECK
from rigidimeter.analysis.estimate_anew.checks import Array, Pull, at_most, found, half_widths
from rigidimeter.analysis.estimate_anew.checks.sensors import rest_of
from rigidimeter.analysis.estimate_anew.grid import SAME_TIME, Complex, Grid, grid_of
from rigidimeter.analysis.estimate_anew.observation import Observation
from rigidimeter.analysis.estimate_anew.signals import band_hz, kinematics, values_at
from rigidimeter.analysis.estimate_anew.stretches import fitted_channels
from rigidimeter.core.findings import UNKNOWN_EFFECT, Effect, Fact, Finding
from rigidimeter.core.records import PARAMETERS, Activity, Epoch, Fit
from rigidimeter.core.settings import Settings
from rigidimeter.core.words import number

WINDOW_S = 1.0
WHOLE = 1.0 - 1e-9
"""Of the window: where it does not fall to an end."""

COURSE = 3
"""Degree of the polynomial in time that is no movement, but where the joint went to rest."""

WIDTH_HZ = 1.0
STANDS_OUT = 3.0
"""The power of the line over that 1 Hz beside it, and over the median, at least."""


def pushing(observation: Observation, fit: Fit, settings: Settings, pull: Pull) -> list[Finding]:
    """Return how much of the torque is the subject's own, in the voluntary band, and how often.

    A second is active if the SD of M_sub in it is above `active_torque_nm` and above
    `active_share_percent` of the SD of the torque: what is much for an elbow is little for an
    ankle.

    Parameters
    ----------
    observation : Observation
    fit : Fit
        Its J, B and K.
    settings : Settings
    pull : Pull
        What torque of the subject does to them.
    """
    checks, torque_sd_nm = settings.diagnostics, _torque_sd_nm(observation)
    grid, own = _own_torque(observation, fit.value)
    low_hz, high_hz = checks.voluntary_low_hz, checks.voluntary_high_hz
    frequency_hz = grid.line / grid.duration_s
    inside = (frequency_hz >= low_hz) & (frequency_hz <= high_hz)
    why, shown = pull.harmless(fit, checks)
    more = {"condition": fit.condition, "effect": pull.effect(fit), "harmless": why}

    share = _sd_nm(grid, own[inside]) / torque_sd_nm if torque_sd_nm > 0 else math.nan
    value, most = 100.0 * share**2, checks.max_voluntary_share_percent
    facts = {"sd_nm": _sd_nm(grid, own), "low_hz": low_hz, "high_hz": high_hz, **shown}
    results = at_most("voluntary_torque", checks, value, most, facts=facts, **more)

    start_s, sd_nm = active_seconds(grid, own * _gain(grid, (low_hz, high_hz)))
    above_nm = max(checks.active_torque_nm, checks.active_share_percent / 100.0 * torque_sd_nm)
    active = sd_nm > above_nm
    value = 100.0 * float(np.mean(active)) if active.size else math.nan
    first_s = float(start_s[active][0]) if np.any(active) else math.nan
    facts = {"above_nm": above_nm, "first_s": first_s, **shown}
    most = checks.max_active_percent
    return results + at_most("active_movement", checks, value, most, facts=facts, **more)


def _own_torque(observation: Observation, values: Array) -> tuple[Grid, Complex]:
    """Return M_sub in the band of the checks, at lines beyond those of tremor where they are known.

    Without drive and instruments the fit ends where the samples no longer show the noise of the
    motion. That is too low for a tremor in 100 samples/s.
    """
    seen, settings = observation.wider or observation, observation.settings
    epoch, (low_hz, high_hz) = seen.epoch, band_hz(seen.epoch, settings.estimation)
    grid, motion, torque_nm = seen.grid, seen.motion, seen.torque_nm
    beyond_hz = min(settings.diagnostics.tremor_high_hz + WIDTH_HZ, high_hz)
    if grid.band_hz[1] < beyond_hz - 1.0 / grid.duration_s and not seen.drive_known:
        channels, holes_s = fitted_channels(epoch), [one[:2] for one in epoch.left_out]
        grid = grid_of(channels, (low_hz, beyond_hz), settings.estimation.trim_s, holes_s)
        motion = grid.lines(kinematics(epoch, grid.time_s))[0].T
        torque_nm = grid.lines(values_at(channels[0], grid.time_s, SAME_TIME))[0]
    return grid, _steady(grid, motion @ values - torque_nm) * _gain(grid, (low_hz, high_hz))


def _torque_sd_nm(observation: Observation) -> float:
    """Return the SD of the torque in the band of the checks, whatever that of the fit."""
    epoch, grid = observation.epoch, observation.grid
    whole = replace(grid, line=np.arange(1, grid.time_s.size // 2))
    torque_nm = whole.lines(values_at(epoch.channels["torque_nm"], grid.time_s, SAME_TIME))[0]
    gain = _gain(whole, band_hz(epoch, observation.settings.estimation))
    return _sd_nm(whole, torque_nm * gain)


def _steady(grid: Grid, lines: Complex) -> Complex:
    """Return the lines without a slow course below the band, which the window spreads over them."""
    x = np.linspace(-1.0, 1.0, grid.coarse_time_s.size)
    powers = np.asarray(np.polynomial.legendre.legvander(x, COURSE)[:, 1:].T, dtype=np.float64)
    course = grid.coarse_lines(powers)
    columns, target = (np.concatenate([z.real, z.imag], axis=-1) for z in (course, lines))
    return np.asarray(lines - np.linalg.lstsq(columns.T, target, rcond=None)[0] @ course)


def _gain(grid: Grid, band: tuple[float, float]) -> Array:
    """Return what `signals.zero_phase_band` makes of the lines."""
    low, high = (edge * grid.duration_s for edge in band)
    return np.asarray(1.0 / (1.0 + (low / grid.line) ** 4) / (1.0 + (grid.line / high) ** 8))


def _power(grid: Grid, lines: Complex) -> Array:
    """Return the mean square of a signal, line by line."""
    return np.asarray(2.0 / (grid.time_s.size * grid.energy) * np.abs(lines) ** 2)


def _sd_nm(grid: Grid, lines: Complex) -> float:
    return math.sqrt(float(np.sum(_power(grid, lines))))


def active_seconds(grid: Grid, lines: Complex) -> tuple[Array, Array]:
    """Return the SD of a signal second by second, where the window is 1.

    It is that about zero, not about the second's mean: a push of a second is no offset.

    Returns
    -------
    start_s : array, shape (k,)
        When each whole second begins, on the epoch's clock.
    sd : array, shape (k,)
    """
    few = grid.in_time(lines)
    place = np.arange(few.size) * (grid.time_s.size / few.size)
    whole = np.interp(place, np.arange(grid.time_s.size), grid.window[0]) > WHOLE
    values = few[whole] * (math.sqrt(2.0 * few.size) / grid.time_s.size)
    length = max(round(WINDOW_S * few.size / grid.duration_s), 1)
    count = values.size // length
    seconds = values[: count * length].reshape(count, length)
    start_s = grid.time_s[0] + place[whole][: count * length : length] / grid.rate_hz
    return start_s, np.sqrt(np.mean(seconds**2, axis=1))


def tremor(observation: Observation, fit: Fit, settings: Settings, pull: Pull) -> list[Finding]:
    """Return the strongest line of M_sub in the tremor band, if it stands out.

    Nothing is said where the band of the checks ends below the tremor. Parameters are those of
    `pushing`.
    """
    checks, bias = settings.diagnostics, pull.bias
    free = 0.0 if bias is None or not np.all(np.isfinite(bias)) else bias
    grid, own = _own_torque(observation, fit.value - free)
    frequency_hz, power = grid.line / grid.duration_s, _power(grid, own)
    width = max(round(WIDTH_HZ * grid.duration_s), 1)
    running = np.convolve(power, np.ones(width), "same")
    highest_hz = band_hz(observation.epoch, settings.estimation)[1] - WIDTH_HZ / 2
    high_hz = min(checks.tremor_high_hz, highest_hz)
    inside = np.flatnonzero((frequency_hz >= checks.tremor_low_hz) & (frequency_hz <= high_hz))
    if inside.size < 3 * width:
        return []
    at = int(inside[np.argmax(running[inside])])
    # The end of a push at low frequency has no valley on its other side.
    beside = running[[max(at - width, 0), min(at + width, running.size - 1)]]
    background = max(*beside, np.median(running[inside]), 1e-300)
    stands_out, torque_sd_nm = float(running[at] / background), _torque_sd_nm(observation)
    share = float(running[at]) / torque_sd_nm**2 if torque_sd_nm > 0 else math.nan
    near = slice(max(at - width // 2, 0), at + width // 2 + 1)
    why, shown = pull.harmless(fit, checks)
    facts: dict[str, Fact] = {
        "frequency_hz": float(np.average(frequency_hz[near], weights=power[near] + 1e-300)),
        "amplitude_nm": math.sqrt(2.0 * running[at]),
        "stands_out": stands_out,
        **shown,
    }
    if stands_out < STANDS_OUT:
        return []
    more = {"condition": fit.condition, "effect": pull.effect(fit), "harmless": why}
    most = checks.max_tremor_share_percent
    return at_most("tremor", checks, 100.0 * share, most, facts=facts, **more)


def emg_activity(
    epoch: Epoch,
    activity: Activity | None,
    fit: Fit,
    with_active: Fit | None,
    settings: Settings,
    pull: Pull,
) -> list[Finding]:
    """Return in what share of the time a muscle was active, and what was done about it.

    Parameters
    ----------
    epoch : Epoch
        As fitted.
    activity : Activity or None
        What its EMG shows.
    fit : Fit
    with_active : Fit or None
        With the stretches that are left out for an active muscle; None where none is, or that fit
        failed. J, B and K with them are held against those without.
    settings : Settings
    pull : Pull
    """
    if activity is None:
        return []
    checks, condition = settings.diagnostics, fit.condition
    value, most = activity.active_percent, checks.max_emg_active_percent
    active = (epoch.channels[one.channel] for one in activity.stretches)
    muscles = dict.fromkeys(one.spoken or one.name for one in active)
    facts: dict[str, Fact] = {"channel": " and ".join(muscles)}
    effect, variant, why = pull.effect(fit), "", "left_out"
    out = [one for one in epoch.left_out if one.check == CHECK]
    if out:
        facts |= rest_of(epoch, out)
        if with_active is not None:
            change, half = with_active.value - fit.value, half_widths(with_active)
            effect = Effect.of(change, with_active.value, half)
            both = ", ".join(
                f"{p.symbol} {number(one)} with them and {number(other)} without"
                for p, one, other, shown in zip(
                    PARAMETERS, with_active.value, fit.value, np.abs(change) > half, strict=True
                )
                if shown
            )
            if both:
                facts["both"], variant, why = both, "moved", ""
    elif activity.stretches and all(one.locked for one in activity.stretches):
        why = "locked"
    elif activity.kept:
        # What the joint was while the muscle pulled no method can tell.
        facts["why"], effect, variant, why = activity.kept, UNKNOWN_EFFECT, "too_much", ""
    elif value <= most:
        return []
    else:
        why, more = pull.harmless(fit, checks)
        facts |= more
    return [
        found(
            CHECK,
            checks,
            value,
            most,
            condition=condition,
            effect=effect,
            facts=facts,
            variant=variant,
            harmless=why,
        )
    ]
