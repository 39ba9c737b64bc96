"""The paper's estimator as it is printed (Sec. 2.4.4, Eq. 6), at the torque's own times.

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

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from rigidimeter.analysis.estimation.amplitude import amplitude_of_signals, amplitude_together
from rigidimeter.analysis.estimation.closedloop.between_samples import acceleration_seen, phases_s
from rigidimeter.analysis.estimation.closedloop.between_uncertainty import NAME
from rigidimeter.analysis.estimation.closedloop.drive_motion import since_ticks
from rigidimeter.analysis.estimation.found import found
from rigidimeter.analysis.estimation.least_squares import fit_inertia_damping_stiffness
from rigidimeter.analysis.estimation.method_record import Method, Progress
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.screening import after_fit, unusable
from rigidimeter.analysis.estimation.signals import (
    Array,
    Signals,
    motion_channels,
    uniform_grid,
    velocity_at,
)
from rigidimeter.analysis.estimation.stretches import sound
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Channel, Epoch, Fit
from rigidimeter.core.settings import EstimationSettings
from rigidimeter.model import DriveModel


def published_signals(
    epoch: Epoch, settings: EstimationSettings, drive: DriveModel | None = None
) -> Signals:
    """Return the regressors and the torque of Eq. 6, at the rate of the torque channel.

    Where no command was recorded, the measured velocity stands in for it.

    Parameters
    ----------
    epoch : Epoch
        With `torque_nm` and `velocity_command_rad_s` (or a measured motion channel).
    settings : EstimationSettings
        For the high-pass filter.
    drive : DriveModel, optional
        Not used: the paper takes the samples as they are.
    """
    del drive
    torque = epoch.channels["torque_nm"]
    command = epoch.channels.get("velocity_command_rad_s")
    others = [command] if command is not None else motion_channels(epoch)
    rate_hz = torque.rate_hz
    time_s = uniform_grid([torque, *others], rate_hz)
    velocity = velocity_at(epoch, time_s) if command is None else _held(command, time_s)
    dt = 1.0 / rate_hz
    acceleration = np.diff(velocity) / dt
    # The sum starts from θ(0) = 0, so the first velocity does not enter it.
    angle = np.concatenate(([0.0], np.cumsum(velocity[1:]) * dt))
    highpass = scipy.signal.butter(
        settings.published_highpass_order,
        settings.published_highpass_hz,
        "highpass",
        fs=rate_hz,
        output="sos",
    )
    angle = scipy.signal.sosfilt(highpass, angle)
    n = acceleration.size  # the last sample has no forward difference
    keep = sound(epoch, time_s[:n], settings.trim_s)
    motion = acceleration[keep], velocity[:n][keep], angle[:n][keep]
    torque_nm = np.interp(time_s[:n][keep], torque.time_s, torque.values)
    return Signals(time_s[:n][keep], torque_nm, *motion, rate_hz, (0.0, rate_hz / 2))


def _held(command: Channel, time_s: Array) -> Array:
    """Return the command in force at each time: the last one sent, as the drive holds it."""
    # A tick of rounding must not turn a command into the one before.
    index = np.searchsorted(command.time_s, time_s + 1e-9, side="right") - 1
    return command.values[np.maximum(index, 0)]


def fit_published(
    epochs: Sequence[PreparedEpoch],
    inertia_kg_m2: float | None = None,
    progress: Progress = lambda _: None,
    pooled: bool = True,
) -> tuple[list[Fit], list[Fit]]:
    """Fit every epoch, and all epochs of a condition put one after the other.

    Parameters and values are those of `method_record.FitEpochs`.
    """
    fits: list[Fit] = []
    groups: dict[str, list[tuple[Fit, Signals]]] = {}
    for prepared in epochs:
        epoch = prepared.epoch
        try:
            signals = prepared.signals(published_signals)
            fitted = fit_inertia_damping_stiffness(signals, inertia_kg_m2)
        except ValueError as error:
            outcome = unusable(epoch, str(error))
            fits.append(Fit(epoch.source, epoch.label, epoch.condition, "published", outcome))
        else:
            outcome = after_fit(epoch, fitted.r_squared, fitted.condition_number)
            fit = replace(
                fitted,
                source=epoch.source,
                epoch=epoch.label,
                condition=epoch.condition,
                method="published",
                outcome=outcome,
                findings=as_they_are(prepared) if inertia_kg_m2 is None else (),
                **amplitude_of_signals(epoch, signals)._asdict(),
            )
            fits.append(fit)
            if outcome.included:
                groups.setdefault(epoch.condition, []).append((fit, signals))
        progress(1.0)
    if not pooled:
        return fits, []
    if len(groups) > 1:
        groups[""] = [member for members in groups.values() for member in members]
    return fits, [_pooled(name, own, inertia_kg_m2) for name, own in groups.items()]


def as_they_are(prepared: PreparedEpoch) -> tuple[Finding, ...]:
    """Return the finding if the drive shows that J comes out wrong from the samples as they are."""
    drive, epoch = prepared.source.drive, prepared.epoch
    command = epoch.channels.get("velocity_command_rad_s")
    if drive is None or command is None:
        return ()
    settings = prepared.settings.diagnostics
    interval_s = 1.0 / command.mean_rate_hz
    _, after_s = since_ticks(command, epoch.channels["torque_nm"].time_s, 0.0)
    seen = acceleration_seen(drive.model, interval_s, phases_s(after_s, interval_s))
    percent, most = 100.0 * abs(1.0 - seen), settings.max_between_samples_percent
    if not percent > most:
        return ()
    facts = {"seen": 100.0 * seen, "side": "small" if seen < 1 else "large"}
    finding = found(
        NAME, settings, percent, most, condition=epoch.condition, facts=facts, variant="as_sampled"
    )
    return (finding,)


def _pooled(
    condition: str, members: Sequence[tuple[Fit, Signals]], inertia_kg_m2: float | None
) -> Fit:
    fits, parts = zip(*members, strict=True)
    columns = ("time_s", "torque_nm", "acceleration_rad_s2", "velocity_rad_s", "angle_rad")
    together = replace(
        parts[0],
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in columns},
    )
    return replace(
        fit_inertia_damping_stiffness(together, inertia_kg_m2),
        source=", ".join(dict.fromkeys(fit.source for fit in fits)),
        epoch="pooled",
        condition=condition,
        method="published",
        findings=fits[0].findings,
        **amplitude_together(fits, [fit.n_samples for fit in fits])._asdict(),
    )


PUBLISHED = Method(
    name="published",
    title="least squares as the paper prints it",
    needs=(),
    methods_text="by ordinary least squares in the time domain, as published",
    fit=fit_published,
    references=("paper",),
    signals=published_signals,
    intervals_text="Intervals take the residual for white and do not include bias",
    pooled_text=(
        "The joint is taken for one that does not change, and where epochs differ by more than "
        "their own intervals these are too narrow"
    ),
    as_recorded=True,
    in_sensitivity=True,
)
