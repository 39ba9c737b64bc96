"""Linear least squares in time, and the paper's estimator as it is printed.

The regressors are scaled to unit length and factorised by singular values; AᵀA is never formed, so
the condition number is not squared, and a motion that cannot distinguish the parameters shows as a
large condition number instead of as a confident wrong answer. Textbook standard errors take the
residual for white, σ² (AᵀA)⁻¹.

The published method (Sec. 2.4.4, Eq. 6), at the torque's own times:

- velocity: the one *commanded* to the drive,
- acceleration: its forward difference, (θ'(t+Δt) − θ'(t)) / Δt,
- position: its running sum, θ(t+Δt) = θ'(t+Δt) Δt + θ(t) with θ(0) = 0, then a Butterworth
  high-pass at 0.20 Hz *on the position alone*,
- torque: as measured, at the time at which the sensor took it; the command is that in force then.

Eq. 6 row by row would pair each torque with the command of the tick that read it. On the virtual
rig, where a torque is 1 ms old by then, the J found here is 13 % larger and B 11 % smaller; with
the paper's rates and 0.05 N·m of the subject's own torque J is 15 % larger.

It is kept as printed so that the paper can be reproduced. High-passing one regressor and not the
torque breaks Eq. 3, which biases the stiffness in the closed loop; `bandlimited` does not do that.
The paper gives neither order nor direction of the filter: here second order and causal by default.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.checks import found
from rigidimeter.analysis.estimation.drive import Drive, since_ticks
from rigidimeter.analysis.estimation.methods import Ready
from rigidimeter.analysis.estimation.signals import (
    Array,
    Signals,
    angle_range_rad,
    bandlimited_signals,
    butterworth,
    held_at,
    joined,
    lines_inside,
    motion_channels,
    uniform_grid,
    velocity_at,
)
from rigidimeter.analysis.estimation.solve import of_fit, smoother
from rigidimeter.analysis.estimation.stretches import bridged, obstacle, sound
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Epoch, Fit, Outcome
from rigidimeter.core.settings import EstimationSettings, Settings
from rigidimeter.model import ON_EDGE, DriveModel

LARGEST_CONDITION_NUMBER = 1e6
"""Beyond this named columns agree to six digits, more than any sensor knows."""

LOW = 0.01
"""In rad a tick: slow enough that what sampling does no longer depends on it."""


class LeastSquares(NamedTuple):
    """What minimises |target − A · values|.

    Attributes
    ----------
    values : array, shape (p,)
        Not finite where columns are linearly dependent, as the rest.
    inverse : array, shape (p, p)
        (AᵀA)⁻¹.
    condition_number : float
        Of A, each column scaled to unit length.
    """

    values: Array
    inverse: Array
    condition_number: float


def least_squares(columns: Array, target: Array, names: Sequence[str] = ()) -> LeastSquares:
    """Return the least-squares solution of columns, shape (n, p), for a target, shape (n,).

    Raises
    ------
    ValueError
        If the columns have names and one is zero, or the data cannot distinguish two; the text
        names them.
    """
    lengths = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(lengths > 0, lengths, 1.0)
    left, singular, right = np.linalg.svd(scaled, full_matrices=False)
    for name, length in zip(names, lengths, strict=bool(names)):
        if not length > 0:
            raise ValueError(f"{name} is zero throughout: this motion holds no information on it")
    if names and len(columns) <= len(names):
        raise ValueError(
            f"{len(columns)} independent samples are too few for {len(names)} parameters"
        )
    if names and singular[-1] * LARGEST_CONDITION_NUMBER < singular[0]:
        share = np.abs(right[-1])
        alike = [name for name, one in zip(names, share, strict=True) if one > 0.2 * share.max()]
        raise ValueError(
            f"the motion cannot distinguish {', '.join(alike[:-1])} and {alike[-1]}; leave one of "
            "them out"
        )
    with np.errstate(divide="ignore", invalid="ignore"):
        back = right.T / singular / lengths[:, None]
        return LeastSquares(back @ (left.T @ target), back @ back.T, singular[0] / singular[-1])


def fit_inertia_damping_stiffness(signals: Signals, inertia_kg_m2: float | None = None) -> Fit:
    """Fit Eq. 6, or Eq. 7 when the inertia is given.

    Parameters
    ----------
    signals : Signals
        Torque and motion on one grid.
    inertia_kg_m2 : float, optional
        Hold J at this value and fit B and K alone; its standard error is then 0.

    Returns
    -------
    Fit
        Without the names of source, epoch, condition and method.

    Raises
    ------
    ValueError
        If the regressors are rank deficient: the motion cannot distinguish the parameters.
    """
    torque = target = signals.torque_nm
    regressors = signals.motion
    if inertia_kg_m2 is not None:
        target = torque - inertia_kg_m2 * regressors[:, 0]
        regressors = np.ascontiguousarray(regressors[:, 1:])
    if not np.all(np.any(regressors, axis=0)):
        raise ValueError("a regressor is zero throughout")
    solved = least_squares(regressors, target)
    if not solved.condition_number < 1 / (target.size * float(np.finfo(np.float64).eps)):
        raise ValueError(
            "the motion cannot distinguish J, B and K: its regressors are linearly dependent"
        )
    residual = target - regressors @ solved.values
    degrees = float(residual.size - solved.values.size)
    covariance = float(residual @ residual) / degrees * solved.inverse
    bound = _bound(signals, regressors, residual)
    total = float(np.sum((torque - torque.mean()) ** 2))
    return Fit(
        *("", "", "", "", Outcome()),
        **of_fit(solved.values, covariance, degrees, bound, inertia_kg_m2),
        r_squared=1.0 - float(residual @ residual) / total,
        vaf_percent=100.0 * (1.0 - float(np.var(residual)) / float(np.var(torque))),
        condition_number=float(solved.condition_number),
        residual_sd_nm=float(np.std(residual)),
        n_samples=torque.size,
        band_hz=signals.band_hz,
    )


def _bound(signals: Signals, regressors: Array, residual: Array) -> Array:
    """Return the Cramér–Rao bound on the standard errors, for the power of the residual.

    Line by line the noise is independent, so the information is 4 Σ X_kᴴ X_k / (n · rate · S_k)
    with S_k its one-sided density in N²m²/Hz.
    """
    n, rate_hz = residual.size, signals.rate_hz
    inside = lines_inside(scipy.fft.rfftfreq(n, 1.0 / rate_hz), signals.band_hz)
    # A one-sided density holds both sides of a line, but at half the rate there is one.
    sides = np.where(2 * inside == n, 1.0, 2.0)
    density = sides / (n * rate_hz) * np.abs(scipy.fft.rfft(residual)[inside]) ** 2
    density = smoother(inside, 1)(density)
    if not np.all(density > 0):
        return np.zeros(regressors.shape[1])  # nothing was left: the channels are exact
    lines = scipy.fft.rfft(np.ascontiguousarray(regressors.T))[:, inside].T
    matrix = (sides / np.sqrt(n * rate_hz * density))[:, None] * lines
    stacked = np.concatenate([matrix.real, matrix.imag])
    return np.sqrt(np.diag(least_squares(stacked, np.zeros(len(stacked))).inverse))


def published_signals(epoch: Epoch, settings: EstimationSettings) -> Signals:
    """Return the regressors and the torque of Eq. 6, at the rate of the torque channel.

    Where no command was recorded, the measured velocity stands in for it.

    Parameters
    ----------
    epoch : Epoch
        With `torque_nm` and `velocity_command_rad_s` (or a measured motion channel).
    settings : EstimationSettings
        For the high-pass filter.
    """
    torque = epoch.channels["torque_nm"]
    command = epoch.channels.get("velocity_command_rad_s")
    others = [command] if command is not None else motion_channels(epoch)
    rate_hz = torque.rate_hz
    time_s = uniform_grid([torque, *others], rate_hz)
    velocity = velocity_at(epoch, time_s) if command is None else held_at(command, time_s)
    dt = 1.0 / rate_hz
    # The sum starts from θ(0) = 0, so the first velocity does not enter it.
    angle = np.concatenate(([0.0], np.cumsum(velocity[1:]) * dt))
    order, edge_hz = settings.published_highpass_order, settings.published_highpass_hz
    angle = scipy.signal.sosfilt(butterworth(order, edge_hz, "highpass", rate_hz), angle)
    # The last sample has no forward difference.
    keep = np.flatnonzero(sound(epoch, time_s[:-1], settings.trim_s))
    torque_nm = np.interp(time_s[keep], torque.time_s, torque.values)
    acceleration = np.diff(velocity)[keep] / dt
    motion = acceleration, velocity[keep], angle[keep]
    return Signals(time_s[keep], torque_nm, *motion, rate_hz, (0.0, rate_hz / 2))


def fit_published(epochs: Sequence[Ready], inertia_kg_m2: float | None = None) -> Fit:
    """Return the fit of epochs, put one after the other, by the published method.

    Raises
    ------
    ValueError
        If the motion cannot distinguish the parameters.
    """
    parts = [published_signals(one.epoch, one.settings.estimation) for one in epochs]
    both, whole = list(zip(epochs, parts, strict=True)), joined(parts)
    power = sum(one.time_s.size * float(np.var(one.angle_rad)) for one in parts)
    ranges_rad = [angle_range_rad(ready.epoch, one.time_s) for ready, one in both]
    return replace(
        fit_inertia_damping_stiffness(whole, inertia_kg_m2),
        findings=_as_they_are(epochs[0]) if inertia_kg_m2 is None else (),
        angle_rms_rad=math.sqrt(power / whole.time_s.size),
        angle_range_rad=float(np.fmax.reduce(ranges_rad)),
    )


def _as_they_are(ready: Ready) -> tuple[Finding, ...]:
    """Return the finding if the drive shows that J comes out wrong from the samples as they are."""
    channels, settings = ready.epoch.channels, ready.settings.diagnostics
    command = channels.get("velocity_command_rad_s")
    if ready.drive is None or command is None:
        return ()
    after_s = since_ticks(command, channels["torque_nm"].time_s, 0.0)[1]
    seen = acceleration_seen(ready.drive.model, 1.0 / command.mean_rate_hz, after_s)
    percent, most = 100.0 * abs(1.0 - seen), settings.max_between_samples_percent
    if not percent > most:
        return ()
    facts = {"seen": 100.0 * seen, "side": "small" if seen < 1 else "large"}
    told = found("between_samples", settings, percent, most, facts=facts, variant="as_sampled")
    return (replace(told, condition=ready.epoch.condition),)


def acceleration_seen(drive: DriveModel, interval_s: float, after_s: Array) -> float:
    """Return the acceleration at the torque's samples as a share of its mean, at low frequency.

    Parameters
    ----------
    drive : DriveModel
    interval_s : float
        Of the ticks.
    after_s : array
        How long after a tick each sample came. Those that do not keep step with the ticks see the
        acceleration at many times, and ten stand for all.
    """
    times_s = np.mean(after_s, keepdims=True)
    if np.ptp(after_s) >= 2 * ON_EDGE * interval_s:
        times_s = np.quantile(after_s, np.linspace(0.05, 0.95, 10))
    omega = np.array([LOW / interval_s])
    z = np.exp(1j * omega * interval_s)
    seen = np.mean([drive.transfer(z, interval_s, one)[0] for one in times_s.tolist()], axis=0)
    turn = np.exp(-1j * omega * np.mean(times_s))
    return float((seen * turn / (1j * omega * drive.transfer(z, interval_s)[1])).real.item())


def epoch_signals(
    epoch: Epoch, settings: Settings, method: str, drive: Drive | None = None
) -> Signals:
    """Return the signals that a method fits, or what figures show of one that fits lines.

    Parameters
    ----------
    epoch : Epoch
    settings : Settings
    method : str
    drive : Drive, optional
        That the recording shows.

    Raises
    ------
    ValueError
        If the epoch cannot be fitted; the text says why.
    """
    if reason := obstacle(epoch, settings.estimation):
        raise ValueError(reason)
    epoch = bridged(epoch)
    if method == "published":
        return published_signals(epoch, settings.estimation)
    return bandlimited_signals(epoch, settings.estimation, drive)
