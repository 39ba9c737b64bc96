"""The drive between command and motion, identified from a recording, and what it does unseen.

The command c is held from tick to tick, so the poles λ that the samples of the velocity show go on
between the samples. There the torque sees an acceleration that no derivative of samples tells: with
a drive of second order and 50 Hz, sampled at 1 kHz at the ticks, it is 0.8 % smaller, with a PI
drive 14 %, and all of that would be taken from J.

The velocity is linear in the numerator of a drive, so poles and delay alone are searched (variable
projection; Golub and Pereyra 1973; slopes after Kaufman 1975). With even samples the search begins
at the poles of v_k = Σ a_i v_(k−i) + Σ b_i c_(k−i) with past commands as instruments. A drive with
dry friction answers the sign of its velocity as well, with the same poles and another numerator.

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
from numpy.typing import NDArray

from rigidimeter.analysis.estimate_anew.stretches import Array, Rows, sound
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import RigSettings, Settings
from rigidimeter.model import (
    ON_EDGE,
    SAME_TIME_S,
    DriveModel,
    HeldCommand,
    lowpass,
    same_time,
    state_at_ticks,
    state_later,
    with_conjugates,
)

Complex = NDArray[np.complex128]
Values = Array | Complex

MOST_TRIED = 5  # epochs of a recording, before its drive is taken for unknown
# Of the velocity, and of command and angle; more do not make a drive known any better that is not
# quite linear.
FEWEST_SAMPLES, MOST_SAMPLES, MOST_TICKS = 50, 3000, 8000
SETTLED_S = 0.3  # after the start, and after commands are lost, the state is not known

MOST_POLES = 4  # a velocity PI has two; a lag and a position loop add one each
# In rad a tick: poles are between the first two; an oscillation beyond π looks like a slower one;
# the samples show poles up to the last, of which 1 % is left at the next tick.
SLOWEST, FASTEST, QUICKEST, SEEN = 5e-4, 6.0, 3.0, 4.6
DOUBLE = 1e-4  # poles this close, as a share of their size, are taken for so far apart
BESIDE = 0.3, 4.0  # where the search for a further pole begins, in times the first
LONGEST_S, LONGEST_TICKS, SHORTEST_TICKS = 0.1, 4.0, 0.25  # of delays
PASSED_HZ = 10.0  # an angle is used as the velocity through a low-pass with this corner
# Of stretches of past commands, ever longer the longer ago.
EDGES_TICKS = (0, 1, *sorted(step << octave for octave in range(13) for step in (2, 3)))
MOST_STEPS, ENOUGH = 12, 1e-6  # of a search; the last share of the power to gain
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
# criterion is above the best by more (Kass and Raftery 1995: strong evidence) is no rival.
UNLIKELY, SLOW = 6.0, 1.0
# Shares of the velocity's SD: where noise is larger the angle may show the drive better; where
# more is left the command does not explain it.
NOISY, MISFIT = 0.01, 0.1
# A share of the SD below which nothing needs friction; the share to which it must bring the power,
# times the next where drives of four poles were not tried; how much more power is as good with it,
# for poles bend to what its law leaves; how often sign and drive are made of each other.
QUIET, RUBS, EARLY, RUBBED, SIGNS = 3e-4, 0.8, 0.5, 4.0, 3
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


class TorqueFilter(NamedTuple):
    """A Butterworth low-pass between the torque and its samples."""

    cutoff_hz: float
    order: int


@dataclass(frozen=True, eq=False)
class Drive:
    """The drive of a recording.

    Attributes
    ----------
    model : DriveModel
        From command to velocity.
    rivals : tuple of DriveModel
        Others that explain the velocity as well.
    """

    model: DriveModel
    rivals: tuple[DriveModel, ...] = ()

    def motion(self, command: Channel, time_s: Array) -> Array:
        """Return acceleration, velocity, angle that the command causes from rest, shape (3, n)."""
        tick, after_s = since_ticks(command, time_s, self.model.delay_s)
        held = HeldCommand(self.model, command.values, _lengths_s(command))
        return np.stack(held.motion(tick, after_s))


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
    even_s = command.time_s[0] + interval_s * np.arange(len(command))
    even = np.ptp(command.time_s - even_s) <= 1e-3 * interval_s
    return interval_s if even else np.diff(command.time_s)


def find_drive(epochs: Sequence[Epoch], settings: Settings) -> Drive | None:
    """Return the drive that the first of some epochs shows; None where none does.

    The motion is the velocity, or the angle where that is all there is or has less noise.

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
    for epoch in epochs[:MOST_TRIED]:
        found: list[tuple[float, bool, Drive]] = []
        for name in ("velocity_rad_s", "angle_rad"):
            if name in epoch.channels and (not found or (found[0][1] and found[0][0] > NOISY**2)):
                found += _identified(epoch, epoch.channels[name], start)
        if found:
            return min(found, key=lambda one: one[0])[2]
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
    """

    command: Channel
    interval_s: float
    lengths_s: float | Array
    inputs: tuple[Array, ...]
    time_s: Array
    measured: Array
    scale: float
    every_s: float = 0.0


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
        return _model(self.record, self.place, self.numerator[: self.zeros + 1])


_power = attrgetter("power")


def _record(epoch: Epoch, motion: Channel) -> _Record | None:
    """Return what the drive is identified from; None where there is too little."""
    command = epoch.channels.get("velocity_command_rad_s")
    if command is None or len(command) < 2 * FEWEST_SAMPLES:
        return None
    of_angle, first_s = motion.name == "angle_rad", command.time_s[0] + SETTLED_S
    holes = [one._replace(stop_s=one.stop_s + SETTLED_S * one.lost) for one in epoch.left_out]
    inside = sound(replace(epoch, left_out=tuple(holes)), motion.time_s)
    inside &= (motion.time_s >= first_s) & (motion.time_s <= command.time_s[:MOST_TICKS][-1])
    rows = np.flatnonzero(inside)[: MOST_TICKS if of_angle else MOST_SAMPLES]
    if rows.size < FEWEST_SAMPLES:
        return None
    time_s, measured = motion.time_s[rows], motion.values[rows]
    every_s = of_angle * float(time_s[-1] - time_s[0]) / (rows.size - 1)
    if of_angle:
        measured = np.real(_from_angle(measured, every_s))
    scale, used = float(np.std(measured)), command.time_s <= time_s[-1]
    if scale == 0.0:
        return None
    sent = Channel(command.name, command.time_s[used], command.values[used])
    held = 1.0 / command.mean_rate_hz, _lengths_s(sent), (sent.values[:, None],)
    return _Record(sent, *held, time_s, measured / scale, scale, every_s)


def _identified(
    epoch: Epoch, motion: Channel, start: DriveModel
) -> list[tuple[float, bool, Drive]]:
    """Return the drive that one channel shows, the power it leaves and whether that is noise."""
    record = _record(epoch, motion)
    if record is None:
        return []
    found = _climbed(record, start)
    times = AS_GOOD if len(found[0].record.inputs) == 1 else RUBBED
    best = min(found, key=_power)
    slowly = epoch.ticks is None and best.power > QUIET**2 and _explainable(best) > 0.5 * STAIRS
    if slowly and _power_of_lines(found) < STAIRS * best.power:
        return []
    found = [one for one in found if _fastest(one) < SEEN]  # the samples show every pole
    best = min(found, key=_power, default=best)
    alike = (one for one in found if one.power <= times * best.power + UNSEEN**2)
    chosen = next(alike, None)
    if chosen is None or chosen.power > MISFIT**2 or not 0.5 < chosen.model.gain < 2.0:
        return []
    noise = bool(best.left[1:] @ best.left[:-1] < COLOURED * best.left.size * best.power)
    most = (times if noise else RIVAL) * best.power + UNSEEN**2
    likely = math.inf
    if noise and _fastest(chosen) < SLOW:
        likely = min(map(_information, found)) + UNLIKELY
    rivals = [one for one in found if one.power <= most and _information(one) <= likely]
    others = [one.model for one in rivals if one is not chosen]
    return [(chosen.power, noise, Drive(chosen.model, (*others, *_neighbours(chosen))))]


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
    """
    rubs = len(record.inputs) > 1
    regressed = {} if rubs else _regressed(record)
    speeds = [1.0] if rubs or regressed else [2.0**-n for n in range(6)]
    models = [replace(start, poles_rad_s=tuple(x * p for p in start.poles_rad_s)) for x in speeds]
    found: list[_Fitted] = []
    enough = False
    for poles in range(2, MOST_POLES + 1):
        least = min((one.power for one in found), default=1.0)
        near = [*models, *regressed.get(poles, []), *(one.model for one in found[-2:])]
        begins = [_coordinates(one, record.interval_s, poles, x) for one in near for x in BESIDE]
        for zeros in range(poles - 2 + rubs, poles):
            found.append(_best(record, begins, zeros, least))
            begins.append(found[-1].place)
        best = min(found, key=_power)
        spent = _explainable(best) < WORTH
        done = enough or (spent and best.place[-1] == 0.0)
        enough = spent
        if rubs:
            done = poles > 2 and RUBBED * best.power > least
        elif best.power > QUIET**2 and (done or poles > 2):
            most = best.power * (1.0 if done or poles == MOST_POLES else EARLY)
            if (rubbed := _rubbed(found[1], most)) is not None:
                return _climbed(rubbed.record, rubbed.model)
        if done:
            break
    near = [*models, *regressed.get(1, []), *(one.model for one in found[:2])]
    single = [_coordinates(one, record.interval_s, 1) for one in near]
    found.append(_best(record, single, 0, best.power))
    return sorted(found, key=lambda one: (one.place.size, one.zeros))


