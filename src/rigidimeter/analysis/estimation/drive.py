"""The drive between command and motion, identified from a recording, and what it does unseen.

The command c is held from tick to tick, so the poles λ that the samples of the velocity show go on
between the samples. There the torque sees an acceleration that no derivative of samples tells: with
a drive of second order and 50 Hz, sampled at 1 kHz at the ticks, it is 0.8 % smaller, with a PI
drive 14 %, and all of that would be taken from J.

The velocity is linear in the numerator of a drive, so poles and delay alone are searched (variable
projection; Golub and Pereyra 1973; slopes after Kaufman 1975). A drive with dry friction answers
the sign of its velocity as well, with the same poles and another numerator.

Torque sampled δ after the ticks holds the acceleration of that time, the samples of the velocity
give another one. With H the drive, F a low-pass in the torque sensor, z = e^(jωT) and * the
z-transform of what is sampled, the torque sees beyond F times what the samples give

    [(F s H)* − F jω H*] C,   [(F H)* − F H*] C,   [(F H/s)* − F (H/s)*] C

of the command C. What moves the arm besides, such as friction in the drive, does not keep step with
the ticks, and its samples are taken as they are.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from operator import attrgetter
from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.grid import Array, Complex
from rigidimeter.analysis.estimation.stretches import Rows, motion_channels, sound
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import RigSettings, Settings
from rigidimeter.model import (
    ON_EDGE,
    SAME_TIME_S,
    DriveModel,
    lowpass,
    same_time,
    state_at_ticks,
    state_later,
    with_conjugates,
)

Values = Array | Complex

# Epochs of a recording, before its drive is taken for unknown, or over which noise is averaged;
# together if their rates differ by a smaller share.
MOST_TRIED, SAME_RATE = 5, 0.01
# Of the velocity, and of command and angle; more do not make a drive known any better that is not
# quite linear.
FEWEST_SAMPLES, MOST_SAMPLES, MOST_TICKS = 50, 3000, 8000
SETTLED_S = 0.3  # after the start, and after commands are lost, the state is not known

MOST_POLES = 4  # a velocity PI has two; a lag and a position loop add one each
# In rad a tick: poles are between the first two; an oscillation beyond π looks like a slower one;
# the samples show poles up to the last, of which 1 % is left at the next tick.
SLOWEST, FASTEST, QUICKEST, SEEN = 5e-4, 6.0, 3.0, 4.6
DOUBLE = 1e-4  # poles this close, as a share of their size, are taken for so far apart
# Where a search begins: the drive of the settings, halved so often; a further pole, in times the
# first.
SPEEDS, BESIDE = 6, (0.3, 2.0)
LONGEST_S, LONGEST_TICKS, SHORTEST_TICKS = 0.1, 4.0, 0.25  # of delays
PASSED_HZ = 10.0  # an angle is used as the velocity through a low-pass with this corner
# Of stretches of past commands, ever longer the longer ago.
EDGES_TICKS = (0, 1, *sorted(step << octave for octave in range(13) for step in (2, 3)))
EACH = 4  # of them hold one tick
MOST_STEPS, ENOUGH = 12, 1e-4  # of a search; the last share of the power to gain
STEP = 1e-4  # of a coordinate, for its slope
FAR = 1e3  # a delay is not searched where more times the power of others is left near it

WORTH = 0.02  # a further pole is tried where past commands explain this share of what is left
# A drive that leaves no more than so many times the power of the best, and this share of the SD of
# the velocity, explains as well.
AS_GOOD, UNSEEN = 1.05, 2e-5
# If what the best leaves is correlated by so much from sample to sample it is not noise, and one
# that leaves so many times its power might be there.
RIVAL, COLOURED = 4.0, 1 / 3
# Where it is noise and no pole is faster than so many rad a tick, a drive whose information
# criterion is above the least by more (Kass and Raftery 1995: strong evidence) is no rival.
UNLIKELY, SLOW = 6.0, 1.0
# Shares of the velocity's SD: where noise is larger the angle may show the drive better, and a
# pole with a delay leaves hardly more than two poles, so that the information criterion chooses;
# where more is left the command does not explain it.
NOISY, MISFIT = 0.01, 0.1
# A share of the SD below which nothing needs friction; the share to which it must bring the power
# that any linear drive would leave; how much more power is as good with it, for poles bend to what
# its law leaves; how often sign and drive are made of each other.
QUIET, RUBS, RUBBED, SIGNS = 3e-4, 0.8, 4.0, 3
# A command that was logged more slowly than it was sent goes on between its samples: if lines
# between them, in so many steps, leave this share of what stairs leave, the stairs are not known.
STAIRS, FINER = 0.5, 4

# A delay must be longer than so many standard errors, and rivals are so many away. They are those
# of sums over so many stretches, whatever the colour of the noise.
ERRORS, BLOCKS = 2.0, 32
# The longest move of a coordinate; one that changes the velocity by more times what the slopes say
# is halved.
LONG, CURVED = 5.0, 2.0
INEXACT = 0.005  # no drive is quite linear: so much of what it tells is uncertain
SCATTERED = 5.0  # stamps keep step if their mean direction is so many standard errors long
TINY = 1e-300


TorqueFilter = tuple[float, int]
"""Cutoff in Hz and order of a Butterworth low-pass between the torque and its samples."""


@dataclass(frozen=True, eq=False)
class Drive:
    """The drive of a recording.

    Attributes
    ----------
    model : DriveModel
        From command to velocity.
    rivals : tuple of DriveModel
        Others that explain the velocity as well.
    by_angle : bool
        Whether the angle showed it: the velocity was not recorded or holds more noise.
    """

    model: DriveModel
    rivals: tuple[DriveModel, ...] = ()
    by_angle: bool = False

    def motion(self, command: Channel, time_s: Array) -> Array:
        """Return acceleration, velocity, angle that the command causes from rest, shape (3, n)."""
        at = since_ticks(command, time_s, self.model.delay_s)
        return np.stack(self.model.motion(command.values, _lengths_s(command), *at))

    def behind(self, torque_filter: TorqueFilter | None) -> Drive:
        """Return the drive as the torque sensor sees its motion."""
        return self if torque_filter is None else Drive(self.model.smoothed(*torque_filter))

    def beyond(self, epoch: Epoch) -> Epoch:
        """Return the epoch with what its motion sensors saw beyond what the command causes."""
        command, rest = epoch.channels["velocity_command_rad_s"], dict(epoch.channels)
        for one in motion_channels(epoch):
            caused = self.motion(command, one.time_s)[2 if one.name == "angle_rad" else 1]
            rest[one.name] = replace(one, values=one.values - caused)
        return replace(epoch, channels=rest)


def since_ticks(
    command: Channel, time_s: Array, delay_s: float, even: float = ON_EDGE
) -> tuple[Rows, Array]:
    """Return the last tick whose command acts at the times, and for how long it has.

    A time that is `even` of an interval or less before a tick is that tick.
    """
    # From the first tick on: on a clock that counts from 1970 a delay is below the rounding.
    ticks_s, interval_s = command.time_s - command.time_s[0], 1.0 / command.mean_rate_hz
    then_s = (time_s - command.time_s[0]) - delay_s
    near_s = max(even * interval_s, SAME_TIME_S)
    tick = np.maximum(np.searchsorted(ticks_s, then_s + near_s, side="right") - 1, 0)
    after_s = np.maximum(then_s - ticks_s[tick], 0.0)
    return tick, np.where(after_s < near_s, 0.0, after_s)


def _lengths_s(command: Channel) -> float | Array:
    """Return the time from each tick to the next; one number if all came evenly."""
    interval_s = 1.0 / command.mean_rate_hz
    off_s = command.time_s - command.time_s[0] - interval_s * np.arange(len(command))
    return interval_s if np.ptp(off_s) <= 1e-3 * interval_s else np.diff(command.time_s)


def find_drive(epochs: Sequence[Epoch], settings: Settings) -> Drive | None:
    """Return the drive that the first of some epochs shows; None where none does.

    The motion is the velocity, or the angle where that is all there is, or where a drive leaves
    less of it and that is noise.

    Parameters
    ----------
    epochs : sequence of Epoch
        Of one recording, in order; of those that can be used a few are tried.
    settings : Settings
        A search may begin at the drive of its rig.

    Returns
    -------
    Drive or None
        None if the command was not recorded, if no drive explains the motion, or if the command
        seems to have been logged more slowly than it was sent, which a loop of ours does not do.
    """
    rig = settings.rig
    start = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    tried = epochs[:MOST_TRIED]
    for number, epoch in enumerate(tried):
        found: list[tuple[float, bool, Drive]] = []
        for motion in motion_channels(epoch):  # the velocity first
            if not found or found[0][0] > NOISY**2:
                found += _identified(tried[number:], motion.name, start)
        if found:
            noise = [one for one in found if one[1]] or found[:1]
            return min(noise, key=lambda one: one[0])[2]
    return None


@dataclass(frozen=True, eq=False)
class _Record:
    """What a drive is identified from.

    Attributes
    ----------
    command : Channel
    interval_s : float
        Of the ticks.
    lengths_s : float or array
        From each tick to the next.
    inputs : tuple of array, each of shape (ticks, f)
        The command and, with dry friction, the mean sign of the velocity, in f parts of a tick.
    time_s, measured : array, shape (n,)
        The velocity at its stamps, as a share of its SD.
    scale : float
        Its SD.
    every_s : float
        Where the angle was measured and `measured` is `_from_angle`: the interval of its stamps.
    others : tuple of _Record
        Of further epochs that show the same drive; what was measured in them is in `measured` too.
    """

    command: Channel
    interval_s: float
    lengths_s: float | Array
    inputs: tuple[Array, ...]
    time_s: Array
    measured: Array
    scale: float
    every_s: float = 0.0
    others: tuple[_Record, ...] = ()


def _record(epoch: Epoch, name: str) -> _Record | None:
    """Return what the drive is identified from; None where there is too little."""
    command, motion = epoch.channels.get("velocity_command_rad_s"), epoch.channels.get(name)
    if command is None or motion is None or len(command) < 2 * FEWEST_SAMPLES:
        return None
    of_angle, stamps_s = name == "angle_rad", motion.time_s
    last_s = command.time_s[:MOST_TICKS][-1]
    holes = [one._replace(stop_s=one.stop_s + SETTLED_S * one.lost) for one in epoch.left_out]
    inside = sound(replace(epoch, left_out=tuple(holes)), stamps_s)
    inside &= (stamps_s >= command.time_s[0] + SETTLED_S) & (stamps_s <= last_s)
    rows = np.flatnonzero(inside)[: MOST_TICKS if of_angle else MOST_SAMPLES]
    if rows.size < FEWEST_SAMPLES or np.ptp(motion.values[rows]) == 0.0:
        return None
    time_s, measured = stamps_s[rows], motion.values[rows]
    every_s = of_angle * float(time_s[-1] - time_s[0]) / (rows.size - 1)
    if of_angle:
        measured = np.real(_from_angle(measured, every_s))
    scale, used = float(np.std(measured)), command.time_s <= time_s[-1]
    sent = Channel(command.name, command.time_s[used], command.values[used])
    held = 1.0 / command.mean_rate_hz, _lengths_s(sent), (sent.values[:, None],)
    return _Record(sent, *held, time_s, measured / scale, scale, every_s)


class _Fitted(NamedTuple):
    """The drive at a place, with the numerator that explains the velocity best.

    Attributes
    ----------
    record : _Record
    place : array, shape (poles + 1,)
        Logarithms of a and b of each (s² + a s + b), of c of (s + c), and the delay, in ticks.
    zeros : int
    numerator : array, shape (j,)
        For the command and then for the sign of the velocity, as a share of the velocity's SD.
    table : array, shape (j, n)
        The velocity that each term of it makes.
    left : array, shape (n,)
        What is left of the velocity, as a share of its SD.
    power : float
        Of `left`.
    """

    record: _Record
    place: Array
    zeros: int
    numerator: Array
    table: Array
    left: Array
    power: float

    @property
    def model(self) -> DriveModel:
        """From command to velocity."""
        poles, interval_s = _poles(self.place, self.record.interval_s), self.record.interval_s
        own = self.record.scale * self.numerator[: self.zeros + 1]
        residues = _shapes(poles, self.zeros) @ own
        return DriveModel(poles, tuple(residues.tolist()), float(self.place[-1]) * interval_s)

    def velocity(self, place: Array, numerator: Array) -> Array:
        """Return the velocity at another place, with another numerator."""
        return np.asarray(numerator @ _table(self.record, place, self.zeros))


_power = attrgetter("power")


def _identified(
    epochs: Sequence[Epoch], motion: str, start: DriveModel
) -> list[tuple[float, bool, Drive]]:
    """Return the drive that one channel shows, the power it leaves and whether that is noise.

    That is of the first epoch; much noise is averaged over the others too.
    """
    first, *rest = epochs
    record = _record(first, motion)
    if record is None:
        return []
    found = _climbed(record, start)
    rubs, best = len(found[0].record.inputs) > 1, min(found, key=_power)
    slowly = first.ticks is None and best.power > QUIET**2 and _explainable(best) > 0.5 * STAIRS
    if slowly and _power_of_lines(found) < STAIRS * best.power:
        return []
    much = best.power > NOISY**2 and _is_noise(best) and not rubs
    if much:
        found = _climbed(_with_others(best, rest, motion), start)
    found = [one for one in found if _fastest(one) < SEEN]  # the samples show every pole
    if not found:
        return []
    best, times = min(found, key=_power), RUBBED if rubs else AS_GOOD
    noise = _is_noise(best)
    chosen = next(one for one in found if one.power <= times * best.power + UNSEEN**2)
    if much:
        chosen = min(found, key=_information)
    if chosen.power > MISFIT**2 or not 0.5 < chosen.model.gain < 2.0:
        return []
    most, likely = (times if noise else RIVAL) * best.power + UNSEEN**2, math.inf
    if noise and _fastest(chosen) < SLOW:
        likely = min(map(_information, found)) + UNLIKELY
    rivals = [one for one in found if one.power <= most and _information(one) <= likely]
    others = [one.model for one in (*rivals, *_neighbours(chosen)) if one is not chosen]
    drive = Drive(chosen.model, tuple(others), by_angle=motion == "angle_rad")
    return [(chosen.power, noise, drive)]


def _with_others(best: _Fitted, epochs: Sequence[Epoch], motion: str) -> _Record:
    """Return the record with those of epochs that came as often and that the drive explains too."""
    own, others = best.record, []
    for one in filter(None, (_record(epoch, motion) for epoch in epochs)):
        alike = np.divide(
            [one.interval_s, one.every_s or 1.0], [own.interval_s, own.every_s or 1.0]
        )
        left = _answer(one, best.place, best.zeros).power
        if np.all(np.abs(alike - 1.0) < SAME_RATE) and left < RIVAL * best.power:
            others.append(one)
    measured = [one.measured * (one.scale / own.scale) for one in (own, *others)]
    return replace(own, measured=np.concatenate(measured), others=tuple(others))


def _is_noise(one: _Fitted) -> bool:
    """Return whether what a drive leaves is not correlated from sample to sample."""
    return bool(one.left[1:] @ one.left[:-1] < COLOURED * one.left.size * one.power)


def _fastest(one: _Fitted) -> float:
    """Return the fastest decay, in rad a tick."""
    return max(-pole.real for pole in one.model.poles_rad_s) * one.record.interval_s


def _information(one: _Fitted) -> float:
    """Return n ln σ² + k ln n (Schwarz 1978), with k poles, numerator and delay."""
    n, k = one.left.size, one.place.size - 1 + one.numerator.size + (one.place[-1] > 0)
    return float(n * math.log(one.power + UNSEEN**2) + k * math.log(n))


def _climbed(record: _Record, start: DriveModel) -> list[_Fitted]:
    """Return ever larger drives, up to where past commands explain no more of what is left.

    Each with two zeros fewer than poles (it smooths the steps of the command) and with one fewer
    (its acceleration jumps at them). One pole more where the best has a delay: a lag looks like it.
    With friction instead, where that leaves less than any linear drive would.
    """
    rubs = len(record.inputs) > 1
    speeds = 2.0 ** -np.arange(1 if rubs else SPEEDS)
    models = [replace(start, poles_rad_s=tuple(x * p for p in start.poles_rad_s)) for x in speeds]
    found: list[_Fitted] = []
    spent = False
    for poles in range(2, MOST_POLES + 1):
        least = min((one.power for one in found), default=1.0)
        near = [*models, *(one.model for one in found[-2:])]
        begins = [_coordinates(one, record.interval_s, poles, x) for one in near for x in BESIDE]
        for zeros in range(poles - 2 + rubs, poles):
            found.append(_best(record, begins, zeros, least))
            begins.append(found[-1].place)
        best = min(found, key=_power)
        if rubs and poles > 2 and RUBBED * best.power > least:
            break
        if rubs:
            continue
        share, before = _explainable(best), spent
        alone = not record.others  # else what one leaves is noise, and no friction
        rubbed = alone and best.power > QUIET**2 and _rubbed(found[1], best.power * (1.0 - share))
        if rubbed:
            return _climbed(rubbed.record, rubbed.model)
        spent = share < WORTH
        if before or (spent and best.place[-1] == 0.0):
            break
    near = [*models, *(one.model for one in found[:2])]
    single = [_coordinates(one, record.interval_s, 1) for one in near]
    found.append(_best(record, single, 0, best.power))
    return sorted(found, key=lambda one: (one.place.size, one.zeros))


def _best(record: _Record, begins: Sequence[Array], zeros: int, least: float) -> _Fitted:
    """Return the drive that explains the velocity best, with a delay only where one is shown.

    `least` is the power that others leave: far above it no delay is searched.
    """
    at = [_answer(record, np.append(one[:-1], 0.0), zeros) for one in begins]
    still = _searched(record, min(at, key=_power).place, zeros, False)
    step, scatter, *_ = _scatter(still)
    delay = still.place.size - 1
    if step[delay] <= ERRORS * np.linalg.norm(scatter[delay]):
        return still
    places = [one for one in begins if one[-1] > 0]
    ticks = np.geomspace(SHORTEST_TICKS, _longest(record), 0 if places else 8)
    places += [np.append(still.place[:-1], late) for late in ticks]
    places.append(still.place + step[: delay + 1])
    late = min((_answer(record, one, zeros) for one in places), key=_power)
    if ticks.size and late.power > FAR * (least + UNSEEN**2):
        return still
    moved = _searched(record, late.place, zeros, True)
    shown = 1.0 - ERRORS**2 / still.left.size if len(record.inputs) == 1 else 1.0 / RUBBED
    return moved if moved.place[-1] > 0 and moved.power < shown * still.power else still


def _searched(record: _Record, begin: Array, zeros: int, delayed: bool) -> _Fitted:
    """Return the best drive near a place, whose delay is searched too or stays.

    By steps of Levenberg and Marquardt.
    """
    one, damping = _answer(record, begin, zeros), 1e-3
    for _ in range(MOST_STEPS):
        along = _slopes(one, begin.size - 1 + delayed)
        table = one.table / (np.linalg.norm(one.table, axis=1, keepdims=True) + TINY)
        along = along - np.linalg.lstsq(table @ table.T, table @ along.T)[0].T @ table
        gram, down, step = along @ along.T, along @ one.left, np.zeros(begin.size)
        tried = None
        while tried is None or tried.power >= one.power:
            damped = gram + np.diag(damping * np.diag(gram) + TINY)
            step[: down.size] = np.linalg.solve(damped, -down)
            tried = _answer(record, one.place + step, zeros)
            if -down @ step[: down.size] <= ENOUGH * one.left.size * (one.power + UNSEEN**2):
                return min(one, tried, key=_power)
            damping *= 10.0 if tried.power >= one.power else 0.2
        one = tried
    return one


def _answer(record: _Record, place: Array, zeros: int) -> _Fitted:
    """Return the drive at a place, with the numerator that explains the velocity best."""
    degrees = np.resize([1.0, 2.0], place.size - 1)
    lower = np.append(degrees * math.log(SLOWEST), 0.0)
    upper = np.append(degrees * math.log(FASTEST), _longest(record))
    place = np.minimum(np.maximum(place, lower), upper)
    table = _table(record, place, zeros)
    size = np.linalg.norm(table, axis=1) + TINY
    scaled = table / size[:, None]
    numerator = np.linalg.lstsq(scaled @ scaled.T, scaled @ record.measured)[0] / size
    left = numerator @ table - record.measured
    return _Fitted(record, place, zeros, numerator, table, left, float(left @ left) / left.size)


def _slopes(one: _Fitted, count: int) -> Array:
    """Return how the velocity changes along coordinates of the place, shape (count, n)."""
    moves = STEP * np.eye(one.place.size)[:count]
    moved = [one.velocity(one.place + by, one.numerator) for by in moves]
    return (np.stack(moved) - one.numerator @ one.table) / STEP


def _table(record: _Record, place: Array, zeros: int) -> Array:
    """Return the velocity that each term of a numerator makes, shape (j, n)."""
    poles, delay_s = _poles(place, record.interval_s), float(place[-1]) * record.interval_s
    twice = np.array([1.0 + (pole.imag != 0.0) for pole in poles])
    parts = []
    # Friction acts behind the zeros of the controller, at once.
    for which, terms in enumerate((zeros + 1, place.size - 1)[: len(record.inputs)]):
        modes = [_mode(record, which, pole, 0.0 if which else delay_s) for pole in poles]
        parts.append(((_shapes(poles, terms - 1).T * twice) @ np.stack(modes)).real)
    own = np.concatenate(parts)
    return np.hstack([own, *(_table(one, place, zeros) for one in record.others)])


@lru_cache(maxsize=256)
def _mode(record: _Record, which: int, pole: complex, delay_s: float) -> Values:
    """Return x of x' = λ x + c at the stamps; for an angle what `_from_angle` makes of ∫ x dt."""
    values, (tick, held_s) = record.inputs[which], _since(record, delay_s)
    growth = pole if pole.imag else pole.real
    # Held for a tick, the weighted mean of its parts leaves the same state.
    parts = np.arange(values.shape[1] - 1, -1, -1) / values.shape[1]
    share = np.exp(growth * record.interval_s * parts)
    sent = values @ (share / np.sum(share)) if parts.size > 1 else values[:, 0]
    before = state_at_ticks(pole, sent, record.lengths_s)[tick]
    state = state_later(pole, before, sent[tick], held_s)
    if not record.every_s:
        return state
    mean = np.mean(values, axis=1)
    summed = np.append(0.0, np.cumsum(mean[:-1] * record.lengths_s))
    return _from_angle((state - summed[tick] - held_s * mean[tick]) / growth, record.every_s)


