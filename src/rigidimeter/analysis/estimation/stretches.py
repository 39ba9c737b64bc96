"""What is left of an epoch without the stretches that are left out.

Least squares filters the whole epoch and then leaves out the rows within `trim_s` of a stretch, as
it does at the ends. So that what a sensor said there does not come out of the filter seconds later,
torque and motion are bridged first by a straight line. The methods of the closed loop use a window
that falls to zero at a stretch and rises after it; what was measured there counts for nothing.

Where samples are lost, every channel gets stamps as even as its others, so that all that is made of
even samples can be made of these too. What was commanded there is not known either: the command
goes on a straight line, the perturbation keeps its level, and what follows from them is forgotten
as what was before the epoch is.

At a tick that our own loop missed nothing was sent, and the drive held its command: its stamps stay
as they are. Rows that are missing in other files may be either, and are taken for lost, the command
on a straight line; too few for a cut, they leave what follows from it as it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.records import Channel, Epoch, LeftOut
from rigidimeter.core.settings import EstimationSettings

LEAST_USED_S = 1.0

GAP = 1.5
"""In mean intervals: where two samples are further apart, some between them are missing."""


def fitted_channels(epoch: Epoch) -> list[Channel]:
    """Return the measured channels that J, B and K are made of, those with samples."""
    wanted = (epoch.channels.get(name) for name in ("torque_nm", "angle_rad", "velocity_rad_s"))
    return [channel for channel in wanted if channel is not None and len(channel)]


def sound(epoch: Epoch, time_s: Array, margin_s: float = 0.0) -> NDArray[np.bool_]:
    """Return at which times nothing within `margin_s` is left out."""
    kept = np.ones(time_s.size, dtype=np.bool_)
    for stretch in epoch.left_out:
        kept &= (time_s < stretch.start_s - margin_s) | (time_s > stretch.stop_s + margin_s)
    return kept


def bridged(epoch: Epoch) -> Epoch:
    """Return the epoch with torque and motion on a straight line over what is left out.

    Command and perturbation stay where they were recorded: they are causes, and what follows the
    stretch depends on them. Missing samples of a command are filled in where it is not known that
    none was sent.
    """
    lost = [stretch for stretch in epoch.left_out if stretch.lost]
    unsaid = [LeftOut(-np.inf, np.inf)] if epoch.ticks is None else lost
    channels = {
        name: _evenly(one, unsaid if name == "velocity_command_rad_s" else lost)
        for name, one in epoch.channels.items()
    }
    if not epoch.left_out and all(channels[name] is one for name, one in epoch.channels.items()):
        return epoch
    epoch = replace(epoch, channels=channels)
    for channel in fitted_channels(epoch):
        kept = sound(epoch, channel.time_s)
        if not np.any(kept):
            continue  # nothing to hang a line on; the epoch is refused for what is left of it
        line = np.interp(channel.time_s, channel.time_s[kept], channel.values[kept])
        values = np.where(kept, channel.values, line)
        channels[channel.name] = replace(channel, values=values)
    return replace(epoch, channels=channels)


def _evenly(channel: Channel, lost: list[LeftOut]) -> Channel:
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
    missing = np.where(wide, more, 0).astype(np.intp)
    if not np.any(missing):
        return channel
    before = np.repeat(np.arange(len(channel)), np.append(missing, 0) + 1)
    first = np.concatenate(([0], np.cumsum(missing + 1)))
    place = before + (np.arange(before.size) - first[before]) / np.append(missing + 1, 1)[before]
    time_s = np.interp(place, np.arange(len(channel)), channel.time_s)
    if channel.name == "perturbation_nm":
        return replace(channel, time_s=time_s, values=channel.values[before])
    values = np.interp(place, np.arange(len(channel)), channel.values)
    return replace(channel, time_s=time_s, values=values)


def longest_part(epoch: Epoch) -> Epoch:
    """Return the longest part of the epoch in which nothing is left out, as an epoch of its own.

    Where an imposed motion is recorded, the part that has most of that. Command and perturbation
    stay whole: what was before the part has caused some of its motion.
    """
    if not epoch.left_out:
        return epoch
    start_s, stop_s = _span(epoch)
    parts, at_s = [], start_s
    for stretch in sorted(epoch.left_out):
        parts.append((at_s, stretch.start_s))
        at_s = max(at_s, stretch.stop_s)
    parts.append((at_s, stop_s))
    motion = epoch.motion
    if motion is not None:
        start_s, stop_s = motion.start_s, motion.start_s + motion.duration_s
    # The first of those that are equally long.
    low_s, high_s = max(parts, key=lambda part: min(part[1], stop_s) - max(part[0], start_s))
    channels = dict(epoch.channels)
    for channel in fitted_channels(epoch):
        # The ends of a stretch are left out with it.
        rows = (channel.time_s >= low_s) & (channel.time_s <= high_s)
        rows &= sound(epoch, channel.time_s)
        channels[channel.name] = Channel(channel.name, channel.time_s[rows], channel.values[rows])
    return replace(epoch, channels=channels, left_out=())


def used_s(epoch: Epoch, trim_s: float) -> tuple[float, float]:
    """Return for how long an epoch can be used, and for how long it could with nothing left out."""
    start_s, stop_s = _span(epoch)
    length_s = max(stop_s - start_s - 2 * trim_s, 0.0)
    edges = [start_s + trim_s, stop_s - trim_s]
    left_s, at_s = 0.0, edges[0]
    for stretch in sorted(epoch.left_out):
        left_s += max(min(stretch.start_s - trim_s, edges[1]) - at_s, 0.0)
        at_s = max(at_s, stretch.stop_s + trim_s)
    return left_s + max(edges[1] - at_s, 0.0), length_s


def left_out_s(epoch: Epoch) -> float:
    """Return for how long something is left out, without the margins."""
    start_s, stop_s = _span(epoch)
    return stop_s - start_s - used_s(epoch, 0.0)[0]


def too_little(epoch: Epoch, settings: EstimationSettings) -> str:
    """Return why what is not left out cannot be used, or an empty text."""
    if not epoch.left_out:
        return ""
    left_s, _ = used_s(epoch, settings.trim_s)
    least_s = max(settings.min_epoch_s - 2 * settings.trim_s, LEAST_USED_S)
    if left_s >= least_s * (1 - 1e-3):
        return ""
    return (
        f"what is left out, with {settings.trim_s:g} s at each side of it, leaves {left_s:.3g} s; "
        f"at least {least_s:g} s are needed"
    )


def _span(epoch: Epoch) -> tuple[float, float]:
    used = fitted_channels(epoch)
    start_s = max(float(channel.time_s[0]) for channel in used)
    return start_s, min(float(channel.time_s[-1]) for channel in used)
