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

from rigidimeter.analysis.estimation.checks import Pull, at_least, at_most, found, half_widths
from rigidimeter.analysis.estimation.checks.motion import WHOLE, hertz
from rigidimeter.analysis.estimation.grid import SAME_TIME, Array, Complex
from rigidimeter.analysis.estimation.observation import Observation
from rigidimeter.analysis.estimation.signals import (
    angle_at,
    band_hz,
    held_at,
    values_at,
    velocity_at,
)
from rigidimeter.analysis.estimation.solve import shortest
from rigidimeter.analysis.estimation.stretches import (
    motion_channels,
    moves,
    rest_of,
    sound,
    unmeasured,
)
from rigidimeter.core.findings import Effect, Fact, Finding
from rigidimeter.core.records import LOST_SAMPLES, Channel, Epoch, Fit, LeftOut
from rigidimeter.core.settings import DiagnosticsSettings
from rigidimeter.core.units import rad_from_deg

REACH = 2
"""Samples to each side: as far as a second difference of central differences reaches."""

ROWS, FEWEST_ROWS = 4000, 100
"""So many rows show whether a sum is exact; fewer than the second say nothing."""

STRETCH_S = 0.25

SHAPE_HIGH_HZ = 10.0
"""Above this the noise of a differentiated angle is no matter of shape."""

CLEARLY = 1.25
"""So many times as much of the torque must the worse motion leave unexplained to be called it."""


def sensors(seen: Observation, fit: Fit, pull: Pull) -> list[Finding]:
    """Return what sensors, loop and guard show of an epoch alone.

    A torque that was computed comes before channels: a binary one repeats its extremes too.
    """
    epoch, checks = seen.epoch, seen.settings.diagnostics
    findings = computed_torque(epoch, checks) + repeating(epoch, checks) + left_out(epoch, checks)
    return findings + loop(seen)


def computed_torque(epoch: Epoch, settings: DiagnosticsSettings) -> list[Finding]:
    """Return whether the torque is a sum of samples of the motion, or of the perturbation.

    Nothing is said of a simulation, whose sensors may be free of noise.
    """
    if epoch.virtual:
        return []
    sent = [one for name, one in epoch.channels.items() if name == "perturbation_nm"]
    causes = {"the motion": motion_channels(epoch), "the perturbation": sent}
    shares = {name: 100.0 * _not_a_sum(epoch, channels) for name, channels in causes.items()}
    origin = min(shares, key=lambda name: shares[name])
    # Infinite where there is nothing to compare it with.
    value, least = shares[origin], settings.min_computed_torque_percent
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
    columns, lags = [np.ones((1, at.size))], at + np.arange(-REACH, REACH + 1)[:, None]
    for one in channels:
        at_times = held_at if one.name == "perturbation_nm" else values_at
        columns.append(at_times(one, torque.time_s)[lags])
    target = torque.values[at] - np.mean(torque.values[at])
    return math.sqrt(_unexplained(np.concatenate(columns), target))


def _unexplained(regressors: Complex | Array, target: Complex | Array) -> float:
    """Return which share of a target's power real multiples of regressors, shape (k, m), leave."""
    lengths = np.linalg.norm(regressors, axis=1, keepdims=True)
    scaled = regressors / np.where(lengths > 0, lengths, 1.0)
    columns, whole = (np.concatenate([x.real, x.imag], axis=-1).T for x in (scaled, target))
    left = whole - columns @ np.linalg.lstsq(columns, whole, rcond=None)[0]
    return float(left @ left / (whole @ whole)) if np.any(whole) else math.nan


def repeating(epoch: Epoch, settings: DiagnosticsSettings) -> list[Finding]:
    """Return whether a channel was at the end of its range, or hung."""
    results: list[Finding] = []
    torque, found_now = epoch.channels["torque_nm"], unmeasured(epoch, settings)
    length_s = float(np.ptp(torque.time_s[[0, -1]]))
    limits = {"saturation": settings.max_saturated_percent, "frozen": settings.max_frozen_s}
    for name, most in limits.items():
        out = [one for one in epoch.left_out if one.check == name]
        spans = out or [one for one in found_now if one.check == name]
        if not spans:
            continue
        # The reason of a stretch begins with its channel.
        names = dict.fromkeys(one.reason.split()[0] for one in spans)
        value, start_s = max((one.stop_s - one.start_s, one.start_s) for one in spans)
        if name == "saturation":
            repeated_s = _seconds(spans) + len(spans) / torque.rate_hz
            value = 100.0 * repeated_s / len(names) / length_s
        facts: dict[str, Fact] = {"channel": " and ".join(names), "start_s": start_s}
        facts |= rest_of(epoch, out) if out else {}
        harmless = "left_out" if out else ""
        results.append(found(name, settings, value, most, facts=facts, harmless=harmless))
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


def loop(seen: Observation) -> list[Finding]:
    """Return ticks that never ran, commands that the guard changed, and the position limit."""
    epoch, ticks, checks = seen.epoch, seen.epoch.ticks, seen.settings.diagnostics
    results: list[Finding] = []
    if ticks is not None:
        if "velocity_command_rad_s" in epoch.channels:
            value, most = ticks.missed_percent, checks.max_missed_ticks_percent
            facts = {"missed": ticks.missed, "ticks": ticks.ran + ticks.missed, "late": ticks.late}
            more = {"facts": facts, "harmless": "followed" if seen.drive_known else ""}
            results += at_most("missed_ticks", checks, value, most, **more)
        value, most = 100.0 * ticks.limited / ticks.ran, checks.max_limited_percent
        results += at_most("guard_limited", checks, value, most)
    angle = epoch.channels.get("angle_rad")
    if angle is not None and epoch.excitation_hz is not None:  # of a session
        limit_deg, most = seen.settings.guard.position_limit_deg, checks.max_position_percent
        value = 100.0 * float(np.max(np.abs(angle.values))) / rad_from_deg(limit_deg)
        results += at_most("position_limit", checks, value, most, facts={"limit_deg": limit_deg})
    return results