def _best(record: _Record, begins: Sequence[Array], zeros: int, least: float) -> _Fitted:
    """Return the drive that explains the velocity best, with a delay only where one is shown.

    `least` is the power that others leave: far above it no delay is searched.
    """
    at = [_answer(record, np.append(one[:-1], 0.0), zeros) for one in begins]
    still = _searched(record, min(at, key=_power).place, zeros, False)
    step, scatter, _ = _scatter(still)
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
    shown = 1.0 - ERRORS**2 / record.measured.size if len(record.inputs) == 1 else 1.0 / RUBBED
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
            if -down @ step[: down.size] <= ENOUGH * one.left.size * (one.power + UNSEEN**2):
                return one
            tried = _answer(record, one.place + step, zeros)
            damping *= 10.0 if tried.power >= one.power else 0.2
        one = tried
    return one


def _answer(record: _Record, place: Array, zeros: int) -> _Fitted:
    """Return the drive at a place, with the numerator that explains the velocity best."""
    degrees = np.resize([1.0, 2.0], place.size - 1)
    lower = np.append(degrees * math.log(SLOWEST), 0.0)
    upper = np.append(degrees * math.log(FASTEST), _longest(record))
    place = np.minimum(np.maximum(place, lower), upper)
    weights, modes = _modes(record, place, zeros)
    table = weights @ modes
    size = np.linalg.norm(table, axis=1) + TINY
    scaled = table / size[:, None]
    numerator = np.linalg.lstsq(scaled @ scaled.T, scaled @ record.measured)[0] / size
    left = numerator @ table - record.measured
    return _Fitted(record, place, zeros, numerator, table, left, float(left @ left) / left.size)


