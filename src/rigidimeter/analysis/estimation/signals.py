"""Torque and motion of an epoch in time, on one uniform grid, all through the same zero-phase band.

Channels have their own clocks: a cubic spline through a channel's own stamps gives its value at any
time between, its derivative and its integral.

A linear time-invariant filter F commutes with Eq. 3,

    J F(θ'') + B F(θ') + K F(θ) = F(M)

so filtering *every* signal alike leaves J (kg·m²), B (N·m·s/rad) and K (N·m/rad) where they are,
while filtering one of them does not. The first and last second are dropped after filtering: there
the filter saw no neighbours. So is a second on each side of what is left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.stretches import Array, motion_channels, sound
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import USABLE_FRACTION_OF_RATE, EstimationSettings

if TYPE_CHECKING:
    from rigidimeter.analysis.estimation.drive import Drive

Edge = float | tuple[float, float]
Kind = Literal["lowpass", "highpass", "bandpass"]

GRID_POINTS_PER_CYCLE = 20
"""Of the highest frequency: the derivative of a cubic spline is then within 0.006 %."""

AS_SAMPLED = 1e-6
"""Stamps closer than this share of an interval are the same time."""

EDGE_SAMPLES = 10
"""Samples of the slowest channel dropped at each end before filtering: there the derivative of a
spline is poor, and a filter with a long memory would carry that into the epoch."""

SHORT_MEMORY = 15
"""Samples over which a signal is continued for the low-pass."""

COLUMNS = "time_s", "torque_nm", "acceleration_rad_s2", "velocity_rad_s", "angle_rad"


@dataclass(frozen=True, eq=False)
class Signals:
    """Torque and motion on one uniform grid, treated alike, ready for a fit.

    Attributes
    ----------
    time_s, torque_nm, acceleration_rad_s2, velocity_rad_s, angle_rad : arrays, shape (n,)
    rate_hz : float
        Of the grid.
    band_hz : (float, float)
        The band to which the signals are confined; (0, Nyquist) when they are not.
    """

    time_s: Array
    torque_nm: Array
    acceleration_rad_s2: Array
    velocity_rad_s: Array
    angle_rad: Array
    rate_hz: float
    band_hz: tuple[float, float]

    @property
    def motion(self) -> Array:
        """Acceleration, velocity and angle, shape (n, 3)."""
        return np.column_stack([self.acceleration_rad_s2, self.velocity_rad_s, self.angle_rad])

    def part(self, rows: slice) -> Signals:
        """Return the same of some of the samples in a row."""
        return replace(self, **{name: getattr(self, name)[rows] for name in COLUMNS})


def joined(parts: Sequence[Signals]) -> Signals:
    """Return signals put one after the other."""
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(one, name) for one in parts]) for name in COLUMNS
    }
    return replace(parts[0], **columns)


def usable_hz(epoch: Epoch, drive_known: bool = False) -> float:
    """Return up to which frequency torque and motion were sampled densely enough to be fitted.

    Where the drive is known the motion between its samples is, too.
    """
    used = [epoch.channels["torque_nm"], *([] if drive_known else motion_channels(epoch))]
    return USABLE_FRACTION_OF_RATE * min(channel.rate_hz for channel in used)


def band_hz(epoch: Epoch, settings: EstimationSettings) -> tuple[float, float]:
    """Return the band for an epoch.

    The upper edge is `band_high_hz` where the perturbation is known (from the session or from a
    recorded perturbation channel) and `band_high_unknown_hz` where it is not, and never above 0.4
    times the rate of the slowest channel used.
    """
    known = epoch.excitation_hz is not None or "perturbation_nm" in epoch.channels
    wanted = settings.band_high_hz if known else settings.band_high_unknown_hz
    return settings.band_low_hz, min(wanted, usable_hz(epoch))


def grid_rate_hz(channels: Sequence[Channel], highest_hz: float) -> float:
    """Return the rate of a common grid: the fastest channel's, or more where that is coarse."""
    fastest_hz = max(channel.rate_hz for channel in channels)
    # Rates come from differences of stamps; their rounding must not double a grid.
    return fastest_hz * max(1, math.ceil(GRID_POINTS_PER_CYCLE * highest_hz / fastest_hz - 1e-6))


def uniform_grid(channels: Sequence[Channel], rate_hz: float) -> Array:
    """Return the uniform times at which every channel has samples on both sides.

    There are none where the channels do not overlap.
    """
    start = max(float(channel.time_s[0]) for channel in channels)
    stop = min(float(channel.time_s[-1]) for channel in channels)
    count = max(int(np.floor((stop - start) * rate_hz + 1e-6)) + 1, 0)
    return np.minimum(start + np.arange(count) / rate_hz, stop)


