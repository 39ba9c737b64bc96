"""The drive between command and motion, identified from the recording itself.

What the drive does between the samples of the velocity follows from how it answers at the samples:
the command is held from tick to tick, and the poles that the samples show go on between them. It
matters because a torque that is sampled at the ticks sees the acceleration at the ticks, not its
mean: with a drive of second order and 50 Hz at 1 kHz it is 0.8 % smaller than the samples of the
velocity suggest, with a PI drive 14 %, and all of that would be taken from J.

Drives of two poles and more are fitted, each with two zeros fewer than poles (it smooths the steps
of the command) and with one fewer (its acceleration jumps at them), until past commands explain no
more of what is left of the velocity. The simplest that explains it as well as the best is taken.

Its rivals are the others that do, and its own neighbours (`drive_search`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.estimation.closedloop.drive_answer import (
    TINY,
    FittedDrive,
    Samples,
    answer,
    coordinates,
    from_angle,
    mean_interval_s,
    measured_velocity,
    velocities,
)
from rigidimeter.analysis.estimation.closedloop.drive_motion import since_ticks
from rigidimeter.analysis.estimation.closedloop.drive_search import (
    RUBBED,
    best_drive,
    neighbours,
    power_of,
    searched,
)
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.analysis.estimation.stretches import sound
from rigidimeter.analysis.estimation.uncertainty import correlation_samples
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.model import DriveModel

BANDWIDTHS = tuple(2.0**-n for n in range(6))
"""Of the drive that the search begins at, in times that of the settings."""

MOST_POLES = 4
"""A velocity PI has two; a lag and a position loop add one each."""

LAGS_TICKS = (0, *sorted(step << octave for octave in range(13) for step in (2, 3)))
"""Edges of stretches of the command, ever longer the longer ago."""

WORTH = 0.02
"""A further pole is worth a try where past commands explain this share of what is left."""

AS_GOOD = 1.05
"""A drive that leaves no more than this many times the power of the best explains as well."""

RIVAL, COLOURED = 4.0, 2.0
"""If what the best leaves is not noise, alike over so many samples, one that leaves so many times
its power might be there."""

UNLIKELY = 6.0
"""Where it is noise, a drive whose information criterion is above the best by more (Kass and
Raftery 1995: strong evidence against it) does not explain as well. Its power alone does not say so:
a larger drive always leaves less of the noise."""

SLOW = 1.0
"""In rad a tick: where a pole is faster the samples hardly show how many there are, and all that
explain as well are rivals."""

UNSEEN = 2e-5
"""Drives that leave no more than this share of the velocity's SD are alike."""

QUIET, RUBS = 3e-4, 0.8
"""What is left below this share of the velocity's SD needs no friction, which must bring its power
down to this share."""

SIGNS = 3
"""So many times the sign of the velocity is made from the drive, and the drive from the sign."""

NOISY = 0.01
"""Where a velocity leaves noise above this share of its SD, the angle may show the drive better."""

LARGEST_MISFIT = 0.1
"""Above this share of the velocity's standard deviation the command does not explain it."""

FEWEST_SAMPLES, MOST_SAMPLES, MOST_TICKS = 50, 3000, 8000
"""Of the velocity, and of command and angle; more do not make a drive known any better that is not
quite linear."""

SETTLED_S = 0.3
"""An epoch may begin in motion, and the model begins at rest. After commands that are lost it is
also in a state that is not known."""

STAIRS, FINER = 0.5, 4
"""A command that was logged more slowly than it was sent goes on between its samples: if lines
between them, in so many steps, leave this share of what stairs leave, the stairs are not known."""


class FoundDrive(NamedTuple):
    """A drive that was identified.

    Attributes
    ----------
    model : DriveModel
        From command to velocity.
    rivals : tuple of DriveModel
        Others that explain the velocity as well.
    """

    model: DriveModel
    rivals: tuple[DriveModel, ...]


def fit_drive(epoch: Epoch, start: DriveModel) -> FoundDrive | None:
    """Identify the drive from command and motion; None where they do not show it.

    The motion is the velocity, or the angle where that is all there is or has less noise.

    Parameters
    ----------
    epoch : Epoch
    start : DriveModel
        Of second order, that of the settings.

    Returns
    -------
    FoundDrive or None
        None if the command was not recorded, if no drive explains the motion, or if the command
        seems to have been logged more slowly than it was sent, which a loop of ours does
        not do.
    """
    velocity, angle = (epoch.channels.get(name) for name in ("velocity_rad_s", "angle_rad"))
    first, second = (velocity, angle) if velocity is not None else (angle, None)
    one = None if first is None else _identified(epoch, first, start)
    if one is None or second is None or not one.noise or one.power < NOISY**2:
        return one and one.drive
    other = _identified(epoch, second, start)
    return (other if other is not None and other.power < one.power else one).drive


