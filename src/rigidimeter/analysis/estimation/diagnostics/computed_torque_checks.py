"""Whether the torque was measured on a joint at all.

A torque that somebody computed from the angle, to compensate gravity for example, is a function of
the angle: samples at nearly the same angle then have nearly the same torque, whichever way and
however fast the joint passes it. Sorted by the angle, with differences d from one sample to the
next,

    share = Σ d² / (2 Σ (M − mean M)²)

is 1 for a torque that has nothing to do with the angle (von Neumann 1941), and 0 for a function of
it. What inertia and damping add to the torque of a joint is in this share.

A torque that somebody computed from the recorded motion, with whatever differences for velocity and
acceleration, or from the perturbation, is a weighted sum of samples of these from two before to two
after, to the digits that it was written with. A sensor's noise is not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy

from rigidimeter.analysis.estimation.diagnostics.check_record import Check, Look, at_least
from rigidimeter.analysis.estimation.diagnostics.excitation_checks import perturbation_nm
from rigidimeter.analysis.estimation.signals import (
    Array,
    Signals,
    motion_channels,
    sampled,
    values_at,
)
from rigidimeter.analysis.estimation.stretches import sound
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import DiagnosticsSettings

REACH = 2
"""Samples to each side: as far as a second difference of central differences reaches."""

ROWS, FEWEST_ROWS = 4000, 100
"""So many rows show whether a sum is exact; fewer than the second say nothing."""


def static_torque(epoch: Epoch, signals: Signals, settings: DiagnosticsSettings) -> Look:
    """Return which share of the torque's variance a function of the angle cannot give, in %."""
    time_s = signals.time_s
    # Noise above the band is nobody's torque. A filter without overshoot keeps the function.
    length = max(round(signals.rate_hz / (2.0 * signals.band_hz[1])), 1)
    angle, torque = (
        scipy.ndimage.uniform_filter1d(_at(epoch.channels[name], time_s), length)
        for name in ("angle_rad", "torque_nm")
    )
    steps = np.diff(torque[np.argsort(angle, kind="stable")])
    variance = float(np.var(torque))
    value = 100.0 * float(np.mean(steps**2)) / (2.0 * variance) if variance > 0 else math.nan
    return at_least(value, settings.min_static_torque_percent)


def _at(channel: Channel, time_s: Array) -> Array:
    place = sampled(channel, time_s)
    if place is not None:
        return channel.values[place]
    return np.interp(time_s, channel.time_s, channel.values)


def computed_torque(epoch: Epoch, settings: DiagnosticsSettings) -> Look | None:
    """Return how much of the torque is no sum of samples of the motion or of the perturbation.

    In % of the torque's standard deviation, the smaller of the two. None for a simulation, whose
    sensors may be free of noise.
    """
    if epoch.virtual:
        return None
    perturbation = [epoch.channels[name] for name in ("perturbation_nm",) if name in epoch.channels]
    causes = {"the motion": motion_channels(epoch), "the perturbation": perturbation}
    shares = {name: _not_a_sum(epoch, channels) for name, channels in causes.items()}
    origin = min(shares, key=lambda name: shares[name])
    value, least = 100.0 * shares[origin], settings.min_computed_torque_percent
    if not math.isfinite(value):
        return None
    return at_least(value, least, origin=origin)


def _not_a_sum(epoch: Epoch, channels: Sequence[Channel]) -> float:
    """Return the share of the torque's SD that samples of the channels nearby do not give."""
    torque = epoch.channels["torque_nm"]
    channels = [c for c in channels if len(c) > 1 and float(np.ptp(c.values)) > 0]
    if not channels:
        return math.inf
    at = np.arange(REACH, len(torque) - REACH)
    start_s = max(float(channel.time_s[0]) for channel in channels)
    stop_s = min(float(channel.time_s[-1]) for channel in channels)
    at = at[(torque.time_s[at - REACH] >= start_s) & (torque.time_s[at + REACH] <= stop_s)]
    at = at[sound(epoch, torque.time_s[at], 0.1)]
    at = at[:: max(at.size // ROWS, 1)]
    if at.size < FEWEST_ROWS:
        return math.inf
    columns = [np.ones(at.size)]
    for channel in channels:
        at_times = perturbation_nm if channel.name == "perturbation_nm" else values_at
        values = at_times(channel, torque.time_s)
        columns += [values[at + lag] for lag in range(-REACH, REACH + 1)]
    regressors = np.column_stack(columns)
    lengths = np.linalg.norm(regressors, axis=0)
    regressors = regressors / np.where(lengths > 0, lengths, 1.0)
    target = torque.values[at] - np.mean(torque.values[at])
    left = target - regressors @ np.linalg.lstsq(regressors, target, rcond=None)[0]
    sd = float(np.std(target))
    return float(np.sqrt(np.mean(left**2))) / sd if sd > 0 else math.inf


COMPUTED_TORQUE_CHECKS = (
    Check("computed_torque", (), lambda c: computed_torque(c.epoch, c.settings), of_fit=False),
)
"""Before those of the channels: a binary torque that was computed repeats its extremes too."""

STATIC_TORQUE_CHECKS = (
    Check(
        "static_torque",
        ("angle_rad",),
        lambda c: static_torque(c.epoch, c.signals, c.settings),
        of_fit=False,
    ),
)
