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

from functools import partial

import numpy as np
from scipy import signal

from rigidimeter.analysis.estimation.closedloop.as_sampled import as_they_are
from rigidimeter.analysis.estimation.least_squares import POOLED_TEXT, fit_least_squares
from rigidimeter.analysis.estimation.method_record import Method
from rigidimeter.analysis.estimation.signals import (
    Array,
    Signals,
    motion_channels,
    uniform_grid,
    velocity_at,
)
from rigidimeter.analysis.estimation.stretches import sound
from rigidimeter.core.records import Channel, Epoch
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
    highpass = signal.butter(
        settings.published_highpass_order,
        settings.published_highpass_hz,
        "highpass",
        fs=rate_hz,
        output="sos",
    )
    angle = signal.sosfilt(highpass, angle)
    n = acceleration.size  # the last sample has no forward difference
    keep = sound(epoch, time_s[:n], settings.trim_s)
    return Signals(
        time_s=time_s[:n][keep],
        torque_nm=np.interp(time_s[:n][keep], torque.time_s, torque.values),
        acceleration_rad_s2=acceleration[keep],
        velocity_rad_s=velocity[:n][keep],
        angle_rad=angle[:n][keep],
        rate_hz=rate_hz,
        band_hz=(0.0, rate_hz / 2),
    )


def _held(command: Channel, time_s: Array) -> Array:
    """Return the command in force at each time: the last one sent, as the drive holds it."""
    # A tick of rounding must not turn a command into the one before.
    index = np.searchsorted(command.time_s, time_s + 1e-9, side="right") - 1
    return command.values[np.maximum(index, 0)]


PUBLISHED = Method(
    name="published",
    title="least squares as the paper prints it",
    needs=(),
    methods_text="by ordinary least squares in the time domain, as published",
    fit=partial(fit_least_squares, "published", published_signals, as_they_are, white=True),
    references=("paper",),
    signals=published_signals,
    intervals_text="Intervals take the residual for white and do not include bias",
    pooled_text=POOLED_TEXT,
    as_recorded=True,
    in_sensitivity=True,
)
