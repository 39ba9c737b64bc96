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
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimate_anew.stretches import Array, sound
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

MOST_TRIED = 5
"""So many epochs of a recording may fail to show the drive before it is taken for unknown."""

FEWEST_SAMPLES, MOST_SAMPLES, MOST_TICKS = 50, 3000, 8000
"""Of the velocity, and of command and angle; more do not make a drive known any better that is not
quite linear."""

SETTLED_S = 0.3
"""The state of the drive is not known for so long after the start and after commands are lost."""

MOST_POLES = 4
"""A velocity PI has two; a lag and a position loop add one each."""

FASTEST, SLOWEST, QUICKEST, FORGOTTEN = 6.0, 5e-4, 3.0, 0.01
"""In rad a tick, poles are between the first two; an oscillation beyond π looks like a slower one;
a pole of which no more than the last is left at the next tick is not seen."""

DOUBLE = 1e-4
"""Two poles that are this close, as a share of their size, are taken for so far apart."""

LONGEST_S, LONGEST_TICKS, SHORTEST_TICKS = 0.1, 4.0, 0.25
"""The longest delay is the larger of the first two; a search begins at the last or later."""

SPEEDS = tuple(2.0**-n for n in range(6))
"""Of the drive of the settings, at which a search begins where no instruments serve."""

LAGS = 24
"""Past commands that are instruments."""

AS_GOOD, UNSEEN = 1.05, 2e-5
"""A drive that leaves no more than so many times the power of the best, and this share of the SD of
the velocity, explains as well."""

WORTH = 0.02
"""A further pole is worth a try where past commands explain this share of what is left."""

LAGS_TICKS = (0, *sorted(step << octave for octave in range(13) for step in (2, 3)))
"""Edges of stretches of the command, ever longer the longer ago."""

RIVAL, COLOURED = 4.0, 1 / 3
"""If what the best leaves is not noise, but correlated by so much from sample to sample, one that
leaves so many times its power might be there."""

UNLIKELY, SLOW = 6.0, 1.0
"""Where it is noise and no pole is faster, in rad a tick, a drive whose information criterion is
above the best by more (Kass and Raftery 1995: strong evidence against it) does not explain it."""

QUIET, RUBS, RUBBED, SIGNS = 3e-4, 0.8, 4.0, 3
"""What is left below this share of the SD needs no friction, which must bring its power down to the
second share. With it, drives are alike up to so many times the power: poles bend to what the law of
friction leaves. The last: how often the sign is made from the drive and the drive from the sign."""

STAIRS, FINER = 0.5, 4
"""A command that was logged more slowly than it was sent goes on between its samples: if lines
between them, in so many steps, leave this share of what stairs leave, the stairs are not known."""

NOISY = 0.01
"""Where a velocity leaves noise above this share of its SD, the angle may show the drive better."""

LARGEST_MISFIT = 0.1
"""Above this share of the velocity's SD the command does not explain it."""

PASSED_HZ = 10.0
"""An angle is used as the velocity through a low-pass of first order and this corner."""

ERRORS = 2.0
"""A delay is there if it is longer than so many standard errors; neighbours are so far away."""

BLOCKS = 32
"""Sums of the scores over so many stretches tell their scatter, whatever colour the noise has."""

STEP, LONG, CURVED, HALVINGS = 1e-4, 5.0, 2.0, 8
"""Of a coordinate, for its slope; the longest move of one; a move that changes the velocity by more
times what the slopes say is too long, and is halved up to so often."""

INEXACT = 0.005
"""No drive is quite linear: so much of what it tells of the motion between samples is uncertain."""

SCATTERED = 5.0
"""Stamps keep step with the ticks if their mean direction is so many standard errors long."""

