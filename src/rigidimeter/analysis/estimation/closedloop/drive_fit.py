"""The drive between command and motion, identified from the recording itself.

Command and velocity are known almost without noise, so they show how the drive follows. What it
does between the samples follows from that: the command is held from tick to tick, and the poles
that the samples show go on between them. It matters because a torque that is sampled at the ticks
sees the acceleration at the ticks, not its mean: with a drive of second order and 50 Hz at 1 kHz
it is 0.8 % smaller than the samples of the velocity suggest, with a PI drive 14 %, and all of that
would be taken from J.

No form of the drive is assumed. Those of `STRUCTURES` are fitted to one half of the samples and
predict the other, and the simplest that predicts as well as the best is taken.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.estimation.closedloop.drive_search import (
    explainable,
    explained,
    mean_sign,
    power_left,
    search,
    with_sign_of,
)
from rigidimeter.analysis.estimation.closedloop.drive_terms import Fitted, Samples, Structure
from rigidimeter.analysis.estimation.closedloop.drive_uncertainty import STANDARD_ERRORS, as_likely
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.analysis.estimation.stretches import sound
from rigidimeter.analysis.estimation.uncertainty import correlation_samples
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.model import DriveModel

STRUCTURES = (
    Structure("second order", 2, 0),
    Structure("velocity PI", 2, 1),
    Structure("second order in a position loop", 3, 0, 0.1),
    Structure("velocity PI with a lag", 3, 1, 4.0),
    Structure("second order with a position loop beside it", 3, 1, 0.1),
    Structure("velocity PI in a position loop", 3, 2, 0.1),
    Structure("velocity PI with a lag in a position loop", 4, 2, 4.0),
    Structure("velocity PI in a position loop with a lag", 4, 2, 0.1),
)
"""From simple to complicated."""


FEWEST_SAMPLES, MOST_SAMPLES, MOST_TICKS = 50, 3000, 8000
"""Of the velocity and of the command; more do not make a drive known any better that is not quite
linear."""

SETTLED_S = 0.3
"""An epoch may begin in motion, and the model begins at rest. After commands that are lost it is
also in a state that is not known."""

LARGEST_MISFIT = 0.1
"""Above this share of the velocity's standard deviation the command does not explain it."""

AS_GOOD, RIVAL = 1.05, 4.0
"""A structure that leaves this many times the power of the best predicts as well; one that leaves
no more than the second of them might be there if what the best leaves is not noise. With friction
the second holds for both: further poles are bent to what is then left."""

COLOURED = 2.0
"""What is left is not noise if it is alike over so many samples."""

UNSEEN = 2e-5
"""Structures that differ by less than this share of the velocity's SD are alike."""

OTHERS = 1.1
"""Of samples it was not fitted to, a structure may leave this much more."""

BETTER = 0.98
"""A pole more is worth a try where the last one brought the power down to this share, and where the
next one, of whatever drive, might do so again."""

QUIET = 3e-4
"""What is left below this share of the velocity's SD needs no friction."""

RUBS = 0.8
"""Friction must explain so much of the power that is left without it."""

SIGNS = 3
"""So many times the sign of the velocity is made from the drive, and the drive from the sign."""

FINER, STAIRS = 4, 0.5
"""A command that was logged more slowly than it was sent goes on between its samples: if lines
between them, in so many steps, leave this share of what stairs leave, the stairs are not known."""


class FoundDrive(NamedTuple):
    """A drive that was identified.

    Attributes
    ----------
    fitted : Fitted
    misfit : float
        What the drive leaves of velocity that it was not fitted to, as a share of its SD.
    rivals : tuple of DriveModel
        Others that predict the velocity as well: the structure fitted to each half of the samples,
        and other structures.
    """

    fitted: Fitted
    misfit: float
    rivals: tuple[DriveModel, ...]

    @property
    def model(self) -> DriveModel:
        """From command to velocity."""
        return self.fitted.model

    @property
    def structure(self) -> str:
        """The name of its structure."""
        return self.fitted.structure.name


