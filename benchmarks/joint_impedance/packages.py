"""What estimates J, B and K: ours, least squares, and packages by others.

Each takes the path of a recording and returns value, low and high of J, B and K, the status and a
reason. Nothing is tuned to a scenario: orders and rates were chosen on the first recording of
`relaxed`, the rates about a tenth of the sampling rate, since at 1000 samples/s the poles of a
joint lie too close to 1. A discrete model gives J, B and K by its frequency response from torque to
angle, to whose inverse K − J ω² + i B ω is fitted; these packages state no intervals of J, B and K.
"""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt
from scipy.stats import t as student

from benchmarks.joint_impedance.score import CAUTION, PARAMETERS, USED, WITHHELD

Array = NDArray[np.float64]
TRIM_S = 1.0
"""Left out at both ends, where filters begin and end."""

LOWPASS_HZ = 20.0
"""Twice the highest frequency of the perturbation; at most a fifth of the sampling rate."""

BAND_HZ = (0.3, 10.0)
"""Where the frequency response of a model is used: there is a perturbation there."""


class Estimate(NamedTuple):
    """Values and the ends of their 95 % intervals, each of shape (3,); NaN where there is none."""

    value: Array
    low: Array
    high: Array
    status: str = USED
    reason: str = ""


NONE = np.full(3, np.nan)


def ours(path: Path) -> Estimate:
    """`rm.estimate` on the file as it is."""
    import rigidimeter as rm

    (fit,) = rm.estimate(rm.read(path)).fits
    numbers = [np.array([getattr(fit, f"{name}{end}") for name in PARAMETERS], dtype=float)
               for end in ("", "_low", "_high")]  # fmt: skip
    cautions = sorted({one.name for one in fit.findings if one.level != "note"})
    if not fit.outcome.included:
        return Estimate(NONE, NONE, NONE, WITHHELD, fit.outcome.reason)
    return Estimate(*numbers, CAUTION if cautions else USED, " ".join(cautions))


class Sampled(NamedTuple):
    """Perturbation, torque and motion on one even clock, behind the same filter."""

    rate_hz: float
    perturbation: Array
    torque: Array
    angle: Array
    velocity: Array
    acceleration: Array

    @property
    def inside(self) -> slice:
        """Without what `TRIM_S` leaves out."""
        edge = round(TRIM_S * self.rate_hz)
        return slice(edge, -edge)


def sampled(path: Path, rate_hz: float | None = None) -> Sampled:
    """Read a recording; at the rate of its slowest sensor, or at most at the one given.

    Cubic splines through the samples are evaluated on the clock; the acceleration is the derivative
    of that of the velocity.
    """
    table = pd.read_csv(path)
    splines, spans_s, rates_hz = [], [], []
    for name in ("perturbation_nm", "torque_nm", "angle_rad", "velocity_rad_s"):
        there = table[name].notna().to_numpy()
        time_s = table["time_s"].to_numpy()[there]
        splines.append(CubicSpline(time_s, table[name].to_numpy()[there]))
        spans_s.append((time_s[0], time_s[-1]))
        rates_hz.append(1.0 / np.median(np.diff(time_s)))
    slowest_hz = min(rates_hz)
    start_s, stop_s = max(start for start, _ in spans_s), min(stop for _, stop in spans_s)
    clock_s = np.arange(start_s, stop_s, 1.0 / slowest_hz)
    sos = butter(4, min(LOWPASS_HZ, slowest_hz / 5.0), fs=slowest_hz, output="sos")
    every = 1 if rate_hz is None else max(1, round(slowest_hz / rate_hz))
    signals = (sosfiltfilt(sos, one(clock_s)) for one in (*splines, splines[-1].derivative()))
    return Sampled(slowest_hz / every, *(signal[::every] for signal in signals))


def _regressors(found: Sampled) -> tuple[Array, Array]:
    columns = (found.acceleration, found.velocity, found.angle, np.ones(found.angle.size))
    return np.column_stack(columns)[found.inside], found.torque[found.inside]


def least_squares(path: Path) -> Estimate:
    """Regression of the torque on acceleration, velocity and angle; the textbook's intervals."""
    X, y = _regressors(sampled(path))
    value, _, _, _ = np.linalg.lstsq(X, y)
    residual = y - X @ value
    free = y.size - X.shape[1]
    covariance = np.linalg.inv(X.T @ X) * (residual @ residual / free)
    half = student.ppf(0.975, free) * np.sqrt(np.diag(covariance))
    return Estimate(value[:3], (value - half)[:3], (value + half)[:3])


