"""What of an epoch can be used: bridging, stretches without a measurement, and what is left.

Torque and motion go on a straight line over what is left out, so that nothing a sensor said there
comes out of a filter seconds later; a spectral window falls to zero there. Command and perturbation
stay as recorded, for they are causes. Where samples are lost, each channel gets stamps as even as
its others: the command on a straight line, the perturbation on its level. At a tick that our own
loop missed nothing was sent, and the drive held its command, so those stamps stay. Missing rows of
other files may be either, and are taken for lost.

A sensor that hangs, or is at the end of its range, repeats a value; a living signal has noise. But
where command and perturbation are zero M = K θ (Eq. 3) may rest; a joint that is told to go on at
one velocity has that velocity; and a coarse velocity does not hang while the angle moves as it
says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.records import Channel, Epoch, LeftOut, Outcome
from rigidimeter.core.settings import USABLE_FRACTION_OF_RATE, EstimationSettings, Settings

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

MOTION = ("velocity_rad_s", "angle_rad")
CAUSES = ("velocity_command_rad_s", "perturbation_nm")

GAP = 1.5
"""In mean intervals: where two samples are further apart, some between them are missing."""

FEWEST_AT_EXTREME = 3
"""An extreme reached by chance is not repeated three times in a row."""

ZERO = 1e-6
"""A command below this share of its largest value is none."""

NEAR = 0.1
"""A velocity no further than this share of the largest command from what it is told obeys it."""

LEAST_USED_S = 1.0

LEAST_BAND_RATIO = 4.0
"""A band narrower than two octaves cannot distinguish three parameters."""

LARGEST_VALUE = 1e9
"""No joint has a torque, an angle or a velocity beyond this, in SI units."""

LARGEST_CONDITION_NUMBER = 1000.0
"""Beyond this the motion excites less than three parameters; a PRBS in the closed loop has 1.3."""


def motion_channels(epoch: Epoch) -> list[Channel]:
    """Return the measured motion channels of an epoch, the velocity first."""
    return [epoch.channels[name] for name in MOTION if name in epoch.channels]


def fitted_channels(epoch: Epoch) -> list[Channel]:
    """Return the measured channels that J, B and K are made of, those with samples."""
    wanted = (epoch.channels.get(name) for name in ("torque_nm", *MOTION[::-1]))
    return [channel for channel in wanted if channel is not None and len(channel)]


def moves(channel: Channel | None) -> bool:
    """Return whether a channel was recorded and changes."""
    return channel is not None and len(channel) > 1 and float(np.ptp(channel.values)) > 0.0


def sound(epoch: Epoch, time_s: Array, margin_s: float = 0.0) -> NDArray[np.bool_]:
    """Return at which times nothing within `margin_s` is left out."""
    kept = np.ones(time_s.size, dtype=np.bool_)
    for stretch in epoch.left_out:
        kept &= (time_s < stretch.start_s - margin_s) | (time_s > stretch.stop_s + margin_s)
    return kept


def screened(epoch: Epoch, settings: Settings) -> Epoch:
    """Return the epoch without its bad stretches, everything that is left out bridged.

    They stay in where their check is not set to ``exclude``, and where too little would be left:
    then the check speaks of the whole epoch.
    """
    epoch, levels = bridged(epoch), settings.diagnostics.levels
    found = [one for one in _bad(epoch, settings) if levels.of(one.check) == "exclude"]
    return leaving_out(epoch, found, settings)[0]


def leaving_out(epoch: Epoch, found: Sequence[LeftOut], settings: Settings) -> tuple[Epoch, str]:
    """Return a bridged epoch without some stretches too; as it is, and why, where they stay in.

    They do where that would take more than `max_left_out_percent` of it, or leave less than can be
    fitted.
    """
    if not found:
        return epoch, ""
    without = replace(epoch, left_out=(*epoch.left_out, *sorted(found)))
    trim_s, most_percent = settings.estimation.trim_s, settings.diagnostics.max_left_out_percent
    before_s, left_s = used_s(epoch, trim_s), used_s(without, trim_s)
    taken_percent = 100.0 * (before_s - left_s) / before_s if before_s > 0 else 100.0
    why = too_little(without, settings.estimation)
    if taken_percent > most_percent:
        why = (
            f"with {trim_s:g} s on each side that would take {taken_percent:.0f} % of the epoch "
            f"(at most {most_percent:g} %)"
        )
    return (epoch, why) if why else (bridged(without), "")


def bridged(epoch: Epoch) -> Epoch:
    """Return the epoch with torque and motion on a straight line over what is left out.

    Lost samples are filled in, and those that are missing from a command where it is not known
    that none was sent.
    """
    lost = [stretch for stretch in epoch.left_out if stretch.lost]
    unsaid = [LeftOut(-np.inf, np.inf)] if epoch.ticks is None else lost
    channels = {
        name: _evenly(one, unsaid if name == CAUSES[0] else lost)
        for name, one in epoch.channels.items()
    }
    if not epoch.left_out and all(channels[name] is one for name, one in epoch.channels.items()):
        return epoch
    for one in fitted_channels(replace(epoch, channels=channels)):
        kept = sound(epoch, one.time_s)
        if np.any(kept):  # else there is nothing to hang a line on
            line = np.interp(one.time_s, one.time_s[kept], one.values[kept])
            channels[one.name] = replace(one, values=np.where(kept, one.values, line))
    return replace(epoch, channels=channels)


def _evenly(channel: Channel, lost: Sequence[LeftOut]) -> Channel:
    """Return a channel with samples where its own are lost, evenly between those around them."""
    if not lost or len(channel) < 2:
        return channel
    steps_s = np.diff(channel.time_s)
    wide = steps_s >= GAP / channel.mean_rate_hz
    if not np.any(wide):
        return channel
    middle_s = channel.time_s[:-1] + 0.5 * steps_s
    wide &= np.any([(one.start_s < middle_s) & (middle_s < one.stop_s) for one in lost], axis=0)
    more = np.maximum(np.rint(steps_s * channel.rate_hz) - 1, 0)
    pieces = np.where(wide, more, 0).astype(np.intp) + 1
    if np.all(pieces == 1):
        return channel
    rows = np.arange(len(channel))
    first = np.concatenate(([0], np.cumsum(pieces)))
    place = np.interp(np.arange(first[-1] + 1), first, rows)
    time_s, line = (np.interp(place, rows, one) for one in (channel.time_s, channel.values))
    held = channel.values[place.astype(np.intp)]
    return replace(channel, time_s=time_s, values=held if channel.name == CAUSES[1] else line)


def longest_part(epoch: Epoch) -> Epoch:
    """Return the longest part of the epoch in which nothing is left out, as an epoch of its own.

    Where an imposed motion is recorded, the part that has most of that. Command and perturbation
    stay whole: what was before the part has caused some of its motion.
    """
    if not epoch.left_out:
        return epoch
    start_s, stop_s = _span(epoch)
    parts, at_s = [], start_s
    for stretch in (*sorted(epoch.left_out), LeftOut(stop_s, stop_s)):
        parts.append((at_s, stretch.start_s))
        at_s = max(at_s, stretch.stop_s)
    if epoch.motion is not None:
        start_s = epoch.motion.start_s
        stop_s = start_s + epoch.motion.duration_s
    # The first of those that are equally long.
    low_s, high_s = max(parts, key=lambda part: min(part[1], stop_s) - max(part[0], start_s))
    channels = dict(epoch.channels)
    for one in fitted_channels(epoch):
        # The ends of a stretch are left out with it.
        rows = (one.time_s >= low_s) & (one.time_s <= high_s) & sound(epoch, one.time_s)
        channels[one.name] = replace(one, time_s=one.time_s[rows], values=one.values[rows])
    return replace(epoch, channels=channels, left_out=())


def used_s(epoch: Epoch, trim_s: float) -> float:
    """Return for how long an epoch can be used, so much further from its ends and what is out."""
    at_s, stop_s = _span(epoch)
    left_s, at_s = 0.0, at_s + trim_s
    for stretch in (*sorted(epoch.left_out), LeftOut(stop_s, stop_s)):
        left_s += max(min(stretch.start_s, stop_s) - trim_s - at_s, 0.0)
        at_s = max(at_s, stretch.stop_s + trim_s)
    return left_s


def left_out_s(epoch: Epoch) -> float:
    """Return for how long something is left out, without the margins."""
    start_s, stop_s = _span(epoch)
    return stop_s - start_s - used_s(epoch, 0.0)


def too_little(epoch: Epoch, settings: EstimationSettings) -> str:
    """Return why what is not left out cannot be used, or an empty text."""
    trim_s = settings.trim_s
    least_s = max(settings.min_epoch_s - 2 * trim_s, LEAST_USED_S)
    if not epoch.left_out or (left_s := used_s(epoch, trim_s)) >= least_s * (1 - 1e-3):
        return ""
    return (
        f"what is left out, with {trim_s:g} s at each side of it, leaves {left_s:.3g} s; "
        f"at least {least_s:g} s are needed"
    )


def _span(epoch: Epoch) -> tuple[float, float]:
    used = fitted_channels(epoch)
    start_s = max(float(channel.time_s[0]) for channel in used)
    return start_s, min(float(channel.time_s[-1]) for channel in used)


def repeated(epoch: Epoch, channel: Channel, most_s: float, *, extreme: bool = False) -> Rows:
    """Return the first and last row of runs of one value that neither joint nor command explain.

    Runs within what is left out do not count.

    Parameters
    ----------
    epoch : Epoch
    channel : Channel
    most_s : float
        Of shorter runs it is not asked why, unless they are extreme.
    extreme : bool
        Those of the channel's largest or smallest value alone, `FEWEST_AT_EXTREME` rows or more.

    Returns
    -------
    array of int, shape (k, 2)
    """
    values = channel.values
    edges = np.flatnonzero(np.diff(np.diff(values) == 0, prepend=False, append=False))
    runs = edges.reshape(-1, 2)
    if epoch.left_out:
        before = np.concatenate(([0], np.cumsum(sound(epoch, channel.time_s))))
        runs = runs[before[runs[:, 1] + 1] > before[runs[:, 0]]]
    if extreme:
        runs = runs[np.ptp(runs, axis=1) >= FEWEST_AT_EXTREME - 1]
        runs = runs[np.isin(values[runs[:, 0]], (np.max(values), np.min(values)))]
    asked = extreme | (np.ptp(channel.time_s[runs], axis=1) > most_s)
    kept = np.ones(asked.size, dtype=np.bool_)
    for place in np.flatnonzero(asked):
        run = runs[place]
        told = _as_told(epoch, channel, run, most_s)
        kept[place] = not (told or _as_the_angle(epoch, channel, run))
    return runs[kept]


def at_extremes_percent(channel: Channel, runs: Rows) -> float:
    """Return in which share of its samples a channel is in runs."""
    return 100.0 * float(np.sum(np.ptp(runs, axis=1) + 1)) / len(channel)


def _bad(epoch: Epoch, settings: Settings) -> list[LeftOut]:
    """Return where a channel hung, or was at the end of its range if it was so too often."""
    most_s, found = settings.diagnostics.max_frozen_s, []
    for one in fitted_channels(epoch):
        spans_s = one.time_s[repeated(epoch, one, most_s)]
        long = spans_s[np.ptp(spans_s, axis=1) > most_s].tolist()
        found += [LeftOut(a, b, f"{one.name} repeats one value", "frozen") for a, b in long]
        runs = repeated(epoch, one, most_s, extreme=True)
        if at_extremes_percent(one, runs) > settings.diagnostics.max_saturated_percent:
            text, spans = f"{one.name} repeats an extreme value", one.time_s[runs].tolist()
            found += [LeftOut(a, b, text, "saturation") for a, b in spans]
    return found


def _as_the_angle(epoch: Epoch, channel: Channel, run: Rows) -> bool:
    """Return whether a velocity is that of the angle, within the step to what is beside it."""
    if channel.name != "velocity_rad_s" or "angle_rad" not in epoch.channels:
        return False
    angle, span_s = epoch.channels["angle_rad"], channel.time_s[run]
    moved_rad = np.diff(np.interp(span_s, angle.time_s, angle.values)).item()
    steps_rad_s = np.abs(np.diff(channel.values[max(run[0] - 1, 0) : run[1] + 2]))
    if moved_rad == 0.0 or not np.any(steps_rad_s):
        return False  # both may hang
    off_rad_s = abs(moved_rad / np.diff(span_s).item() - channel.values[run[0]])
    return bool(off_rad_s < np.min(steps_rad_s[steps_rad_s > 0]))


def _as_told(epoch: Epoch, channel: Channel, run: Rows, most_s: float) -> bool:
    """Return whether the command is why a channel repeats a value, except for `most_s` of it.

    The motion begins and ends later than its command, by the delay of the drive.
    """
    start_s, stop_s = channel.time_s[run].tolist()
    other_most_s = min(most_s, 0.5 * (stop_s - start_s))

    def inside(cause: Channel) -> Array:
        first = np.searchsorted(cause.time_s, start_s)
        return cause.values[first : np.searchsorted(cause.time_s, stop_s, side="right")]

    def keeps(cause: Channel, level: float) -> bool:
        other = np.abs(inside(cause) - level) > ZERO * np.max(np.abs(cause.values))
        other_s = np.count_nonzero(other) / cause.mean_rate_hz
        return other.size > 0 and bool(other_s <= other_most_s)

    causes = [epoch.channels[name] for name in CAUSES if name in epoch.channels]
    if not causes or causes[0].name != CAUSES[0]:
        return False
    if all(keeps(cause, 0.0) for cause in causes):
        return True
    if channel.name != "velocity_rad_s" or inside(causes[0]).size == 0:
        return False
    told, near = np.median(inside(causes[0])), NEAR * np.max(np.abs(causes[0].values))
    obeyed = abs(channel.values[run[0]] - told) <= near < abs(told)
    return bool(obeyed) and keeps(causes[0], float(told))


def obstacle(epoch: Epoch, settings: EstimationSettings) -> str:
    """Return why the epoch cannot be fitted by any method, or an empty text."""
    torque, motion = epoch.channels.get("torque_nm"), motion_channels(epoch)
    if torque is None:
        return "torque_nm was not recorded"
    if not motion:
        return "neither velocity_rad_s nor angle_rad was recorded"
    measured = (torque, *motion)
    sent = (epoch.channels[name] for name in CAUSES if name in epoch.channels)
    for one in (*measured, *(one for one in sent if len(one) > 1)):
        if len(one) < 2:
            return f"{one.name} holds {len(one)} sample(s)"
        if not np.isfinite([np.min(one.values), np.max(one.values)]).all():
            bad = int(np.argmin(np.isfinite(one.values)))
            return (
                f"{one.name} is {one.values[bad]} at {one.time_s[bad]:.4g} s; "
                "samples must be finite numbers"
            )
    slowest = min(measured, key=lambda channel: channel.rate_hz)
    if USABLE_FRACTION_OF_RATE * slowest.rate_hz < LEAST_BAND_RATIO * settings.band_low_hz:
        return (
            f"{slowest.name} was sampled at {slowest.rate_hz:.3g} Hz, too slowly for a band from "
            f"{settings.band_low_hz:g} Hz up; check the unit of the time stamps (seconds)"
        )
    start_s, stop_s = _span(epoch)
    both_s = stop_s - start_s
    # The last sample of an epoch begins one interval before its end.
    if both_s + 1 / slowest.rate_hz < settings.min_epoch_s * (1 - 1e-3):
        spans_s = [float(one.time_s[-1] - one.time_s[0]) for one in measured]
        short = min(spans_s) - both_s < 0.1 and max(spans_s) < settings.min_epoch_s
        length = "this part is {:.3g} s long" if short else "torque and motion overlap for {:.3g} s"
        return (
            f"{length.format(max(both_s, 0.0))}; at least {settings.min_epoch_s:g} s are "
            "needed (estimation.min_epoch_s)"
        )
    if both_s < 2 * settings.trim_s + 1:
        return (
            f"it lasts {both_s:.3g} s, which leaves less than 1 s after trimming "
            f"{settings.trim_s:g} s at each end (estimation.trim_s)"
        )
    if reason := too_little(epoch, settings):
        return reason
    for one in measured:
        largest = float(np.max(np.abs(one.values)))
        if largest > LARGEST_VALUE:
            return f"{one.name} reaches {largest:.3g} {one.unit}; check its unit"
        # A sensor that is connected shows its noise; one that repeats a number is not measuring.
        if np.ptp(one.values) <= 1e-12 * largest:
            return (
                f"{one.name} is constant ({one.values[0]:g} {one.unit}); "
                "check that the sensor was connected and its column is the right one"
            )
    return ""


def after_fit(
    epoch: Epoch, r_squared: float, condition_number: float, *, least_r_squared: float = 0.0
) -> Outcome:
    """Return whether a fitted epoch counts, and why not.

    Excluded are epochs that were not closed with success (among them those that touched a position
    limit), those with R² below zero (Sec. 2.4.4), and those whose motion cannot tell the
    parameters apart. `least_r_squared` is lower for methods that do not minimise the residual:
    there a subject who pushes may turn R² negative and the estimate still be right.
    """
    if not epoch.closed.included:
        return Outcome("excluded", epoch.closed.reason)
    if r_squared < least_r_squared:
        least = "zero" if least_r_squared == 0 else f"{least_r_squared:g}"
        return Outcome("excluded", f"R² is {r_squared:.3g}, below {least}")
    if condition_number > LARGEST_CONDITION_NUMBER:
        return Outcome(
            "excluded",
            f"the motion cannot distinguish J, B and K (condition number {condition_number:.3g}, "
            f"limit {LARGEST_CONDITION_NUMBER:g}); a perturbation with more frequencies is needed",
        )
    return Outcome()


def unusable(epoch: Epoch, reason: str) -> Outcome:
    """Return the outcome of an epoch without numbers.

    One that was not closed with success is excluded for that reason; any other has failed.
    """
    if not epoch.closed.included:
        return Outcome("excluded", f"{epoch.closed.reason}; {reason}")
    return Outcome("failed", reason)