@lru_cache(maxsize=64)
def _since(record: _Record, delay_s: float) -> tuple[Rows, Array | float]:
    tick, after_s = since_ticks(record.command, record.time_s, delay_s, even=0.0)
    return tick, same_time(after_s)


def _longest(record: _Record) -> float:
    return max(LONGEST_S / record.interval_s, LONGEST_TICKS)


def _from_angle(angle_rad: Values, interval_s: float) -> Values:
    """Return the velocity through a low-pass, made of the angle without a derivative.

    y_k = e^(−aT) y_(k−1) + θ_k − θ_(k−1), with a the corner: white noise of the angle stays white
    above it, and neither where the angle begins nor a slow drift counts.
    """
    kept = math.exp(-2 * math.pi * PASSED_HZ * interval_s)
    steps = np.diff(angle_rad, prepend=angle_rad[:1])
    return np.asarray(scipy.signal.lfilter([1.0], [1.0, -kept], steps))


def _poles(place: Array, interval_s: float) -> tuple[complex, ...]:
    """Return the poles, of a conjugate pair the one with the positive imaginary part."""
    poles: list[complex] = []
    coefficients = np.exp(place[:-1]).tolist()
    for a, b in zip(coefficients[::2], coefficients[1::2], strict=False):
        root = max(cmath.sqrt(a * a / 4 - b), complex(DOUBLE * a), key=abs)
        if root.imag:
            poles.append(complex(-a / 2, min(abs(root.imag), QUICKEST)))
        else:
            poles += [complex(-a / 2 - root.real), complex(-b / (a / 2 + root.real))]
    if len(coefficients) % 2:
        poles.append(complex(-coefficients[-1]))
    return tuple(pole / interval_s for pole in poles)