def _slopes(one: _Fitted, count: int) -> Array:
    """Return how the velocity changes along coordinates of the place, shape (count, n)."""
    explained = one.numerator @ one.table
    moved = [
        _velocity(one, one.place + by, one.numerator)
        for by in STEP * np.eye(one.place.size)[:count]
    ]
    return (np.stack(moved) - explained) / STEP


def _velocity(one: _Fitted, place: Array, numerator: Array) -> Array:
    """Return the velocity of a numerator at another place."""
    weights, modes = _modes(one.record, place, one.zeros)
    return np.asarray(numerator @ weights @ modes)


def _modes(record: _Record, place: Array, zeros: int) -> tuple[Array, Array]:
    """Return what each term of a numerator has of each mode, and the modes, shape (m, n)."""
    poles = _poles(place[:-1], record.interval_s)
    delay_s, count = float(place[-1]) * record.interval_s, place.size - 1
    terms = (zeros + 1, count)[: len(record.inputs)]  # friction acts behind the controller's zeros
    weights = np.zeros((sum(terms), count * len(terms)))
    modes: list[Array] = []
    for which, own in enumerate(terms):
        rows = weights[zeros + 1 :] if which else weights[: zeros + 1]
        for pole, shape in zip(poles, _shapes(poles, own - 1), strict=True):
            mode = _mode(record, which, pole, 0.0 if which else delay_s)
            rows[:, len(modes)] = shape.real * (2 if pole.imag else 1)
            modes.append(mode.real)
            if pole.imag:
                rows[:, len(modes)] = -2 * shape.imag
                modes.append(mode.imag)
    return weights, np.stack(modes)


