"""Values that only make sense in degrees, in microvolts or in milliseconds.

An axis on a bench may turn as far as degrees count, a limb on a robot not with the torque that goes
with it: a motion is taken for degrees only where torque and velocity, taken for rad/s, would be
more power than such a robot gives.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from rigidimeter.recording.formats.columns import seconds
from rigidimeter.recording.formats.gaps import Signal
from rigidimeter.records import Notice

DEGREES = "degrees: divide by 57.2958 to have rad"
PLAUSIBLE: Mapping[str, tuple[float, str]] = {
    "angle_rad": (2 * math.pi, DEGREES),
    "velocity_rad_s": (50.0, f"{DEGREES}/s"),
    "velocity_command_rad_s": (50.0, f"{DEGREES}/s"),
    "emg_v": (20.0, "microvolts: divide by 1e6 to have V"),
}
"""The largest plausible value of a channel, and what a larger one looks like. Amplifiers of EMG
give at most ±10 V or so."""

LARGEST_POWER_W = 20.0
"""The default of `guard.power_limit_w`."""

LARGEST_STEP_S = 0.5


def about_units(source: str, signals: Mapping[str, Signal], step_s: float) -> list[Notice]:
    """Warn of values that look like another unit."""
    notices = []
    for name in (name for name in signals if name in PLAUSIBLE):
        limit, right = PLAUSIBLE[name]
        largest = float(np.max(np.abs(signals[name].values)))
        if largest > limit and (name == "emg_v" or _power_w(signals) > LARGEST_POWER_W):
            text = f"{source}: {name} reaches {largest:.4g}, which looks like {right}"
            notices.append(Notice("warning", text))
    if step_s > LARGEST_STEP_S:
        text = (
            f"{source}: the rows are {seconds(step_s)} apart, which looks like milliseconds: "
            "divide by 1000 to have s"
        )
        notices.append(Notice("warning", text))
    return notices


def _power_w(signals: Mapping[str, Signal]) -> float:
    """Return the largest torque times the largest velocity; infinite where one is unknown."""
    torque, angle = signals.get("torque_nm"), signals.get("angle_rad")
    fastest = [
        float(np.max(np.abs(signals[name].values)))
        for name in ("velocity_rad_s", "velocity_command_rad_s")
        if name in signals
    ]
    if angle is not None and angle.values.size > 1:
        steps = np.abs(np.diff(angle.values)) / np.maximum(np.diff(angle.time_s), 1e-9)
        # One sample that is off is no velocity.
        fastest.append(float(np.quantile(steps, 0.99)))
    if torque is None or not fastest:
        return math.inf
    return float(np.max(np.abs(torque.values))) * max(fastest)
