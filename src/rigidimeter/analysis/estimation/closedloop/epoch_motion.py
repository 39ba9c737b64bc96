"""The motion of an epoch at any times, with what is made for it once.

Where the drive is known it is in two parts: what the command causes, which is known at any time,
and what the sensors saw beyond that, which is interpolated between their samples.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy

from rigidimeter.analysis.estimation.closedloop.between_samples import without_driven
from rigidimeter.analysis.estimation.closedloop.drive_motion import DrivenAt
from rigidimeter.analysis.estimation.signals import Array, angle_at, sampled, spline, velocity_at
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.model import DriveModel


class EpochMotion:
    """The motion of an epoch; it does not change when the torque is moved in time.

    Parameters
    ----------
    epoch : Epoch
    drive : DriveModel or None
        That carried out the command, if it is known.
    """

    def __init__(self, epoch: Epoch, drive: DriveModel | None) -> None:
        self._epoch = epoch
        self._drive = drive
        self._splines: dict[str, scipy.interpolate.CubicSpline] = {}

    @cached_property
    def driven_at(self) -> DrivenAt | None:
        """What the command causes; None where drive or command are not known."""
        command = self._epoch.channels.get("velocity_command_rad_s")
        if self._drive is None or command is None:
            return None
        return DrivenAt(self._drive, command)

    @cached_property
    def beyond(self) -> Epoch:
        """The epoch with the motion that the command does not cause."""
        return (
            self._epoch if self.driven_at is None else without_driven(self._epoch, self.driven_at)
        )

    def beyond_at(self, time_s: Array, share: float) -> tuple[Array, Array]:
        """Return angle and velocity of `beyond` at the times.

        Parameters
        ----------
        time_s : array, shape (n,)
        share : float
            Of an interval: samples that are closer than this are taken as they are.
        """
        channels = self.beyond.channels
        angle, velocity = channels.get("angle_rad"), channels.get("velocity_rad_s")
        if angle is None or velocity is None:
            return angle_at(self.beyond, time_s), velocity_at(self.beyond, time_s)
        return self._values(angle, time_s, share), self._values(velocity, time_s, share)

    def _values(self, channel: Channel, time_s: Array, share: float) -> Array:
        """Return `signals.values_at`, of one spline for all times."""
        place = sampled(channel, time_s, share)
        if place is not None:
            return channel.values[place]
        if channel.name not in self._splines:
            self._splines[channel.name] = spline(channel)
        return np.asarray(self._splines[channel.name](time_s))
