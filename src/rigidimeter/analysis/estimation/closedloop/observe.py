"""From an epoch to its `Observation`: lines, loop, and what the perturbation does in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.between_samples import (
    INEXACT,
    Beyond,
    acceleration_beyond_slope,
    assumed_ticks_hz,
    beyond_samples,
    phases_s,
    step_kept_s,
    torque_filter_of,
)
from rigidimeter.analysis.estimation.closedloop.controller_used import (
    controller_used,
    loop_known,
    loop_shown,
)
from rigidimeter.analysis.estimation.closedloop.epoch_motion import EpochMotion
from rigidimeter.analysis.estimation.closedloop.excitation import Excitation, excitation
from rigidimeter.analysis.estimation.closedloop.grid import Grid, epoch_grid, grid_at
from rigidimeter.analysis.estimation.closedloop.observation import DENSE, Observation, epoch_lines
from rigidimeter.analysis.estimation.closedloop.recorded_perturbation import (
    closed_loop_obstacle,
    evenly,
    while_sampled,
    whole_periods,
)
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.screening import LEAST_BAND_RATIO
from rigidimeter.analysis.estimation.signals import Array, motion_channels
from rigidimeter.analysis.estimation.stretches import longest_part
from rigidimeter.core.records import Channel
from rigidimeter.core.settings import USABLE_FRACTION_OF_RATE
from rigidimeter.model import DriveModel, Loop

Complex = NDArray[np.complex128]

WIDER = 0.5, 1.4
"""Lines are also kept of a band whose edges are these times those of the fit."""


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
    return _observed(prepared, perturbation, grid, wider=wider, motion=motion)


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
    return _observed(part, perturbation, grid, periods)


def observe_motion(prepared: PreparedEpoch, motion: EpochMotion | None = None) -> Observation:
    """Return an epoch at all lines of the band, whatever perturbed it.

    `motion` and errors are as for `observe`.
    """
    if prepared.obstacle:
        raise ValueError(prepared.obstacle)
    return _observed(prepared, None, _grid(prepared, None, alone=True), motion=motion)


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
    periods: int = 1,
    *,
    wider: Grid | None = None,
    motion: EpochMotion | None = None,
) -> Observation:
    loop: Loop | None
    if perturbation is None:
        made, loop = None, controller_used(prepared) if loop_known(prepared) else None
    else:
        loop = loop_shown(prepared)
        made = _excitation(prepared, perturbation, loop, grid)
    torque_filter = torque_filter_of(prepared.settings.estimation)
    motion = motion_of(prepared) if motion is None else motion
    seen = epoch_lines(prepared.epoch, wider or grid, motion, torque_filter, noise=made is None)
    return replace(
        seen.on(grid),
        loop=loop,
        perturbation=perturbation,
        excitation=made,
        periods=periods,
        make_otherwise=partial(_otherwise, prepared),
    )


def _excitation(
    prepared: PreparedEpoch, perturbation: Channel, loop: Loop, grid: Grid
) -> Excitation:
    """Return `excitation`, which epochs with one perturbation and one layout share."""
    key = (
        loop,
        round((grid.time_s[0] - perturbation.time_s[0]) * 1e9),
        round(1e6 * perturbation.mean_rate_hz),
        grid.time_s.size,
        round(1e6 * grid.rate_hz),
        int(grid.line[0]),
        int(grid.line[-1]),
        prepared.epoch.left_out,
    )
    known: list[tuple[Array, Excitation]] = prepared.source.once(key, list)
    for values, made in known:
        if np.array_equal(values, perturbation.values):
            return made
    known.append((perturbation.values, excitation(perturbation, loop, grid)))
    return known[-1][1]


def _otherwise(prepared: PreparedEpoch, seen: Observation) -> list[Complex]:
    """Return what would add to the motion without a drive, and with others.

    One that tells a little less, the rivals, samples that kept step with the ticks where it may be
    the stamps that did not, and motion that the command does not cause as if it did.
    """
    found, sent, omega = prepared.source.drive, seen.sent, seen.grid.omega_rad_s
    torque_filter = torque_filter_of(prepared.settings.estimation)
    if found is None or sent is None:
        rig = prepared.settings.rig
        ticks_hz = assumed_ticks_hz(rig, prepared.epoch.channels["torque_nm"])
        beyond = acceleration_beyond_slope(rig, ticks_hz, torque_filter, omega)
        change = np.zeros_like(seen.motion)
        change[:, 0] = beyond * seen.motion[:, 1]
        return [np.zeros_like(change), change]

    interval_s, after_s = sent.interval_s, sent.after_s
    alone = "velocity_rad_s" not in prepared.epoch.channels

    def beyond_by(drive: DriveModel, late_s: float = sent.mean_s) -> Beyond:
        at = omega, interval_s, late_s
        return beyond_samples(drive, torque_filter, *at, angle_alone=alone)

    ours, velocity = beyond_by(found.model)
    changes = [-ours, -INEXACT * ours, *(beyond_by(rival).seen - ours for rival in found.rivals)]
    kept_s = step_kept_s(after_s, interval_s)
    if kept_s is not None:
        late = phases_s(after_s, interval_s).tolist()
        there = [beyond_by(found.model, late_s).seen for late_s in late]
        changes.append(beyond_by(found.model, kept_s).seen - np.mean(there, axis=0))
    more = ours * (seen.motion[:, 1:2] / velocity - sent.command)
    return [*(np.asarray(change * sent.command) for change in changes), more]
