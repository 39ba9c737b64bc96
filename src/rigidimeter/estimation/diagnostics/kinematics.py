"""Whether the velocity belongs to the angle: in scale and in time.

Over any stretch of length T, a velocity that is g times too small and stamped τ too late obeys

    θ(t + T) − θ(t) = g ∫ v dt + τ (v(t + T) − v(t))

to the first order in τ, with the integral over the stretch. Both follow from one least-squares fit
over many stretches. Degrees for radians give g = 57.3 or 0.0175, a wrong sign gives g = −1; a
velocity that a filter made late gives τ.
"""

from __future__ import annotations

import numpy as np

from rigidimeter.estimation.diagnostics.finding_text import judged
from rigidimeter.estimation.signals import Array
from rigidimeter.records import Epoch, Finding
from rigidimeter.settings import DiagnosticsSettings

__all__ = ["velocity_delay", "velocity_fit", "velocity_scale"]

STRETCH_S = 0.25


def velocity_fit(epoch: Epoch) -> tuple[float, float]:
    """Return the scale g and the delay τ in s of the velocity against the angle.

    NaN where the epoch does not move or is too short.
    """
    angle, velocity = epoch.channels["angle_rad"], epoch.channels["velocity_rad_s"]
    low = max(angle.time_s[0], velocity.time_s[0])
    high = min(angle.time_s[-1], velocity.time_s[-1])
    starts = angle.time_s[(angle.time_s >= low) & (angle.time_s <= high - STRETCH_S)]
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


def velocity_scale(fitted: tuple[float, float], settings: DiagnosticsSettings) -> Finding:
    """Return by how much the velocity's scale is off, in %."""
    value, most = 100.0 * abs(fitted[0] - 1.0), settings.velocity_scale_most_percent
    return judged(
        "velocity_scale",
        value,
        most,
        settings,
        failed=not value <= most,
        fact=(
            f"angle_rad changes {fitted[0]:.3g} times as much as velocity_rad_s says (within "
            f"{most:g} % of 1)"
        ),
        meaning="one of them is in another unit, has another sign, or is another joint's",
        remedy="check the units and signs of both channels",
    )


def velocity_delay(fitted: tuple[float, float], settings: DiagnosticsSettings) -> Finding:
    """Return how late the velocity is against the angle, in ms; negative where it is early."""
    scale, delay_s = fitted
    value, most = 1e3 * delay_s / scale, settings.velocity_delay_most_ms
    return judged(
        "velocity_delay",
        value,
        most,
        settings,
        failed=not abs(value) <= most,
        fact=f"velocity_rad_s is {value:.2g} ms late against angle_rad (at most {most:g} ms)",
        meaning="a filter or a buffer moved one of them, and B and K take each other's part",
        remedy="correct the stamps, or leave velocity_rad_s out: it is made from the angle then",
    )