TINY = float(np.finfo(np.float64).tiny)


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
) -> tuple[NDArray[np.intp], Array]:
    """Return the last tick whose command acts at the times, and for how long it has.

    A time that is `even` of an interval or less before a tick is that tick.
    """
    # From the first tick on: on a clock that counts from 1970 a delay is below the rounding.
    ticks_s, interval_s = command.time_s - command.time_s[0], 1.0 / command.mean_rate_hz
    then_s = (time_s - command.time_s[0]) - delay_s
    near_s = max(even * interval_s, SAME_TIME_S)
    edges_s = np.concatenate(([-np.inf], ticks_s[1:], [np.inf]))
    tick = np.clip((then_s + near_s) / interval_s, 0, ticks_s.size - 1).astype(np.intp)
    other = (then_s + near_s < edges_s[tick]) | (then_s + near_s >= edges_s[tick + 1])
    if np.any(other):  # the ticks did not come evenly
        tick[other] = np.searchsorted(edges_s, then_s[other] + near_s, side="right") - 1
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
        Of its rig, the drive is where a search may begin.

    Returns
    -------
    Drive or None
        None if the command was not recorded, if no drive explains the motion, or if the command
        seems to have been logged more slowly than it was sent, which a loop of ours does not do.
    """
    start = DriveModel.second_order(
        settings.rig.drive_bandwidth_hz, settings.rig.drive_damping_ratio
    )
    for epoch in epochs[:MOST_TRIED]:
        best: _Identified | None = None
        for name in ("velocity_rad_s", "angle_rad"):
            if name in epoch.channels and (best is None or (best.noise and best.power > NOISY**2)):
                one = _identified(epoch, epoch.channels[name], start)
                best = min((one, best), key=lambda x: math.inf if x is None else x.power)
        if best is not None:
            return best.drive
    return None


@dataclass(frozen=True, eq=False)
class _Record:
    """What a drive is identified from.

    Attributes
    ----------
    command : Channel
    interval_s : float
        Of the ticks.
    time_s, measured : array, shape (n,)
        The velocity at its stamps, as a share of its SD.
    scale : float
        Its SD.
    of_angle : bool
        Whether the angle was measured and `measured` is `_from_angle`.
    sign : Channel or None
        Of the velocity, in parts of a tick, where dry friction acts on the drive.
    """

    command: Channel
    interval_s: float
    time_s: Array
    measured: Array
    scale: float
    of_angle: bool = False
    sign: Channel | None = None


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


class _Identified(NamedTuple):
    """A drive, the power that it leaves of the motion, and whether that is noise."""

    drive: Drive
    power: float
    noise: bool


def _record(epoch: Epoch, motion: Channel) -> _Record | None:
    """Return what the drive is identified from; None where there is too little."""
    command = epoch.channels.get("velocity_command_rad_s")
    if command is None or len(command) < 2 * FEWEST_SAMPLES:
        return None
    time_s, of_angle = motion.time_s, motion.name == "angle_rad"
    inside = (time_s >= command.time_s[0] + SETTLED_S) & (time_s <= command.time_s[:MOST_TICKS][-1])
    inside &= sound(epoch, time_s)
    for hole in epoch.left_out:
        if hole.lost:
            inside &= (time_s < hole.stop_s) | (time_s > hole.stop_s + SETTLED_S)
    most = MOST_TICKS if of_angle else MOST_SAMPLES
    time_s, measured = time_s[inside][:most], motion.values[inside][:most]
    if time_s.size < FEWEST_SAMPLES:
        return None
    if of_angle:
        measured = _from_angle(measured, _mean_interval_s(time_s))
    scale = float(np.std(measured))
    if scale == 0.0:
        return None
    used = command.time_s <= time_s[-1]
    sent = Channel(command.name, command.time_s[used], command.values[used])
    return _Record(sent, 1.0 / command.mean_rate_hz, time_s, measured / scale, scale, of_angle)


def _identified(epoch: Epoch, motion: Channel, start: DriveModel) -> _Identified | None:
    """Return the drive that one channel of the motion shows; None where it shows none."""
    record = _record(epoch, motion)
    if record is None:
        return None
    found = _climbed(record, start)
    least = min(found, key=_power)
    rubbed = _rubbed(least) if least.power > QUIET**2 else None
    if rubbed is not None:
        record, found = rubbed, _climbed(rubbed, least.model)
    found = [one for one in found if _ticks_show(one)]
    if not found:
        return None
    best = min(found, key=_power)
    if epoch.ticks is None and best.power > QUIET**2 and _between_lines(best) < STAIRS:
        return None
    times = AS_GOOD if record.sign is None else RUBBED
    chosen = next(one for one in found if one.power <= times * best.power + UNSEEN**2)
    model = chosen.model
    if chosen.power > LARGEST_MISFIT**2 or not 0.5 < model.gain < 2.0:
        return None
    noise = best.left[1:] @ best.left[:-1] < COLOURED * best.left.size * best.power
    most = (times if noise else RIVAL) * best.power + UNSEEN**2
    others = [one for one in found if one is not chosen and one.power <= most]
    if noise and max(map(abs, model.poles_rad_s)) * record.interval_s < SLOW:
        likely = min(map(_information, found)) + UNLIKELY
        others = [one for one in others if _information(one) <= likely]
    rivals = [*(one.model for one in others), *_neighbours(chosen)]
    if not noise:  # where a drive is not linear its halves differ
        middle = record.time_s.size // 2
        for part in (slice(middle), slice(middle, None)):
            half = replace(record, time_s=record.time_s[part], measured=record.measured[part])
            rivals.append(_searched(half, chosen.place, chosen.zeros, chosen.place[-1] > 0).model)
    return _Identified(Drive(model, tuple(rivals)), chosen.power, noise)


def _power(one: _Fitted) -> float:
    return one.power


def _ticks_show(one: _Fitted) -> bool:
    """Return whether the samples show every pole."""
    fastest = max(-pole.real for pole in one.model.poles_rad_s)
    return math.exp(-fastest * one.record.interval_s) > FORGOTTEN


def _information(one: _Fitted) -> float:
    """Return n ln σ² + k ln n (Schwarz 1978), with k poles, numerator and delay."""
    n, k = one.left.size, one.place.size - 1 + one.numerator.size + (one.place[-1] > 0)
    return float(n * math.log(one.power + UNSEEN**2) + k * math.log(n))


def _climbed(record: _Record, start: DriveModel) -> list[_Fitted]:
    """Return ever larger drives, up to where past commands explain no more of what is left.

    Each with two zeros fewer than poles (it smooths the steps of the command) and with one fewer
    (its acceleration jumps at them). One pole more where the best has a delay: a lag looks like it.
    """
    models = [replace(start, poles_rad_s=tuple(share * p for p in start.poles_rad_s))
              for share in SPEEDS]  # fmt: skip
    models = [*_regressed(record), *models]
    found: list[_Fitted] = []
    enough = False
    for poles in range(1, MOST_POLES + 1):
        begins = [_coordinates(one, record.interval_s, poles) for one in models]
        for zeros in range(max(poles - 2, 0), poles):
            found.append(_best(record, begins, zeros))
            begins.append(found[-1].place[:-1])
        models += [one.model for one in found[-2:]]
        if poles == 1:
            continue
        best = min(found, key=_power)
        spent = _explainable(best) < WORTH
        if enough or (spent and best.place[-1] == 0.0):
            break
        enough = spent
    return found


def _best(record: _Record, begins: Sequence[Array], zeros: int) -> _Fitted:
    """Return the drive that explains the velocity best, with a delay only where one is shown."""
    at = [_answer(record, np.append(begin, 0.0), zeros) for begin in begins]
    still = _searched(record, min(at, key=_power).place, zeros, False)
    matrix = np.concatenate([_slopes(still), still.table])
    delay = still.place.size - 1
    step = np.linalg.lstsq(matrix @ matrix.T, -matrix @ still.left)[0][delay]
    if step <= 0 or step <= ERRORS * math.sqrt(
        max(_covariance(matrix, still.left)[delay, delay], 0)
    ):
        return still
    ticks = np.geomspace(SHORTEST_TICKS, _longest(record), 12)
    late = [_answer(record, np.append(still.place[:-1], one), zeros) for one in ticks]
    moved = _searched(record, min(late, key=_power).place, zeros, True)
    shown = 1.0 - ERRORS**2 / record.measured.size if record.sign is None else 1.0 / RUBBED
    return moved if moved.place[-1] > 0 and moved.power < shown * still.power else still


def _searched(record: _Record, begin: Array, zeros: int, delayed: bool) -> _Fitted:
    """Return the best drive near a place, whose delay is searched too or stays."""
    free = begin.size if delayed else begin.size - 1

    def at(x: Array) -> _Fitted:
        return _answer(record, np.append(x, begin[free:]), zeros)

    def left(x: Array) -> Array:
        return at(x).left

    def slopes(x: Array) -> Array:
        one = at(x)
        along = _slopes(one)[:free]
        size = np.linalg.norm(one.table, axis=1, keepdims=True) + TINY
        table = one.table / size
        return along - np.linalg.lstsq(table @ table.T, table @ along.T)[0].T @ table

    x, *_ = scipy.optimize.leastsq(left, begin[:free], Dfun=slopes, col_deriv=True,
                                   ftol=1e-6, xtol=1e-6, maxfev=30)  # fmt: skip
    return at(x)


def _answer(record: _Record, place: Array, zeros: int) -> _Fitted:
    """Return the drive at a place, with the numerator that explains the velocity best."""
    degrees = np.resize([1.0, 2.0], place.size - 1)
    lower = np.append(degrees * math.log(SLOWEST), 0.0)
    upper = np.append(degrees * math.log(FASTEST), _longest(record))
    place = np.clip(place, lower, upper)
    weights, modes = _modes(record, place, zeros)
    table = weights @ modes
    size = np.linalg.norm(table, axis=1) + TINY
    scaled = table / size[:, None]
    numerator = np.linalg.lstsq(scaled @ scaled.T, scaled @ record.measured)[0] / size
    left = numerator @ table - record.measured
    return _Fitted(record, place, zeros, numerator, table, left, float(left @ left) / left.size)


def _slopes(one: _Fitted) -> Array:
    """Return how the velocity changes along each coordinate of the place, shape (p, n)."""
    explained, rows = one.numerator @ one.table, []
    for by in STEP * np.eye(one.place.size):
        weights, modes = _modes(one.record, one.place + by, one.zeros)
        rows.append((one.numerator @ weights @ modes - explained) / STEP)
    return np.stack(rows)


def _modes(record: _Record, place: Array, zeros: int) -> tuple[Array, Array]:
    """Return the velocities of the poles, shape (m, n), and what each numerator has of them."""
    poles = _poles(place[:-1], record.interval_s)
    acting = [(zeros, float(place[-1]) * record.interval_s, False)]
    if record.sign is not None:  # friction acts behind the controller, whose zeros are not its own
        acting.append((place.size - 2, 0.0, True))
    rows, parts = [], []
    for own_zeros, delay_s, of_sign in acting:
        own = []
        for pole, shape in zip(poles, _shapes(poles, own_zeros), strict=True):
            mode = _mode(record, pole, delay_s, of_sign)
            if pole.imag:
                rows += [mode.real, mode.imag]
                own += [2 * shape.real, -2 * shape.imag]
            else:
                rows.append(mode)
                own.append(shape.real)
        parts.append(np.array(own).T)
    return scipy.linalg.block_diag(*parts), np.stack(rows)


@lru_cache(maxsize=64)
def _mode(record: _Record, pole: complex, delay_s: float, of_sign: bool) -> Array | Complex:
    """Return x of x' = λ x + c at the stamps of the velocity; for an angle as it is made of it."""
    channel = record.sign if of_sign and record.sign is not None else record.command
    tick, held_s = _since(record, delay_s, of_sign)
    sent, lengths_s = channel.values, _lengths(record, of_sign)
    before = np.asarray(state_at_ticks(pole, sent, lengths_s))
    state = np.asarray(state_later(pole, before[tick], sent[tick], held_s))
    if not record.of_angle:
        return state
    # ∫ x dt, as x' = λ x + c
    summed = np.concatenate(([0.0], np.cumsum(sent[:-1] * lengths_s)))
    integral = (state - summed[tick] - held_s * sent[tick]) / (pole if pole.imag else pole.real)
    return _from_angle(integral, _mean_interval_s(record.time_s))


