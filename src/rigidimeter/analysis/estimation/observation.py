"""An epoch at the lines of its band: torque, motion, and the motion that the perturbation causes.

All are sums over the samples of the torque, at its stamps: a torque that was sampled at a point in
time is held against the motion at that point. Where the command is recorded and explains the
velocity, the motion there is what the command causes, known at any time, plus what the sensors saw
beyond it; so neither slow sensors nor the ripple between the ticks bias the fit (`drive`).

The perturbation alone causes, from rest and without noise,

    θ = H A P / (1 + L(J, B, K))

with the admittance A and the loop gain L of the settings (`rigidimeter.model.Loop`) and the drive
H. It carries nothing of what the subject does. A wrong loop makes it a weaker instrument, not a
wrong one; a loop that would be unstable with the joint did not move it, and is opened.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.drive import (
    Drive,
    Sampling,
    TorqueFilter,
    alternatives,
    beyond,
    passed,
    since_ticks,
    ticks_hz,
    without_drive,
)
from rigidimeter.analysis.estimation.grid import (
    SAME_TIME,
    Array,
    Complex,
    Grid,
    grid_of,
    lines_of,
)
from rigidimeter.analysis.estimation.signals import (
    angle_at,
    columns_at,
    held_at,
    motion_channels,
    sampled,
    uniform_grid,
    usable_hz,
    values_at,
    velocity_at,
)
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import Settings
from rigidimeter.model import ON_EDGE, Loop, on_circle

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
        if self.at_s is not None:
            spline = scipy.interpolate.CubicSpline(self.at_s, motion, axis=1)
            motion = spline(self.grid.coarse_time_s)
        motion = motion[:, : self.grid.coarse_time_s.size]
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
    terms_nm : complex array, shape (m,)
        What of the torque terms beside J, B and K take.
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
    of_angle : bool
        Whether acceleration and velocity are made of the angle alone.
    wider : Observation or None
        The same at the lines of a wider band.
    """

    epoch: Epoch
    settings: Settings
    grid: Grid
    torque_nm: Complex
    terms_nm: Complex
    motion: Complex
    coarse: Array
    noise: Complex | None
    changes: Complex
    loop: Loop | None = None
    cause: Cause | None = None
    periods: int = 1
    drive_known: bool = False
    of_angle: bool = False
    wider: Observation | None = None

    @property
    def excited(self) -> NDArray[np.bool_]:
        """At which lines the perturbation has power, shape (m,)."""
        return np.asarray(self.grid.line % self.periods == 0)

    def left(self, values: Array) -> Complex:
        """Return the torque that J, B and K, and the terms beside them, leave, shape (m,)."""
        return np.asarray(self.torque_nm - self.terms_nm - self.motion @ values)

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
            terms_nm=self.terms_nm[lines],
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
    cutoff_hz = settings.estimation.torque_lowpass_hz
    return (cutoff_hz, settings.estimation.torque_lowpass_order) if cutoff_hz else None


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
    torque, estimation = epoch.channels["torque_nm"], settings.estimation
    perturbation, caused = epoch.channels.get("perturbation_nm"), causes is not None
    if caused and (reason := no_instrument(epoch)):
        raise ValueError(reason)
    moving = motion_channels(epoch)
    usable, low_hz = usable_hz(epoch, drive is not None), estimation.band_low_hz
    high_hz = min(estimation.band_high_closed_loop_hz, usable)
    if not caused and drive is None and low_hz > 0:  # one from 0 Hz was asked for up to its end
        # Higher, noise of the motion that no half of the samples shows would count as motion.
        slowest = min(one.rate_hz for one in (torque, *moving))
        high_hz = min(high_hz, max(slowest / DENSE, NARROWEST * low_hz))
    band_hz = wide_hz = low_hz, high_hz
    if caused and not periodic:
        wide_hz = WIDER[0] * low_hz, min(WIDER[1] * high_hz, usable)
    used = [torque, *moving, *([perturbation] if perturbation is not None else [])]
    repeats_s = _repeated_s(perturbation, used) if periodic and perturbation else None
    holes = [one[:2] for one in epoch.left_out]
    grid = grid_of(used, wide_hz, estimation.trim_s, holes, repeats_s)
    periods = 1 if repeats_s is None else round(grid.duration_s / repeats_s)
    observed = _at_lines(epoch, settings, grid, drive, noise=not caused)
    observed = replace(observed, loop=loop, periods=periods)
    if causes is not None and perturbation is not None and loop is not None:
        observed = replace(observed, cause=_cause(_evenly(perturbation), loop, grid, causes))
    if wide_hz == band_hz:
        return observed
    start, stop = np.searchsorted(grid.line, lines_of(band_hz, grid.duration_s)).tolist()
    return replace(observed.part(slice(start, stop)), wider=observed)