def hac(path: Path) -> Estimate:
    """The same by statsmodels, with the intervals of Newey and West over half a second."""
    from statsmodels.api import OLS

    found = sampled(path, 100.0)
    X, y = _regressors(found)
    lags = round(0.5 * found.rate_hz)
    fit = OLS(y, X).fit(cov_type="HAC", cov_kwds={"maxlags": lags, "use_correction": True})
    low, high = np.asarray(fit.conf_int(0.05)).T
    return Estimate(np.asarray(fit.params)[:3], low[:3], high[:3])


def instrumental(path: Path) -> Estimate:
    """Two-stage least squares by statsmodels: the perturbation of the last half second explains
    the motion, and that part of the motion the torque; the textbook's intervals.
    """
    from statsmodels.sandbox.regression.gmm import IV2SLS

    found = sampled(path, 100.0)
    X, y = _regressors(found)
    past = range(round(0.5 * found.rate_hz))
    lagged = np.column_stack([np.roll(found.perturbation, lag) for lag in past])[found.inside]
    fit = IV2SLS(y, X, np.column_stack([lagged, np.ones(y.size)])).fit()
    low, high = np.asarray(fit.conf_int(0.05)).T
    return Estimate(np.asarray(fit.params)[:3], low[:3], high[:3])


def sippy(path: Path) -> Estimate:
    """ARMAX of second order from the torque to the angle, by SIPPY."""
    from sippy_unipi import system_identification

    found = sampled(path, 100.0)
    torque, angle = (values[found.inside] for values in (found.torque, found.angle))
    with contextlib.redirect_stdout(io.StringIO()):
        model = system_identification(
            angle - angle.mean(),
            torque - torque.mean(),
            "ARMAX",
            ARMAX_orders=[2, 3, 2, 0],
            tsample=1.0 / found.rate_hz,
        )
    return _of_response(lambda z: np.asarray(model.G(z)).reshape(-1), found.rate_hz)


def nfoursid(path: Path) -> Estimate:
    """N4SID of sixth order from the perturbation to torque and angle, by nfoursid.

    The ratio of the two responses is that of the joint, also in a closed loop.
    """
    from nfoursid.nfoursid import NFourSID

    found = sampled(path, 50.0)
    signals = {"in": found.perturbation, "torque": found.torque, "angle": found.angle}
    table = pd.DataFrame(signals)[found.inside]
    table -= table.mean()
    size = table.std()
    subspace = NFourSID(table / size, ["torque", "angle"], ["in"], num_block_rows=20)
    subspace.subspace_identification()
    model, _ = subspace.system_identification(rank=6)

    def response(z: Array) -> Array:
        resolvent = np.linalg.inv(z[:, None, None] * np.eye(6) - model.a)
        torque, angle = ((model.c @ resolvent @ model.b) + model.d)[:, :, 0].T
        return np.asarray(angle * size["angle"] / (torque * size["torque"]))

    return _of_response(response, found.rate_hz)


def _of_response(response: Callable[[Any], Any], rate_hz: float) -> Estimate:
    """Fit K − J ω² + i B ω to the inverse of a response, weighted by its gain."""
    omega = 2.0 * np.pi * np.linspace(*BAND_HZ, 100)
    gain = response(np.exp(1j * omega / rate_hz))
    X = np.column_stack([-(omega**2), 1j * omega, np.ones(omega.size)]) * gain[:, None]
    ones = np.ones(omega.size, dtype=complex)
    stacked = np.vstack([X.real, X.imag]), np.concatenate([ones.real, ones.imag])
    return Estimate(np.linalg.lstsq(*stacked)[0], NONE, NONE)


PACKAGES: Mapping[str, Callable[[Path], Estimate]] = {
    "lstsq": least_squares,
    "statsmodels": hac,
    "statsmodels-iv": instrumental,
    "sippy-unipi": sippy,
    "nfoursid": nfoursid,
    "rigidimeter": ours,
}
"""By name, in the order of the table."""


def estimate(package: str, path: Path) -> Estimate:
    """Return the estimate of a package; what it raises is a reason to withhold."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return PACKAGES[package](path)
        except ImportError:
            raise
        except Exception as error:
            return Estimate(NONE, NONE, NONE, WITHHELD, f"{type(error).__name__}: {error}")
