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

import itertools
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from rigidimeter.analysis.estimate_anew.activity import CHECK
from rigidimeter.analysis.estimate_anew.checks import Pull, at_most, found, half_widths
from rigidimeter.analysis.estimate_anew.checks.excitation import (
    checked_lines,
    gain,
    hertz,
    in_time,
)
from rigidimeter.analysis.estimate_anew.checks.sensors import rest_of
from rigidimeter.analysis.estimate_anew.grid import SAME_TIME, Array, Complex, Grid, grid_of
from rigidimeter.analysis.estimate_anew.observation import Observation
from rigidimeter.analysis.estimate_anew.signals import band_hz, kinematics, values_at
from rigidimeter.analysis.estimate_anew.solve import shortest
from rigidimeter.analysis.estimate_anew.stretches import fitted_channels
from rigidimeter.core.findings import UNKNOWN_EFFECT, Effect, Fact, Finding
from rigidimeter.core.records import PARAMETERS, Activity, Epoch, Fit
from rigidimeter.core.settings import Settings
from rigidimeter.core.words import number

WINDOW_S = 1.0

COURSE = 3
"""Degree of the polynomial in time that is no movement, but where the joint went to rest."""

WIDTH_HZ = 1.0
STANDS_OUT = 3.0
"""The power of the line over that 1 Hz beside it, and over the median, at least."""


def own_torque(observation: Observation, fit: Fit, pull: Pull) -> list[Finding]:
    """Return what the torque holds that is the subject's own."""
    seen = checked_lines(_to_tremor(observation))
    settings, bias = seen.settings.diagnostics, pull.bias
    free = 0.0 if bias is None or not np.all(np.isfinite(bias)) else bias
    own, freed = _steady(seen, np.stack([fit.value, fit.value - free]))
    torque_sd_nm = math.sqrt(np.sum(_power(seen.grid, seen.torque_nm)))
    told = pull.told(fit, settings)
    return pushing(seen, own, torque_sd_nm, told) + tremor(seen, freed, torque_sd_nm, told)


def pushing(
    seen: Observation, own: Complex, torque_sd_nm: float, told: Mapping[str, Any]
) -> list[Finding]:
    """Return how much of the torque is the subject's own, in the voluntary band, and how often.

    A second is active if the SD of M_sub in it is above `active_torque_nm` and above
    `active_share_percent` of the SD of the torque: what is much for an elbow is little for an
    ankle.

    Parameters
    ----------
    seen : Observation
        At the lines of the checks.
    own : complex array, shape (m,)
        M_sub.
    torque_sd_nm : float
    told : mapping
        What torque of the subject does to J, B and K.
    """
    checks, power, frequency_hz = (
        seen.settings.diagnostics,
        _power(seen.grid, own),
        hertz(seen.grid),
    )
    band = low_hz, high_hz = checks.voluntary_low_hz, checks.voluntary_high_hz
    inside = (frequency_hz >= low_hz) & (frequency_hz <= high_hz)
    value = 100.0 * float(np.sum(power[inside])) / torque_sd_nm**2 if torque_sd_nm else math.nan
    facts = {"sd_nm": math.sqrt(np.sum(power)), "low_hz": low_hz, "high_hz": high_hz}
    more = {**told, "facts": facts | told["facts"]}
    results = at_most("voluntary_torque", checks, value, checks.max_voluntary_share_percent, **more)
    # The SD is that about zero, not about the second's mean: a push of a second is no offset.
    time_s, (values,), rate_hz = in_time(seen.grid, (own * gain(seen.grid, band))[None])
    length = max(round(WINDOW_S * rate_hz), 1)
    whole = values.size // length * length
    sd_nm = np.sqrt(np.mean(values[:whole].reshape(-1, length) ** 2, axis=1))
    above_nm = max(checks.active_torque_nm, checks.active_share_percent / 100.0 * torque_sd_nm)
    active = sd_nm > above_nm
    value = 100.0 * float(np.mean(active)) if active.size else math.nan
    first_s = float(time_s[:whole:length][np.argmax(active)]) if np.any(active) else math.nan
    more = {**told, "facts": {"above_nm": above_nm, "first_s": first_s, **told["facts"]}}
    return results + at_most("active_movement", checks, value, checks.max_active_percent, **more)


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
    return replace(observation, grid=grid, motion=motion, torque_nm=torque_nm)


def _steady(seen: Observation, values: Array) -> Complex:
    """Return M_sub of each J, B and K, shape (k, m), without a slow course below the band.

    The window spreads that over the lines.
    """
    grid = seen.grid
    x = np.linspace(-1.0, 1.0, grid.coarse_time_s.size)
    powers = np.asarray(np.polynomial.legendre.legvander(x, COURSE)[:, 1:].T, dtype=np.float64)
    course = grid.coarse_lines(powers).T
    course *= gain(grid, band_hz(seen.epoch, seen.settings.estimation))[:, None]
    left = (seen.motion @ values.T).T - seen.torque_nm
    gram, moments = ((lines @ course.conj()).real for lines in (course.T, left))
    return np.asarray(left - shortest(gram, moments) @ course.T)


def _power(grid: Grid, lines: Complex) -> Array:
    """Return the mean square of a signal, line by line."""
    return np.asarray(2.0 / (grid.time_s.size * grid.energy) * np.abs(lines) ** 2)


def tremor(
    seen: Observation, own: Complex, torque_sd_nm: float, told: Mapping[str, Any]
) -> list[Finding]:
    """Return the strongest line of M_sub in the tremor band, if it stands out.

    Nothing is said where the band of the checks ends below the tremor. Parameters are those of
    `pushing`; M_sub is that of a joint freed of the pull.
    """
    checks, frequency_hz = seen.settings.diagnostics, hertz(seen.grid)
    power, width = _power(seen.grid, own), max(round(WIDTH_HZ * seen.grid.duration_s), 1)
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
    facts: dict[str, Fact] = {
        "frequency_hz": float(np.average(frequency_hz[near], weights=power[near] + 1e-300)),
        "amplitude_nm": math.sqrt(2.0 * running[at]),
        "stands_out": stands_out,
    }
    value = 100.0 * float(running[at]) / torque_sd_nm**2 if torque_sd_nm else math.nan
    more = {**told, "facts": facts | told["facts"]}
    return at_most("tremor", checks, value, checks.max_tremor_share_percent, **more)


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
    checks, variant = settings.diagnostics, ""
    value, most = activity.active_percent, checks.max_emg_active_percent
    active = (epoch.channels[one.channel] for one in activity.stretches)
    muscles = dict.fromkeys(one.spoken or one.name for one in active)
    more = pull.told(fit, checks)
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
    return [found(CHECK, checks, value, most, **{**more, "facts": facts, "variant": variant})]
