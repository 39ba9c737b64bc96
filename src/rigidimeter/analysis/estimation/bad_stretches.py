"""Stretches in which a sensor hung or was at the end of its range.

A sensor at the end of its range repeats its extreme value; one that hangs repeats whatever it had.
A living signal does neither for long: it has noise. But a joint that is told to rest is at rest:
where command and perturbation are zero, a repeated value is what Eq. 3 gives, M = K θ. And a joint
that is told to go on at one velocity has that velocity. Nor does a coarse velocity hang while the
angle moves as it says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.stretches import (
    bridged,
    fitted_channels,
    sound,
    too_little,
    used_s,
)
from rigidimeter.core.records import Channel, Epoch, LeftOut
from rigidimeter.core.settings import DiagnosticsSettings, Settings

CAUSES = ("velocity_command_rad_s", "perturbation_nm")
FEWEST_AT_EXTREME = 3
"""An extreme reached by chance is not repeated three times in a row."""

ZERO = 1e-6
"""A command below this share of its largest value is none."""

Runs = tuple[NDArray[np.int64], NDArray[np.int64]]
"""First and last rows of stretches of equal values."""

NEAR = 0.1
"""A velocity no further than this share of the largest command from what it is told obeys it."""


def without_bad_stretches(epoch: Epoch, settings: Settings) -> Epoch:
    """Return the epoch with its bad stretches left out and everything left out bridged.

    They stay in where their check is not set to ``exclude``, and where too little would be left:
    then the check speaks of the whole epoch.
    """
    epoch = bridged(epoch)
    diagnostics, levels = settings.diagnostics, settings.diagnostics.levels
    if not fitted_channels(epoch):
        return epoch
    found = [one for one in bad_stretches(epoch, diagnostics) if levels.of(one.check) == "exclude"]
    return leaving_out(epoch, found, settings)[0]


def leaving_out(epoch: Epoch, found: Sequence[LeftOut], settings: Settings) -> tuple[Epoch, str]:
    """Return a bridged epoch without some stretches too; as it is, and why, where they stay in.

    They do where that would take more than `max_left_out_percent` of it, or leave less than can be
    fitted.
    """
    if not found:
        return epoch, ""
    why = _why_kept(epoch, found, settings)
    return (epoch, why) if why else (bridged(_without(epoch, found)), "")


def _why_kept(epoch: Epoch, found: Sequence[LeftOut], settings: Settings) -> str:
    without, trim_s = _without(epoch, found), settings.estimation.trim_s
    (before_s, _), (left_s, _) = used_s(epoch, trim_s), used_s(without, trim_s)
    taken_percent = 100.0 * (before_s - left_s) / before_s if before_s > 0 else 100.0
    most_percent = settings.diagnostics.max_left_out_percent
    if taken_percent > most_percent:
        return (
            f"with {trim_s:g} s on each side that would take {taken_percent:.0f} % of the epoch "
            f"(at most {most_percent:g} %)"
        )
    return too_little(without, settings.estimation)


def _without(epoch: Epoch, found: Sequence[LeftOut]) -> Epoch:
    return replace(epoch, left_out=(*epoch.left_out, *sorted(found)))


def bad_stretches(epoch: Epoch, settings: DiagnosticsSettings) -> list[LeftOut]:
    """Return where a channel repeats one value for too long, or was at the end of its range.

    That is longer than `max_frozen_s`, and where a channel that was at the end of its range too
    often was there.
    """
    found = []
    for channel in fitted_channels(epoch):
        runs = _runs(channel.values)
        starts_s, stops_s = _repetitions(epoch, channel, runs, settings)
        long = stops_s - starts_s > settings.max_frozen_s
        text = f"{channel.name} repeats one value"
        spans = zip(starts_s[long], stops_s[long], strict=True)
        found += [LeftOut(float(one), float(two), text, "frozen") for one, two in spans]
        rows, starts, stops = _at_extremes(epoch, channel, runs, settings)
        if 100.0 * rows / len(channel) > settings.max_saturated_percent:
            text = f"{channel.name} repeats an extreme value"
            spans = zip(channel.time_s[starts], channel.time_s[stops], strict=True)
            found += [LeftOut(float(one), float(two), text, "saturation") for one, two in spans]
    return found


def longest_repetition(
    epoch: Epoch, channel: Channel, settings: DiagnosticsSettings
) -> tuple[float, float]:
    """Return how long the longest repetition of one value lasts, and when it begins, in s."""
    starts_s, stops_s = _repetitions(epoch, channel, _runs(channel.values), settings)
    if starts_s.size == 0:
        return 0.0, float(channel.time_s[0])
    longest = int(np.argmax(stops_s - starts_s))
    return float(stops_s[longest] - starts_s[longest]), float(starts_s[longest])


def share_at_extremes(epoch: Epoch, channel: Channel, settings: DiagnosticsSettings) -> float:
    """Return in which share of its samples a channel repeats an extreme value."""
    return _at_extremes(epoch, channel, _runs(channel.values), settings)[0] / len(channel)


def _at_extremes(
    epoch: Epoch, channel: Channel, runs: Runs, settings: DiagnosticsSettings
) -> tuple[int, NDArray[np.int64], NDArray[np.int64]]:
    """Return how many samples repeat an extreme, and the first and last row of each such run."""
    starts, stops = runs
    level = channel.values[starts]
    kept = (stops - starts >= FEWEST_AT_EXTREME - 1) & _in_use(epoch, channel, starts, stops)
    if np.any(kept):
        kept &= (level == np.max(channel.values)) | (level == np.min(channel.values))
    for run in np.flatnonzero(kept):
        kept[run] = not _moves(epoch, channel, starts[run], stops[run], settings.max_frozen_s)
    return int(np.sum((stops - starts + 1)[kept])), starts[kept], stops[kept]


def _repetitions(
    epoch: Epoch, channel: Channel, runs: Runs, settings: DiagnosticsSettings
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return from when to when, in s, a channel repeats a value that nobody told it to keep."""
    starts, stops = runs
    most_s = settings.max_frozen_s
    kept = _in_use(epoch, channel, starts, stops)
    long = kept & (channel.time_s[stops] - channel.time_s[starts] > most_s)
    for run in np.flatnonzero(long):
        kept[run] = not _moves(epoch, channel, starts[run], stops[run], most_s)
    return channel.time_s[starts[kept]], channel.time_s[stops[kept]]


