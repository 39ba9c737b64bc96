"""Angular impulse (Eq. 1) and work of a sinusoidal epoch, per cycle (Sec. 2.3).

    impulse = Σ|M| Δt / n          work = ∮ M dθ / n

over n whole cycles at full amplitude. Eq. 2 as printed lacks the displacement; the text says the
area of the torque-angle loop, which is what is computed. For θ = A sin ωt and Eq. 3 the work of a
cycle is π B ω A², whatever J and K.

The chords of a loop sampled N times a cycle enclose less than the loop does, by (2π/N)²/6: 0.07 %
at 100 samples. Both signals are therefore refined by their cubic splines before the trapezoid rule,
which also lets the cycles begin and end between samples.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.signals import (
    Array,
    angle_at,
    butterworth,
    grid_rate_hz,
    power_lines,
    uniform_grid,
    values_at,
)
from rigidimeter.analysis.estimation.stretches import motion_channels, obstacle, unusable
from rigidimeter.core.records import Channel, Epoch, Motion, Outcome, Score
from rigidimeter.core.settings import EstimationSettings, ScoreSettings

POINTS_PER_CYCLE = 4096
"""Enough that the chords miss less than 4e-7 of the loop."""

SAMPLES_PER_CYCLE = 10.0
"""With fewer samples a cycle the spline no longer follows a sinusoid to a tenth of a percent."""

LEAST_GAIN = 0.25
"""Half of half: the gain, taken twice, at the edges of the band."""

SAME_AMPLITUDE = 0.9
"""A cycle at the end of a recording with less of the full excursion is a start or a stop."""


LOWEST_HZ, HIGHEST_HZ = 0.25, 10.0
"""Where the frequency of an imposed sinusoid is looked for: slower motion is drift."""

LEAST_VELOCITY_SHARE = 0.5
"""In the line of a sinusoid there is at least this share of the velocity's variance too."""


@dataclass(frozen=True)
class Cycles:
    """Whole cycles of torque and angle, band-passed alike, end points included.

    `time_s`, `torque_nm` and `angle_rad` have shape (n_cycles · points per cycle + 1,).
    """

    time_s: Array
    torque_nm: Array
    angle_rad: Array
    frequency_hz: float
    n_cycles: int


def loop_area_j(torque_nm: Array, angle_rad: Array) -> float:
    """Return ∮ M dθ in J by the trapezoid rule, positive for work done on the joint."""
    return float(np.sum(0.5 * (torque_nm[1:] + torque_nm[:-1]) * np.diff(angle_rad)))


def scoring_cycles(epoch: Epoch, settings: ScoreSettings) -> Cycles:
    """Return the cycles that are scored: whole ones, without the first and last second of motion.

    Torque and angle pass the same zero-phase band-pass (second-order Butterworth, forwards and
    backwards), so neither is delayed against the other. They are scaled to unit gain at the
    frequency of the motion: the paper's band has it at 1 Hz, and would take 17 % off the work at
    3 Hz.

    Raises
    ------
    ValueError
        If the motion holds not one whole cycle, or lies outside the band; the text says why.
    """
    motion = find_motion(epoch)
    used = [epoch.channels["torque_nm"], *motion_channels(epoch)]
    slowest = min(used, key=lambda channel: channel.rate_hz)
    if slowest.rate_hz < SAMPLES_PER_CYCLE * motion.frequency_hz:
        raise ValueError(
            f"{slowest.name} was sampled at {slowest.rate_hz:.3g} Hz; a {motion.frequency_hz:.3g} "
            f"Hz motion needs {SAMPLES_PER_CYCLE * motion.frequency_hz:.3g} Hz"
        )
    rate_hz = grid_rate_hz(used, settings.band_high_hz)
    grid = uniform_grid(used, rate_hz)
    both = np.stack([values_at(used[0], grid), angle_at(epoch, grid)])
    band = settings.band_low_hz, settings.band_high_hz
    bandpass = butterworth(2, band, "bandpass", rate_hz)
    _, response = scipy.signal.sosfreqz(bandpass, [motion.frequency_hz], fs=rate_hz)
    gain = float(np.abs(response[0]) ** 2)  # once forwards and once backwards
    if gain < LEAST_GAIN:
        raise ValueError(
            f"the {motion.frequency_hz:.3g} Hz motion lies outside the band of the scores, "
            f"{settings.band_low_hz:g} to {settings.band_high_hz:g} Hz ([scores] sets it)"
        )
    padding_s = 3 / settings.band_low_hz  # the slowest part of the filter settles in that time
    start = max(motion.start_s + settings.discard_s, float(grid[0]))
    stop = min(motion.start_s + motion.duration_s - settings.discard_s, float(grid[-1]))
    n_cycles = settings.cycles_in(stop - start, motion.frequency_hz)
    if n_cycles < 1:
        raise ValueError(
            f"the {motion.frequency_hz:.3g} Hz motion of {motion.duration_s:.3g} s holds no whole "
            f"cycle once {settings.discard_s:g} s at each end are discarded"
        )
    points = np.arange(n_cycles * POINTS_PER_CYCLE + 1)
    fine = start + points / (POINTS_PER_CYCLE * motion.frequency_hz)
    centred = both - np.mean(both, axis=1, keepdims=True)
    padded, before = _continued(grid, centred, motion.frequency_hz, padding_s)
    filtered = scipy.signal.sosfiltfilt(bandpass, padded)[:, before : before + grid.size]
    torque, angle = scipy.interpolate.CubicSpline(grid, filtered / gain, axis=1)(fine)
    return Cycles(fine, torque, angle, motion.frequency_hz, n_cycles)


