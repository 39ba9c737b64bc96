"""Whether the sensors measured and the arm had room.

A sensor at the end of its range repeats its extreme value; one that hangs repeats whatever it had.
A living signal does neither for long: it has noise. A joint at the position limit, or a command
that the guard changed, is not the perturbation as designed.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidimeter.estimation.diagnostics.finding_text import judged
from rigidimeter.records import Channel, Epoch, Finding
from rigidimeter.settings import DiagnosticsSettings

__all__ = ["frozen", "guard_limited", "position_limit", "saturation"]

FITTED = ("torque_nm", "angle_rad", "velocity_rad_s")
FEWEST_AT_EXTREME = 3
"""An extreme reached by chance is not repeated three times in a row."""


def saturation(epoch: Epoch, settings: DiagnosticsSettings) -> Finding:
    """Return the largest share of samples in which a channel repeats its extreme value."""
    shares = {c.name: 100.0 * _share_at_extremes(c) for c in _fitted(epoch)}
    worst = max(shares, key=lambda name: shares[name])
    value, most = shares[worst], settings.saturated_most_percent
    return judged(
        "saturation",
        value,
        most,
        settings,
        failed=not value <= most,
        fact=f"{worst} repeats its extreme values in {value:.2g} % of samples (at most {most:g} %)",
        meaning="the sensor or its amplifier was at the end of its range",
        remedy="choose a larger range or a smaller perturbation, and repeat",
    )


def frozen(epoch: Epoch, settings: DiagnosticsSettings) -> Finding:
    """Return the longest time for which a channel repeats one value."""
    found = {channel.name: _longest_repetition(channel) for channel in _fitted(epoch)}
    worst = max(found, key=lambda name: found[name][0])
    (value, start_s), most = found[worst], settings.frozen_most_s
    when = f", from {start_s:.3g} s" if value > 0 else ""
    return judged(
        "frozen",
        value,
        most,
        settings,
        failed=not value <= most,
        fact=f"{worst} repeats one value for {value:.2g} s (at most {most:g} s){when}",
        meaning="the sensor hung, or the joint was held",
        remedy="check the sensor's cable and its rate; leave that stretch out",
    )


def guard_limited(limited: ArrayLike, settings: DiagnosticsSettings) -> Finding:
    """Return in what share of the ticks the guard changed the command.

    Parameters
    ----------
    limited : array, shape (n,)
        The recorded column: 0 where the command was sent as asked for.
    settings : DiagnosticsSettings
    """
    value = 100.0 * float(np.mean(np.asarray(limited) > 0))
    most = settings.limited_most_percent
    return judged(
        "guard_limited",
        value,
        most,
        settings,
        failed=not value <= most,
        fact=f"the guard changed {value:.2g} % of the commands (at most {most:g} %)",
        meaning="the arm did not follow the perturbation as designed",
        remedy="use a smaller perturbation or wider limits in [guard]",
    )


def position_limit(angle: Channel, limit_rad: float, settings: DiagnosticsSettings) -> Finding:
    """Return how near the joint came to the position limit, in % of it."""
    value = 100.0 * float(np.max(np.abs(angle.values))) / limit_rad
    most = settings.position_most_percent
    return judged(
        "position_limit",
        value,
        most,
        settings,
        failed=not value <= most,
        fact=(
            f"the joint came to {value:.0f} % of the position limit of "
            f"{math.degrees(limit_rad):.3g} deg (at most {most:g} %)"
        ),
        meaning="it was held back there, which the fit takes for stiffness",
        remedy="use a smaller perturbation, or begin nearer to the middle of the range",
    )


def _fitted(epoch: Epoch) -> list[Channel]:
    return [epoch.channels[name] for name in FITTED if name in epoch.channels]


def _runs(values: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return first rows and lengths of the stretches of equal values."""
    starts = np.concatenate(([0], np.flatnonzero(np.diff(values) != 0) + 1))
    return starts, np.diff(starts, append=values.size)


def _share_at_extremes(channel: Channel) -> float:
    starts, lengths = _runs(channel.values)
    level = channel.values[starts]
    extreme = (level == np.max(level)) | (level == np.min(level))
    return float(np.sum(lengths[extreme & (lengths >= FEWEST_AT_EXTREME)])) / len(channel)


def _longest_repetition(channel: Channel) -> tuple[float, float]:
    """Return how long the longest stretch lasts, and when it begins, in s."""
    starts, lengths = _runs(channel.values)
    stops = starts + lengths - 1
    spans = channel.time_s[stops] - channel.time_s[starts]
    longest = int(np.argmax(spans))
    return float(spans[longest]), float(channel.time_s[starts[longest]])
