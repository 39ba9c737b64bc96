"""Whether angle and velocity belong together.

The velocity belongs to the angle in scale and in time. Over any stretch of length T, a velocity
that is g times too small and stamped τ too late obeys

    θ(t + T) − θ(t) = g ∫ v dt + τ (v(t + T) − v(t))

to the first order in τ, with the integral over the stretch. Both follow from one least-squares fit
over many stretches. Degrees for radians give g = 57.3 or 0.0175, a wrong sign gives g = −1; a
velocity that a filter made late gives τ.

What is left beyond scale and delay is a velocity of another shape: of another joint, with the
ripple of a tachometer, or an angle that slips. The equation is then fitted twice, with the motion
from the angle alone and from the velocity alone; the torque says which of them the joint made.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rigidimeter.analysis.estimation.bandlimited import bandlimited_signals, zero_phase_band
from rigidimeter.analysis.estimation.diagnostics.check_record import Case, Check, Look, at_most
from rigidimeter.analysis.estimation.least_squares import fit_inertia_damping_stiffness
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import (
    Array,
    grid_rate_hz,
    thinned,
    uniform_grid,
    values_and_slopes,
)
from rigidimeter.analysis.estimation.stretches import sound
from rigidimeter.core.findings import Effect
from rigidimeter.core.records import Epoch
from rigidimeter.core.settings import DiagnosticsSettings, EstimationSettings

SHAPE_HIGH_HZ = 10.0
"""Above this the noise of a differentiated angle is no matter of shape."""

CLEARLY = 1.25
"""So many times as much of the torque must the worse motion leave unexplained to be called it."""

EDGE_SAMPLES = 3
"""A spline feels the end of a stretch that is left out for so many samples."""

STRETCH_S = 0.25


def velocity_fit(epoch: Epoch) -> tuple[float, float]:
    """Return the scale g and the delay τ in s of the velocity against the angle.

    NaN where the epoch does not move or is too short.
    """
    angle, velocity = epoch.channels["angle_rad"], epoch.channels["velocity_rad_s"]
    low = max(angle.time_s[0], velocity.time_s[0])
    high = min(angle.time_s[-1], velocity.time_s[-1])
    starts = angle.time_s[(angle.time_s >= low) & (angle.time_s <= high - STRETCH_S)]
    # Neither a stretch that is left out nor one that reaches into it.
    starts = starts[sound(epoch, starts, STRETCH_S)]
    if starts.size < 3:
        return np.nan, np.nan
    time_s, values = velocity.time_s, velocity.values
    areas = 0.5 * (values[1:] + values[:-1]) * np.diff(time_s)
    travelled = np.concatenate(([0.0], np.cumsum(areas)))

    def over(of_s: Array, signal: Array) -> Array:
        after = np.interp(starts + STRETCH_S, of_s, signal)
        return np.asarray(after - np.interp(starts, of_s, signal), dtype=np.float64)

    regressors = np.column_stack([over(time_s, travelled), over(time_s, values)])
    scales = np.linalg.norm(regressors, axis=0)
    if not scales.all():
        return np.nan, np.nan
    solution = np.linalg.lstsq(regressors / scales, over(angle.time_s, angle.values))[0] / scales
    return float(solution[0]), float(solution[1])


def velocity_scale(fitted: tuple[float, float], settings: DiagnosticsSettings) -> Look:
    """Return by how much the velocity's scale is off, in %."""
    value = 100.0 * abs(fitted[0] - 1.0)
    return at_most(value, settings.max_velocity_scale_percent, scale=fitted[0])


def velocity_delay(case: Case) -> Look | None:
    """Return how late the velocity is against the angle, in ms; negative where it is early.

    With the torque in time with the velocity B is K τ too low, which half its interval must hold.
    """
    scale, delay_s = _fitted(case)
    if not np.isfinite([scale, delay_s]).all():
        return None
    late_s = delay_s / scale
    bias = np.array([0.0, -case.parameters[2] * late_s, 0.0])
    held_ms = 1e3 * abs(late_s) * case.half_widths[1] / max(abs(bias[1]), 1e-300)
    most = min(case.settings.max_velocity_delay_ms, float(held_ms))
    effect = Effect.of(bias, case.parameters, case.half_widths)
    return Look(1e3 * late_s, most, not abs(1e3 * late_s) <= most, effect=effect)


