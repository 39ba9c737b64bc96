"""What is commanded in a session: its epochs in order, and each of them tick by tick.

Each epoch is followed by a rest drawn at random. The paper rests 10 or 20 s between perturbations,
chosen at random so that the subject cannot tell when the next one starts, while the arm returns to
where it began (Sec. 2.3 and 2.4.3).

The torque perturbation (Sec. 2.4.3) is a maximal-length pseudo-random binary sequence. A shift
register of n bits with a primitive feedback polynomial runs through all its 2ⁿ − 1 nonzero states
before it repeats. Its output, held for one clock period a chip and mapped to ±1, has a mean of
1/(2ⁿ − 1) and an autocorrelation that is 1 at no lag and −1/(2ⁿ − 1) at every other: as near to
white as two levels can be.

The position perturbation for the impulse and work scores (Sec. 2.3) is

    θ(t) = A w(t) sin(2π f t)
    θ'(t) = A (w(t) 2π f cos(2π f t) + w'(t) sin(2π f t))        0 ≤ t < motion

with w a raised cosine that rises from 0 to 1 over the taper, stays at 1, and falls back over the
last taper: w = (1 − cos(π t / taper)) / 2 while it rises. After the motion the angle is held at
zero for the rest of the epoch. The paper moves ±20 deg at 1.0 Hz for 10 s of a 20 s epoch and
drops the first and the last second; with a taper of 1 s the eight cycles that remain are pure.

Ticks are counted exactly, in fractions of the decimals that were written: a float such as 22.6 is
not the decimal 22.6, and `floor(i * 22.6 / 1000)` slips by one tick wherever the product rounds
across a whole number.

References
----------
S. W. Golomb, "Shift Register Sequences", Holden-Day, 1967: the run, balance and correlation
properties, and primitive polynomials. `scipy.signal.max_len_seq` gives the same sequences; it is
not called, since loading it takes the loop's process a second.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Task
from rigidimeter.core.session import PlannedEpoch, Protocol
from rigidimeter.core.settings import PrbsSettings, ProtocolSettings, SinusoidSettings
from rigidimeter.core.units import rad_from_deg

_REST_STREAM = 0x7265_7374
"""Sets the rests' random stream apart from others that start at the same recorded seed."""


