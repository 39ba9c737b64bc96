"""By how much two clocks differ, from a torque on one and the motion on the other.

The torque of a joint is J θ″ + B θ′ + K θ, so the share of it that least squares on the motion
explains is largest where the clocks agree. Units and the signs of both do not matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.reading.channels.looks import BAND_HZ, FEWEST
from rigidimeter.core.errors import UserError

Array = NDArray[np.float64]

HIGHEST_RATE_HZ = 250.0
LEAST_R_SQUARED = 0.5
RIVAL = 0.9
"""Another offset that explains so much of what the best does makes it ambiguous."""
_APART_S = 0.5
_EDGE_S = 3.0
_LEAST_OVERLAP = 0.5


@dataclass(frozen=True)
class Offset:
    """What is added to the motion's clock, with its standard error, and the torque it explains."""

    value_s: float
    error_s: float
    r_squared: float


def find_offset(
    torque: tuple[Array, Array], motion: tuple[Array, Array], *, is_angle: bool
) -> Offset:
    """Find the offset of two clocks.

    Parameters
    ----------
    torque, motion : (array, array)
        Time in s and values.
    is_angle : bool
        Whether the motion is an angle, and not a velocity.

    Raises
    ------
    UserError
        If no offset explains the torque, or several do.
    """
    slowest_s = max(float(np.median(np.diff(stamps))) for stamps, _ in (torque, motion))
    rate_hz = min(HIGHEST_RATE_HZ, 1.0 / slowest_s)
    high_hz = min(BAND_HZ[1], 0.2 * rate_hz)
    target, regressors = _grid(*torque, rate_hz), _motion(motion, rate_hz, is_angle=is_angle)
    if min(target.size, regressors.shape[1]) < FEWEST:
        raise UserError(f"--clock-offset found: needs {FEWEST} samples of torque and of motion")
    sos = scipy.signal.butter(2, [BAND_HZ[0], high_hz], "bandpass", fs=rate_hz, output="sos")
    target = scipy.signal.sosfiltfilt(sos, target - target.mean())
    regressors = scipy.signal.sosfiltfilt(sos, regressors - regressors.mean(axis=1, keepdims=True))
    # At the ends the filter was starting: those of the motion are then no torque of the joint.
    edge = min(int(_EDGE_S * rate_hz), target.size // 8, regressors.shape[1] // 8)
    target, regressors = target[edge:-edge], regressors[:, edge:-edge]
    lags, explained = _explained(target, regressors)
    best = int(np.argmax(explained))
    near = np.abs(lags - lags[best]) <= _APART_S * rate_hz
    if explained[best] < LEAST_R_SQUARED:
        raise UserError(
            f"--clock-offset found: at no offset the motion explains more than "
            f"{100 * explained[best]:.0f} % of the torque; give the offset in seconds"
        )
    if np.max(explained[~near], initial=0.0) > RIVAL * explained[best]:
        raise UserError(
            "--clock-offset found: several offsets explain the torque as well, as with a motion "
            "that repeats; give the offset in seconds"
        )
    starts_s = torque[0][0] - motion[0][0]
    at = np.arange(target.size) - lags[best]
    inside = (at >= 3) & (at <= regressors.shape[1] - 4)
    part, at = target[inside], at[inside]
    index = np.arange(regressors.shape[1])
    curves = [scipy.interpolate.CubicSpline(index, row) for row in regressors]

    def left(shift: float) -> Array:
        return _left(part, np.column_stack([curve(at - shift) for curve in curves]))

    found = scipy.optimize.minimize_scalar(
        lambda shift: float(np.sum(left(shift) ** 2)), bounds=(-1.5, 1.5), method="bounded",
        options={"xatol": 1e-4},
    )  # fmt: skip
    shift = float(found.x)
    residual, slope = left(shift), left(shift + 0.5) - left(shift - 0.5)
    free = max(2 * (high_hz - BAND_HZ[0]) / rate_hz * part.size - 4, 1.0)
    return Offset(
        float(starts_s + (lags[best] + shift) / rate_hz),
        _error(residual, slope) * np.sqrt((free + 4) / free) / rate_hz,
        1.0 - float(found.fun) / float(part @ part),
    )


def _error(residual: Array, slope: Array) -> float:
    """Return the standard error of a shift from what is left, and its slope over the shift.

    To first order the shift is wrong by Σ z e / Σ z², with z the slope and e the noise, of which
    the filter and the joint's own torque leave an uneven spectrum S. So the variance is
    Σ |Z|² S / (Σ z²)² over the frequencies, with the periodogram of what is left for S.
    """
    spectra = np.abs(scipy.fft.fft(slope) * scipy.fft.fft(residual)) ** 2
    return float(np.sqrt(np.sum(spectra)) / (slope @ slope)) / residual.size


def _grid(stamps: Array, values: Array, rate_hz: float) -> Array:
    count = int((stamps[-1] - stamps[0]) * rate_hz) + 1
    grid = stamps[0] + np.arange(count) / rate_hz
    return np.asarray(np.interp(grid, stamps, values), dtype=np.float64)


def _motion(motion: tuple[Array, Array], rate_hz: float, *, is_angle: bool) -> Array:
    """Return angle, velocity and acceleration, shape (3, n).

    A velocity from differences is too small by (ω h)²/6, which an offset of B h²/(6 J) makes up
    for; that of a spline is right to the fourth power.
    """
    values = _grid(*motion, rate_hz)
    values = values - values.mean()
    spline = scipy.interpolate.CubicSpline(np.arange(values.size) / rate_hz, values)
    angle = spline if is_angle else spline.antiderivative()
    return np.stack([angle(spline.x, order) for order in range(3)])


def _explained(target: Array, regressors: Array) -> tuple[NDArray[np.int_], Array]:
    """Return, for each whole shift of the motion, the share of the torque that it explains."""
    n, m = target.size, regressors.shape[1]
    size = scipy.fft.next_fast_len(n + m)
    spectrum = scipy.fft.rfft(target, size)
    crossed = scipy.fft.irfft(spectrum * np.conj(scipy.fft.rfft(regressors, size)), size)
    lags = np.arange(-m + 1, n)
    crossed = crossed[:, lags]  # negative lags from the end
    gram = np.linalg.inv(regressors @ regressors.T)
    start, stop = np.maximum(lags, 0), np.minimum(lags + m, n)
    power = np.concatenate([[0.0], np.cumsum(target**2)])
    shares = np.einsum("ik,ij,jk->k", crossed, gram, crossed)
    explained = shares / np.maximum(power[stop] - power[start], np.finfo(float).tiny)
    return lags, np.where(stop - start >= _LEAST_OVERLAP * min(n, m), explained, 0.0)


def _left(part: Array, moved: Array) -> Array:
    """Return the torque that the moved motion leaves."""
    moved = moved / np.linalg.norm(moved, axis=0)
    solution, *_ = np.linalg.lstsq(moved, part, rcond=None)
    return np.asarray(part - moved @ solution, dtype=np.float64)