@lru_cache(maxsize=64)
def _mode(record: _Record, which: int, pole: complex, delay_s: float) -> Values:
    """Return x of x' = λ x + c at the stamps; for an angle what `_from_angle` makes of ∫ x dt."""
    values = record.inputs[which]
    tick, held_s = _since(record, delay_s)
    growth = pole if pole.imag else pole.real
    # Held for a tick, the weighted mean of its parts leaves the same state.
    parts = np.arange(values.shape[1] - 1, -1, -1) / values.shape[1]
    share = np.exp(growth * record.interval_s * parts)
    sent = values @ (share / np.sum(share)) if parts.size > 1 else values[:, 0]
    before = state_at_ticks(pole, sent, record.lengths_s)[tick]
    state = state_later(pole, before, sent[tick], held_s)
    if record.every_s:  # x' = λ x + c
        moved = _from_angle(state, record.every_s) - _integral(record, which, delay_s)
        state = np.asarray(moved / growth)
    return state


@lru_cache(maxsize=16)
def _since(record: _Record, delay_s: float) -> tuple[Rows, Array | float]:
    tick, after_s = since_ticks(record.command, record.time_s, delay_s, even=0.0)
    return tick, same_time(after_s)


@lru_cache(maxsize=16)
def _integral(record: _Record, which: int, delay_s: float) -> Values:
    """Return what `_from_angle` makes of ∫ c dt."""
    tick, held_s = _since(record, delay_s)
    sent = np.mean(record.inputs[which], axis=1)
    summed = np.append(0.0, np.cumsum(sent[:-1] * record.lengths_s))
    return _from_angle(summed[tick] + held_s * sent[tick], record.every_s)


def _longest(record: _Record) -> float:
    return max(LONGEST_S / record.interval_s, LONGEST_TICKS)


def _from_angle(angle_rad: Values, interval_s: float) -> Values:
    """Return the velocity through a low-pass, made of the angle without a derivative.

    y_k = e^(−aT) y_(k−1) + θ_k − θ_(k−1), with a the corner: white noise of the angle stays white
    above it, and neither where the angle begins nor a slow drift counts.
    """
    steps = np.diff(angle_rad, prepend=angle_rad[:1])
    return np.asarray(scipy.signal.lfilter([1.0], [1.0, -_kept(interval_s)], steps))


def _kept(interval_s: float) -> float:
    return math.exp(-2 * math.pi * PASSED_HZ * interval_s)


def _model(record: _Record, place: Array, numerator: Array) -> DriveModel:
    """Return the drive at a place with a numerator for the command."""
    poles = _poles(place[:-1], record.interval_s)
    residues = record.scale * _shapes(poles, numerator.size - 1) @ numerator
    return DriveModel(poles, tuple(residues.tolist()), float(place[-1]) * record.interval_s)


def _poles(place: Array, interval_s: float) -> tuple[complex, ...]:
    """Return the poles, of a conjugate pair the one with the positive imaginary part."""
    poles: list[complex] = []
    coefficients = np.exp(place).tolist()
    for a, b in zip(coefficients[::2], coefficients[1::2], strict=False):
        root = cmath.sqrt(a * a / 4 - b)
        root = root if abs(root) >= DOUBLE * a else complex(DOUBLE * a)
        if root.imag:
            poles.append(complex(-a / 2, min(abs(root.imag), QUICKEST)))
        else:
            poles += [complex(-a / 2 - root.real), complex(-b / (a / 2 + root.real))]
    if len(coefficients) % 2:
        poles.append(complex(-coefficients[-1]))
    return tuple(pole / interval_s for pole in poles)


def _shapes(poles: tuple[complex, ...], zeros: int) -> Complex:
    """Return the residues of s^j / Π(s − λ), s in units of the first pole, shape (poles, j)."""
    unit = abs(poles[0])
    everyone = with_conjugates(poles)
    rests = [math.prod(((pole - p) / unit for p in everyone if p != pole), start=complex(1))
             for pole in poles]  # fmt: skip
    return np.array([[unit * (pole / unit) ** j / rest for j in range(zeros + 1)]
                     for pole, rest in zip(poles, rests, strict=True)])  # fmt: skip