def _shapes(poles: tuple[complex, ...], zeros: int) -> Complex:
    """Return the residues of s^j / Π(s − λ), s in units of the first pole, shape (poles, j)."""
    own, everyone = np.array(poles), np.array(with_conjugates(poles))
    apart = (own[:, None] - everyone) / abs(poles[0])
    rest = np.prod(apart, axis=1, where=own[:, None] != everyone)[:, None]
    powers = np.vander(own / abs(poles[0]), zeros + 1, increasing=True)
    return np.asarray(abs(poles[0]) * powers / rest)


def _coordinates(drive: DriveModel, interval_s: float, poles: int, beside: float = 1.0) -> Array:
    """Return where a search with so many poles begins at a drive."""
    slowest = sorted(drive.poles_rad_s, key=lambda pole: (pole.imag == 0, abs(pole)))
    known = np.array(with_conjugates(slowest)[:poles])
    further = -abs(known[0]) * beside ** np.arange(1.0, poles - known.size + 1)
    rates = -interval_s * np.append(known, further)
    pairs, single = rates[: poles - poles % 2].reshape(-1, 2), rates[poles - poles % 2 :]
    found = np.stack([pairs.sum(axis=1), pairs.prod(axis=1)], axis=1).real.ravel()
    # One of a pair does not stand alone.
    return np.append(np.log(np.append(found, np.abs(single))), drive.delay_s / interval_s)