class Identified(NamedTuple):
    """A drive, the power that it leaves of the motion, and whether that is noise."""

    drive: FoundDrive
    power: float
    noise: bool


def _identified(epoch: Epoch, motion: Channel, start: DriveModel) -> Identified | None:
    """Return the drive that one channel of the motion shows; None where it shows none."""
    samples = _samples(epoch, motion)
    if samples is None:
        return None
    start = _as_fast(samples, start)
    samples, found = _with_friction(samples, _climbed(samples, [start]), start)
    found = [one for one in found if one.seen]
    if not found:
        return None
    least = min(one.power for one in found)
    # A loop of ours logs each command that it sends.
    slowly = epoch.ticks is None and least > QUIET**2
    if slowly and _power_between_lines(samples, start) < STAIRS * least:
        return None
    times = AS_GOOD if samples.sign is None else RUBBED
    chosen = next(one for one in found if one.power <= times * least + UNSEEN**2)
    if chosen.power > LARGEST_MISFIT**2 or not 0.5 < chosen.model.gain < 2.0:
        return None
    left = min(found, key=power_of).left
    noise = correlation_samples(left[:, None]).item() < COLOURED
    most = (times if noise else RIVAL) * least + UNSEEN**2
    others = [one for one in found if one is not chosen and one.power <= most]
    fastest = max(map(abs, chosen.model.poles_rad_s))
    if noise and fastest * samples.interval_s < SLOW:
        likely = min(map(_information, found)) + UNLIKELY
        others = [one for one in others if _information(one) <= likely]
    rivals = [one.model for one in others]
    rivals += neighbours(chosen)
    if not noise:
        rivals += _of_halves(chosen)
    return Identified(FoundDrive(chosen.model, tuple(rivals)), chosen.power, noise)


def _information(one: FittedDrive) -> float:
    """Return n ln σ² + k ln n (Schwarz 1978), with k poles, numerator and delay."""
    n, k = one.left.size, one.place.size - 1 + one.numerator.size + (one.place[-1] > 0.0)
    return float(n * math.log(one.power + UNSEEN**2) + k * math.log(n))


def _of_halves(one: FittedDrive) -> Iterator[DriveModel]:
    """Yield the drive as each half of the samples has it: where it is not linear they differ."""
    samples, middle = one.samples, one.left.size // 2
    for part in (slice(middle), slice(middle, None)):
        half = replace(samples, time_s=samples.time_s[part], measured=samples.measured[part])
        yield searched(half, one.place, one.zeros, delayed=one.place[-1] > 0.0).model


def _as_fast(samples: Samples, start: DriveModel) -> DriveModel:
    """Return the drive of the bandwidth, up to that of `start`, that explains most."""
    models = [
        DriveModel(tuple(share * pole for pole in start.poles_rad_s), start.residues)
        for share in BANDWIDTHS
    ]
    places = [np.append(coordinates(one, samples.interval_s, 2), 0.0) for one in models]
    powers = [answer(samples, place, 0).power for place in places]
    return models[int(np.argmin(powers))]


def _climbed(samples: Samples, starts: Sequence[DriveModel]) -> list[FittedDrive]:
    """Return ever larger drives, up to where past commands explain no more of what is left.

    One pole more where the best has a delay: a lag looks like it at the samples. The search begins
    at the poles of `starts`, and then also at those of the drives before.
    """
    slowest = [min(abs(pole) for pole in one.poles_rad_s) for one in starts]
    places = [np.log([pole * samples.interval_s]) for pole in slowest]
    single = best_drive(samples, places, 0)
    found: list[FittedDrive] = []
    enough = False
    for poles in range(2, MOST_POLES + 1):
        models = (*starts, *(one.model for one in found[-2:]))
        begins = [coordinates(one, samples.interval_s, poles) for one in models]
        smooth = best_drive(samples, begins, poles - 2)
        spent = _explainable(smooth) < WORTH
        jumps = best_drive(samples, [smooth.place[:-1], *(() if spent else begins)], poles - 1)
        if not spent:
            smooth = min(smooth, best_drive(samples, [jumps.place[:-1]], poles - 2), key=power_of)
        found += [smooth, jumps]
        best = min(found, key=power_of)
        spent = spent or _explainable(best) < WORTH
        if enough or (spent and best.place[-1] == 0.0):
            break
        enough = spent
    return [single, *found]


