"""One epoch as the methods of the closed loop see it: its lines, and what perturbed it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.between_samples import (
    INEXACT,
    Beyond,
    acceleration_beyond_slope,
    beyond_samples,
    phases_s,
    step_kept_s,
    torque_filter_of,
)
from rigidimeter.analysis.estimation.closedloop.controller_used import (
    controller_used,
    loop_shown,
)
from rigidimeter.analysis.estimation.closedloop.epoch_motion import EpochMotion
from rigidimeter.analysis.estimation.closedloop.excitation import Excitation, excitation
from rigidimeter.analysis.estimation.closedloop.grid import Grid, epoch_grid, grid_at
from rigidimeter.analysis.estimation.closedloop.recorded_perturbation import (
    closed_loop_obstacle,
    evenly,
    while_sampled,
    whole_periods,
)
from rigidimeter.analysis.estimation.closedloop.spectral_lines import Lines, epoch_lines
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.screening import LEAST_BAND_RATIO
from rigidimeter.analysis.estimation.signals import motion_channels
from rigidimeter.analysis.estimation.stretches import longest_part
from rigidimeter.core.records import Channel
from rigidimeter.core.settings import USABLE_FRACTION_OF_RATE
from rigidimeter.model import DriveModel, Loop

Complex = NDArray[np.complex128]

DENSE = 16.0
"""Samples a cycle of the highest line from which half of them show the motion as well as all: an
acceleration near half the rate is then an angle 49 times smaller than at that line, or less."""

WIDER = 0.5, 1.4
"""Lines are also kept of a band whose edges are these times those of the fit."""


@dataclass(frozen=True, eq=False)
class Observation:
    """One epoch, ready.

    Attributes
    ----------
    lines : Lines
    perturbation : Channel or None
        At every tick; None where it is not used.
    excitation : Excitation or None
        What the perturbation does in the loop; None where it is not used.
    loop : Loop
        That the epoch ran in, by the settings and the drive that the recording shows; where the
        perturbation is not used also with the controller that it shows.
    excited : array of bool, shape (m,)
        The lines at which a periodic perturbation has power; all where it is not periodic.
    drive_known : bool
    wider : Lines or None
        Those of a wider band, for `band_sensitivity`.
    make_otherwise : callable
        Returns `otherwise`.
    """

    lines: Lines
    perturbation: Channel | None
    excitation: Excitation | None
    loop: Loop
    excited: NDArray[np.bool_]
    drive_known: bool = False
    wider: Lines | None = None
    make_otherwise: Callable[[], Sequence[Complex]] = tuple

    @cached_property
    def otherwise(self) -> Complex:
        """What would add to the motion at the lines, shape (k, m, 3).

        If the samples were taken as they are, and then with other drives that explain the velocity
        as well; where the drive is unknown, with that of the settings.
        """
        changes = self.make_otherwise()
        return np.stack(changes) if changes else np.empty((0, *self.lines.motion.shape))


def observe(prepared: PreparedEpoch, motion: EpochMotion | None = None) -> Observation:
    """Return an epoch at all lines of the band.

    Parameters
    ----------
    prepared : PreparedEpoch
    motion : EpochMotion, optional
        That of the epoch, where it was made already.

    Raises
    ------
    ValueError
        If the epoch cannot be used; the text says why.
    """
    perturbation = _perturbation(prepared)
    grid = _grid(prepared, None)
    band_hz, trim_s = _band_hz(prepared, WIDER), prepared.settings.estimation.trim_s
    wider = grid_at(grid.time_s, grid.rate_hz, band_hz, trim_s, prepared.epoch)
    everywhere = np.ones(grid.line.size, dtype=np.bool_)
    return _observed(prepared, perturbation, grid, everywhere, wider, motion)


def observe_periods(prepared: PreparedEpoch) -> Observation:
    """Return whole periods of an epoch, so that the perturbation is in some of the lines alone.

    Raises
    ------
    ValueError
        If the epoch cannot be used, or does not hold two whole periods; the text says why.
    """
    # A window with a hole would spread the excited lines over those between them.
    part = replace(prepared, epoch=longest_part(prepared.epoch))
    perturbation = _perturbation(part)
    known = while_sampled(perturbation, part.epoch.channels["torque_nm"])
    periods = 0

    def samples(available: int, rate_hz: float) -> int:
        nonlocal periods
        periods, count = whole_periods(known, rate_hz, available)
        return count

    grid = _grid(part, samples)
    return _observed(part, perturbation, grid, grid.line % periods == 0)


def observe_motion(prepared: PreparedEpoch, motion: EpochMotion | None = None) -> Observation:
    """Return an epoch at all lines of the band, whatever perturbed it.

    `motion` and errors are as for `observe`.
    """
    if prepared.obstacle:
        raise ValueError(prepared.obstacle)
    grid = _grid(prepared, None, alone=True)
    everywhere = np.ones(grid.line.size, dtype=np.bool_)
    return _observed(prepared, None, grid, everywhere, None, motion)


def motion_of(prepared: PreparedEpoch) -> EpochMotion:
    """Return the motion of an epoch, with the drive that its source shows."""
    command = prepared.epoch.channels.get("velocity_command_rad_s")
    found = prepared.source.drive if command is not None else None
    return EpochMotion(prepared.epoch, None if found is None else found.model)


def _perturbation(prepared: PreparedEpoch) -> Channel:
    obstacle = prepared.obstacle or closed_loop_obstacle(prepared.epoch)
    if obstacle:
        raise ValueError(obstacle)
    return evenly(prepared.epoch.channels["perturbation_nm"])


def _grid(
    prepared: PreparedEpoch,
    samples: Callable[[int, float], int] | None,
    *,
    alone: bool = False,
) -> Grid:
    band_hz, trim_s = _band_hz(prepared, alone=alone), prepared.settings.estimation.trim_s
    return epoch_grid(prepared.epoch, band_hz, trim_s, samples)


def _band_hz(
    prepared: PreparedEpoch, factors: tuple[float, float] = (1.0, 1.0), *, alone: bool = False
) -> tuple[float, float]:
    """Return the band, its edges times these factors as far as the rate allows.

    `alone` says whether the motion is its own instrument.
    """
    epoch, estimation = prepared.epoch, prepared.settings.estimation
    torque = epoch.channels["torque_nm"]
    limiting = [torque] if prepared.source.drive else [torque, *motion_channels(epoch)]
    slowest = min(channel.rate_hz for channel in limiting)
    low, high = estimation.band_low_hz, estimation.band_high_closed_loop_hz
    usable_hz = USABLE_FRACTION_OF_RATE * slowest
    if alone and not prepared.source.drive:
        # Higher, noise of the motion that no half of the samples shows would count as motion.
        usable_hz = min(usable_hz, max(slowest / DENSE, LEAST_BAND_RATIO * low))
    return factors[0] * low, min(factors[1] * high, usable_hz)


def _observed(
    prepared: PreparedEpoch,
    perturbation: Channel | None,
    grid: Grid,
    excited: NDArray[np.bool_],
    wider: Grid | None = None,
    motion: EpochMotion | None = None,
) -> Observation:
    epoch = prepared.epoch
    if perturbation is None:
        made, loop = None, controller_used(prepared)
    else:
        loop = loop_shown(prepared)
        key = (
            hashlib.sha256(perturbation.values.tobytes()).digest(),
            loop,
            round((grid.time_s[0] - perturbation.time_s[0]) * 1e9),
            grid.time_s.size,
            round(1e6 * grid.rate_hz),
            int(grid.line[0]),
            int(grid.line[-1]),
            prepared.epoch.left_out,
        )
        cause = perturbation
        made = prepared.source.once(key, lambda: excitation(cause, loop, grid))
    torque_filter = torque_filter_of(prepared.settings.estimation)
    motion = motion_of(prepared) if motion is None else motion
    everything = epoch_lines(epoch, wider or grid, motion, torque_filter, noise=made is None)
    lines = everything.on(grid)
    return Observation(
        lines,
        perturbation,
        made,
        loop,
        excited,
        lines.sent is not None,
        everything if wider is not None else None,
        partial(_otherwise, prepared, lines),
    )


def _otherwise(prepared: PreparedEpoch, lines: Lines) -> list[Complex]:
    """Return what would add to the motion without a drive, and with others.

    One that tells a little less, the rivals, samples that kept step with the ticks where it may be
    the stamps that did not, and motion that the command does not cause as if it did.
    """
    epoch, found, sent = prepared.epoch, prepared.source.drive, lines.sent
    omega = lines.grid.omega_rad_s
    torque_filter = torque_filter_of(prepared.settings.estimation)
    if found is None or sent is None:
        beyond = acceleration_beyond_slope(prepared.settings.rig, torque_filter, omega)
        change = np.zeros_like(lines.motion)
        change[:, 0] = beyond * lines.motion[:, 1]
        return [np.zeros_like(change), change]

    def seen(drive: DriveModel, after_s: float = sent.after_s) -> Beyond:
        return beyond_samples(drive, torque_filter, omega, sent.interval_s, after_s)

    ours, velocity = seen(found.model)
    changes = [-ours, -INEXACT * ours, *(seen(rival).seen - ours for rival in found.rivals)]
    command = epoch.channels["velocity_command_rad_s"]
    stamps_s = epoch.channels["torque_nm"].time_s
    kept_s = step_kept_s(command, stamps_s)
    if kept_s is not None:
        there = [seen(found.model, late_s).seen for late_s in phases_s(command, stamps_s).tolist()]
        changes.append(seen(found.model, kept_s).seen - np.mean(there, axis=0))
    more = ours * (lines.motion[:, 1:2] / velocity - sent.command)
    return [*(np.asarray(change * sent.command) for change in changes), more]
