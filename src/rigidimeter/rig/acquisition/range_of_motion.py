"""A session within the range of motion of a person: the guard's limits, and what fits into them.

The range is on the drive's own scale. Where the joint stands on it is known once the rig is
enabled: only then the range is in the angles of the guard, which begin there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.settings import Settings
from rigidimeter.core.units import deg_from_rad
from rigidimeter.model import minimum_jerk
from rigidimeter.planning import beyond_range, demand
from rigidimeter.rig.acquisition.control_modes import return_duration_s, return_speed_rad_s
from rigidimeter.rig.acquisition.tick import ControlLoop
from rigidimeter.rig.guard import within_range

Motion = tuple[NDArray[np.float64], NDArray[np.float64]]


def keep_within(
    loop: ControlLoop, range_rad: tuple[float, float] | None, origin_rad: float
) -> tuple[float, float] | None:
    """Cut the guard's limits by a range on the drive's scale; return it from the start on."""
    if range_rad is None:
        return None
    low_rad, high_rad = range_rad[0] - origin_rad, range_rad[1] - origin_rad
    loop.limits = within_range(loop.limits, low_rad, high_rad)
    return low_rad, high_rad


def motion_beyond(loop: ControlLoop, settings: Settings, imposed: Motion) -> str:
    """Return why the motions that are known beforehand do not fit into the range; empty if they do.

    Parameters
    ----------
    loop : ControlLoop
        Its limits are cut by the range.
    settings : Settings
    imposed : tuple of arrays, shape (n,)
        Angle and velocity of the sinusoid, in rad and rad/s; it counts where the protocol has one.
    """
    rate_hz, guard = settings.rig.tick_rate_hz, settings.guard
    low_rad, high_rad = loop.limits.extent_rad
    found: list[str] = []
    if any(block.task == "sinusoid" for block in settings.protocol.blocks):
        needs = demand(*imposed, rate_hz, guard)
        found += beyond_range("the sinusoid", needs, low_rad, high_rad)
    for end_rad in (low_rad, high_rad):
        needs = demand(*_way_back(settings, end_rad), rate_hz, guard)
        what = f"the way back from {deg_from_rad(end_rad):.4g} deg"
        # The end that it begins at is where the limit lets the arm be.
        ends = (low_rad, needs.highest_rad) if end_rad > 0.0 else (needs.lowest_rad, high_rad)
        found += beyond_range(what, needs, *ends)
    return "; ".join(found)


def _way_back(settings: Settings, from_rad: float) -> Motion:
    """Return the motion from an end of the range to the start, by minimum jerk."""
    protocol, rate_hz = settings.protocol, settings.rig.tick_rate_hz
    duration_s = return_duration_s(from_rad, protocol.return_s, return_speed_rad_s(settings))
    times_s = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    way = np.array([minimum_jerk(from_rad, duration_s, time_s) for time_s in times_s.tolist()])
    return way[:, 0], way[:, 1]
