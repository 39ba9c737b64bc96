"""One epoch as the methods of the closed loop see it: torque and motion at the lines of its grid.

The integrals of `grid` are sums over the samples of the torque, at the stamps of the torque: a
torque that was sampled at a point in time is held against the motion at that point. Where the
command is recorded and explains the velocity, the motion at those points is the motion that the
command causes, plus what the sensors saw beyond it; so neither slow sensors nor the ripple between
the ticks bias the fit (`drive_fit`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.between_samples import (
    TorqueFilter,
    beyond_samples,
    driven_behind,
    filtered,
    in_step,
)
from rigidimeter.analysis.estimation.closedloop.drive_motion import since_ticks
from rigidimeter.analysis.estimation.closedloop.epoch_motion import EpochMotion
from rigidimeter.analysis.estimation.closedloop.excitation import Excitation
from rigidimeter.analysis.estimation.closedloop.grid import SAME_TIME, Complex, Grid
from rigidimeter.analysis.estimation.signals import Array, motion_channels, sampled, values_at
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.model import Loop

DENSE = 16.0
"""Samples a cycle of the highest line from which half of them show the motion as well as all: an
acceleration near half the rate is then an angle 49 times smaller than at that line, or less."""


class Sent(NamedTuple):
    """The command of a drive that is known.

    Attributes
    ----------
    command : complex array, shape (m, 1)
        At the lines, as it was in force at the samples.
    interval_s : float
        Of the ticks.
    mean_s : float
        How long after a tick the samples came, on average.
    after_s : array
        How long after a tick each sample of the torque came, at its own stamp.
    """

    command: Complex
    interval_s: float
    mean_s: float
    after_s: Array


@dataclass(frozen=True, eq=False)
class Observation:
    """One epoch, ready.

    Attributes
    ----------
    grid : Grid
    torque_nm : complex array, shape (m,)
        At the lines.
    motion : complex array, shape (m, 3)
        Acceleration, velocity and angle.
    noise : complex array, shape (m, 3), or None
        Half the difference of what the even and the odd samples of the motion give, whose noise is
        independent; None where that was not wanted, or the motion lies between its samples.
    sent : Sent or None
    loop : Loop or None
        That the epoch ran in, by the settings and the drive that the recording shows; where the
        perturbation is not used also with the controller that it shows. None where no loop is
        known.
    perturbation : Channel or None
        At every tick; None where it is not used.
    excitation : Excitation or None
        What the perturbation does in the loop; None where it is not used.
    periods : int
        How often the perturbation repeats within the grid, so that only lines whose number is a
        multiple of it have power; 1 where it need not repeat.
    wider : Observation or None
        The same at the lines of a wider band.
    make_otherwise : callable
        Takes the observation and returns `otherwise`.
    """

    grid: Grid
    torque_nm: Complex
    motion: Complex
    noise: Complex | None = None
    sent: Sent | None = None
    loop: Loop | None = None
    perturbation: Channel | None = None
    excitation: Excitation | None = None
    periods: int = 1
    wider: Observation | None = None
    make_otherwise: Callable[[Observation], Sequence[Complex]] = lambda _: ()

    @property
    def excited(self) -> NDArray[np.bool_]:
        """The lines at which the perturbation has power, shape (m,)."""
        return np.asarray(self.grid.line % self.periods == 0)

    @property
    def drive_known(self) -> bool:
        """Whether what the drive does between the samples is known."""
        return self.sent is not None

    @cached_property
    def otherwise(self) -> Complex:
        """What would add to the motion at the lines, shape (k, m, 3).

        If the samples were taken as they are, and then with other drives that explain the velocity
        as well; where the drive is unknown, with that of the settings.
        """
        changes = self.make_otherwise(self)
        return np.stack(changes) if changes else np.empty((0, *self.motion.shape))

    def on(self, grid: Grid) -> Observation:
        """Return the epoch at the lines of a grid of the same samples within this one."""
        if grid is self.grid:
            return self
        first = int(grid.line[0] - self.grid.line[0])
        part = slice(first, first + grid.line.size)
        return replace(
            self,
            grid=grid,
            torque_nm=self.torque_nm[part],
            motion=self.motion[part],
            noise=None if self.noise is None else self.noise[part],
            sent=self.sent and self.sent._replace(command=self.sent.command[part]),
            wider=self,
        )


def epoch_lines(
    epoch: Epoch,
    grid: Grid,
    motion: EpochMotion,
    torque_filter: TorqueFilter | None = None,
    *,
    noise: bool = False,
) -> Observation:
    """Return torque and motion at the lines.

    Parameters
    ----------
    epoch : Epoch
    grid : Grid
        Of this epoch or one with the same stamps.
    motion : EpochMotion
        That of the epoch. Where its drive is known, what the command did between the samples is
        taken into account.
    torque_filter : TorqueFilter or None
        That the torque went through; the motion is sent through it too.
    noise : bool
        Whether `Observation.noise` is wanted.
    """
    stamped, time_s = epoch.channels["torque_nm"], grid.time_s
    moving = motion_channels(epoch)
    own = {
        one.name: one.values[place]
        for one in moving
        if (place := sampled(one, time_s, SAME_TIME)) is not None
    }
    angle, velocity = own.get("angle_rad"), own.get("velocity_rad_s")
    recorded = angle is not None and len(own) == len(moving)
    through = filtered(torque_filter, grid.omega_rad_s)
    caused: list[Array] = []
    if motion.driven_at is not None:
        command = motion.driven_at.command
        ticks, stamps_s = since_ticks(command, stamped.time_s, 0.0)
        if (place := sampled(stamped, time_s, SAME_TIME)) is not None:
            tick, after_s = ticks[place], stamps_s[place]
        else:
            tick, after_s = since_ticks(command, time_s, 0.0)
        interval_s, mean_s = 1.0 / command.mean_rate_hz, float(np.mean(after_s))
        recorded &= in_step(tick, after_s, interval_s)
        caused = [command.values[tick]]
        if not recorded:
            # At the stamps of the torque, and from there like the torque.
            caused += [
                values_at(Channel(stamped.name, stamped.time_s, part), time_s, SAME_TIME)
                for part in driven_behind(motion.driven_at, torque_filter, stamped)
            ]
    if not recorded:
        angle, velocity = motion.beyond_at(time_s, SAME_TIME)
    assert angle is not None  # where it is not recorded it is made
    torque = values_at(stamped, time_s, SAME_TIME)
    lines, *apart = through * spectra(grid, angle, velocity, halves=noise and recorded)
    noises = apart[0] if apart else None
    first, *others = grid.transform(np.stack([torque, *caused]))
    if motion.driven_at is None:
        return Observation(grid, first, lines, noises)
    sent = Sent(others[0][:, None], interval_s, mean_s, stamps_s)
    if recorded:
        at, alone = (grid.omega_rad_s, interval_s, mean_s), velocity is None
        drive = motion.driven_at.drive
        lines += sent.command * beyond_samples(drive, torque_filter, *at, angle_alone=alone).seen
    else:
        lines += np.stack(others[1:], axis=-1)
    return Observation(grid, first, lines, noises, sent)


def spectra(
    grid: Grid, angle_rad: Array, velocity_rad_s: Array | None, *, halves: bool = True
) -> Complex:
    """Return acceleration, velocity and angle (of which the velocity may be made) at the lines.

    The shape is (1 or 2, m, 3): `halves` are those of `Grid.transforms`.
    """
    if velocity_rad_s is None:
        found = grid.transforms(angle_rad, 2, halves=halves)[:, ::-1]
    else:
        fast = grid.transforms(velocity_rad_s, 1, halves=halves)[:, ::-1]
        found = np.concatenate([fast, grid.transforms(angle_rad, 0, halves=halves)], axis=1)
    return np.moveaxis(found, 1, -1)