def rest_generator(seed: int) -> np.random.Generator:
    """Return the generator of the rests of a session with this seed.

    Raises
    ------
    ValueError
        If the seed is negative.
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_REST_STREAM,)))


def draw_rests_s(
    rests_s: Sequence[float], count: int, generator: np.random.Generator
) -> tuple[float, ...]:
    """Return `count` rests drawn from `rests_s`, each with the same chance, in s."""
    return tuple(float(rests_s[index]) for index in generator.integers(len(rests_s), size=count))


def plan(
    protocol: ProtocolSettings, prbs: PrbsSettings, sinusoid: SinusoidSettings, seed: int
) -> Protocol:
    """Return the epochs of a session, block after block.

    Parameters
    ----------
    protocol : ProtocolSettings
        Blocks in order, and the rests to draw from.
    prbs, sinusoid : PrbsSettings, SinusoidSettings
        For the duration of their epochs.
    seed : int
        Recorded with the session; the same seed and settings give the same session.

    Raises
    ------
    ValueError
        If the seed is negative.
    """
    duration_s: dict[Task, float] = {"prbs": prbs.duration_s, "sinusoid": sinusoid.duration_s}
    in_order = [block for block in protocol.blocks for _ in range(block.epochs)]
    rests_s = draw_rests_s(protocol.rests_s, len(in_order), rest_generator(seed))
    epochs = tuple(
        PlannedEpoch(number, str(number), block.task, block.condition, duration_s[block.task], rest)
        for number, (block, rest) in enumerate(zip(in_order, rests_s, strict=True), start=1)
    )
    return Protocol(seed, epochs, protocol.return_s)


def exact_decimal(value: float, name: str) -> Fraction:
    """Return the shortest decimal that reads back as this float, as an exact fraction.

    Raises
    ------
    ValueError
        If the value is not finite or not greater than zero; `name` is for that message.
    """
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name} must be finite and greater than 0, got {value}")
    return Fraction(repr(float(value)))


def tick_count(duration_s: float, rate_hz: float) -> int:
    """Return the number of ticks in a duration, to the nearest whole tick.

    Raises
    ------
    ValueError
        If a value is not greater than zero, or the duration is shorter than half a tick.
    """
    count = round(exact_decimal(duration_s, "duration_s") * exact_decimal(rate_hz, "rate_hz"))
    if count < 1:
        raise ValueError(f"{duration_s:g} s holds no tick at {rate_hz:g} Hz")
    return count


def tick_times_s(count: int, rate_hz: float) -> NDArray[np.float64]:
    """Return the times of the first `count` ticks, from 0, in seconds."""
    return np.arange(count, dtype=np.float64) / rate_hz


def chip_count(settings: PrbsSettings) -> int:
    """Return the chips in one period, 2ⁿ − 1."""
    return (1 << settings.register_bits) - 1


def prbs_period_s(settings: PrbsSettings) -> float:
    """Return the time after which the sequence repeats, (2ⁿ − 1) / f_clock, in seconds."""
    return chip_count(settings) / settings.clock_hz


_TAPS = {
    **{2: (1,), 3: (2,), 4: (3,), 5: (3,), 6: (5,), 7: (6,), 8: (7, 6, 1), 9: (5,), 10: (7,)},
    **{11: (9,), 12: (11, 10, 4), 13: (12, 11, 8), 14: (13, 12, 2), 15: (14,), 16: (15, 13, 4)},
    **{17: (14,), 18: (11,), 19: (18, 17, 14), 20: (17,)},
}
"""For n bits the powers t of the primitive polynomial xⁿ + Σ xᵗ + 1."""


def prbs_levels(register_bits: int) -> NDArray[np.float64]:
    """Return one period of the sequence as levels of ±1, one a chip.

    The register starts from all ones, so that the same number of bits always gives the same
    sequence: the paper used one sequence in every epoch and condition.

    Parameters
    ----------
    register_bits : int
        n, from 2 to 20.

    Returns
    -------
    array, shape (2**n - 1,)
        With one more +1 than −1.
    """
    taps = _TAPS[register_bits]
    bits = [1] * register_bits
    for k in range(2**register_bits - 1 - register_bits):
        bit = bits[k]
        for tap in taps:
            bit ^= bits[k + tap]
        bits.append(bit)
    return 2.0 * np.array(bits, dtype=np.float64) - 1.0


def prbs_nm(settings: PrbsSettings, rate_hz: float) -> NDArray[np.float64]:
    """Return the torque perturbation of one epoch, one value a tick.

    Chip k starts at the first tick that is not before k / f_clock, counted in whole numbers; the
    sequence repeats or is cut to fill the duration. What remains of a mean over the duration is
    taken off, so that the perturbation does not push the arm to one side; the two levels stay
    2 × amplitude apart.

    Parameters
    ----------
    settings : PrbsSettings
        Bits, clock, amplitude and duration.
    rate_hz : float
        Ticks a second; at least the clock.

    Returns
    -------
    array, shape (duration_s * rate_hz,)
        M_PRBS of Eq. 5, in N·m. Zero mean.

    Raises
    ------
    ValueError
        If the rate is not greater than zero or is below the clock.
    UserError
        If the duration is over before the sequence first changes level.
    """
    per_chip = exact_decimal(rate_hz, "rate_hz") / exact_decimal(settings.clock_hz, "clock_hz")
    if per_chip < 1:
        raise ValueError(
            f"a clock of {settings.clock_hz:g} Hz needs at least as many ticks a second, "
            f"got {rate_hz:g} Hz"
        )
    ticks = tick_count(settings.duration_s, rate_hz)
    up, down = per_chip.numerator, per_chip.denominator
    chips = -(-ticks * down // up)
    starts = np.array([-(-chip * up // down) for chip in range(chips)] + [ticks])
    levels = np.resize(prbs_levels(settings.register_bits), chips)
    signs = np.repeat(levels, np.diff(starts))

    high = int(np.count_nonzero(signs > 0))
    if high in (0, ticks):
        first_change = int(np.argmax(np.diff(prbs_levels(settings.register_bits)) != 0)) + 1
        raise UserError(
            f"prbs.duration_s = {settings.duration_s:g} s ends before the sequence first changes "
            f"level, after {first_change} chips of prbs.clock_hz = {settings.clock_hz:g} Hz "
            f"({first_change / settings.clock_hz:g} s): make it longer or the clock faster"
        )
    # amplitude·(±1 − mean), written so that the two levels cancel over the epoch
    top = 2.0 * settings.amplitude_nm * ((ticks - high) / ticks)
    bottom = -2.0 * settings.amplitude_nm * (high / ticks)
    return np.where(signs > 0, top, bottom)


def sinusoid(
    settings: SinusoidSettings, rate_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the angle and velocity commanded in one epoch, one value a tick.

    The command starts and ends at rest at zero angle. Without a taper it starts at full speed, and
    ends at zero angle only if the motion holds a whole number of half cycles.

    Parameters
    ----------
    settings : SinusoidSettings
        Frequency, amplitude, durations and taper.
    rate_hz : float
        Ticks a second.

    Returns
    -------
    angle_rad, velocity_rad_s : array, shape (duration_s * rate_hz,)
        The velocity is the exact derivative of the angle, taper included, in rad/s.

    Raises
    ------
    ValueError
        If the rate is not greater than zero.
    """
    ticks = tick_count(settings.duration_s, rate_hz)
    moving = min(ticks, tick_count(settings.motion_s, rate_hz))
    amplitude_rad = rad_from_deg(settings.amplitude_deg)
    omega = 2.0 * math.pi * settings.frequency_hz
    time_s = tick_times_s(moving, rate_hz)
    weight, slope = _taper(time_s, settings.motion_s, settings.taper_s)
    sine, cosine = np.sin(omega * time_s), np.cos(omega * time_s)

    angle_rad = np.zeros(ticks)
    velocity_rad_s = np.zeros(ticks)
    angle_rad[:moving] = amplitude_rad * weight * sine
    velocity_rad_s[:moving] = amplitude_rad * (weight * omega * cosine + slope * sine)
    return angle_rad, velocity_rad_s


def _taper(
    time_s: NDArray[np.float64], motion_s: float, taper_s: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the weight w, from 0 to 1, and its derivative in 1/s."""
    if taper_s == 0.0:
        return np.ones_like(time_s), np.zeros_like(time_s)
    to_end_s = motion_s - time_s
    phase = np.pi * np.clip(np.minimum(time_s, to_end_s) / taper_s, 0.0, 1.0)
    slope = 0.5 * np.pi / taper_s * np.sin(phase)
    falling = time_s > to_end_s
    full = phase == np.pi
    return 0.5 * (1.0 - np.cos(phase)), np.where(full, 0.0, np.where(falling, -slope, slope))