def _coordinates(drive: DriveModel, interval_s: float, poles: int, beside: float = 1.0) -> Array:
    """Return where a search with so many poles begins at a drive."""
    slowest = sorted(drive.poles_rad_s, key=lambda pole: (pole.imag == 0, abs(pole)))
    everyone = with_conjugates(slowest)[:poles]
    everyone += [complex(-abs(everyone[0]) * beside**n)
                 for n in range(1, poles - len(everyone) + 1)]  # fmt: skip
    found: list[float] = []
    for a, b in zip(everyone[::2], everyone[1::2], strict=False):
        found += [-(a + b).real * interval_s, (a * b).real * interval_s**2]
    if poles % 2:  # one of a pair does not stand alone
        found.append(abs(everyone[-1]) * interval_s)
    return np.append(np.log(found), drive.delay_s / interval_s)


@lru_cache(maxsize=2)
def _past(record: _Record) -> Array:
    """Return independent sums of past commands at the stamps, shape (n, e)."""
    sums = np.append(0.0, np.cumsum(record.command.values))
    tick, _ = _since(record, 0.0)
    edges = [sums[np.maximum(tick + 1 - lag, 0)] for lag in EDGES_TICKS if lag <= tick[-1]]
    table = np.diff(edges, axis=0).T
    return np.linalg.qr(table / (np.linalg.norm(table, axis=0) + TINY))[0]


def _explainable(one: _Fitted) -> float:
    """Return how much of what is left any linear drive might explain, as a share of its power.

    Whatever its poles, it adds up past commands. What chance gives so many is taken off.
    """
    past = _past(one.record)
    n, e = past.shape
    share = np.sum((one.left @ past) ** 2) / (one.power * n + TINY)
    return float(1.0 - (1.0 - share) * n / max(n - e, 1))


def _regressed(record: _Record) -> dict[int, list[DriveModel]]:
    """Return drives with the poles of regressions on even samples, by their number; or none."""
    tick, held_s = _since(record, 0.0)
    rows = np.arange(MOST_POLES, tick.size)
    rows = rows[tick[rows] - tick[rows - MOST_POLES] == MOST_POLES]
    found: dict[int, list[DriveModel]] = {}
    if np.ndim(held_s) or np.ndim(record.lengths_s) or rows.size < FEWEST_SAMPLES:
        return found
    sent = record.command.values
    if record.every_s:
        sent = scipy.signal.lfilter([1.0], [1.0, -_kept(record.every_s)], sent)
    columns = [record.measured[rows - lag] for lag in range(MOST_POLES + 1)]
    columns += [sent[np.maximum(tick[rows] - lag, 0)] for lag in range(MOST_POLES + 2)]
    through = _past(record)[rows].T @ np.stack(columns, axis=1)
    for poles in range(1, MOST_POLES + 1):
        own = [*range(1, poles + 1), *range(MOST_POLES + 1, MOST_POLES + poles + 3)]
        values = np.linalg.lstsq(through[:, own], through[:, 0], rcond=1e-12)[0]
        roots = np.roots([1.0, *-values[:poles]]) + 0j
        lasting = (np.abs(roots) < 1) & ((roots.imag > 0) | ((roots.imag == 0) & (roots.real > 0)))
        if np.any(lasting):
            shown = np.log(roots[lasting]) / record.interval_s
            found[poles] = [DriveModel(tuple(shown.tolist()), ())]
    return found


def _rubbed(one: _Fitted, least: float) -> _Fitted | None:
    """Return a drive with friction, where the sign of its velocity explains what others leave."""
    for again in range(SIGNS):
        record = replace(one.record, inputs=(one.record.inputs[0], _signs(one)))
        one = _answer(record, np.append(one.place[:-1], 0.0), one.zeros)
        step, _, slopes = _scatter(one)
        if not again and np.mean((one.left + step @ slopes) ** 2) > RUBS * least:
            return None
        one = _searched(record, one.place, one.zeros, False)
    return one if one.power < RUBS * least else None