def fit_drive(epoch: Epoch, start: DriveModel) -> FoundDrive | None:
    """Identify the drive from command and velocity; None where they do not show it.

    Parameters
    ----------
    epoch : Epoch
    start : DriveModel
        Of second order, where the search starts.

    Returns
    -------
    FoundDrive or None
        None if command or velocity was not recorded, if no structure explains the velocity, or if
        the command seems to have been logged more slowly than it was sent, which a loop of ours
        does not do.
    """
    samples = _samples(epoch)
    if samples is None:
        return None
    samples, everyone = _fitted(samples, start)
    fitted = [one for one in everyone if not one.too_fast]
    if not fitted:
        return None
    enough = RIVAL * min(one.power for one in fitted) + UNSEEN**2
    rubbing = [one for one in fitted if one.structure.friction and one.model.delay_s > 0.0]
    fitted = [_without_delay(samples, one) if one.power <= enough else one for one in fitted]
    fitted += [one for one in rubbing if one not in fitted]
    least = min(one.power for one in fitted)
    # A loop of ours logs each command that it sends.
    slowly = epoch.ticks is None and least > QUIET**2
    if slowly and _power_between_lines(samples, fitted[0].model) < STAIRS * least:
        return None
    as_good = RIVAL if min(fitted, key=_by_power).structure.friction else AS_GOOD
    simple = (one for one in fitted if one.power <= as_good * least + UNSEEN**2)
    # What is left of samples that a structure was fitted to is never more than of others.
    tried: list[_Tried] = []
    for one in simple:
        tried.append(_tried(samples, one))
        if tried[-1].power <= as_good * OTHERS * least + UNSEEN**2:
            break
    best = min(tried, key=lambda one: one.power)
    chosen, misfit = best.whole, math.sqrt(best.power)
    if misfit > LARGEST_MISFIT or not 0.5 < chosen.model.gain < 2.0:
        return None
    rival = AS_GOOD if _noise(samples, min(fitted, key=_by_power)) else RIVAL
    near = (
        one
        for one in fitted
        if one.power <= rival * least + UNSEEN**2 and (chosen.unseen_pair or not one.unseen_pair)
    )
    rivals = (
        *best.halves,
        *as_likely(samples, chosen),
        *(one.model for one in near if one is not chosen),
    )
    return FoundDrive(chosen, misfit, rivals)


class _Tried(NamedTuple):
    """A structure fitted to all samples and to each half, and what halves leave of the other."""

    whole: Fitted
    halves: tuple[DriveModel, DriveModel]
    power: float


def _fitted(samples: Samples, start: DriveModel) -> tuple[Samples, list[Fitted]]:
    """Return structures fitted to all samples, and the samples with the sign of the velocity.

    One with one more pole, or with friction, is fitted only where those before it leave more than
    noise would, as far as the steps before show.
    """
    smooth = _climbed(samples, start, friction=False)
    least = min(smooth, key=_by_power).power
    if least < QUIET**2:
        return samples, smooth
    rubbing = STRUCTURES[1]._replace(friction=True)
    # Friction bends the poles of a drive that has none, and leaves them where they began.
    begins = (start, *(one.model for one in smooth[:2]))
    first = min((search(samples, rubbing, one, delayed=False) for one in begins), key=_by_power)
    # The velocity's samples do not show when its sign changed; a drive does, and is found by it.
    signed = samples
    for _ in range(SIGNS):
        signed = with_sign_of(signed, first)
        first = search(signed, rubbing, first.model, delayed=False)
    if first.power > RUBS * least:
        return samples, smooth
    return signed, [*smooth, *_climbed(signed, first.model, friction=True)]


def _climbed(samples: Samples, start: DriveModel, friction: bool) -> list[Fitted]:
    """Return structures of one kind, with ever more poles as long as that is worth a try."""
    fitted: list[Fitted] = []
    for poles in sorted({one.poles for one in STRUCTURES}):
        before = min((one.power for one in fitted), default=math.inf)
        for structure in (one for one in STRUCTURES if one.poles == poles):
            best = min(fitted, key=_by_power) if fitted else None
            # Two poles may have found a long delay, where a third one has no place.
            starts = [best.model, fitted[0].model] if best else [start]
            if best is None or best is fitted[0] or best.power < QUIET**2 or friction:
                starts = starts[:1]
            if best is not None and best.too_fast:
                starts = [start, best.model]  # a pole that is not seen leads to no other
            wanted = structure._replace(friction=friction)
            found = [search(samples, wanted, begin) for begin in starts]
            fitted.append(min(found, key=_by_power))
        best = min(fitted, key=_by_power)
        if best.power > BETTER * before:
            break
        if not best.too_fast and explainable(samples, best) < 1.0 - BETTER:
            break
    return fitted