def _runs(values: NDArray[np.float64]) -> Runs:
    """Return first and last rows of the stretches of equal values, two rows at least."""
    same = np.diff(values) == 0
    if not np.any(same):
        return np.empty(0, np.int64), np.empty(0, np.int64)
    edges = np.flatnonzero(np.diff(same, prepend=False, append=False))
    return edges[::2], edges[1::2]


def _in_use(
    epoch: Epoch, channel: Channel, starts: NDArray[np.int64], stops: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return which runs do not lie in what is left out already."""
    if not epoch.left_out:
        return np.ones(starts.size, dtype=np.bool_)
    kept = np.asarray(sound(epoch, channel.time_s), dtype=np.int64)
    before = np.concatenate(([0], np.cumsum(kept)))
    return np.asarray(before[stops + 1] > before[starts])


def _moves(epoch: Epoch, channel: Channel, start: int, stop: int, within_s: float) -> bool:
    """Return whether a channel repeats a value because the joint does what that value says."""
    return _as_the_angle(epoch, channel, start, stop) or _as_told(
        epoch, channel, start, stop, within_s
    )


def _as_the_angle(epoch: Epoch, channel: Channel, start: int, stop: int) -> bool:
    """Return whether a velocity is that of the angle, within the step to what is beside it."""
    if channel.name != "velocity_rad_s" or "angle_rad" not in epoch.channels:
        return False
    angle, values = epoch.channels["angle_rad"], channel.values
    span_s = channel.time_s[[start, stop]]
    moved_rad = np.diff(np.interp(span_s, angle.time_s, angle.values)).item()
    if moved_rad == 0.0:
        return False  # both may hang
    beside = [row for row in (start - 1, stop + 1) if 0 <= row < values.size]
    step_rad_s = np.min(np.abs(values[beside] - values[start]), initial=np.inf if beside else 0.0)
    return bool(abs(moved_rad / np.diff(span_s).item() - values[start]) < step_rad_s)


def _as_told(epoch: Epoch, channel: Channel, start: int, stop: int, within_s: float) -> bool:
    """Return whether the command is why a channel repeats a value, except for `within_s` of it.

    The motion begins and ends later than its command, by the delay of the drive.
    """
    if CAUSES[0] not in epoch.channels:
        return False
    start_s, stop_s = float(channel.time_s[start]), float(channel.time_s[stop])
    moving_most_s = min(within_s, 0.5 * (stop_s - start_s))
    command = epoch.channels[CAUSES[0]]
    causes = [epoch.channels[name] for name in CAUSES if name in epoch.channels]
    if all(_keeps(cause, start_s, stop_s, 0.0, moving_most_s) for cause in causes):
        return True
    inside = _within(command, start_s, stop_s)
    if channel.name != "velocity_rad_s" or inside.size == 0:
        return False
    told, largest = float(np.median(inside)), _largest(command)
    obeyed = abs(channel.values[start] - told) <= NEAR * largest and abs(told) > NEAR * largest
    return obeyed and _keeps(command, start_s, stop_s, told, moving_most_s)


def _keeps(
    cause: Channel, start_s: float, stop_s: float, level: float, other_most_s: float
) -> bool:
    """Return whether a cause has a level in a stretch, except for a time."""
    inside = _within(cause, start_s, stop_s)
    if inside.size == 0:
        return False
    other = np.abs(inside - level) > ZERO * _largest(cause)
    return float(np.count_nonzero(other)) / cause.mean_rate_hz <= other_most_s


def _within(channel: Channel, start_s: float, stop_s: float) -> NDArray[np.float64]:
    first = np.searchsorted(channel.time_s, start_s)
    return channel.values[first : np.searchsorted(channel.time_s, stop_s, side="right")]


def _largest(channel: Channel) -> float:
    return max(float(np.max(channel.values)), -float(np.min(channel.values)))
