"""What the samples of the last second say: largest values, age of the readings, lateness."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.rig.guard import Limited

RECENT_S = 1.0


class RecentSamples(NamedTuple):
    """The samples of the last second in a few numbers; NaN where there are none.

    The largest are absolute values. `torque_nm` is the mean of the last 0.1 s, readable where the
    torque itself is not. Ages are those of the last sample. `held_back` says whether the position
    limit held a command back.
    """

    samples: int = 0
    torque_nm: float = math.nan
    largest_angle_rad: float = math.nan
    largest_velocity_rad_s: float = math.nan
    largest_torque_nm: float = math.nan
    largest_power_w: float = math.nan
    largest_lateness_s: float = math.nan
    torque_age_s: float = math.nan
    motion_age_s: float = math.nan
    torque_status: int = 0
    motion_status: int = 0
    held_back: bool = False


def recent_samples(rows: NDArray[np.void]) -> RecentSamples:
    """Return what the rows say; all of them count."""
    if not rows.size:
        return RecentSamples()
    last = rows[-1]
    power_w = rows["torque_nm"] * rows["velocity_rad_s"]
    newest = rows["torque_nm"][rows["time_s"] > last["time_s"] - 0.1]
    return RecentSamples(
        int(rows.size),
        float(np.mean(newest)),
        _largest(rows["angle_rad"]),
        _largest(rows["velocity_rad_s"]),
        _largest(rows["torque_nm"]),
        _largest(power_w),
        _largest(rows["lateness_s"]),
        float(last["time_s"] - last["torque_time_s"]),
        float(last["time_s"] - last["motion_time_s"]),
        int(last["torque_status"]),
        int(last["motion_status"]),
        bool(np.any(rows["limited"] == Limited.POSITION)),
    )


def _largest(values: NDArray[np.float64]) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(np.max(finite)) if finite.size else math.nan
