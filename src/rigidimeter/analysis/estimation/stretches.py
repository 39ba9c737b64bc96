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
from rigidimeter.core.settings import (
    USABLE_FRACTION_OF_RATE,
    DiagnosticsSettings,
    EstimationSettings,
    Settings,
)

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

MOST_SHOWN = 3
"""Stretches that a sentence names."""

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
    for start_s, stop_s, *_ in epoch.left_out:
        kept &= (time_s < start_s - margin_s) | (time_s > stop_s + margin_s)
    return kept


def screened(epoch: Epoch, settings: Settings) -> Epoch:
    """Return the epoch without its bad stretches, everything that is left out bridged.

    They stay in where their check is not set to ``exclude``, and where too little would be left:
    then the check speaks of the whole epoch.
    """
    epoch, checks = bridged(epoch), settings.diagnostics
    found = [one for one in unmeasured(epoch, checks) if checks.levels.of(one.check) == "exclude"]
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
    left = used_s(without, trim_s) / max(used_s(epoch, trim_s), 1e-9)
    why, taken_percent = too_little(without, settings.estimation), 100.0 * (1.0 - left)
    if taken_percent > most_percent:
        taken = f"{taken_percent:.0f} % of the epoch (at most {most_percent:g} %)"
        why = f"with {trim_s:g} s on each side that would take {taken}"
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
    middle_s = channel.time_s[:-1] + 0.5 * steps_s
    within = np.any([(one.start_s < middle_s) & (middle_s < one.stop_s) for one in lost], axis=0)
    within &= steps_s >= GAP / channel.mean_rate_hz
    pieces = np.maximum(np.rint(steps_s * channel.rate_hz * within).astype(np.intp), 1)
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
    if epoch.motion is not None:
        start_s = epoch.motion.start_s
        stop_s = start_s + epoch.motion.duration_s
    # The first of those that are equally long.
    low_s, high_s = max(_parts(epoch), key=lambda one: min(one[1], stop_s) - max(one[0], start_s))
    channels = dict(epoch.channels)
    for one in fitted_channels(epoch):
        # The ends of a stretch are left out with it.
        rows = (one.time_s >= low_s) & (one.time_s <= high_s) & sound(epoch, one.time_s)
        channels[one.name] = replace(one, time_s=one.time_s[rows], values=one.values[rows])
    return replace(epoch, channels=channels, left_out=())


def _parts(epoch: Epoch, margin_s: float = 0.0) -> list[tuple[float, float]]:
    """Return from when to when nothing is left out, so much further from ends and what is out."""
    at_s, stop_s = _span(epoch)
    parts = []
    for stretch in (*sorted(epoch.left_out), LeftOut(stop_s, stop_s)):
        parts.append((at_s + margin_s, min(stretch.start_s, stop_s) - margin_s))
        at_s = max(at_s, stretch.stop_s)
    return parts


def used_s(epoch: Epoch, trim_s: float) -> float:
    """Return for how long an epoch can be used, so much further from its ends and what is out."""
    return sum(max(stop_s - start_s, 0.0) for start_s, stop_s in _parts(epoch, trim_s))


def rest_of(epoch: Epoch, stretches: Sequence[LeftOut]) -> dict[str, float | str]:
    """Return which parts are left out, and how much of the epoch is used, as a finding has it."""
    spans = [f"from {one.start_s:.4g} to {one.stop_s:.4g} s" for one in stretches]
    more = [f"{len(spans) - MOST_SHOWN} more"] if len(spans) > MOST_SHOWN else []
    start_s, stop_s = _span(epoch)
    shown = " and ".join(spans[:MOST_SHOWN] + more)
    return {"spans": shown, "used_s": used_s(epoch, 0.0), "length_s": stop_s - start_s}


def too_little(epoch: Epoch, settings: EstimationSettings) -> str:
    """Return why what is not left out cannot be used, or an empty text."""
    trim_s = settings.trim_s
    least_s = max(settings.min_epoch_s - 2 * trim_s, LEAST_USED_S)
    if not epoch.left_out or (left_s := used_s(epoch, trim_s)) >= least_s * (1 - 1e-3):
        return ""
    out = f"what is left out, with {trim_s:g} s at each side of it,"
    return f"{out} leaves {left_s:.3g} s; at least {least_s:g} s are needed"


def _span(epoch: Epoch) -> tuple[float, float]:
    used = fitted_channels(epoch)
    start_s = max(float(channel.time_s[0]) for channel in used)
    return start_s, min(float(channel.time_s[-1]) for channel in used)