def velocity_shape(
    epoch: Epoch, band_hz: tuple[float, float], settings: DiagnosticsSettings
) -> Look | None:
    """Return what of the angle's derivative the velocity does not follow, in % of its rms.

    Both pass one band, which ends at 10 Hz. Scale and delay are other checks' business and are
    fitted first. None where the band is too narrow or nothing moves.
    """
    band = band_hz[0], min(band_hz[1], SHAPE_HIGH_HZ)
    angle, velocity = (
        thinned(epoch.channels[name], band[1]) for name in ("angle_rad", "velocity_rad_s")
    )
    rate_hz = grid_rate_hz([angle, velocity], band[1])
    time_s = uniform_grid([angle, velocity], rate_hz)
    trim = round(rate_hz)
    if band[0] <= 0 or band[1] <= 2 * band[0] or time_s.size < 4 * trim:
        return None
    kept = sound(epoch, time_s, 1.0)
    kept[:trim] = kept[time_s.size - trim :] = False
    signals = [values_and_slopes(angle, time_s)[1], *values_and_slopes(velocity, time_s)]
    # Lines across what is left out are not each other's slopes, and the band remembers for seconds.
    there = sound(epoch, time_s, EDGE_SAMPLES / rate_hz)
    signals[0] = np.where(there, signals[0], signals[1])
    derived, measured, changing = zero_phase_band(np.stack(signals), rate_hz, band)[:, kept]
    size = float(np.linalg.norm(derived))
    if not (size > 0 and np.any(measured)):
        return None
    regressors = np.column_stack([measured, changing])
    solution = np.linalg.lstsq(regressors, derived, rcond=None)[0]
    value = 100.0 * float(np.linalg.norm(derived - regressors @ solution)) / size
    most = settings.max_velocity_shape_percent
    if value <= most:
        return Look(value, most, False)
    by_angle = _r_squared(epoch, band_hz, "velocity_rad_s")
    by_velocity = _r_squared(epoch, band_hz, "angle_rad")
    facts = {
        "low_hz": band[0],
        "high_hz": band[1],
        "by_angle": by_angle,
        "by_velocity": by_velocity,
    }
    less, more = sorted((1.0 - by_angle, 1.0 - by_velocity))
    worse = "velocity" if by_angle > by_velocity else "angle"
    return Look(value, most, True, facts, worse if more > CLEARLY * less else "")


def _r_squared(epoch: Epoch, band_hz: tuple[float, float], without: str) -> float:
    channels = {name: c for name, c in epoch.channels.items() if name != without}
    low, high = band_hz
    settings = EstimationSettings().model_copy(
        update={"band_low_hz": low, "band_high_hz": high, "band_high_unknown_hz": high}
    )
    try:
        signals = bandlimited_signals(replace(epoch, channels=channels), settings)
        return fit_inertia_damping_stiffness(signals).r_squared
    except ValueError:
        return float("nan")  # that motion cannot tell J, B and K apart


def _fitted(case: Case) -> tuple[float, float]:
    if case.prepared is None:
        return velocity_fit(case.epoch)
    return case.prepared.once(_velocity_fit)


def _velocity_fit(prepared: PreparedEpoch) -> tuple[float, float]:
    return velocity_fit(prepared.epoch)


def _velocity_scale(case: Case) -> Look | None:
    fitted = _fitted(case)
    # What does not move is found by other checks.
    return velocity_scale(fitted, case.settings) if np.isfinite(fitted).all() else None


MOTION_CHECKS = (
    Check(
        "velocity_scale",
        ("angle_rad", "velocity_rad_s"),
        _velocity_scale,
        of_fit=False,
    ),
    Check("velocity_delay", ("angle_rad", "velocity_rad_s"), velocity_delay),
    Check(
        "velocity_shape",
        ("angle_rad", "velocity_rad_s"),
        lambda c: velocity_shape(c.epoch, c.signals.band_hz, c.settings),
        of_fit=False,
    ),
)
