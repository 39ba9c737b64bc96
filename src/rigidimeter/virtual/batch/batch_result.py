"""The recorded columns of many epochs as arrays, and each as an epoch for the estimation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.guard import Cause, why_ended
from rigidimeter.records import Channel, Epoch, Outcome
from rigidimeter.settings import Settings

__all__ = ["Batch"]


@dataclass(frozen=True)
class Batch:
    """PRBS epochs that each started from rest on a rig of its own.

    The columns have shape (epochs, ticks), the names and the values of a recorded session. An epoch
    that the guard ended has `ticks` entries; what comes after is NaN, and 0 in `limited`.

    Parameters
    ----------
    settings : Settings
    source : str
        Where the epochs say they come from.
    first : int
        Number of the first epoch, counted from 0.
    joints : tuple of JointDynamics
        The truth, one an epoch.
    conditions : tuple of str
    time_s : array, shape (ticks,)
        When each tick was due.
    perturbation_nm : array, shape (epochs, ticks)
    torque_nm, torque_time_s, angle_rad, velocity_rad_s, motion_time_s : array
        The newest samples at each tick, with their stamps.
    velocity_request_rad_s, velocity_command_rad_s : array
        What the controller asked for and what the guard let pass.
    limited : array of int8
        `guard.Limited` values.
    ticks, cause, limited_ticks : array of int, shape (epochs,)
        Entries of the epoch, `guard.Cause` value, commands that the guard changed.
    limit_time_s : array, shape (epochs,)
        When the position limit first held the command back; NaN if it never did.
    """

    settings: Settings
    source: str
    first: int
    joints: tuple[JointDynamics, ...]
    conditions: tuple[str, ...]
    time_s: NDArray[np.float64]
    perturbation_nm: NDArray[np.float64]
    torque_nm: NDArray[np.float64]
    torque_time_s: NDArray[np.float64]
    angle_rad: NDArray[np.float64]
    velocity_rad_s: NDArray[np.float64]
    motion_time_s: NDArray[np.float64]
    velocity_request_rad_s: NDArray[np.float64]
    velocity_command_rad_s: NDArray[np.float64]
    limited: NDArray[np.int8]
    ticks: NDArray[np.int64]
    cause: NDArray[np.int64]
    limit_time_s: NDArray[np.float64]
    limited_ticks: NDArray[np.int64]

    def __post_init__(self) -> None:
        for name, values in vars(self).items():
            if isinstance(values, np.ndarray):
                values = values.view()
                values.setflags(write=False)
                object.__setattr__(self, name, values)

    def __len__(self) -> int:
        return len(self.joints)

    def epoch(self, i: int) -> Epoch:
        """Return epoch `i` of this batch as reading it from a session would give it."""
        if not 0 <= i < len(self):
            raise IndexError(f"epoch {i} of a batch of {len(self)}")
        rows = slice(0, int(self.ticks[i]))
        time_s = self.time_s[rows]
        channels = [
            _fresh("torque_nm", self.torque_time_s[i, rows], self.torque_nm[i, rows]),
            _fresh("angle_rad", self.motion_time_s[i, rows], self.angle_rad[i, rows]),
            _fresh("velocity_rad_s", self.motion_time_s[i, rows], self.velocity_rad_s[i, rows]),
            Channel("velocity_command_rad_s", time_s, self.velocity_command_rad_s[i, rows]),
            Channel("perturbation_nm", time_s, self.perturbation_nm[i, rows]),
        ]
        why = why_ended(self.settings, Cause(int(self.cause[i])), float(self.limit_time_s[i]))
        prbs = self.settings.prbs
        return Epoch(
            source=self.source,
            label=str(self.first + i),
            channels={channel.name: channel for channel in channels},
            condition=self.conditions[i],
            task="prbs",
            excitation_hz=(prbs.wanted_low_hz, prbs.wanted_high_hz),
            closed=Outcome("excluded", why) if why else Outcome(),
            virtual=True,
        )


def _fresh(name: str, stamps_s: NDArray[np.float64], values: NDArray[np.float64]) -> Channel:
    """Return a channel with one entry for each sample: a held reading repeats its stamp."""
    fresh = np.concatenate(([True], np.diff(stamps_s) > 0))
    return Channel(name, stamps_s[fresh], values[fresh])
