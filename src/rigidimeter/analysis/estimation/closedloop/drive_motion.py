"""The motion that a recorded command causes, at any times."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.records import Channel
from rigidimeter.model import ON_EDGE, SAME_TIME_S, ArmMotion, DriveModel, HeldCommand

UNEVEN = 1e-3
"""Ticks that differ by less than this share of one came evenly."""


def driven(drive: DriveModel, command: Channel, time_s: Array) -> ArmMotion:
    """Return the motion under a recorded command, from rest, at any times; exact between ticks."""
    return DrivenAt(drive, command)(time_s)


class DrivenAt:
    """The motion under a recorded command; channels of the same stamps have it computed once."""

    def __init__(self, drive: DriveModel, command: Channel) -> None:
        self.drive, self.command = drive, command
        self._made: list[tuple[Array, ArmMotion]] = []

    @cached_property
    def _held(self) -> HeldCommand:
        return HeldCommand(self.drive, self.command.values, lengths_s(self.command))

    def __call__(self, time_s: Array) -> ArmMotion:
        """Return `driven` at the times."""
        for own_s, motion in self._made:
            if np.array_equal(own_s, time_s):
                return motion
        motion = self._held.motion(*since_ticks(self.command, time_s, self.drive.delay_s))
        self._made.append((time_s, motion))
        return motion


def lengths_s(command: Channel) -> float | Array:
    """Return the time from each tick to the next, shape (n - 1,); one number if all came evenly."""
    interval_s = 1.0 / command.mean_rate_hz
    even_s = command.time_s[0] + interval_s * np.arange(len(command))
    if np.ptp(command.time_s - even_s) <= UNEVEN * interval_s:
        return interval_s
    return np.diff(command.time_s)


def since_ticks(
    command: Channel, time_s: Array, delay_s: float, even: float = ON_EDGE
) -> tuple[NDArray[np.intp], Array]:
    """Return the last tick whose command acts at the times, and for how long it has."""
    # From the first tick on: on a clock that counts from 1970 a delay is below the rounding.
    origin_s, interval_s = command.time_s[0], 1.0 / command.mean_rate_hz
    ticks_s = command.time_s - origin_s
    then_s = (time_s - origin_s) - delay_s
    # A stamp that is a rounding error early belongs to the tick it names.
    near_s = max(even * interval_s, SAME_TIME_S)
    tick = _last_before(ticks_s, then_s + near_s, interval_s)
    after_s = np.maximum(then_s - ticks_s[tick], 0.0)
    after_s[after_s < near_s] = 0.0
    return tick, after_s


def _last_before(ticks_s: Array, time_s: Array, interval_s: float) -> NDArray[np.intp]:
    """Return the last tick that is no later than each time, or the first tick.

    Where ticks came evenly a division tells; the others are searched for.
    """
    edges_s = np.concatenate(([-np.inf], ticks_s[1:], [np.inf]))
    tick = np.clip(time_s / interval_s, 0, ticks_s.size - 1).astype(np.intp)
    other = (time_s < edges_s[tick]) | (time_s >= edges_s[tick + 1])
    if np.any(other):
        tick[other] = np.searchsorted(edges_s, time_s[other], side="right") - 1
    return tick