@lru_cache(maxsize=2)
def _past(record: _Record) -> Array:
    """Return independent sums of past commands at the stamps, shape (n, e)."""
    each = [past_sums(one.command.values, _since(one, 0.0)[0]) for one in (record, *record.others)]
    table = np.vstack([one[:, : min(len(one.T) for one in each)] for one in each])
    return np.linalg.qr(table / (np.linalg.norm(table, axis=0) + TINY))[0]


def past_sums(sent: Array, tick: Rows) -> Array:
    """Return sums of what was sent up to each tick, ever longer the longer ago, shape (n, e).

    The first `EACH` of them hold one tick each.
    """
    sums = np.append(0.0, np.cumsum(sent))
    edges = [sums[np.maximum(tick + 1 - lag, 0)] for lag in EDGES_TICKS if lag <= tick[-1]]
    return -np.diff(edges, axis=0).T


def _explainable(one: _Fitted) -> float:
    """Return how much of what is left any linear drive might explain, as a share of its power.

    Whatever its poles, it adds up past commands. What chance gives so many is taken off.
    """
    past = _past(one.record)
    n, e = past.shape
    share = np.sum((one.left @ past) ** 2) / (one.power * n + TINY)
    return float(1.0 - (1.0 - share) * n / max(n - e, 1))


