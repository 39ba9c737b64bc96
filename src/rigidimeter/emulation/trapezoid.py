"""The trajectory generator of a serial servo: a velocity, or a trapezoid to a target.

It runs in steps whoever is there to see. Lengths are in counts of the encoder.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["Ramps", "Trapezoid"]


@dataclass(frozen=True)
class Ramps:
    """Acceleration and deceleration in counts/s²."""

    up: float
    down: float


@dataclass
class Trapezoid:
    """Where the generator is, and where it heads for.

    Parameters
    ----------
    place, target : float
        In counts.
    speed, limit : float
        In counts/s; of the move, the largest.
    aborting : bool
        Whether it brakes to rest, whatever the target.
    """

    place: float
    target: float
    speed: float = 0.0
    limit: float = 0.0
    aborting: bool = True

    def rest(self, place: float) -> None:
        """Stand still at a place."""
        self.place = self.target = place
        self.speed, self.aborting = 0.0, True

    def move(self, target: float, limit: float) -> None:
        """Begin an absolute move."""
        self.target, self.limit, self.aborting = target, limit, False

    def wanted(self, ramps: Ramps) -> float:
        """Return the velocity in counts/s that the move heads for."""
        if self.aborting:
            return 0.0
        left = self.target - self.place
        braking = math.sqrt(2.0 * ramps.down * abs(left))
        return math.copysign(min(self.limit, braking), left) if left else 0.0

    def change(self, wanted: float, ramps: Ramps, step_s: float) -> float:
        """Bring the speed nearer to what is wanted; return the largest change there may be."""
        speeding_up = wanted * self.speed >= 0.0 and abs(wanted) > abs(self.speed)
        most = (ramps.up if speeding_up else ramps.down) * step_s
        self.speed += max(-most, min(most, wanted - self.speed))
        return most

    def step(self, ramps: Ramps, step_s: float) -> None:
        """Go on with the move for a while."""
        most = self.change(self.wanted(ramps), ramps, step_s)
        left, way = self.target - self.place, self.speed * step_s
        arrives = not self.aborting and abs(self.speed) <= 2.0 * most
        if arrives and abs(left) <= max(1.0, abs(way)):
            self.place, self.speed = self.target, 0.0
        else:
            self.place += way

    def run(self, velocity: float, ramps: Ramps, step_s: float) -> None:
        """Go on at a velocity for a while."""
        self.change(velocity, ramps, step_s)
        self.place += self.speed * step_s