def _continued(
    grid: Array, values: Array, frequency_hz: float, padding_s: float
) -> tuple[Array, int]:
    """Return signals, shape (k, n), continued at both ends, and how many values were put before.

    The last of the signals is the angle, which shows whether it moves at an end.

    A recording that begins in the middle of the motion is continued with the cycles next to its
    end, one at rest with its last value; a filter that started from a mirror image instead would
    take seconds to forget it, longer than the second that is discarded.
    """
    interval_s, cycle_s = float(grid[1] - grid[0]), 1.0 / frequency_hz
    n, cycle = round(padding_s / interval_s), round(cycle_s / interval_s)
    # How far into the first cycle, for each time before it, from the last on.
    back = (-np.arange(1, n + 1) * interval_s) % cycle_s
    full, motion = (
        SAME_AMPLITUDE * float(np.ptp(values[-1])),
        scipy.interpolate.CubicSpline(grid, values, axis=1),
    )
    early, late = (float(np.ptp(end)) > full for end in (values[-1, :cycle], values[-1, -cycle:]))
    before, after = motion(grid[0] + early * back), motion(grid[-1] - late * back)
    return np.concatenate([before[:, ::-1], values, after], axis=1), n


def score_epoch(epoch: Epoch, settings: ScoreSettings, screening: EstimationSettings) -> Score:
    """Return impulse and work per cycle; a bad epoch gives an outcome with its reason."""
    try:
        if reason := obstacle(epoch, screening):
            raise ValueError(reason)
        cycles = scoring_cycles(epoch, settings)
    except ValueError as error:
        outcome = unusable(epoch, str(error))
        return Score(epoch.source, epoch.label, epoch.condition, outcome)
    n = cycles.n_cycles
    interval_s = 1.0 / (POINTS_PER_CYCLE * cycles.frequency_hz)
    return Score(
        source=epoch.source,
        epoch=epoch.label,
        condition=epoch.condition,
        outcome=Outcome() if epoch.closed.included else Outcome("excluded", epoch.closed.reason),
        # The last point begins the next cycle, so Eq. 1 leaves it out.
        impulse_nm_s=float(np.sum(np.abs(cycles.torque_nm[:-1])) * interval_s) / n,
        work_j=loop_area_j(cycles.torque_nm, cycles.angle_rad) / n,
        n_cycles=n,
        frequency_hz=cycles.frequency_hz,
    )