def _rubbed(one: _Fitted, least: float) -> _Fitted | None:
    """Return a drive with friction, where the sign of its velocity explains what others leave."""
    for again in range(SIGNS):
        record = replace(one.record, inputs=(one.record.inputs[0], _signs(one)))
        one = _answer(record, np.append(one.place[:-1], 0.0), one.zeros)
        step, _, slopes, _ = _scatter(one)
        if not again and np.mean((one.left + step @ slopes) ** 2) > RUBS * least:
            return None
        one = _searched(record, one.place, one.zeros, False)
    return one if one.power < RUBS * least else None


def _power_of_lines(found: Sequence[_Fitted]) -> float:
    """Return what drives of two poles leave whose command went straight between samples."""
    sent = found[0].record.command.values
    parts = (np.arange(FINER * sent.size) + 0.5) / FINER
    lines = np.interp(parts, np.arange(sent.size), sent).reshape(-1, FINER)
    record = replace(found[0].record, inputs=(lines,))
    two = [one for one in found if one.place.size == 3]
    return min(_searched(record, one.place, one.zeros, one.place[-1] > 0).power for one in two)


def _signs(one: _Fitted) -> Array:
    """Return the mean sign of the velocity in parts of a tick, shape (ticks, parts).

    The velocity is what a drive makes there, and straight between the samples what it leaves; of
    an angle, what the drive makes.
    """
    record, ticks_s = one.record, one.record.command.time_s
    lengths_s = np.append(np.diff(ticks_s), record.interval_s)
    time_s = (ticks_s[:, None] + lengths_s[:, None] * np.arange(FINER) / FINER).ravel()
    finer = one._replace(record=replace(record, time_s=time_s, every_s=0.0))
    velocity = finer.velocity(one.place, one.numerator)
    if not record.every_s:
        velocity = velocity - np.interp(time_s, record.time_s, one.left)
    after = np.append(velocity[1:], velocity[-1])
    mean = (velocity + after) / (np.abs(velocity) + np.abs(after) + TINY)
    return np.asarray(mean.reshape(-1, FINER))


