"""The trajectory generator of a serial servo: a velocity, or a trapezoid to a target.

It advances in time steps. Positions are in encoder counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Ramps:
    """Acceleration and deceleration in counts/s²."""

    up: float
    down: float


@dataclass
class Trapezoid:
    """Position, speed and target of the generator.

    Parameters
    ----------
    position, target : float
        Present and target position, in counts.
    speed, limit : float
        Present speed and largest speed of the move, in counts/s.
    aborting : bool
        Whether it is braking to rest regardless of the target.
    """

    position: float
    target: float
    speed: float = 0.0
    limit: float = 0.0
    aborting: bool = True

    def rest(self, position: float) -> None:
        """Stop at a position."""
        self.position = self.target = position
        self.speed, self.aborting = 0.0, True

    def move(self, target: float, limit: float) -> None:
        """Start an absolute move."""
        self.target, self.limit, self.aborting = target, limit, False

    def wanted(self, ramps: Ramps) -> float:
        """Return the target velocity of the move, in counts/s."""
        if self.aborting:
            return 0.0
        left = self.target - self.position
        braking = math.sqrt(2.0 * ramps.down * abs(left))
        return math.copysign(min(self.limit, braking), left) if left else 0.0

    def change(self, wanted: float, ramps: Ramps, step_s: float) -> float:
        """Change the speed toward the wanted one; return the largest change allowed."""
        speeding_up = wanted * self.speed >= 0.0 and abs(wanted) > abs(self.speed)
        change = (ramps.up if speeding_up else ramps.down) * step_s
        self.speed += max(-change, min(change, wanted - self.speed))
        return change

    def step(self, ramps: Ramps, step_s: float) -> None:
        """Advance the move by a time step."""
        change = self.change(self.wanted(ramps), ramps, step_s)
        left, step = self.target - self.position, self.speed * step_s
        arrives = not self.aborting and abs(self.speed) <= 2.0 * change
        if arrives and abs(left) <= max(1.0, abs(step)):
            self.position, self.speed = self.target, 0.0
        else:
            self.position += step

    def run(self, velocity: float, ramps: Ramps, step_s: float) -> None:
        """Advance at a velocity by a time step."""
        self.change(velocity, ramps, step_s)
        self.position += self.speed * step_s
