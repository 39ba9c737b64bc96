"""How far the joint is from each limit of the guard, in the limit's unit and as a part of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rigidimeter.core.settings import GuardSettings
from rigidimeter.core.units import deg_from_rad
from rigidimeter.rig.console.recent_samples import RecentSamples

NEAR = 0.8
"""From this part of a limit on, the joint is near it."""


@dataclass(frozen=True)
class LimitDistance:
    """The largest value of the last second, and the limit.

    Attributes
    ----------
    name, unit : str
    value, limit : float
        In `unit`; NaN where the value is not known.
    """

    name: str
    unit: str
    value: float
    limit: float

    @property
    def part(self) -> float:
        """The value as a part of the limit: 1 at the limit."""
        return self.value / self.limit

    @property
    def text(self) -> str:
        """The value and the limit, as ``14.6 of 40 deg``."""
        return f"{self._rounded(self.value)} of {self.limit:g} {self.unit}"

    def _rounded(self, value: float) -> str:
        """Return a value with the digits that tell a hundredth of the limit."""
        digits = max(0, 2 - math.floor(math.log10(self.limit)))
        return f"{value:.{digits}f}" if math.isfinite(value) else "-"

    @property
    def near(self) -> bool:
        """Whether the joint is near the limit or beyond it."""
        return self.part >= NEAR


def limit_distances(
    guard: GuardSettings, recent: RecentSamples, energy_j: float
) -> tuple[LimitDistance, ...]:
    """Return the distance to each limit.

    Parameters
    ----------
    guard : GuardSettings
    recent : RecentSamples
    energy_j : float
        What the guard counts as going to and fro within a second.
    """
    return (
        LimitDistance(
            "angle", "deg", deg_from_rad(recent.largest_angle_rad), guard.position_limit_deg
        ),
        LimitDistance(
            "speed", "deg/s", deg_from_rad(recent.largest_velocity_rad_s), guard.speed_limit_deg_s
        ),
        LimitDistance("torque", "N·m", recent.largest_torque_nm, guard.torque_limit_nm),
        LimitDistance("power", "W", recent.largest_power_w, guard.power_limit_w),
        LimitDistance("energy", "J", energy_j, guard.energy_limit_j),
    )
