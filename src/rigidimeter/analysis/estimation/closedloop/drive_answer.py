"""What a drive of given poles and delay makes of the command, with the numerator that fits best.

For given poles λ and delay the velocity is linear in the numerator, so it alone is solved for and
only poles and delay are searched (variable projection, Golub and Pereyra 1973). A drive with dry
friction answers the sign of its velocity as well as the command, with the same poles and a
numerator of its own.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.drive_motion import lengths_s, since_ticks
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.records import Channel
from rigidimeter.model import (
    DriveModel,
    same_time,
    state_at_ticks,
    state_later,
    with_conjugates,
)

Complex = NDArray[np.complex128]

LONGEST_S, LONGEST_TICKS = 0.1, 4.0
"""The longest delay of a drive, the larger of both."""

FASTEST, SLOWEST = 6.0, 5e-4
"""In rad a tick: poles are sought between; a faster one leaves nothing to see at the ticks."""

FORGOTTEN = 0.01
"""A pole of which no more is left at the next tick is not seen."""

QUICKEST = 3.0
"""In rad a tick: an oscillation beyond π a tick looks like a slower one at the ticks."""

DOUBLE = 1e-4
"""Two poles that are this close, as a share of their size, are taken for so far apart."""

BESIDE = 0.3
"""Where the search for a further pole starts, in times the first."""

PASSED_HZ = 10.0
"""An angle is used as the velocity through a low-pass of first order and this corner."""

TINY = float(np.finfo(np.float64).tiny)


@dataclass(frozen=True, eq=False)
class Samples:
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
    sign : Channel or None
        Of the velocity, in parts of a tick, where dry friction acts on the drive.
    of_angle : bool
        Whether the angle was measured and not the velocity. `measured` is then `from_angle`, and
        so is every velocity that is compared with it.
    """

    command: Channel
    interval_s: float
    time_s: Array
    measured: Array
    scale: float
    sign: Channel | None = None
    of_angle: bool = False
    _since: dict[str, tuple[float, tuple[NDArray[np.intp], Array | float]]] = field(
        default_factory=dict, init=False, repr=False
    )

    def since(self, channel: Channel, delay_s: float) -> tuple[NDArray[np.intp], Array | float]:
        """Return the last tick that acts at each stamp, and for how long; the last delay's kept."""
        known = self._since.get(channel.name)
        if known is None or known[0] != delay_s:
            tick, after_s = since_ticks(channel, self.time_s, delay_s, even=0.0)
            known = self._since[channel.name] = delay_s, (tick, same_time(after_s))
        return known[1]


def mean_interval_s(time_s: Array) -> float:
    """Return the mean interval of stamps."""
    return float(time_s[-1] - time_s[0]) / (time_s.size - 1)


def from_angle(angle_rad: Array, interval_s: float) -> Array:
    """Return the velocity through a low-pass, made of the angle without a derivative.

    By parts, with a the corner,

        ∫ e^(−a(t − s)) θ'(s) ds = θ(t) − a ∫ e^(−a(t − s)) θ(s) ds

    plus what the begin leaves. At samples it is y_k = e^(−aT) y_(k−1) + θ_k − θ_(k−1): white noise
    of the angle stays white above the corner, and neither where the angle begins nor a slow drift
    counts.

    Parameters
    ----------
    angle_rad : array, shape (..., n)
    interval_s : float
        T, of the samples.
    """
    kept = _kept(interval_s)
    steps = np.diff(angle_rad, axis=-1, prepend=angle_rad[..., :1])
    return np.asarray(scipy.signal.lfilter([1.0], [1.0, -kept], steps))


def measured_velocity(samples: Samples) -> tuple[Array, Array]:
    """Return times and velocity as measured; of an angle its differences, midway between stamps."""
    if not samples.of_angle:
        return samples.time_s, samples.measured
    interval_s = mean_interval_s(samples.time_s)
    steps = samples.measured[1:] - _kept(interval_s) * samples.measured[:-1]
    return samples.time_s[1:] - 0.5 * interval_s, steps / interval_s


def _kept(interval_s: float) -> float:
    return math.exp(-2 * math.pi * PASSED_HZ * interval_s)


class FittedDrive(NamedTuple):
    """The drive at a place, with the numerator that explains the velocity best.

    Attributes
    ----------
    samples : Samples
    place : array, shape (poles + 1,)
        Coordinates of poles (`coordinates`) and delay, in ticks.
    zeros : int
    numerator : array, shape (j,)
        For the command and then for the sign of the velocity, as a share of the velocity's SD.
    table : array, shape (j, n)
        The velocity that each term of it makes.
    left : array, shape (n,)
        What is left of the velocity, as a share of its SD.
    """

    samples: Samples
    place: Array
    zeros: int
    numerator: Array
    table: Array
    left: Array

    @property
    def model(self) -> DriveModel:
        """From command to velocity."""
        return drive_at(self.samples, self.place, self.numerator[: self.zeros + 1])

    @property
    def power(self) -> float:
        """Of what is left, as a share of the velocity's variance."""
        return float(np.mean(self.left**2))

    @property
    def seen(self) -> bool:
        """Whether the ticks show every pole."""
        fastest = max(-pole.real for pole in self.model.poles_rad_s)
        return math.exp(-fastest * self.samples.interval_s) > FORGOTTEN