def _with_friction(
    samples: Samples, found: list[FittedDrive], start: DriveModel
) -> tuple[Samples, list[FittedDrive]]:
    """Return samples and drives with dry friction, where that explains what the others leave."""
    least = min(one.power for one in found)
    if least < QUIET**2:
        return samples, found
    starts = [start, *(one.model for one in found[1:3])]
    rubbed = replace(samples, sign=_sign(samples))
    # The velocity's samples do not show when its sign changed; a drive does, and is found by it.
    for _ in range(SIGNS):
        places = [np.append(coordinates(one, samples.interval_s, 2), 0.0) for one in starts]
        first = min((searched(rubbed, one, 1, delayed=False) for one in places), key=power_of)
        starts = [first.model]
        rubbed = replace(rubbed, sign=_sign(rubbed, first))
    return (samples, found) if first.power > RUBS * least else (rubbed, _climbed(rubbed, starts))


def _sign(samples: Samples, one: FittedDrive | None = None) -> Channel:
    """Return the mean sign of the velocity in parts of a tick.

    The velocity is what a drive makes there, and straight between the samples what it leaves; of
    an angle, what the drive makes.
    """
    time_s = _finer(samples.command.time_s)
    if one is None:
        velocity = np.interp(time_s, *measured_velocity(samples))
    else:
        there = replace(samples, time_s=time_s, of_angle=False)
        velocity = one.numerator @ velocities(there, one.place, one.zeros)
        if not samples.of_angle:
            velocity -= np.interp(time_s, samples.time_s, one.left)
    after = np.append(velocity[1:], velocity[-1])
    larger = np.maximum(np.abs(velocity) + np.abs(after), TINY)
    return Channel("velocity_rad_s", time_s, (velocity + after) / larger)


def _finer(ticks_s: Array) -> Array:
    """Return times that divide each tick evenly."""
    place = np.arange(FINER * (ticks_s.size - 1) + 1) / FINER
    return np.interp(place, np.arange(ticks_s.size), ticks_s)


def _explainable(one: FittedDrive) -> float:
    """Return how much of what is left any linear drive might explain, as a share of its power.

    Whatever its poles, it adds up past commands: so do their means over `LAGS_TICKS`. What chance
    gives so many of them is taken off.
    """
    sums = np.concatenate(([0.0], np.cumsum(one.samples.command.values)))
    tick, _ = since_ticks(one.samples.command, one.samples.time_s, 0.0)
    edges = [sums[np.maximum(tick + 1 - lag, 0)] for lag in LAGS_TICKS if lag <= tick[-1]]
    table = np.diff(edges, axis=0)
    table /= np.linalg.norm(table, axis=1, keepdims=True) + TINY
    along = table @ one.left
    explained = float(along @ np.linalg.lstsq(table @ table.T, along)[0])
    total, free = float(one.left @ one.left), max(one.left.size - len(table), 1)
    return 1.0 - (1.0 - explained / total) * one.left.size / free


def _power_between_lines(samples: Samples, start: DriveModel) -> float:
    """Return what simple drives leave whose command went straight from sample to sample."""
    sent = samples.command
    time_s = _finer(sent.time_s)
    middle = np.interp(time_s + 0.5 * (time_s[1] - time_s[0]), sent.time_s, sent.values)
    finer = replace(
        samples,
        command=Channel(sent.name, time_s, middle),
        interval_s=samples.interval_s / FINER,
        sign=None,
    )
    begins = [coordinates(start, finer.interval_s, 2)]
    return min(best_drive(finer, begins, zeros).power for zeros in (0, 1))


def _samples(epoch: Epoch, motion: Channel) -> Samples | None:
    """Return what the drive is identified from; None where there is too little."""
    command = epoch.channels.get("velocity_command_rad_s")
    if command is None or len(command) < 2 * FEWEST_SAMPLES:
        return None
    start_s = command.time_s[0] + SETTLED_S
    last_s = command.time_s[:MOST_TICKS][-1]
    inside = (motion.time_s >= start_s) & (motion.time_s <= last_s)
    inside &= sound(epoch, motion.time_s)
    for stretch in epoch.left_out:
        if stretch.lost:
            inside &= (motion.time_s < stretch.stop_s) | (
                motion.time_s > stretch.stop_s + SETTLED_S
            )
    of_angle = motion.name == "angle_rad"
    most = MOST_TICKS if of_angle else MOST_SAMPLES
    time_s, measured = motion.time_s[inside][:most], motion.values[inside][:most]
    if time_s.size < FEWEST_SAMPLES:
        return None
    if of_angle:
        measured = from_angle(measured, mean_interval_s(time_s))
    scale = float(np.std(measured))
    if scale == 0.0:
        return None
    ticks = int(np.searchsorted(command.time_s, time_s[-1], side="right"))
    used = Channel(command.name, command.time_s[:ticks], command.values[:ticks])
    interval_s = 1.0 / command.mean_rate_hz
    return Samples(used, interval_s, time_s, measured / scale, scale, of_angle=of_angle)