@lru_cache(maxsize=16)
def _since(
    record: _Record, delay_s: float, of_sign: bool
) -> tuple[NDArray[np.intp], Array | float]:
    channel = record.sign if of_sign and record.sign is not None else record.command
    tick, after_s = since_ticks(channel, record.time_s, delay_s, even=0.0)
    return tick, same_time(after_s)


@lru_cache(maxsize=16)
def _lengths(record: _Record, of_sign: bool) -> float | Array:
    return _lengths_s(record.sign if of_sign and record.sign is not None else record.command)


def _longest(record: _Record) -> float:
    return max(LONGEST_S / record.interval_s, LONGEST_TICKS)


def _mean_interval_s(time_s: Array) -> float:
    return float(time_s[-1] - time_s[0]) / (time_s.size - 1)


def _from_angle(angle_rad: Array, interval_s: float) -> Array:
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
    rows = []
    for pole in poles:
        rest = math.prod(((pole - p) / unit for p in everyone if p != pole), start=complex(1))
        rows.append([unit * (pole / unit) ** j / rest for j in range(zeros + 1)])
    return np.array(rows)


def _coordinates(drive: DriveModel, interval_s: float, poles: int) -> Array:
    """Return where a search with so many poles begins at a drive; what it lacks is slower."""
    pairs = [pole for pole in with_conjugates(drive.poles_rad_s) if pole.imag]
    single = sorted((pole for pole in drive.poles_rad_s if not pole.imag), key=abs)
    if poles % 2 and not single:
        single = [complex(-abs(pairs[0]) * 0.3) * interval_s / interval_s]
    everyone = [pole * interval_s for pole in (*pairs, *single)]
    everyone += [complex(-abs(everyone[0]) * 0.3**n) for n in range(1, poles - len(everyone) + 1)]
    found: list[float] = []
    for a, b in zip(everyone[:poles][::2], everyone[:poles][1::2], strict=False):
        found += [math.log(-(a + b).real), math.log((a * b).real)]
    if poles % 2:
        found.append(math.log(-everyone[poles - 1].real))
    return np.array(found)