def _at_lines(
    epoch: Epoch, settings: Settings, grid: Grid, drive: Drive | None, *, noise: bool
) -> Observation:
    """Return torque and motion at the lines, without loop and cause."""
    torque, command = epoch.channels["torque_nm"], epoch.channels.get("velocity_command_rad_s")
    time_s, channels, through = grid.time_s, epoch.channels, torque_filter_of(settings)
    recorded, driven, seen = "angle_rad" in channels, None, epoch
    recorded &= all(sampled(one, time_s, SAME_TIME) for one in motion_channels(epoch))
    by_angle = "velocity_rad_s" not in channels or (drive is not None and drive.by_angle)
    lines_rad_s = float(grid.omega_rad_s[0]), float(grid.omega_rad_s[-1]), grid.line.size
    at = Sampling(lines_rad_s, 1.0 / ticks_hz(settings.rig, torque), through)
    if drive is not None and command is not None:
        interval_s = float(f"{1.0 / command.mean_rate_hz:.9g}")
        at = Sampling(lines_rad_s, interval_s, through, by_angle)
        place = sampled(torque, time_s, SAME_TIME)
        tick, after_s = since_ticks(command, torque.time_s[place] if place else time_s, 0.0)
        recorded &= bool(np.all(np.diff(tick) == 1) and np.ptp(after_s) < 2 * ON_EDGE * interval_s)
        if not recorded:
            caused = drive.behind(through).motion(command, torque.time_s)
            driven, seen = columns_at(torque, caused, time_s, SAME_TIME), drive.beyond(epoch)
    angle, velocity = angle_at(seen, time_s, SAME_TIME), velocity_at(seen, time_s, SAME_TIME)
    angle, passing = angle - np.mean(angle), passed(through, grid.omega_rad_s)[:, None]
    of_angle = recorded and by_angle
    own = None if of_angle else velocity
    motion, apart = passing * _motion_lines(grid, angle, own), None
    if noise and recorded and grid.rate_hz >= DENSE * grid.band_hz[1]:
        # As far below half the rate as the lines are above zero there is noise alone.
        turned = np.where(np.arange(time_s.size) % 2, -1.0, 1.0)
        apart = passing * _motion_lines(grid, turned * angle, None if own is None else turned * own)
    if driven is not None:
        motion = motion + grid.lines(driven)[0].T
        angle, velocity = angle + driven[2] - np.mean(driven[2]), velocity + driven[1]
    if drive is None or command is None:
        changes = without_drive(motion, settings.rig, at)
    else:
        sent = grid.lines(command.values[tick])[0][:, None]
        if recorded:
            motion = motion + sent * beyond(drive.model, at, round(float(np.mean(after_s)), 9))[0]
        stamped_s = since_ticks(command, torque.time_s, 0.0)[1]
        changes = alternatives(drive, motion, sent, at, stamped_s)
    return Observation(
        epoch,
        settings,
        grid,
        grid.lines(values_at(torque, time_s, SAME_TIME))[0],
        np.zeros(grid.line.size, dtype=np.complex128),
        motion,
        grid.coarse(np.stack([velocity, angle])),
        apart,
        changes,
        drive_known=drive is not None and command is not None,
        of_angle=of_angle,
    )