def sampled(channel: Channel, time_s: Array, share: float = AS_SAMPLED) -> slice | None:
    """Return which samples of a channel were taken at just these times; None where none were.

    Parameters
    ----------
    channel : Channel
    time_s : array, shape (n,)
    share : float
        Of the channel's interval: stamps that are closer are the same time.
    """
    if not time_s.size or len(channel) < max(time_s.size, 2):
        return None
    close_s = share / channel.mean_rate_hz
    first = int(np.searchsorted(channel.time_s, time_s[0] - close_s))
    stamps = channel.time_s[first : first + time_s.size]
    if stamps.size < time_s.size or np.max(np.abs(stamps - time_s)) > close_s:
        return None
    return slice(first, first + time_s.size)


def columns_at(channel: Channel, columns: Array, time_s: Array, share: float = AS_SAMPLED) -> Array:
    """Return columns of a channel's stamps, shape (..., n), at other times.

    Without a spline where these are stamps too (`sampled`).
    """
    place = sampled(channel, time_s, share)
    if place is not None:
        return columns[..., place]
    return np.asarray(scipy.interpolate.CubicSpline(channel.time_s, columns, axis=-1)(time_s))


def values_at(channel: Channel, time_s: Array, share: float = AS_SAMPLED) -> Array:
    """Return a channel at other times, as `columns_at`."""
    return columns_at(channel, channel.values, time_s, share)


def held_at(channel: Channel, time_s: Array) -> Array:
    """Return what was in force at each time: the last value sent, as it is held to the next."""
    # A tick of rounding must not turn a value into the one before.
    index = np.searchsorted(channel.time_s, time_s + 1e-9, side="right") - 1
    return channel.values[np.maximum(index, 0)]


def kinematics(epoch: Epoch, time_s: Array) -> Array:
    """Return acceleration, velocity and angle at times within the stamps, shape (3, n).

    Measured channels are used where they are recorded. A missing velocity is the derivative of the
    angle; a missing angle is the integral of the velocity, zero at the first time. The acceleration
    is the derivative of the velocity.
    """
    found, own = velocity_at(epoch, time_s), epoch.channels.get("velocity_rad_s")
    # A second spline through the velocity, since the second derivative of the first is only
    # piecewise linear and loses the upper part of the band.
    known = (time_s, found) if own is None else (own.time_s, own.values)
    slope = scipy.interpolate.CubicSpline(*known).derivative()
    return np.stack([slope(time_s), found, angle_at(epoch, time_s)])


def angle_at(epoch: Epoch, time_s: Array, share: float = AS_SAMPLED) -> Array:
    """Return the angle of `kinematics` alone."""
    if "angle_rad" in epoch.channels:
        return values_at(epoch.channels["angle_rad"], time_s, share)
    velocity = epoch.channels["velocity_rad_s"]
    integral = scipy.interpolate.CubicSpline(velocity.time_s, velocity.values).antiderivative()
    return np.asarray(integral(time_s) - integral(time_s[:1]))


def velocity_at(epoch: Epoch, time_s: Array, share: float = AS_SAMPLED) -> Array:
    """Return the velocity of `kinematics` alone."""
    if "velocity_rad_s" in epoch.channels:
        return values_at(epoch.channels["velocity_rad_s"], time_s, share)
    angle = epoch.channels["angle_rad"]
    slope = scipy.interpolate.CubicSpline(angle.time_s, angle.values).derivative()
    return np.asarray(slope(time_s))


def angle_range_rad(epoch: Epoch, time_s: Array) -> float:
    """Return largest less smallest measured angle between the first and the last time.

    Of all frequencies, without what is left out; NaN where the angle was not measured, since an
    integrated velocity drifts.
    """
    angle = epoch.channels.get("angle_rad")
    if angle is None or time_s.size == 0:
        return math.nan
    within = (angle.time_s >= time_s[0]) & (angle.time_s <= time_s[-1])
    values = angle.values[within & sound(epoch, angle.time_s)]
    return float(np.ptp(values)) if values.size else math.nan