def _regressed(record: _Record) -> Iterator[DriveModel]:
    """Yield drives with the poles that regressions of even samples have; none of uneven ones."""
    tick, held_s = _since(record, 0.0, False)
    if not isinstance(held_s, float) or not isinstance(_lengths(record, False), float):
        return
    rows = np.arange(MOST_POLES, tick.size)
    rows = rows[(tick[rows] - tick[rows - MOST_POLES] == MOST_POLES) & (tick[rows] >= LAGS)]
    if rows.size < 4 * LAGS:
        return
    sent = record.command.values
    if record.of_angle:
        sent = scipy.signal.lfilter([1.0], [1.0, -_kept(record.interval_s)], sent)
    columns = [sent[tick[rows] - lag] for lag in range(LAGS)]
    columns += [record.measured[rows - lag] for lag in range(MOST_POLES + 1)]
    through = np.linalg.qr(np.stack(columns, axis=1), mode="r")[:LAGS]
    for poles in range(1, MOST_POLES + 1):
        own = [*range(poles + 2), *range(LAGS + 1, LAGS + 1 + poles)]
        values = np.linalg.lstsq(through[:, own], through[:, LAGS], rcond=1e-10)[0][poles + 2 :]
        roots = [complex(z) for z in np.roots([1.0, *-values])]
        good = [z for z in roots if z.imag >= 0 and 1e-3 < abs(z) < 1 and (z.imag or z.real > 0)]
        if good:
            yield DriveModel(
                tuple(cmath.log(z) / record.interval_s for z in good), (0j,) * len(good)
            )