def answer(samples: Samples, place: Array, zeros: int) -> FittedDrive:
    """Return the drive at a place, with the numerator that explains the velocity best."""
    degrees = np.resize([1.0, 2.0], place.size - 1)
    longest = max(LONGEST_S / samples.interval_s, LONGEST_TICKS)
    lower = np.append(degrees * math.log(SLOWEST), 0.0)
    upper = np.append(degrees * math.log(FASTEST), longest)
    place = np.clip(place, lower, upper)
    table = velocities(samples, place, zeros)
    size = np.linalg.norm(table, axis=1) + TINY
    scaled = table / size[:, None]
    gram, along = scaled @ scaled.T, scaled @ samples.measured
    numerator = np.linalg.lstsq(gram, along)[0] / size
    return FittedDrive(
        samples, place, zeros, numerator, table, numerator @ table - samples.measured
    )


def drive_at(samples: Samples, place: Array, numerator: Array) -> DriveModel:
    """Return the drive at a place with a numerator for the command."""
    poles = _poles(place[:-1], samples.interval_s)
    residues = samples.scale * _shapes(poles, numerator.size - 1) @ numerator
    return DriveModel(poles, tuple(residues.tolist()), float(place[-1]) * samples.interval_s)


def velocities(samples: Samples, place: Array, zeros: int) -> Array:
    """Return the velocity that each term of a numerator makes at a place, shape (j, n)."""
    poles, delay_s = _poles(place[:-1], samples.interval_s), float(place[-1]) * samples.interval_s
    acting = [(samples.command, zeros, delay_s)]
    if samples.sign is not None:
        # Friction acts behind the controller, whose zeros are not its own.
        acting.append((samples.sign, place.size - 2, 0.0))
    rows = []
    for channel, own_zeros, late_s in acting:
        tick, held_s = samples.since(channel, late_s)
        steps_s = lengths_s(channel)
        total = np.zeros((own_zeros + 1, tick.size))
        sent = _integral(channel, steps_s, tick, held_s) if samples.of_angle else None
        for pole, shape in zip(poles, _shapes(poles, own_zeros), strict=True):
            before = state_at_ticks(pole, channel.values, steps_s)[tick]
            state = state_later(pole, before, channel.values[tick], held_s)
            if sent is not None:  # ∫x dt, as x' = λ x + c
                state = np.asarray((state - sent) / (pole if pole.imag else pole.real))
            weight = shape * (2.0 if pole.imag else 1.0)
            total += np.outer(weight.real, state.real)
            if pole.imag:
                total -= np.outer(weight.imag, state.imag)
        rows.append(total)
    made = np.concatenate(rows)
    if samples.of_angle:
        return from_angle(made, mean_interval_s(samples.time_s))
    return made


def _integral(
    channel: Channel, steps_s: float | Array, tick: NDArray[np.intp], held_s: Array | float
) -> Array:
    """Return ∫ c dt of a held command."""
    summed = np.concatenate(([0.0], np.cumsum(channel.values[:-1] * steps_s)))
    return np.asarray(summed[tick] + held_s * channel.values[tick])


def coordinates(drive: DriveModel, interval_s: float, poles: int) -> Array:
    """Return the logarithms of the coefficients of (s + a) or (s² + a s + b), shape (poles,).

    In units of the tick. Two real poles and a conjugate pair are the same to the coefficients.

    Parameters
    ----------
    drive : DriveModel
    interval_s : float
        Of the ticks.
    poles : int
        So many; those that the drive has not are `BESIDE` times as large as the first, and so on.
    """
    pairs = [pole for pole in with_conjugates(drive.poles_rad_s) if pole.imag]
    single = [pole for pole in drive.poles_rad_s if not pole.imag]
    everyone = [pole * interval_s for pole in (*pairs, *single)]
    more = range(1, poles - len(everyone) + 1)
    everyone += [complex(-abs(everyone[0]) * BESIDE**n) for n in more]
    found = []
    for a, b in zip(everyone[::2], everyone[1::2], strict=False):
        found += [math.log(-(a + b).real), math.log((a * b).real)]
    if len(everyone) % 2:
        found.append(math.log(-everyone[-1].real))
    return np.array(found)


def _poles(place: Array, interval_s: float) -> tuple[complex, ...]:
    """Return the poles, of a conjugate pair the one with the positive imaginary part."""
    poles: list[complex] = []
    coefficients = np.exp(place)
    for a, b in zip(coefficients[::2], coefficients[1::2], strict=False):
        root = cmath.sqrt(a * a / 4 - b)
        if abs(root) < DOUBLE * a:
            root = complex(DOUBLE * a)
        if root.imag:
            poles.append(complex(-a / 2, min(abs(root.imag), QUICKEST)))
        else:
            poles += [complex(-a / 2 - root.real), complex(-b / (a / 2 + root.real))]
    if coefficients.size % 2:
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
