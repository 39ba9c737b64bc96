"""Whether the sensors measured, what they measured belongs together, and the arm had room.

Where a sensor hung or was at the end of its range (`stretches`), that stretch is left out and the
check notes it; where too little would be left, it speaks of the whole epoch.

A torque that somebody computed from the motion, or from the perturbation, is a weighted sum of
samples of these nearby, to the digits that it was written with. A sensor's noise is not. A torque
that is a function of the angle is nearly the same at nearly the same angles. Sorted by the angle,
with differences d from one sample to the next,

    share = Σ d² / (2 Σ (M − mean M)²)

is 1 for a torque that has nothing to do with the angle (von Neumann 1941), and 0 for a function of
it.

A velocity that is g times too small and stamped τ too late obeys, over any stretch of length T,

    θ(t + T) − θ(t) = g ∫ v dt + τ (v(t + T) − v(t))

to the first order in τ. Degrees for radians give g = 57.3 or 0.0175, a wrong sign g = −1; a filter
gives τ. What of the angle's derivative is left beyond both at the lines is a velocity of another
shape: of another joint, with the ripple of a tachometer, or an angle that slips. The torque, fitted
with the motion from either alone, says which of them the joint made.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from rigidimeter.analysis.estimate_anew.checks import Array, at_least, at_most, found, half_widths
from rigidimeter.analysis.estimate_anew.grid import Complex, grid_of
from rigidimeter.analysis.estimate_anew.signals import (
    angle_at,
    band_hz,
    grid_rate_hz,
    held_at,
    uniform_grid,
    values_at,
)
from rigidimeter.analysis.estimate_anew.stretches import (
    at_extremes_percent,
    fitted_channels,
    left_out_s,
    motion_channels,
    moves,
    repeated,
    sound,
)
from rigidimeter.core.findings import Effect, Fact, Finding
from rigidimeter.core.records import LOST_SAMPLES, Channel, Epoch, Fit, LeftOut
from rigidimeter.core.settings import DiagnosticsSettings, Settings
from rigidimeter.core.units import rad_from_deg

MOST_SHOWN = 3
"""Stretches that a sentence names."""

REACH = 2
"""Samples to each side: as far as a second difference of central differences reaches."""

ROWS, FEWEST_ROWS = 4000, 100
"""So many rows show whether a sum is exact; fewer than the second say nothing."""

STRETCH_S = 0.25

SHAPE_HIGH_HZ = 10.0
"""Above this the noise of a differentiated angle is no matter of shape."""

CLEARLY = 1.25
"""So many times as much of the torque must the worse motion leave unexplained to be called it."""


def sensors(epoch: Epoch, settings: Settings, followed: bool) -> list[Finding]:
    """Return what sensors, loop and guard show of an epoch alone.

    A torque that was computed comes before channels: a binary one repeats its extremes too.

    Parameters
    ----------
    epoch : Epoch
        As fitted.
    settings : Settings
    followed : bool
        Whether the method knows how the drive carries out a command that it holds.
    """
    checks = settings.diagnostics
    alone = computed_torque(epoch, checks) + repeating(epoch, checks) + left_out(epoch, checks)
    return _of(epoch, alone + loop(epoch, settings, followed))


def _of(epoch: Epoch, findings: Sequence[Finding]) -> list[Finding]:
    return [replace(one, condition=epoch.condition) for one in findings]


def computed_torque(epoch: Epoch, settings: DiagnosticsSettings) -> list[Finding]:
    """Return whether the torque is a sum of samples of the motion, or of the perturbation.

    Nothing is said of a simulation, whose sensors may be free of noise.
    """
    if epoch.virtual:
        return []
    sent = [epoch.channels[name] for name in ("perturbation_nm",) if name in epoch.channels]
    causes = {"the motion": motion_channels(epoch), "the perturbation": sent}
    shares = {name: 100.0 * _not_a_sum(epoch, channels) for name, channels in causes.items()}
    origin = min(shares, key=lambda name: shares[name])
    value, least = shares[origin], settings.min_computed_torque_percent
    if math.isinf(value):
        return []  # nothing to compare it with
    return at_least("computed_torque", settings, value, least, facts={"origin": origin})


def _not_a_sum(epoch: Epoch, channels: Sequence[Channel]) -> float:
    """Return the share of the torque's SD that samples of the channels nearby do not give."""
    torque = epoch.channels["torque_nm"]
    channels = [channel for channel in channels if moves(channel)]
    if not channels:
        return math.inf
    at = np.arange(REACH, len(torque) - REACH)
    start_s = max(float(channel.time_s[0]) for channel in channels)
    stop_s = min(float(channel.time_s[-1]) for channel in channels)
    at = at[(torque.time_s[at - REACH] >= start_s) & (torque.time_s[at + REACH] <= stop_s)]
    at = at[sound(epoch, torque.time_s[at], 0.1)]
    at = at[:: max(at.size // ROWS, 1)]
    if at.size < FEWEST_ROWS:
        return math.inf
    columns, lags = [np.ones((at.size, 1))], at[:, None] + np.arange(-REACH, REACH + 1)
    for one in channels:
        at_times = held_at if one.name == "perturbation_nm" else values_at
        columns.append(at_times(one, torque.time_s)[lags])
    target = torque.values[at] - np.mean(torque.values[at])
    left, sd = _left(np.hstack(columns), target), float(np.std(target))
    return float(np.sqrt(np.mean(left**2))) / sd if sd > 0 else math.inf


def _left(regressors: Array, target: Array) -> Array:
    """Return what least squares leaves of a target, each regressor scaled to unit length."""
    lengths = np.linalg.norm(regressors, axis=0)
    scaled = regressors / np.where(lengths > 0, lengths, 1.0)
    return np.asarray(target - scaled @ np.linalg.lstsq(scaled, target, rcond=None)[0])


def repeating(epoch: Epoch, settings: DiagnosticsSettings) -> list[Finding]:
    """Return whether a channel was at the end of its range, or hung."""

    def seen(one: Channel, extreme: bool) -> tuple[float, dict[str, Fact]]:
        runs = repeated(epoch, one, settings.max_frozen_s, extreme=extreme)
        if extreme:
            return at_extremes_percent(one, runs), {"channel": one.name}
        spans_s = np.vstack([one.time_s[[0, 0]], one.time_s[runs]])
        start_s, stop_s = spans_s[np.argmax(np.ptp(spans_s, axis=1))].tolist()
        return stop_s - start_s, {"channel": one.name, "start_s": start_s}

    results: list[Finding] = []
    limits = {"saturation": settings.max_saturated_percent, "frozen": settings.max_frozen_s}
    for name, most in limits.items():
        extreme = name == "saturation"
        if out := [one for one in epoch.left_out if one.check == name]:
            value = max(one.stop_s - one.start_s for one in out)
            value = 100.0 * _seconds(out) / _length_s(epoch) if extreme else value
            # The reason of a stretch begins with its channel.
            said = " and ".join(dict.fromkeys(one.reason.split()[0] for one in out))
            facts = {"channel": said, **rest_of(epoch, out)}
            results.append(found(name, settings, value, most, facts=facts, harmless="left_out"))
        else:
            each = [seen(one, extreme) for one in fitted_channels(epoch)]
            value, facts = max(each, key=lambda one: one[0])
            results += at_most(name, settings, value, most, facts=facts)
    return results


def left_out(epoch: Epoch, settings: DiagnosticsSettings) -> list[Finding]:
    """Return what the user left out, and in which share of the time samples are lost."""
    results: list[Finding] = []
    if out := [one for one in epoch.left_out if not one.check]:
        reasons = "; ".join(dict.fromkeys(one.reason for one in out if one.reason))
        facts = {"reason": reasons or "no reason was given", **rest_of(epoch, out)}
        results.append(found("left_out", settings, _seconds(out), 0.0, facts=facts))
    if out := [one for one in epoch.left_out if one.lost]:
        torque_s, most = epoch.channels["torque_nm"].time_s, settings.max_left_out_percent
        start_s = min(float(torque_s[0]), *(one.start_s for one in out))
        stop_s = max(float(torque_s[-1]), *(one.stop_s for one in out))
        value = 100.0 * _seconds(out) / (stop_s - start_s)
        facts = {"lost_s": _seconds(out), "reason": out[0].reason, **rest_of(epoch, out)}
        harmless = "left_out" if value <= most else ""
        results.append(found(LOST_SAMPLES, settings, value, most, facts=facts, harmless=harmless))
    return results


def _seconds(stretches: Sequence[LeftOut]) -> float:
    return sum(stretch.stop_s - stretch.start_s for stretch in stretches)


def _length_s(epoch: Epoch) -> float:
    return float(np.ptp(epoch.channels["torque_nm"].time_s[[0, -1]]))


def rest_of(epoch: Epoch, stretches: Sequence[LeftOut]) -> dict[str, Fact]:
    """Return which parts are left out, and how much of the epoch is used."""
    spans = [f"from {s.start_s:.4g} to {s.stop_s:.4g} s" for s in stretches[:MOST_SHOWN]]
    more, length_s = len(stretches) - MOST_SHOWN, _length_s(epoch)
    shown = " and ".join(spans) + (f" and {more} more" if more > 0 else "")
    return {"spans": shown, "used_s": length_s - left_out_s(epoch), "length_s": length_s}


def loop(epoch: Epoch, settings: Settings, followed: bool) -> list[Finding]:
    """Return ticks that never ran, commands that the guard changed, and the position limit."""
    ticks, checks = epoch.ticks, settings.diagnostics
    results: list[Finding] = []
    if ticks is not None and "velocity_command_rad_s" in epoch.channels:
        value, most = ticks.missed_percent, checks.max_missed_ticks_percent
        facts = {"missed": ticks.missed, "ticks": ticks.ran + ticks.missed, "late": ticks.late}
        why = "followed" if followed else ""
        results += at_most("missed_ticks", checks, value, most, facts=facts, harmless=why)
    if ticks is not None:
        value, most = 100.0 * ticks.limited / ticks.ran, checks.max_limited_percent
        results += at_most("guard_limited", checks, value, most)
    angle = epoch.channels.get("angle_rad")
    if angle is not None and epoch.excitation_hz is not None:  # of a session
        limit_deg, most = settings.guard.position_limit_deg, checks.max_position_percent
        value = 100.0 * float(np.max(np.abs(angle.values))) / rad_from_deg(limit_deg)
        results += at_most("position_limit", checks, value, most, facts={"limit_deg": limit_deg})
    return results


def velocity(epoch: Epoch, fit: Fit, settings: Settings) -> list[Finding]:
    """Return whether the velocity has the scale of the angle, its time, and its shape.

    With the torque in time with the velocity B is K τ too low, which half its interval must hold.
    """
    scale, delay_s = velocity_fit(epoch)
    if not np.isfinite([scale, delay_s]).all():
        return []  # what does not move is found by other checks
    checks, late_ms, half = settings.diagnostics, 1e3 * delay_s / scale, half_widths(fit)
    value, most = 100.0 * abs(scale - 1.0), checks.max_velocity_scale_percent
    results = at_most("velocity_scale", checks, value, most, facts={"scale": scale})
    bias = np.array([0.0, -1e-3 * fit.value[2] * late_ms, 0.0])
    held_ms = abs(late_ms) * half[1] / max(abs(bias[1]), 1e-300)
    most = min(checks.max_velocity_delay_ms, float(held_ms))
    if not abs(late_ms) <= most:
        effect = Effect.of(bias, fit.value, half)
        results.append(found("velocity_delay", checks, late_ms, most, effect=effect))
    return _of(epoch, results + velocity_shape(epoch, settings))


def velocity_fit(epoch: Epoch) -> tuple[float, float]:
    """Return the scale g and the delay τ in s of the velocity against the angle.

    NaN where one is missing, or the epoch does not move or is too short.
    """
    angle, velocity = epoch.channels.get("angle_rad"), epoch.channels.get("velocity_rad_s")
    if angle is None or velocity is None:
        return math.nan, math.nan
    low_s = max(angle.time_s[0], velocity.time_s[0])
    high_s = min(angle.time_s[-1], velocity.time_s[-1]) - STRETCH_S
    starts_s = angle.time_s[(angle.time_s >= low_s) & (angle.time_s <= high_s)]
    # Neither a stretch that is left out nor one that reaches into it.
    starts_s = starts_s[sound(epoch, starts_s, STRETCH_S)]
    time_s, values = velocity.time_s, velocity.values
    travelled = np.append(0.0, np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time_s)))
    pairs = (time_s, travelled), (time_s, values), (angle.time_s, angle.values)
    steps = [np.interp(starts_s + STRETCH_S, *one) - np.interp(starts_s, *one) for one in pairs]
    regressors = np.column_stack(steps[:2])
    lengths = np.linalg.norm(regressors, axis=0)
    if starts_s.size < 3 or not lengths.all():
        return math.nan, math.nan
    scale, delay_s = np.linalg.lstsq(regressors / lengths, steps[2])[0] / lengths
    return float(scale), float(delay_s)


