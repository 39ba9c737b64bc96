"""The range of motion of one person: two angles on the drive's own scale, for one session.

It is asked for each session and kept in its record alone. Settings do not hold it, so that nobody
is moved within the range of somebody else.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.units import deg_from_rad, rad_from_deg
from rigidimeter.rig.devices.base import DeviceError

TYPED, LED = "typed", "led by hand"

STOP_LOW, STOP_HIGH = "mechanical_stop_low_deg", "mechanical_stop_high_deg"
"""Where the mechanical stops are, as numbers of a commissioning record."""

STOP_MARGIN_DEG = 3.0
"""So far inside the mechanical stops a range must end: an arm that is braked late does not hit
them, and a drive may hold its own bound between the two."""

LEAST_DEG = 1.0
"""A range that is narrower was read twice at one place."""


@dataclass(frozen=True)
class MotionRange:
    """The range of motion of one person.

    Parameters
    ----------
    low_deg, high_deg : float
        On the drive's own scale.
    how : str
        `TYPED` or `LED`.
    subject : str
        Whose it is; empty where the session names nobody.
    """

    low_deg: float
    high_deg: float
    how: str = TYPED
    subject: str = ""

    def __post_init__(self) -> None:
        """Refuse what is no range.

        Raises
        ------
        UserError
            If an end is not finite, or the upper end is not above the lower one.
        """
        if not (math.isfinite(self.low_deg) and math.isfinite(self.high_deg)):
            raise UserError(
                f"the range of motion {self.low_deg:g} to {self.high_deg:g} deg must be two finite "
                "angles on the drive's scale"
            )
        if self.high_deg - self.low_deg < LEAST_DEG:
            raise UserError(
                f"the range of motion {self.low_deg:g} to {self.high_deg:g} deg must go from a "
                f"lower to a higher angle, at least {LEAST_DEG:g} deg apart"
            )

    @property
    def range_rad(self) -> tuple[float, float]:
        """Both ends in rad."""
        return rad_from_deg(self.low_deg), rad_from_deg(self.high_deg)

    @property
    def words(self) -> str:
        """What is said of it."""
        whose = f" of {self.subject}" if self.subject else ""
        return (
            f"range of motion{whose}: {self.low_deg:.4g} to {self.high_deg:.4g} deg on the drive's "
            f"scale, {self.how}"
        )

    def facts(self) -> dict[str, Any]:
        """Return it as the manifest keeps it."""
        return {
            "low_deg": self.low_deg,
            "high_deg": self.high_deg,
            "how": self.how,
            "subject": self.subject,
        }

    def require_inside(self, stops: Mapping[str, float], where: str) -> None:
        """Refuse a range that is not inside the mechanical stops by the margin.

        Parameters
        ----------
        stops : mapping
            The numbers of the commissioning record.
        where : str
            What holds them, as the refusal begins.

        Raises
        ------
        UserError
            Also if the record does not have them.
        """
        if STOP_LOW not in stops or STOP_HIGH not in stops:
            raise UserError(
                f"{where}: has no angles of the mechanical stops, so a range of motion cannot be "
                "compared with them; commission the rig again"
            )
        low_deg, high_deg = stops[STOP_LOW] + STOP_MARGIN_DEG, stops[STOP_HIGH] - STOP_MARGIN_DEG
        if not low_deg <= self.low_deg < self.high_deg <= high_deg:
            raise UserError(
                f"{self.words}, must be inside {low_deg:.4g} to {high_deg:.4g} deg: the mechanical "
                f"stops are at {stops[STOP_LOW]:.4g} and {stops[STOP_HIGH]:.4g} deg ({where}), and "
                f"{STOP_MARGIN_DEG:g} deg must be left before them"
            )


def range_of(stored: Any, where: str) -> MotionRange | None:
    """Return the range that a manifest keeps, None if it has none.

    Raises
    ------
    UserError
        If what it keeps is no range.
    """
    if stored is None:
        return None
    try:
        low_deg, high_deg = float(stored["low_deg"]), float(stored["high_deg"])
        return MotionRange(low_deg, high_deg, str(stored["how"]), str(stored["subject"]))
    except (KeyError, TypeError, ValueError, UserError):
        raise UserError(f"{where}: the range of motion in its manifest cannot be read") from None


def require_within(range_rad: tuple[float, float], angle_rad: float) -> None:
    """Refuse a joint that stands outside of the range, or at its end.

    Raises
    ------
    DeviceError
        Says where the joint is and where it must be.
    """
    low_rad, high_rad = range_rad
    if not low_rad < angle_rad < high_rad:
        raise DeviceError(
            f"drive: the joint stands at {deg_from_rad(angle_rad):.1f} deg of the drive's scale, "
            f"outside of the range of motion of this person, {deg_from_rad(low_rad):.1f} to "
            f"{deg_from_rad(high_rad):.1f} deg; lead it inside by hand when the drive's power is "
            "off, and try again"
        )