def _noise(samples: Samples, one: Fitted) -> bool:
    """Return whether a drive without friction leaves no more than noise of the velocity."""
    left = samples.measured - explained(samples, one, samples.time_s)
    return not one.structure.friction and correlation_samples(left[:, None]).item() < COLOURED


def _without_delay(samples: Samples, one: Fitted) -> Fitted:
    """Return the structure without a delay where the samples do not show one.

    A short delay and faster poles look alike at few samples, and the search takes either.
    """
    if one.model.delay_s == 0.0:
        return one
    alone = search(samples, one.structure, one.model, delayed=False)
    shown = 1.0 + STANDARD_ERRORS**2 / samples.measured.size
    if one.structure.friction:
        shown = RIVAL
    return alone if alone.power <= shown * one.power and not alone.too_fast else one


def _by_power(one: Fitted) -> float:
    return one.power


def _tried(samples: Samples, whole: Fitted) -> _Tried:
    """Return how well a structure that is fitted to each half predicts the other."""
    first, second = (search(samples, whole.structure, whole.model, half) for half in samples.halves)
    power = 0.5 * (
        power_left(samples, second, samples.halves[0])
        + power_left(samples, first, samples.halves[1])
    )
    return _Tried(whole, (first.model, second.model), power)


def _power_between_lines(samples: Samples, start: DriveModel) -> float:
    """Return what simple drives leave whose command went straight from sample to sample."""
    sent = samples.command
    time_s = _finer(sent.time_s)
    half_s = 0.5 * (time_s[1] - time_s[0])
    middle = np.interp(time_s + half_s, sent.time_s, sent.values)
    finer = samples._replace(
        command=Channel(sent.name, time_s, middle), interval_s=samples.interval_s / FINER
    )
    return min(search(finer, one, start).power for one in STRUCTURES if one.poles == 2)


def velocity_sign(epoch: Epoch, fitted: Fitted) -> Channel | None:
    """Return the sign of an epoch's velocity between its samples, by a drive with friction.

    None for a drive without friction, or where command or velocity was not recorded.
    """
    command = epoch.channels.get("velocity_command_rad_s")
    velocity = epoch.channels.get("velocity_rad_s")
    if not fitted.structure.friction or command is None or velocity is None:
        return None
    time_s = _finer(command.time_s)
    sign = mean_sign(time_s, np.interp(time_s, velocity.time_s, velocity.values))
    scale = float(np.std(velocity.values))
    samples = Samples(command, sign, fitted.interval_s, velocity.time_s, velocity.values, scale)
    for _ in range(SIGNS):
        samples = with_sign_of(samples, fitted)
    return samples.sign


def _finer(ticks_s: Array) -> Array:
    """Return times that divide each tick evenly."""
    place = np.arange(FINER * (ticks_s.size - 1) + 1) / FINER
    return np.interp(place, np.arange(ticks_s.size), ticks_s)


def _samples(epoch: Epoch) -> Samples | None:
    """Return what the drive is identified from; None where there is too little."""
    command = epoch.channels.get("velocity_command_rad_s")
    velocity = epoch.channels.get("velocity_rad_s")
    if command is None or velocity is None or len(command) < 100:
        return None
    interval_s = 1.0 / command.mean_rate_hz
    start_s = command.time_s[0] + SETTLED_S
    last_s = command.time_s[:MOST_TICKS][-1]
    inside = (velocity.time_s >= start_s) & (velocity.time_s <= last_s)
    inside &= sound(epoch, velocity.time_s)
    for stretch in epoch.left_out:
        if stretch.lost:
            inside &= (velocity.time_s < stretch.stop_s) | (
                velocity.time_s > stretch.stop_s + SETTLED_S
            )
    time_s = velocity.time_s[inside][:MOST_SAMPLES]
    measured = velocity.values[inside][:MOST_SAMPLES]
    if time_s.size < FEWEST_SAMPLES or np.std(measured) == 0.0:
        return None
    ticks = int(np.searchsorted(command.time_s, time_s[-1], side="right"))
    used = Channel(command.name, command.time_s[:ticks], command.values[:ticks])
    sign_s = _finer(used.time_s)
    sign = mean_sign(sign_s, np.interp(sign_s, velocity.time_s, velocity.values))
    return Samples(used, sign, interval_s, time_s, measured, float(np.std(measured)))