def velocity_shape(epoch: Epoch, settings: Settings) -> list[Finding]:
    """Return whether the velocity follows the angle's derivative up to 10 Hz."""
    wanted, checks = ("torque_nm", "angle_rad", "velocity_rad_s"), settings.diagnostics
    channels = [epoch.channels[name] for name in wanted if name in epoch.channels]
    band = band_hz(epoch, settings.estimation)
    highest_hz = min(band[1], SHAPE_HIGH_HZ)
    if len(channels) < len(wanted) or highest_hz <= 2 * band[0]:
        return []
    holes_s = [one[:2] for one in epoch.left_out]
    try:
        grid = grid_of(channels, band, settings.estimation.trim_s, holes_s)
    except ValueError:
        return []  # too few lines
    torque, angle, velocity = (values_at(one, grid.time_s) for one in channels)
    by_angle, by_velocity = grid.lines(angle, 2), grid.lines(velocity, 1)
    slow = grid.line <= highest_hz * grid.duration_s
    follows = _r_squared(by_velocity[:, slow], by_angle[1, slow])
    value, most = 100.0 * math.sqrt(1.0 - follows), checks.max_velocity_shape_percent
    if not value > most:
        return []
    rest = {name: one for name, one in epoch.channels.items() if name != "angle_rad"}
    integral = angle_at(replace(epoch, channels=rest), grid.time_s)
    # It drifts, and does not know how far the joint went in what is left out.
    drifts = [grid.time_s - grid.time_s[0], *(grid.time_s > stop_s for _, stop_s in holes_s)]
    integrals, (target,) = grid.lines(np.stack([integral, *drifts]))[0], grid.lines(torque)
    shares = {
        "by_angle": _r_squared(by_angle, target),
        "by_velocity": _r_squared(np.concatenate([by_velocity, integrals]), target),
    }
    less, more = sorted(1.0 - share for share in shares.values())
    worse = "velocity" if shares["by_angle"] > shares["by_velocity"] else "angle"
    facts = {"low_hz": band[0], "high_hz": highest_hz, **shares}
    variant = worse if more > CLEARLY * less else ""
    return [found("velocity_shape", checks, value, most, facts=facts, variant=variant)]