def unmeasured(epoch: Epoch, settings: DiagnosticsSettings) -> list[LeftOut]:
    """Return where a channel hung, or was at the end of its range if it was so too often.

    It repeats a value there that neither joint nor command explain. Within what is left out that
    does not count.
    """
    found, most_s = [], settings.max_frozen_s
    for one in fitted_channels(epoch):
        values, time_s = one.values, one.time_s
        same = np.concatenate(([False], values[1:] == values[:-1], [False]))
        runs = np.flatnonzero(same[1:] != same[:-1]).reshape(-1, 2)
        if epoch.left_out:
            before = np.concatenate(([0], np.cumsum(sound(epoch, time_s))))
            runs = runs[before[runs[:, 1] + 1] > before[runs[:, 0]]]
        hung = np.diff(time_s[runs], axis=1)[:, 0] > most_s
        rows = np.diff(runs, axis=1)[:, 0] + 1
        level = values[runs[:, 0]]
        extreme = (level == np.max(values)) | (level == np.min(values))
        extreme &= rows >= FEWEST_AT_EXTREME
        for place in np.flatnonzero(hung | extreme):
            run = runs[place]
            if _as_told(epoch, one, run, most_s) or _as_the_angle(epoch, one, run):
                hung[place] = extreme[place] = False
        if 100.0 * np.sum(rows[extreme]) <= settings.max_saturated_percent * len(one):
            extreme[:] = False
        for a, b in time_s[runs[hung]].tolist():
            found.append(LeftOut(a, b, f"{one.name} repeats one value", "frozen"))
        for a, b in time_s[runs[extreme]].tolist():
            found.append(LeftOut(a, b, f"{one.name} repeats an extreme value", "saturation"))
    return found


def _as_the_angle(epoch: Epoch, channel: Channel, run: Rows) -> bool:
    """Return whether a velocity is that of the angle, within the step to what is beside it."""
    angle, span_s = epoch.channels.get("angle_rad"), channel.time_s[run]
    if channel.name != MOTION[0] or angle is None:
        return False
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

    def inside(cause: Channel) -> Array:
        first = np.searchsorted(cause.time_s, start_s)
        return cause.values[first : np.searchsorted(cause.time_s, stop_s, side="right")]

    def keeps(cause: Channel, level: float) -> bool:
        other = np.abs(inside(cause) - level) > ZERO * np.max(np.abs(cause.values))
        other_s = np.count_nonzero(other) / cause.mean_rate_hz
        return other.size > 0 and bool(other_s <= min(most_s, 0.5 * (stop_s - start_s)))

    command, perturbation = (epoch.channels.get(name) for name in CAUSES)
    if command is None:
        return False
    if keeps(command, 0.0) and (perturbation is None or keeps(perturbation, 0.0)):
        return True
    if channel.name != MOTION[0] or inside(command).size == 0:
        return False
    told, near = float(np.median(inside(command))), NEAR * float(np.max(np.abs(command.values)))
    return bool(abs(channel.values[run[0]] - told) <= near < abs(told)) and keeps(command, told)


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
        bad = int(np.argmin(np.isfinite(one.values)))
        if not np.isfinite(one.values[bad]):
            value = f"{one.values[bad]} at {one.time_s[bad]:.4g} s"
            return f"{one.name} is {value}; samples must be finite numbers"
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
        needed = f"at least {settings.min_epoch_s:g} s are needed (estimation.min_epoch_s)"
        return f"{length.format(max(both_s, 0.0))}; {needed}"
    if both_s < 2 * settings.trim_s + 1:
        trimmed = f"trimming {settings.trim_s:g} s at each end (estimation.trim_s)"
        return f"it lasts {both_s:.3g} s, which leaves less than 1 s after {trimmed}"
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
        shown = f"condition number {condition_number:.3g}, limit {LARGEST_CONDITION_NUMBER:g}"
        why = f"the motion cannot distinguish J, B and K ({shown})"
        return Outcome("excluded", f"{why}; a perturbation with more frequencies is needed")
    return Outcome()


def unusable(epoch: Epoch, reason: str) -> Outcome:
    """Return the outcome of an epoch without numbers.

    One that was not closed with success is excluded for that reason; any other has failed.
    """
    if not epoch.closed.included:
        return Outcome("excluded", f"{epoch.closed.reason}; {reason}")
    return Outcome("failed", reason)