def _explainable(one: _Fitted) -> float:
    """Return how much of what is left any linear drive might explain, as a share of its power.

    Whatever its poles, it adds up past commands: so do their means over `LAGS_TICKS`. What chance
    gives so many of them is taken off.
    """
    sums = np.concatenate(([0.0], np.cumsum(one.record.command.values)))
    tick, _ = _since(one.record, 0.0, False)
    edges = [sums[np.maximum(tick + 1 - lag, 0)] for lag in LAGS_TICKS if lag <= tick[-1]]
    table = np.diff(edges, axis=0)
    table /= np.linalg.norm(table, axis=1, keepdims=True) + TINY
    along = table @ one.left
    explained = float(along @ np.linalg.lstsq(table @ table.T, along)[0])
    free = max(one.left.size - len(table), 1)
    return 1.0 - (1.0 - explained / (one.power * one.left.size)) * one.left.size / free


def _rubbed(one: _Fitted) -> _Record | None:
    """Return the record with the sign of its velocity, where dry friction explains what is left."""
    record, least = one.record, one.power
    record = replace(record, sign=_sign(one))
    for _ in range(SIGNS):
        first = _searched(
            record, np.append(_coordinates(one.model, record.interval_s, 2), 0.0), 1, False
        )
        one = first
        record = replace(record, sign=_sign(one))
    return None if one.power > RUBS * least else record