def _signs(one: _Fitted) -> Array:
    """Return the mean sign of the velocity in parts of a tick, shape (ticks, parts).

    The velocity is what a drive makes there, and straight between the samples what it leaves; of
    an angle, what the drive makes.
    """
    record = one.record
    ticks_s = np.append(record.command.time_s, record.command.time_s[-1] + record.interval_s)
    parts = np.arange(FINER * len(record.command)) / FINER
    time_s = np.interp(parts, np.arange(ticks_s.size), ticks_s)
    inputs = tuple(np.repeat(x, FINER // x.shape[1], axis=1).reshape(-1, 1) for x in record.inputs)
    sent = Channel(record.command.name, time_s, inputs[0][:, 0])
    finer = replace(record, command=sent, lengths_s=_lengths_s(sent), inputs=inputs, time_s=time_s)
    velocity = _velocity(one._replace(record=replace(finer, every_s=0.0)), one.place, one.numerator)
    if not record.every_s:
        velocity = velocity - np.interp(time_s, record.time_s, one.left)
    after = np.append(velocity[1:], velocity[-1])
    mean = (velocity + after) / (np.abs(velocity) + np.abs(after) + TINY)
    return np.asarray(mean.reshape(-1, FINER))


def _power_of_lines(found: Sequence[_Fitted]) -> float:
    """Return what drives of two poles leave whose command went straight between samples."""
    sent = found[0].record.command.values
    parts = (np.arange(FINER * sent.size) + 0.5) / FINER
    lines = np.interp(parts, np.arange(sent.size), sent).reshape(-1, FINER)
    record = replace(found[0].record, inputs=(lines,))
    begins = [(one.place, one.zeros) for one in found if one.place.size == 3]
    return min(_searched(record, *begin, begin[0][-1] > 0).power for begin in begins)


def _scatter(one: _Fitted) -> tuple[Array, Array, Array]:
    """Return a step of place and numerator to where less is left, the scatter, and the slopes.

    The covariance is that of the step, s sᵀ with the scatter s of shape (p, blocks).
    """
    slopes = np.concatenate([_slopes(one, one.place.size), one.table])
    size = np.linalg.norm(slopes, axis=1)
    size[size == 0] = 1.0
    basis, upper = np.linalg.qr((slopes / size[:, None]).T)
    inverse = np.linalg.pinv(upper, rcond=1e-15) / size[:, None]  # one at its limit changes nothing
    block = np.arange(0, one.left.size, -(-one.left.size // BLOCKS))
    sums = np.add.reduceat(basis * one.left[:, None], block)
    return -inverse @ (one.left @ basis), inverse @ sums.T, slopes


def _neighbours(one: _Fitted) -> Iterator[DriveModel]:
    """Yield the drive moved by two standard errors either way along each axis of its covariance.

    A move is halved until it changes the velocity about as its slopes say, and leaves no delay
    below zero. At few samples a tick constant one axis is long: delay, fastest pole and numerator
    change together, hardly the velocity at the samples, and the acceleration between them a lot.
    """
    _, scatter, slopes = _scatter(one)
    size = np.linalg.norm(slopes, axis=1, keepdims=True)
    size[size == 0] = 1.0
    axes, errors, _ = np.linalg.svd(scatter * size, full_matrices=False)
    explained, p = one.numerator @ one.table, one.place.size
    for longest in (ERRORS * errors * axes / size).T:
        most = CURVED * np.linalg.norm(longest @ slopes)
        for move in (longest, -longest):
            for by in (move / 2**halved for halved in range(8)):
                place, numerator = one.place + by[:p], one.numerator + by[p:]
                if place[-1] < 0.0 or np.max(np.abs(by[:p])) > LONG:
                    continue
                if np.linalg.norm(_velocity(one, place, numerator) - explained) <= most:
                    yield _model(one.record, place, numerator[: one.zeros + 1])
                    break


def behind(drive: Drive, torque_filter: TorqueFilter | None) -> Drive:
    """Return the drive as the torque sensor sees its motion."""
    return drive if torque_filter is None else Drive(drive.model.smoothed(*torque_filter))


def beyond(
    model: DriveModel,
    omega_rad_s: Array,
    interval_s: float,
    after_s: float,
    torque_filter: TorqueFilter | None = None,
    *,
    angle_alone: bool = False,
) -> tuple[Complex, Complex]:
    """Return what the torque sees beyond the samples, and the velocity's samples, of each command.

    Parameters
    ----------
    model : DriveModel
    omega_rad_s : array, shape (m,)
        Of lines that follow each other.
    interval_s : float
        Of the ticks.
    after_s : float
        How long after each tick torque and motion were sampled.
    torque_filter : TorqueFilter, optional
    angle_alone : bool
        Whether acceleration and velocity are those of the angle's samples.

    Returns
    -------
    seen : complex array, shape (m, 3)
        What stands before C in the equation of the module.
    velocity : complex array, shape (m, 1)
        F H*, or jω F (H/s)* of the angle's samples.
    """
    lines = float(omega_rad_s[0]), float(omega_rad_s[-1]), omega_rad_s.size
    interval_s, after_s = float(f"{interval_s:.9g}"), round(after_s, 9)
    return _beyond(model, lines, interval_s, after_s, torque_filter, angle_alone)


@lru_cache(maxsize=128)
def _beyond(
    model: DriveModel,
    lines: tuple[float, float, int],
    interval_s: float,
    after_s: float,
    torque_filter: TorqueFilter | None,
    angle_alone: bool,
) -> tuple[Complex, Complex]:
    omega = np.linspace(*lines)
    z = np.exp(1j * omega * interval_s)
    seen = motion = model.transfer(z, interval_s, after_s)
    through: Complex = np.ones(omega.size, dtype=np.complex128)
    if torque_filter is not None:
        through = lowpass(np.asarray(1j * omega), *torque_filter)
        seen = model.smoothed(*torque_filter).transfer(z, interval_s, after_s)
    velocity = 1j * omega * motion[2] if angle_alone else motion[1]
    sampled = through * np.stack([1j * omega * velocity, velocity, motion[2]])
    return (seen - sampled).T, sampled[1][:, None]


def alternatives(
    drive: Drive,
    motion: Complex,
    sent: Complex,
    omega_rad_s: Array,
    interval_s: float,
    after_s: Array,
    torque_filter: TorqueFilter | None = None,
    angle_alone: bool = False,
) -> list[Complex]:
    """Return how the lines of the motion change: first without a drive, then with others.

    One that tells a little less, the rivals, samples that kept step with the ticks where it may be
    the stamps that did not, and motion that the command does not cause as if it did.

    Parameters
    ----------
    drive : Drive
    motion : complex array, shape (m, 3)
    sent : complex array, shape (m, 1)
        Lines of the command.
    omega_rad_s, interval_s, torque_filter, angle_alone
        Those of `beyond`.
    after_s : array
        How long the command was in force at each sample of the torque.
    """

    def seen(model: DriveModel, late_s: float) -> tuple[Complex, Complex]:
        at = omega_rad_s, interval_s, late_s, torque_filter
        return beyond(model, *at, angle_alone=angle_alone)

    mean_s = float(np.mean(after_s))
    ours, velocity = seen(drive.model, mean_s)
    changes = [-ours, -INEXACT * ours, *(seen(one, mean_s)[0] - ours for one in drive.rivals)]
    turns = complex(np.mean(np.exp(2j * np.pi * after_s / interval_s)))
    scattered = np.ptp(after_s) >= ON_EDGE * interval_s
    if scattered and SCATTERED / np.sqrt(after_s.size) <= abs(turns) <= 1.0 - ON_EDGE**2:
        kept_s = cmath.phase(turns) / (2 * math.pi) % 1.0 * interval_s
        late = np.quantile(after_s, np.linspace(0.05, 0.95, 10))
        there = np.mean([seen(drive.model, one)[0] for one in late.tolist()], axis=0)
        changes.append(seen(drive.model, kept_s)[0] - there)
    return [*(one * sent for one in changes), ours * (motion[:, 1:2] / velocity - sent)]


def ticks_hz(rig: RigSettings, torque: Channel) -> float:
    """Return how often commands are taken to be sent where none was recorded.

    As the settings state; where they do not, not more often than the torque was sampled.
    """
    stated = "tick_rate_hz" in rig.model_fields_set
    return rig.tick_rate_hz if stated else min(rig.tick_rate_hz, torque.rate_hz)


def without_drive(
    motion: Complex,
    rig: RigSettings,
    torque: Channel,
    torque_filter: TorqueFilter | None,
    omega_rad_s: Array,
) -> list[Complex]:
    """Return `alternatives` where the drive is not known: none, and that of the settings."""
    model = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    seen, velocity = beyond(model, omega_rad_s, 1.0 / ticks_hz(rig, torque), 0.0, torque_filter)
    change = np.zeros_like(motion)
    change[:, 0] = seen[:, 0] / velocity[:, 0] * motion[:, 1]
    return [np.zeros_like(change), change]