def velocity(seen: Observation, fit: Fit, pull: Pull) -> list[Finding]:
    """Return whether the velocity has the scale of the angle, its time, and its shape.

    With the torque in time with the velocity B is K τ too low, which half its interval must hold,
    unless the velocity is not used.
    """
    if not {"angle_rad", "velocity_rad_s"} <= seen.epoch.channels.keys():
        return []
    time_s, (v, x) = seen.grid.coarse_time_s, seen.coarse
    travelled = scipy.integrate.cumulative_trapezoid(v, time_s, initial=0)
    n = max(round(STRETCH_S * seen.grid.rate_hz / seen.grid.step), 1)
    signals = np.stack([travelled, v, x])
    # Neither a stretch that is left out nor one that reaches into it.
    steps = (signals[:, n:] - signals[:, :-n])[:, sound(seen.epoch, time_s[:-n], STRETCH_S)]
    products = steps @ steps.T
    if steps.shape[1] < 3 or not np.all(np.diag(products) > 0):
        return []  # what does not move is found by other checks
    scale, delay_s = shortest(products[:2, :2], products[:2, 2]).tolist()
    checks, late_ms, half = seen.settings.diagnostics, 1e3 * delay_s / scale, half_widths(fit)
    value, most = 100.0 * abs(scale - 1.0), checks.max_velocity_scale_percent
    results = at_most("velocity_scale", checks, value, most, facts={"scale": scale})
    bias = np.array([0.0, 0.0 if seen.of_angle else -1e-3 * fit.value[2] * late_ms, 0.0])
    held_ms = abs(late_ms) * half[1] / max(abs(bias[1]), 1e-300)
    most = min(checks.max_velocity_delay_ms, float(held_ms))
    effect = Effect.of(bias, fit.value, half)
    if not abs(late_ms) <= most:
        results.append(found("velocity_delay", checks, late_ms, most, effect=effect))
    return results + velocity_shape(seen)


def velocity_shape(seen: Observation) -> list[Finding]:
    """Return whether the velocity follows the angle's derivative up to 10 Hz."""
    epoch, grid, checks = seen.epoch, seen.grid, seen.settings.diagnostics
    low_hz, high_hz = band_hz(epoch, seen.settings.estimation)
    highest_hz, (v, x) = min(high_hz, SHAPE_HIGH_HZ), seen.coarse
    slow, used = (hertz(grid) <= most_hz for most_hz in (highest_hz, high_hz))
    slope, own = grid.coarse_motion(x, v)[slow, 0], grid.coarse_motion(v, x)[slow, :2]
    value = 100.0 * math.sqrt(_unexplained(own.T, slope))
    most = checks.max_velocity_shape_percent
    if highest_hz <= 2 * low_hz or not value > most:
        return []
    rest = {name: one for name, one in epoch.channels.items() if name != "angle_rad"}
    integral = angle_at(replace(epoch, channels=rest), grid.time_s)
    # It drifts, and does not know how far the joint went in what is left out.
    drifts = [grid.time_s - grid.time_s[0], *(grid.time_s > one.stop_s for one in epoch.left_out)]
    by_angle = grid.lines(angle_at(epoch, grid.time_s), 2)
    by_velocity = grid.lines(velocity_at(epoch, grid.time_s), 1)
    by_velocity = np.concatenate([by_velocity, grid.lines(np.stack([integral, *drifts]))[0]])
    torque_nm = seen.torque_nm[used]
    left = [_unexplained(lines[:, used], torque_nm) for lines in (by_angle, by_velocity)]
    worse = "velocity" if left[0] < left[1] else "angle"
    facts: dict[str, Fact] = {"low_hz": low_hz, "high_hz": highest_hz}
    facts |= {"by_angle": 1.0 - left[0], "by_velocity": 1.0 - left[1]}
    variant = worse if max(left) > CLEARLY * min(left) else ""
    return [found("velocity_shape", checks, value, most, facts=facts, variant=variant)]


def static_torque(seen: Observation, fit: Fit, pull: Pull) -> list[Finding]:
    """Return whether the torque is a function of the angle."""
    channels, grid, checks = seen.epoch.channels, seen.grid, seen.settings.diagnostics
    if "angle_rad" not in channels:
        return []
    # Noise above the band is nobody's torque. Means without overshoot keep the function.
    highest_hz, kept = band_hz(seen.epoch, seen.settings.estimation)[1], grid.window[0] > WHOLE
    length = max(round(grid.rate_hz / (2.0 * highest_hz)), 1)
    posture, values = (
        scipy.ndimage.uniform_filter1d(values_at(one, grid.time_s, SAME_TIME), length)[kept]
        for one in (channels["angle_rad"], channels["torque_nm"])
    )
    values = values[np.argsort(posture, kind="stable")]
    variance = float(np.var(values))
    value = 50.0 * float(np.mean(np.diff(values) ** 2)) / variance if variance > 0 else math.nan
    return at_least("static_torque", checks, value, checks.min_static_torque_percent)