def _r_squared(regressors: Complex, target: Complex) -> float:
    """Return which share of a target's power at the lines real multiples of regressors give."""
    whole = np.concatenate([target.real, target.imag])
    left = _left(np.concatenate([regressors.real, regressors.imag], axis=1).T, whole)
    power = float(whole @ whole)
    return 1.0 - float(left @ left) / power if power > 0 else math.nan


def static_torque(epoch: Epoch, settings: Settings) -> list[Finding]:
    """Return whether the torque is a function of the angle."""
    angle, torque = epoch.channels.get("angle_rad"), epoch.channels["torque_nm"]
    if angle is None:
        return []
    highest_hz, trim_s = band_hz(epoch, settings.estimation)[1], settings.estimation.trim_s
    used = [torque, *motion_channels(epoch)]
    rate_hz = grid_rate_hz(used, highest_hz)
    time_s = uniform_grid(used, rate_hz)
    inside = (time_s >= time_s[0] + trim_s) & (time_s <= time_s[-1] - trim_s)
    time_s = time_s[inside & sound(epoch, time_s, trim_s)]
    # Noise above the band is nobody's torque. A filter without overshoot keeps the function.
    length = max(round(rate_hz / (2.0 * highest_hz)), 1)
    posture, values = (
        scipy.ndimage.uniform_filter1d(np.interp(time_s, one.time_s, one.values), length)
        for one in (angle, torque)
    )
    steps, variance = np.diff(values[np.argsort(posture, kind="stable")]), float(np.var(values))
    value = 100.0 * float(np.mean(steps**2)) / (2.0 * variance) if variance > 0 else math.nan
    least = settings.diagnostics.min_static_torque_percent
    return _of(epoch, at_least("static_torque", settings.diagnostics, value, least))