def _motion_lines(grid: Grid, angle: Array, velocity: Array | None) -> Complex:
    """Return acceleration, velocity and angle at the lines, shape (m, 3)."""
    if velocity is None:
        return grid.lines(angle, 2)[::-1].T
    return np.concatenate([grid.lines(velocity, 1)[::-1], grid.lines(angle)]).T


def _cause(ticks: Channel, loop: Loop, grid: Grid, causes: list[tuple[Array, Cause]]) -> Cause:
    """Return what of the response to a perturbation does not change with the joint."""
    begin_s, rate_hz = float(grid.time_s[0] - ticks.time_s[0]), ticks.mean_rate_hz
    holed = grid.window[0].tobytes() if np.any(grid.window[0][1:-1] == 0) else 0
    key = round(begin_s * 1e9), round(1e6 * rate_hz), round(1e6 * grid.rate_hz), hash((loop, holed))
    whole = np.concatenate([[float(one) for one in key], [grid.time_s.size], ticks.values])
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
        at_s = grid.time_s[0] + span_s / samples * np.arange(samples)
    held = np.pad(ticks.values, (0, circle.damping.size - len(ticks)))
    bins, ticks_show = int(wanted / 2) + 1, circle.length // 2 + 1
    through = _rolled_off(bins) if bins < ticks_show else np.ones(ticks_show)
    bins = through.size
    shift = np.exp(2j * np.pi * begin_s / span_s * np.arange(bins)) * (samples / circle.length)
    decay_1_s = -float(np.log(circle.damping[1])) * rate_hz
    made = Cause(
        grid,
        (circle.to(held) * circle.loop.admittance)[:bins],
        (circle.loop.forward * circle.loop.read)[:, :bins],
        circle.loop.sensed[:, :bins] * (through * shift),
        samples,
        np.exp(decay_1_s * (begin_s + span_s / samples * np.arange(samples))),
        at_s,
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


def _evenly(perturbation: Channel) -> Channel:
    """Return the perturbation at every tick: the last level is held where ticks are missing."""
    interval_s = 1.0 / perturbation.rate_hz
    if np.ptp(np.diff(perturbation.time_s)) < 0.5 * interval_s:
        return perturbation
    count = int((perturbation.time_s[-1] - perturbation.time_s[0]) / interval_s + 0.5) + 1
    time_s = perturbation.time_s[0] + interval_s * np.arange(count)
    return Channel(perturbation.name, time_s, held_at(perturbation, time_s + 0.5 * interval_s))


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


def _repeated_s(perturbation: Channel, used: Sequence[Channel]) -> float:
    """Return the period of a perturbation that is there twice or more while all is sampled."""
    torque, sent_s = used[0], perturbation.time_s
    # Before and after it the perturbation may not be known.
    rows = (sent_s >= torque.time_s[0]) & (sent_s <= torque.time_s[-1])
    known = Channel(perturbation.name, sent_s[rows], perturbation.values[rows])
    period, times_s = period_s(known), uniform_grid(used, torque.rate_hz)
    long_s = times_s.size / torque.rate_hz
    if period is not None and long_s / period + 1e-6 >= 2:
        return period
    shown = f"no period of the perturbation is twice in the {long_s:.3g} s in a row"
    if period is not None:
        shown = (
            f"the perturbation repeats every {period:.3g} s, and of the {2 * period:.3g} s of "
            f"two periods there are {long_s:.3g} s in a row"
        )
    raise ValueError(
        f"{shown} that can be used; the spectral method needs two whole periods with nothing "
        "left out between; use --method iv, which needs none and allows for what is left out"
    )