def find_motion(epoch: Epoch) -> Motion:
    """Return the imposed sinusoid: as recorded, else as found in the angle.

    The frequency is the one whose sinusoid explains most of the moving part; the motion starts and
    stops where the envelope passes half its typical height.

    Raises
    ------
    ValueError
        If the epoch does not move at all.
    """
    if epoch.motion is not None:
        return epoch.motion
    time_s, angle = _angle(epoch)
    peak_hz, _ = _spectral_peak(time_s, angle)
    rate_hz = 1.0 / float(time_s[1] - time_s[0])
    band = 0.5 * peak_hz, min(2 * peak_hz, 0.45 * rate_hz)
    around = butterworth(2, band, "bandpass", rate_hz)
    envelope = np.abs(scipy.signal.hilbert(scipy.signal.sosfiltfilt(around, angle)))
    moving = np.flatnonzero(envelope > 0.5 * np.quantile(envelope, 0.9))
    first, last = int(moving[0]), int(moving[-1])
    t, x = time_s[first : last + 1], angle[first : last + 1]

    def unexplained(frequency_hz: float) -> float:
        phase = 2 * np.pi * frequency_hz * (t - t[0])
        basis = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(phase), phase])
        return float(np.sum((x - basis @ np.linalg.lstsq(basis, x, rcond=None)[0]) ** 2))

    width = 1.0 / float(t[-1] - t[0])
    best = scipy.optimize.minimize_scalar(
        unexplained, bounds=(max(peak_hz - width, 0.01), peak_hz + width), method="bounded"
    )
    return Motion(float(best.x), float(t[0]), float(t[-1] - t[0]))


class LineShares(NamedTuple):
    """The share of the variance of angle and velocity near the angle's strongest line."""

    angle: float
    velocity: float

    def single(self, most: float) -> bool:
        """Return whether the motion is a sinusoid: more than `most` of the angle is in the line.

        Steps to and fro are not: the line of their period holds 0.8 to 0.95 of the angle, but not
        half of the velocity, and the rest tells J from K.
        """
        return self.angle > most and self.velocity > LEAST_VELOCITY_SHARE


def line_shares(epoch: Epoch) -> LineShares:
    """Return the shares within a quarter octave of the angle's strongest line.

    That of the angle is close to 1 for an imposed sinusoid, well below for a perturbation with many
    frequencies.
    """
    motion = {c.name: _thinned(c) for c in motion_channels(epoch)}
    time_s, angle = _angle(replace(epoch, channels=motion))
    if time_s.size < 16 or not np.any(angle):
        return LineShares(0.0, 0.0)
    return _spectral_peak(time_s, angle)[1]


def _thinned(channel: Channel) -> Channel:
    """Return the means of a channel over stretches that keep 20 points a cycle."""
    step = int(channel.rate_hz / (20 * HIGHEST_HZ) + 1e-6)
    if step < 2:
        return channel
    both = np.stack([channel.time_s, channel.values])[:, : len(channel) // step * step]
    return Channel(channel.name, *both.reshape(2, -1, step).mean(axis=2))


def _angle(epoch: Epoch) -> tuple[Array, Array]:
    used = motion_channels(epoch)
    time_s = uniform_grid(used, grid_rate_hz(used, HIGHEST_HZ / 2))
    angle = angle_at(epoch, time_s)
    return time_s, np.asarray(scipy.signal.detrend(angle), dtype=np.float64)


def _spectral_peak(time_s: Array, angle: Array) -> tuple[float, LineShares]:
    """Return the frequency of the strongest line and its share of the power."""
    rate_hz = 1.0 / float(time_s[1] - time_s[0])
    frequency_hz, power = power_lines(angle, rate_hz, tapered=True, longer=4)
    return strongest_line(frequency_hz, power, 1.0 / float(time_s[-1] - time_s[0]))


def strongest_line(frequency_hz: Array, power: Array, line_hz: float) -> tuple[float, LineShares]:
    """Return the frequency of the angle's strongest line, and its shares of the power.

    Parameters
    ----------
    frequency_hz, power : arrays, shape (m,)
        Of the angle.
    line_hz : float
        From one line to the next, one over the duration.
    """
    inside = (frequency_hz >= LOWEST_HZ) & (frequency_hz <= HIGHEST_HZ)
    if not np.any(power[inside] > 0):
        raise ValueError("the joint does not move")
    peak_hz = float(frequency_hz[inside][np.argmax(power[inside])])
    near = np.abs(frequency_hz - peak_hz) <= max(0.19 * peak_hz, 2.0 * line_hz)
    of_velocity = power * frequency_hz**2 * (frequency_hz <= HIGHEST_HZ)
    shares = (float(one[near].sum() / one.sum()) for one in (power, of_velocity))
    return peak_hz, LineShares(*shares)