def _sign(one: _Fitted) -> Channel:
    """Return the mean sign of the velocity in parts of a tick.

    The velocity is what a drive makes there, and straight between the samples what it leaves; of
    an angle, what the drive makes.
    """
    time_s = _finer(one.record.command.time_s)
    there = replace(one.record, time_s=time_s, of_angle=False)
    weights, modes = _modes(there, one.place, one.zeros)
    velocity = one.numerator @ weights @ modes
    if not one.record.of_angle:
        velocity = velocity - np.interp(time_s, one.record.time_s, one.left)
    after = np.append(velocity[1:], velocity[-1])
    larger = np.maximum(np.abs(velocity) + np.abs(after), TINY)
    return Channel("velocity_rad_s", time_s, (velocity + after) / larger)


def _finer(ticks_s: Array) -> Array:
    """Return times that divide each tick evenly."""
    place = np.arange(FINER * (ticks_s.size - 1) + 1) / FINER
    return np.interp(place, np.arange(ticks_s.size), ticks_s)


def _between_lines(one: _Fitted) -> float:
    """Return what a drive leaves whose command went straight between samples, of what it left."""
    sent = one.record.command
    time_s = _finer(sent.time_s)
    middle = np.interp(time_s + 0.5 * (time_s[1] - time_s[0]), sent.time_s, sent.values)
    finer = replace(one.record, command=Channel(sent.name, time_s, middle), sign=None,
                    interval_s=one.record.interval_s / FINER)  # fmt: skip
    begin = np.append(_coordinates(one.model, finer.interval_s, 2), 0.0)
    return min(_searched(finer, begin, zeros, False).power for zeros in (0, 1)) / one.power


def _covariance(matrix: Array, left: Array) -> Array:
    """Return the covariance of place and numerator, whose slopes are the rows, shape (p, p)."""
    size = np.linalg.norm(matrix, axis=1)
    size = np.where(size > 0, size, 1.0)
    scaled = (matrix / size[:, None]).T
    _, singular, right = np.linalg.svd(scaled, full_matrices=False)
    shown = singular > np.finfo(np.float64).eps * singular[0]  # one at its limit changes nothing
    inverse = right[shown].T / singular[shown]
    sums = np.add.reduceat(scaled * left[:, None], np.arange(0, left.size, left.size // BLOCKS))
    half = (inverse @ inverse.T @ sums.T) / size[:, None]
    return half @ half.T


def _neighbours(one: _Fitted) -> Iterator[DriveModel]:
    """Yield the drive moved by two standard errors either way along each axis of its covariance.

    A move is halved until it changes the velocity about as its slopes say, and leaves no delay
    below zero.
    """
    matrix = np.concatenate([_slopes(one), one.table])
    size = np.linalg.norm(matrix, axis=1)
    size = np.where(size > 0, size, 1.0)
    variances, axes = np.linalg.eigh(_covariance(matrix, one.left) * np.outer(size, size))
    explained, p = one.numerator @ one.table, one.place.size
    for variance, axis in zip(variances, axes.T, strict=True):
        longest = ERRORS * math.sqrt(max(variance, 0.0)) * axis / size
        most = CURVED * np.linalg.norm(longest @ matrix)
        for move in (longest, -longest):
            for halved in range(HALVINGS):
                by = move / 2**halved
                place, numerator = one.place + by[:p], one.numerator + by[p:]
                if place[-1] < 0.0 or np.max(np.abs(by[:p])) > LONG:
                    continue
                weights, modes = _modes(one.record, place, one.zeros)
                if np.linalg.norm(numerator @ weights @ modes - explained) <= most:
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
        through = lowpass(1j * omega, *torque_filter)
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
        many = np.ptp(after_s) >= 2 * ON_EDGE * interval_s
        late = np.quantile(after_s, np.linspace(0.05, 0.95, 10)) if many else np.array([mean_s])
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