def bandlimited_signals(
    epoch: Epoch, settings: EstimationSettings, drive: Drive | None = None
) -> Signals:
    """Return torque, acceleration, velocity and angle through the same band, edges trimmed.

    The motion is that at the torque's samples where the drive is known, as far as the command
    causes it: that is known between the samples too.

    Parameters
    ----------
    epoch : Epoch
        With `torque_nm` and `velocity_rad_s` or `angle_rad`.
    settings : EstimationSettings
        For the band and the trimming.
    drive : Drive, optional
        That carried out `velocity_command_rad_s`.
    """
    torque, band = epoch.channels["torque_nm"], band_hz(epoch, settings)
    used = [torque, *motion_channels(epoch)]
    rate_hz = grid_rate_hz(used, band[1])
    full = uniform_grid(used, rate_hz)
    command = epoch.channels.get("velocity_command_rad_s")
    if drive is None or command is None:
        motion = kinematics(epoch, full)
    else:
        cutoff_hz, order = settings.torque_lowpass_hz, settings.torque_lowpass_order
        seen = drive.behind((cutoff_hz, order) if cutoff_hz else None)
        # One spline of the three, at the stamps that they share.
        caused = columns_at(torque, seen.motion(command, torque.time_s), full)
        motion = caused + kinematics(drive.beyond(epoch), full)
    edge = math.ceil(EDGE_SAMPLES * rate_hz / min(channel.rate_hz for channel in used))
    inner = slice(edge, full.size - edge)
    time_s, motion = full[inner], motion[:, inner]
    trim = max(round(settings.trim_s * rate_hz) - edge, 0)
    keep = sound(epoch, time_s, settings.trim_s)
    keep[:trim] = keep[time_s.size - trim :] = False
    everything = np.stack([values_at(torque, time_s), *motion])
    torque_nm, a, v, x = zero_phase_band(everything, rate_hz, band)[:, keep]
    return Signals(time_s[keep], torque_nm, a, v, x, rate_hz, band)


def zero_phase_band(values: Array, rate_hz: float, band: tuple[float, float]) -> Array:
    """Band-pass without phase: Butterworth forwards and backwards.

    Second order at the lower edge and fourth at the upper, each applied twice. The two are
    separate filters because one band-pass over a ratio of 70 would be poorly conditioned.

    The signal is continued by its mirror image for as long as the lower edge remembers. A point
    reflection, scipy's default, would hang that memory on a single sample with its noise: at the
    paper's rates it tripled the scatter of K.

    Parameters
    ----------
    values : array, shape (n,) or (k, n)
    rate_hz : float
    band : (float, float)
    """
    n, passed = values.shape[-1], values - np.mean(values, axis=-1, keepdims=True)
    if n <= SHORT_MEMORY:
        raise ValueError(f"{n} samples are too few for a filter; it needs {SHORT_MEMORY + 1}")
    lowpass = butterworth(4, band[1], "lowpass", rate_hz), SHORT_MEMORY
    highpass = butterworth(2, band[0], "highpass", rate_hz), round(rate_hz / band[0])
    for sections, memory in (lowpass, highpass):
        past = min(n - 1, memory)
        passed = scipy.signal.sosfiltfilt(sections, passed, padtype="even", padlen=past)
    return np.asarray(passed)


def butterworth(order: int, edge_hz: Edge, kind: Kind, rate_hz: float) -> Array:
    """Return the sections of a Butterworth filter."""
    # To the digits that stamps are good for, so that epochs share their filters.
    return _sections(order, edge_hz, kind, float(f"{rate_hz:.9g}"))


@lru_cache(maxsize=32)
def _sections(order: int, edge_hz: Edge, kind: Kind, rate_hz: float) -> Array:
    """Return a filter; to design it takes longer than to filter an epoch."""
    return np.asarray(scipy.signal.butter(order, edge_hz, kind, fs=rate_hz, output="sos"))


def power_lines(
    values: Array, rate_hz: float, *, tapered: bool = False, longer: int = 1
) -> tuple[Array, Array]:
    """Return frequencies and the power at each; without a taper it sums to the variance.

    A few samples at the end are not used where the transform of all takes many times as long: that
    of 18,001 takes 15 times as long as of 18,000. They are at most 2.2 % of a thousand or more.

    Parameters
    ----------
    values : array, shape (n,)
        Its mean is taken off.
    rate_hz : float
    tapered : bool
        Through Hann's window, for signals whose slow part would leak into all other lines.
    longer : int
        So many times as many lines, for a peak between two of them.
    """
    values = values[: scipy.fft.prev_fast_len(values.size)]
    n, centred = longer * values.size, values - np.mean(values)
    if tapered:
        centred = centred * (np.sqrt(8.0 / 3.0) * scipy.signal.windows.hann(values.size))
    power = (2.0 / (n * values.size)) * np.abs(scipy.fft.rfft(centred, n)) ** 2
    power[[0, -1] if n % 2 == 0 else 0] /= 2.0
    return scipy.fft.rfftfreq(n, 1.0 / rate_hz), power


def lines_inside(frequency_hz: Array, band: tuple[float, float]) -> NDArray[np.intp]:
    """Return which lines lie in a band, ends included, zero left out."""
    low, high = band
    return np.flatnonzero((frequency_hz > 0) & (frequency_hz >= low) & (frequency_hz <= high))
