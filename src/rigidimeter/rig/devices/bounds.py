"""What a drive must not exceed by itself, whatever it is told: bounds behind those of the guard.

All are of the joint. With a the steeper of the drive's ways to brake or accelerate, J_d the inertia
of motor and gear seen at the joint, J the largest inertia of an arm in the settings, F the friction
between motor and joint, and M_stop the torque at which the guard stops the rig
(`guard.torque_stop_nm`):

    torque       T = 1.25 ((J_d + J) a + F + M_stop)                            N·m
    position     start ± (guard.position_limit_deg + guard.following_limit_deg) rad
    slippage     s = 2 · 2ζ a / ω                                               rad/s
    motor speed  1.25 times the drive's own limit of the velocity               rad/s

The first is what a quick stop takes: the drive brakes itself, its friction (which helps, and does
not where the motion has turned) and the arm, against a joint that pushes as hard as the guard
allows. A person's range cuts the position; the margin is how far the arm may be from where the
guard believes it. ω and ζ are the drive's in the settings: a drive of second order lags a ramp by
2ζ a/ω, so half of the slippage is left for what is not in that model.

A bound is written and read back, which does not prove that the drive obeys it: by CiA 402 some act
in some modes only, and what a drive does when one is reached is the maker's. So commissioning
tightens each in turn until a slow move must hit it, and looks.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rigidimeter.core.settings import Settings
from rigidimeter.core.units import rad_from_deg

TORQUE_MARGIN = 1.25
SLIP_MARGIN = 2.0
SPEED_MARGIN = 1.25


class DriveBounds(NamedTuple):
    """What of the settings the bounds of a drive are computed from.

    Parameters
    ----------
    reach_rad : float
        How far from the start the guard lets the joint go.
    margin_rad : float
        By which the drive's bound lies outside of that, and of the person's range.
    arm_inertia_kg_m2 : float
        The largest J of the settings.
    stop_torque_nm : float
        M_stop.
    lag_s : float
        2ζ/ω.
    range_rad : tuple of float or None
        The person's range, lower and upper end, on the drive's own scale.
    """

    reach_rad: float
    margin_rad: float
    arm_inertia_kg_m2: float
    stop_torque_nm: float
    lag_s: float
    range_rad: tuple[float, float] | None = None

    def torque_nm(
        self, reflected_inertia_kg_m2: float, friction_nm: float, ramp_rad_s2: float
    ) -> float:
        """Return T, with its margin.

        >>> bounds = DriveBounds(0.7, 0.03, 0.0045, 20.0, 0.0045)
        >>> bounds.torque_nm(0.05, 0.3, 120.0)  # 1.25 (0.0545 · 120 + 0.3 + 20)
        33.55
        """
        inertia = reflected_inertia_kg_m2 + self.arm_inertia_kg_m2
        return TORQUE_MARGIN * (inertia * ramp_rad_s2 + friction_nm + self.stop_torque_nm)

    def slip_rad_s(self, ramp_rad_s2: float) -> float:
        """Return s."""
        return SLIP_MARGIN * self.lag_s * ramp_rad_s2

    def span_rad(self, start_rad: float) -> tuple[float, float]:
        """Return the lowest and highest angle, on the scale that the start and the range are on."""
        low, high = start_rad - self.reach_rad, start_rad + self.reach_rad
        if self.range_rad is not None:
            low, high = max(low, self.range_rad[0]), min(high, self.range_rad[1])
        return low - self.margin_rad, high + self.margin_rad


def drive_bounds(settings: Settings, range_rad: tuple[float, float] | None = None) -> DriveBounds:
    """Return what the bounds are computed from."""
    guard, rig = settings.guard, settings.rig
    return DriveBounds(
        rad_from_deg(guard.position_limit_deg),
        rad_from_deg(guard.following_limit_deg),
        max(arm.inertia_kg_m2 for arm in settings.subject.values()),
        guard.torque_stop_nm,
        2.0 * rig.drive_damping_ratio / (2.0 * math.pi * rig.drive_bandwidth_hz),
        range_rad,
    )


class Tight(NamedTuple):
    """A bound that a slow move must hit: how far and how fast the move goes."""

    name: str
    reach_rad: float
    speed_rad_s: float


class BoundFound(NamedTuple):
    """One bound of a drive.

    Parameters
    ----------
    name : str
        One of `BOUNDS`.
    where : str
        The object or register that holds it; empty where it is not written.
    words : str
        Its value at the joint and as written; where it is not written, why.
    lost : str
        What is lost without it.
    torque_nm, ramp_rad_s2 : float
        Of a bound of the torque: T by the drive's own scale, and the a that it was computed with.
    """

    name: str
    where: str
    words: str
    lost: str
    torque_nm: float = math.nan
    ramp_rad_s2: float = math.nan


TORQUE, POSITION, SPEED, MOTOR_SPEED, SLIPPAGE = (
    "torque",
    "position",
    "speed",
    "motor speed",
    "slippage",
)
LOST = {
    TORQUE: "between two ticks the drive gives all the torque that its motor has",
    POSITION: "the joint's way is bounded by this program and the mechanical stops alone",
    SPEED: "a target that this program did not mean is followed at any speed",
    MOTOR_SPEED: "a drive that overshoots or overspeeds is noticed by this program alone",
    SLIPPAGE: "a blocked or dragged joint is noticed by this program alone",
}
"""Every bound, with what is lost where a drive has not got it."""

BOUND_FACT = "bound:"
"""What the names of bounds begin with among a drive's facts; each session has its own."""
