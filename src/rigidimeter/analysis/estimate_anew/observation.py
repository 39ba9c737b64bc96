"""An epoch at the lines of its band: torque, motion, and the motion that the perturbation causes.

All are sums over the samples of the torque, at its stamps: a torque that was sampled at a point in
time is held against the motion at that point. Where the command is recorded and explains the
velocity, the motion there is what the command causes, known at any time, plus what the sensors saw
beyond it; so neither slow sensors nor the ripple between the ticks bias the fit (`drive`).

The perturbation alone causes, from rest and without noise,

    θ = H A P / (1 + L(J, B, K))

with the admittance A and the loop gain L of the settings (`rigidimeter.model.Loop`) and the drive
H. It carries nothing of what the subject does. A wrong loop makes it a weaker instrument, not a wrong
one; a loop that would be unstable with the joint was not the one that moved it, and is opened.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimate_anew.drive import (
    Drive,
    TorqueFilter,
    alternatives,
    behind,
    beyond,
    since_ticks,
    without_drive,
)
from rigidimeter.analysis.estimate_anew.grid import SAME_TIME, Array, Complex, Grid, grid_of
from rigidimeter.analysis.estimate_anew.signals import (
    angle_at,
    motion_channels,
    sampled,
    values_at,
    velocity_at,
)
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import USABLE_FRACTION_OF_RATE, Settings
from rigidimeter.model import ON_EDGE, Loop, lowpass, on_circle

LEAST = np.array([1e-5, 1e-3, 1e-2])
"""Smallest J, B and K that a loop is simulated with, so that it is stable."""

DENSE = 16.0
"""Samples a cycle of the highest line from which half of them show the motion as well as all: an
acceleration near half the rate is then an angle 49 times smaller than at that line, or less."""

NARROWEST = 4.0
"""A band narrower than two octaves cannot distinguish three parameters."""

WIDER = 0.5, 1.4
"""Lines are also kept of a band whose edges are these times those of the fit."""

PAD_S = 8.0
"""Behind the end of a perturbation, before it begins anew in the circle of its FFT."""

REPEATS = 0.999
"""The correlation of a perturbation with itself one period later, at least."""


class Caused(NamedTuple):
    """What a perturbation causes.

    Attributes
    ----------
    lines : complex array, shape (m, 3)
        Acceleration, velocity and angle.
    coarse : array, shape (2, n)
        Velocity and angle at the coarse samples.
    """

    lines: Complex
    coarse: Array


@dataclass(frozen=True, eq=False)
class Cause:
    """A perturbation in a loop, as it comes to the coarse samples of a grid.

    Attributes
    ----------
    grid : Grid
    command : complex array, shape (f,)
        Without feedback: admittance times perturbation, at f frequencies.
    gain, motion : complex arrays, shape (3, f)
        The loop gain per J, B and K; acceleration, velocity and angle per command, later by what
        the grid begins after the ticks.
    samples : int
        Of the inverse transform.
    raising : array, shape (samples,)
        Takes the damping of the transform away.
    at_s : array or None
        Times of the samples, where the coarse ones lie between them.
    """

    grid: Grid
    command: Complex
    gain: Complex
    motion: Complex
    samples: int
    raising: Array
    at_s: Array | None

    def at(self, joint: Array) -> Caused:
        """Return what the perturbation causes in a loop with this J, B and K."""
        around = 1 + np.maximum(joint, LEAST) @ self.gain
        # Nyquist: on the upper half of the circle each unstable pole turns 1 + L by −2π.
        turned = float(np.sum(np.angle(around[1:] * around[:-1].conj())))
        command = self.command if turned < -0.5 * np.pi else self.command / around
        motion = scipy.fft.irfft(self.motion * command, self.samples) * self.raising
        count = self.grid.coarse_time_s.size
        if self.at_s is not None:
            motion = scipy.interpolate.CubicSpline(self.at_s, motion, axis=1)(
                self.grid.coarse_time_s
            )
        motion = motion[:, :count]
        return Caused(self.grid.coarse_lines(motion).T, motion[1:])


@dataclass(frozen=True, eq=False)
class Observation:
    """One epoch, ready to be fitted.

    Attributes
    ----------
    epoch : Epoch
    settings : Settings
    grid : Grid
    torque_nm : complex array, shape (m,)
    motion : complex array, shape (m, 3)
        Acceleration, velocity and angle.
    coarse : array, shape (2, n)
        Measured velocity and angle at the coarse samples, the angle about its mean.
    noise : complex array, shape (m, 3), or None
        Half the difference of what even and odd samples of the motion give; None where that does
        not show its noise.
    changes : complex array, shape (k, m, 3)
        How the motion changes: if its samples are taken as they are, then with other drives that
        may be the one.
    loop : Loop or None
        That the epoch ran in; None where it is not known.
    cause : Cause or None
        Of epochs with one perturbation and one grid the same object; None where it is not used.
    periods : int
        How often the perturbation repeats, so that it has power at every so many lines; 1 where it
        need not repeat.
    drive_known : bool
    wider : Observation or None
        The same at the lines of a wider band.
    """

    epoch: Epoch
    settings: Settings
    grid: Grid
    torque_nm: Complex
    motion: Complex
    coarse: Array
    noise: Complex | None
    changes: Complex
    loop: Loop | None = None
    cause: Cause | None = None
    periods: int = 1
    drive_known: bool = False
    wider: Observation | None = None

    @property
    def excited(self) -> NDArray[np.bool_]:
        """At which lines the perturbation has power, shape (m,)."""
        return np.asarray(self.grid.line % self.periods == 0)

    def of_lines(self, lines: Complex) -> Complex:
        """Return those of `cause` that are lines of this grid, shape (m, ...)."""
        assert self.cause is not None  # observed for instruments
        first = int(self.grid.line[0] - self.cause.grid.line[0])
        return lines[first : first + self.grid.line.size]

    def late(self, delay_s: float) -> Observation:
        """Return it with the torque earlier by a delay, without reading the motion again."""
        turn = np.exp(1j * self.grid.omega_rad_s * delay_s)
        wider = None if self.wider is None else self.wider.late(delay_s)
        return replace(self, torque_nm=self.torque_nm * turn, wider=wider)

    def part(self, lines: slice) -> Observation:
        """Return it at some of its lines in a row."""
        return replace(
            self,
            grid=self.grid.part(lines),
            torque_nm=self.torque_nm[lines],
            motion=self.motion[lines],
            noise=None if self.noise is None else self.noise[lines],
            changes=self.changes[:, lines],
        )


def no_instrument(epoch: Epoch) -> str:
    """Return why the perturbation cannot be the instrument, or an empty text."""
    perturbation = epoch.channels.get("perturbation_nm")
    if perturbation is None:
        return "perturbation_nm was not recorded"
    if len(perturbation) < 2 or not np.all(np.isfinite(perturbation.values)):
        return "perturbation_nm holds no samples or numbers that are not finite"
    if float(np.ptp(perturbation.values)) == 0.0:
        return "perturbation_nm is constant"
    torque = epoch.channels.get("torque_nm")
    if torque is not None and np.array_equal(torque.values, perturbation.values):
        return "perturbation_nm holds the same numbers as torque_nm"
    return ""


def loop_of(settings: Settings, torque_rate_hz: float, drive: Drive | None) -> Loop:
    """Return the loop of the settings with the drive that the recording shows."""
    rig, estimation = settings.rig, settings.estimation
    # To the digits that stamps are good for, so that epochs of one rig have equal loops.
    torque = rig.torque.model_copy(update={"rate_hz": float(f"{torque_rate_hz:.4g}")})
    return Loop(
        settings.controller,
        rig.model_copy(update={"torque": torque}),
        None if drive is None else drive.model,
        estimation.torque_lowpass_hz,
        estimation.torque_lowpass_order,
    )


def torque_filter_of(settings: Settings) -> TorqueFilter | None:
    """Return cutoff in Hz and order of the low-pass that the settings name; None for none."""
    estimation = settings.estimation
    cutoff_hz = estimation.torque_lowpass_hz
    return TorqueFilter(cutoff_hz, estimation.torque_lowpass_order) if cutoff_hz else None


def observe(
    epoch: Epoch,
    settings: Settings,
    drive: Drive | None,
    loop: Loop | None,
    causes: list[tuple[Array, Cause]] | None = None,
    *,
    periodic: bool = False,
) -> Observation:
    """Return an epoch at its lines.

    Parameters
    ----------
    epoch : Epoch
        Screened, on the clock of its torque.
    settings : Settings
    drive : Drive or None
        Of its recording.
    loop : Loop or None
    causes : list, optional
        The perturbation is the instrument; what was made of those of other epochs, shared where it
        is the same, is in the list and added to it.
    periodic : bool
        Whole periods alone.

    Raises
    ------
    ValueError
        If the epoch cannot be used so; the text says why.
    """
    channels = epoch.channels
    torque, perturbation = channels["torque_nm"], channels.get("perturbation_nm")
    moving = motion_channels(epoch)
    caused, periods, count = causes is not None, 1, None
    if caused and (reason := no_instrument(epoch)):
        raise ValueError(reason)
    if periodic:
        assert perturbation is not None  # else there was a reason

        def count(available: int, rate_hz: float) -> int:
            nonlocal periods
            periods, samples = _whole_periods(_while(perturbation, torque), rate_hz, available)
            return samples

    band_hz = _band_hz(epoch, settings, drive, alone=not caused)
    wide_hz = band_hz
    if caused and not periodic:
        highest_hz = _usable_hz(torque, moving, drive)
        wide_hz = WIDER[0] * band_hz[0], min(WIDER[1] * band_hz[1], highest_hz)
    used = [torque, *moving, *([perturbation] if perturbation is not None else [])]
    holes = [one[:2] for one in epoch.left_out]
    grid = grid_of(used, wide_hz, settings.estimation.trim_s, holes, count)
    observed = replace(
        _at_lines(epoch, settings, grid, drive, noise=not caused), loop=loop, periods=periods
    )
    if causes is not None:
        assert perturbation is not None and loop is not None  # instruments need both
        ticks = _evenly(perturbation)
        observed = replace(observed, cause=_cause(ticks, loop, grid, causes))
    if wide_hz == band_hz:
        return observed
    low, high = (edge * grid.duration_s for edge in band_hz)
    first, last = max(int(np.ceil(low - 1e-6)) - 1, 1), int(high + 1e-6)
    start, stop = np.searchsorted(grid.line, [first, last + 1])
    return replace(observed.part(slice(int(start), int(stop))), wider=observed)


def _band_hz(
    epoch: Epoch, settings: Settings, drive: Drive | None, *, alone: bool
) -> tuple[float, float]:
    """Return the band of the fit; `alone` says whether the motion is its own instrument."""
    torque, moving = epoch.channels["torque_nm"], motion_channels(epoch)
    usable_hz, low_hz = _usable_hz(torque, moving, drive), settings.estimation.band_low_hz
    if alone and drive is None:
        # Higher, noise of the motion that no half of the samples shows would count as motion.
        slowest = min(one.rate_hz for one in (torque, *moving))
        usable_hz = min(usable_hz, max(slowest / DENSE, NARROWEST * low_hz))
    return low_hz, min(settings.estimation.band_high_closed_loop_hz, usable_hz)


def _usable_hz(torque: Channel, moving: Sequence[Channel], drive: Drive | None) -> float:
    limiting = [torque] if drive is not None else [torque, *moving]
    return USABLE_FRACTION_OF_RATE * min(one.rate_hz for one in limiting)


def _at_lines(
    epoch: Epoch, settings: Settings, grid: Grid, drive: Drive | None, *, noise: bool
) -> Observation:
    """Return torque and motion at the lines, without loop and cause."""
    torque, command = epoch.channels["torque_nm"], epoch.channels.get("velocity_command_rad_s")
    moving, through_filter = motion_channels(epoch), torque_filter_of(settings)
    own = {
        one.name: one.values[place]
        for one in moving
        if (place := sampled(one, grid.time_s, SAME_TIME)) is not None
    }
    recorded = "angle_rad" in own and len(own) == len(moving)
    through: Complex = np.ones(grid.line.size, dtype=np.complex128)
    if through_filter is not None:
        through = lowpass(np.asarray(1j * grid.omega_rad_s), *through_filter)
    torque_nm = grid.lines(values_at(torque, grid.time_s, SAME_TIME))[0]
    driven: Array | None = None
    if drive is not None and command is not None:
        tick, after_s = since_ticks(command, _stamps_s(torque, grid.time_s), 0.0)
        interval_s = 1.0 / command.mean_rate_hz
        recorded &= bool(np.all(np.diff(tick) == 1) and np.ptp(after_s) < 2 * ON_EDGE * interval_s)
        if not recorded:
            seen = behind(drive, through_filter).motion(command, torque.time_s)
            driven = np.stack(
                [
                    values_at(Channel(torque.name, torque.time_s, one), grid.time_s, SAME_TIME)
                    for one in seen
                ]
            )
    if recorded:
        angle, velocity = own["angle_rad"], own.get("velocity_rad_s")
    else:
        rest = epoch if driven is None else _without(epoch, drive, command)
        angle, velocity = angle_at(rest, grid.time_s), velocity_at(rest, grid.time_s)
    dense = recorded and grid.rate_hz >= DENSE * grid.band_hz[1]
    motion, apart = _motion_lines(grid, angle, velocity, halves=noise and dense)
    motion = motion * through[:, None]
    if velocity is None:
        velocity = velocity_at(epoch, grid.time_s)
    if driven is not None:
        motion = motion + grid.lines(driven)[0].T
        angle, velocity = angle + driven[2], velocity + driven[1]
    made = Observation(
        epoch,
        settings,
        grid,
        torque_nm,
        motion,
        grid.coarse(np.stack([velocity, angle - np.mean(angle)])),
        None if apart is None else apart * through[:, None],
        np.empty((0, *motion.shape)),
    )
    if drive is None or command is None:
        changes = without_drive(motion, settings.rig, torque, through_filter, grid.omega_rad_s)
        return replace(made, changes=np.stack(changes))
    sent = grid.lines(command.values[tick])[0][:, None]
    alone = "velocity_rad_s" not in epoch.channels
    if recorded:
        late_s = float(np.mean(after_s))
        at = grid.omega_rad_s, interval_s, late_s, through_filter
        motion = motion + sent * beyond(drive.model, *at, angle_alone=alone)[0]
    _, stamped_s = since_ticks(command, torque.time_s, 0.0)
    changes = alternatives(
        drive, motion, sent, grid.omega_rad_s, interval_s, stamped_s, through_filter, alone
    )
    return replace(made, motion=motion, changes=np.stack(changes), drive_known=True)


def _stamps_s(torque: Channel, time_s: Array) -> Array:
    """Return the stamps that the torque has at even times."""
    place = sampled(torque, time_s, SAME_TIME)
    return time_s if place is None else torque.time_s[place]


def _without(epoch: Epoch, drive: Drive | None, command: Channel | None) -> Epoch:
    """Return the epoch with what its motion sensors saw beyond what the command causes."""
    assert drive is not None and command is not None
    rest = dict(epoch.channels)
    for one in motion_channels(epoch):
        row = 2 if one.name == "angle_rad" else 1
        seen = drive.motion(command, one.time_s)[row]
        rest[one.name] = Channel(one.name, one.time_s, one.values - seen)
    return replace(epoch, channels=rest)


def _motion_lines(
    grid: Grid, angle: Array, velocity: Array | None, *, halves: bool
) -> tuple[Complex, Complex | None]:
    """Return acceleration, velocity and angle at the lines, and half the differences: (m, 3)."""
    read = grid.lines_and_noise if halves else lambda *of: (grid.lines(*of),)
    if velocity is None:
        found = [part[::-1].T for part in read(angle, 2)]
    else:
        parts = zip(read(velocity, 1), read(angle, 0), strict=True)
        found = [np.concatenate([fast[::-1], slow]).T for fast, slow in parts]
    return found[0], found[1] if halves else None


def _cause(ticks: Channel, loop: Loop, grid: Grid, causes: list[tuple[Array, Cause]]) -> Cause:
    """Return what of the response to a perturbation does not change with the joint."""
    begin_s, rate_hz = float(grid.time_s[0] - ticks.time_s[0]), ticks.mean_rate_hz
    key = np.array(
        [round(begin_s * 1e9), round(1e6 * rate_hz), grid.time_s.size, round(1e6 * grid.rate_hz),
         hash((loop, grid.window[0].tobytes() if np.any(grid.window[0][1:-1] == 0) else 0))]
    )  # fmt: skip
    whole = np.concatenate([key.astype(float), ticks.values])
    for known, made in causes:
        if np.array_equal(known, whole):
            return made
    # Longer by what the roll-off reaches over the end, and a multiple of the coarse steps.
    steps = max(round(grid.step * rate_hz / grid.rate_hz), 1)
    least = -(-(len(ticks) + round(PAD_S * rate_hz)) // steps)
    circle = on_circle(loop, steps * scipy.fft.next_fast_len(least, real=True), rate_hz, 1)
    span_s = circle.length / rate_hz
    wanted = span_s * grid.rate_hz / grid.step
    samples, at_s = round(wanted), None
    if abs(wanted - samples) > 1e-6 * samples:
        samples = 4 * samples
        at_s = begin_s + span_s / samples * np.arange(samples)
    held = np.pad(ticks.values, (0, circle.damping.size - len(ticks)))
    bins, ticks_show = int(wanted / 2) + 1, circle.length // 2 + 1
    passed = _rolled_off(bins) if bins < ticks_show else np.ones(ticks_show)
    bins = passed.size
    shift = np.exp(2j * np.pi * begin_s / span_s * np.arange(bins)) * (samples / circle.length)
    decay_1_s = -float(np.log(circle.damping[1])) * rate_hz
    raising = np.exp(decay_1_s * (begin_s + span_s / samples * np.arange(samples)))
    made = Cause(
        grid,
        (circle.to(held) * circle.loop.admittance)[:bins],
        (circle.loop.forward * circle.loop.read)[:, :bins],
        circle.loop.sensed[:, :bins] * (passed * shift),
        samples,
        raising,
        None if at_s is None else np.asarray(at_s + float(ticks.time_s[0])),
    )
    causes.append((whole, made))
    return made


def _rolled_off(bins: int) -> Array:
    """Return a gain that falls smoothly over the upper half of so many bins.

    Cut off at once, what the record begins with would ring to its end, where the damping of the
    circle is taken away.
    """
    x = np.clip(2.0 - 2.0 * np.arange(bins) / (bins - 1), 0.0, 1.0)
    return np.asarray(x**4 * (35 - 84 * x + 70 * x**2 - 20 * x**3))


def _while(perturbation: Channel, torque: Channel) -> Channel:
    """Return the perturbation while the torque was sampled: elsewhere it may not be known."""
    early, late = np.searchsorted(perturbation.time_s, torque.time_s[[0, -1]])
    rows = slice(int(early), int(late) + 1)
    return Channel(perturbation.name, perturbation.time_s[rows], perturbation.values[rows])


def _evenly(perturbation: Channel) -> Channel:
    """Return the perturbation at every tick: the last level is held where ticks are missing."""
    interval_s, spacing_s = 1.0 / perturbation.rate_hz, np.diff(perturbation.time_s)
    if np.ptp(spacing_s) < 0.5 * interval_s:
        return perturbation
    count = int((perturbation.time_s[-1] - perturbation.time_s[0]) / interval_s + 0.5) + 1
    time_s = perturbation.time_s[0] + interval_s * np.arange(count)
    last = np.searchsorted(perturbation.time_s, time_s + 0.5 * interval_s, side="right") - 1
    return Channel(perturbation.name, time_s, perturbation.values[np.maximum(last, 0)])


def period_s(perturbation: Channel) -> float | None:
    """Return the shortest period of a perturbation; None if it does not repeat within the epoch."""
    values = perturbation.values - np.mean(perturbation.values)
    n = values.size
    products = scipy.signal.correlate(values, values, method="fft")[n - 1 : n + n // 2]
    power = np.concatenate(([0.0], np.cumsum(values**2)))
    lag = np.arange(products.size)
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = products / np.sqrt((power[n] - power[lag]) * power[n - lag])
    low = np.flatnonzero(correlation < 0.5)
    again = np.flatnonzero(correlation[low[0] :] > REPEATS) if low.size else low
    if not again.size:
        return None
    # The best of the neighbours: a period need not be a whole number of ticks.
    first = int(low[0] + again[0])
    return float(first + np.argmax(correlation[first : first + 3])) / perturbation.mean_rate_hz


def _whole_periods(perturbation: Channel, rate_hz: float, samples: int) -> tuple[int, int]:
    """Return how many whole periods there are in so many samples, and how many samples they are."""
    period = period_s(perturbation)
    periods = 0 if period is None else int(samples / rate_hz / period + 1e-6)
    if period is None or periods < 2:
        long_s = samples / rate_hz
        shown = (
            f"no period of the perturbation is twice in the {long_s:.3g} s in a row"
            if period is None
            else f"the perturbation repeats every {period:.3g} s, and of the {2 * period:.3g} s of "
            f"two periods there are {long_s:.3g} s in a row"
        )
        raise ValueError(
            f"{shown} that can be used; the spectral method needs two whole periods with nothing "
            "left out between; use --method iv, which needs none and allows for what is left out"
        )
    return periods, round(periods * period * rate_hz)