def _scatter(one: _Fitted) -> tuple[Array, Array, Array, Array]:
    """Return a step of place and numerator to where less is left, the scatter, slopes, their sizes.

    The covariance is that of the step, s sᵀ with the scatter s of shape (p, blocks).
    """
    slopes = np.concatenate([_slopes(one, one.place.size), one.table])
    size = np.linalg.norm(slopes, axis=1, keepdims=True)
    size[size == 0] = 1.0
    basis, upper = np.linalg.qr((slopes / size).T)
    inverse = np.linalg.pinv(upper, rcond=1e-15) / size  # one at its limit changes nothing
    block = np.arange(0, one.left.size, -(-one.left.size // BLOCKS))
    sums = np.add.reduceat(basis * one.left[:, None], block)
    return -inverse @ (one.left @ basis), inverse @ sums.T, slopes, size


def _neighbours(one: _Fitted) -> Iterator[_Fitted]:
    """Yield the drive moved by two standard errors either way along each axis of its covariance.

    A move is halved until it changes the velocity about as its slopes say, and leaves no delay
    below zero. At few samples a tick constant one axis is long: delay, fastest pole and numerator
    change together, hardly the velocity at the samples, and the acceleration between them a lot.
    """
    _, scatter, slopes, size = _scatter(one)
    axes, errors, _ = np.linalg.svd(scatter * size, full_matrices=False)
    explained, p = one.numerator @ one.table, one.place.size
    for longest in (ERRORS * errors * axes / size).T:
        most = CURVED * np.linalg.norm(longest @ slopes)
        for move in (longest, -longest):
            for by in (move / 2**halved for halved in range(8)):
                place, numerator = one.place + by[:p], one.numerator + by[p:]
                if place[-1] < 0.0 or np.max(np.abs(by[:p])) > LONG:
                    continue
                if np.linalg.norm(one.velocity(place, numerator) - explained) <= most:
                    yield one._replace(place=place, numerator=numerator)
                    break


class Sampling(NamedTuple):
    """How torque and motion are sampled, and at which lines they are compared.

    Attributes
    ----------
    lines_rad_s : (float, float, int)
        First, last and how many; they follow each other.
    interval_s : float
        Of the ticks.
    torque_filter : (float, int), optional
    angle_alone : bool
        Whether acceleration and velocity are those of the angle's samples.
    """

    lines_rad_s: tuple[float, float, int]
    interval_s: float
    torque_filter: TorqueFilter | None = None
    angle_alone: bool = False


def passed(torque_filter: TorqueFilter | None, omega_rad_s: Array) -> Complex:
    """Return the response of what is in the torque sensor."""
    s = np.asarray(1j * omega_rad_s)
    return np.ones_like(s) if torque_filter is None else lowpass(s, *torque_filter)


@lru_cache(maxsize=128)
def beyond(model: DriveModel, at: Sampling, after_s: float) -> tuple[Complex, Complex]:
    """Return what the torque sees beyond the samples, and the velocity's samples, of each command.

    Parameters
    ----------
    model : DriveModel
    at : Sampling
    after_s : float
        How long after each tick torque and motion were sampled.

    Returns
    -------
    seen : complex array, shape (m, 3)
        What stands before C in the equation of the module.
    velocity : complex array, shape (m, 1)
        F H*, or jω F (H/s)* of the angle's samples.
    """
    omega = np.linspace(*at.lines_rad_s)
    z = np.exp(1j * omega * at.interval_s)
    motion = model.transfer(z, at.interval_s, after_s)
    behind = Drive(model).behind(at.torque_filter).model
    seen = motion if behind is model else behind.transfer(z, at.interval_s, after_s)
    velocity = 1j * omega * motion[2] if at.angle_alone else motion[1]
    sampled = np.stack([1j * omega * velocity, velocity, motion[2]])
    sampled = passed(at.torque_filter, omega) * sampled
    return (seen - sampled).T, sampled[1][:, None]


def alternatives(
    drive: Drive, motion: Complex, sent: Complex, at: Sampling, after_s: Array
) -> Complex:
    """Return how the lines of the motion change: first without a drive, then with others.

    One that tells a little less, the rivals, samples that kept step with the ticks where it may be
    the stamps that did not, and motion that the command does not cause as if it did.

    Parameters
    ----------
    drive : Drive
    motion : complex array, shape (m, 3)
    sent : complex array, shape (m, 1)
        Lines of the command.
    at : Sampling
    after_s : array
        How long the command was in force at each sample of the torque.
    """
    mean_s = round(float(np.mean(after_s)), 9)
    ours, velocity = beyond(drive.model, at, mean_s)
    changes = [-ours, -INEXACT * ours, *(beyond(one, at, mean_s)[0] - ours for one in drive.rivals)]
    turns = complex(np.mean(np.exp(2j * np.pi * after_s / at.interval_s)))
    scattered = np.ptp(after_s) >= ON_EDGE * at.interval_s
    if scattered and SCATTERED / np.sqrt(after_s.size) <= abs(turns) <= 1.0 - ON_EDGE**2:
        kept_s = cmath.phase(turns) / (2 * math.pi) % 1.0 * at.interval_s
        late = np.quantile(after_s, np.linspace(0.05, 0.95, 10))
        there = np.mean([beyond(drive.model, at, one)[0] for one in late.tolist()], axis=0)
        changes.append(beyond(drive.model, at, kept_s)[0] - there)
    return np.stack([*(one * sent for one in changes), ours * (motion[:, 1:2] / velocity - sent)])


def ticks_hz(rig: RigSettings, torque: Channel) -> float:
    """Return how often commands are taken to be sent where none was recorded.

    As the settings state; where they do not, not more often than the torque was sampled.
    """
    stated = "tick_rate_hz" in rig.model_fields_set
    return rig.tick_rate_hz if stated else min(rig.tick_rate_hz, torque.rate_hz)


def without_drive(motion: Complex, rig: RigSettings, at: Sampling) -> Complex:
    """Return `alternatives` where the drive is not known: none, and that of the settings."""
    model = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    seen, velocity = beyond(model, at, 0.0)
    changes = np.zeros((2, *motion.shape), dtype=np.complex128)
    changes[1, :, 0] = seen[:, 0] / velocity[:, 0] * motion[:, 1]
    return changes
