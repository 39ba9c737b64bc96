"""What the loop knows of a rig."""

from __future__ import annotations

from typing import NamedTuple, Protocol

__all__ = ["Reading", "Rig"]


class Reading(NamedTuple):
    """The newest sample of each sensor, with the time it was taken on the loop's clock.

    Sensors have clocks of their own, so a reading may repeat the sample of the tick before; then
    its stamp repeats too.
    """

    torque_nm: float
    torque_time_s: float
    angle_rad: float
    velocity_rad_s: float
    motion_time_s: float


class Rig(Protocol):
    """A torque sensor and a velocity drive on one joint."""

    def enable(self) -> None:
        """Command zero velocity, then energise."""

    def read(self) -> Reading:
        """Return the newest readings; called once a tick."""

    def write(self, velocity_rad_s: float) -> float:
        """Send a velocity command; return what was really sent."""

    def disable(self) -> None:
        """Command zero velocity, then take the power away. Safe to call at any time, and twice."""
