"""What a perturbation asks of the rig, held against the guard's limits before it is commanded.

The sinusoid states its motion. The PRBS is a torque: what it does to the arm is predicted with the
ideal loop, in which the measured torque is exactly the joint's and the drive follows at once. Eq. 3
in Eq. 5, without voluntary torque, is then

    (J_c + J_p) θ'' + (B_c + B_p) θ' + K_p θ = M_PRBS

and the free arm is the same without J_p, B_p and K_p. Torque filter, drive and a subject who
moves come on top.

The room that the guard keeps free before its position limit, at a speed v toward it, is

    r(v) = v (τ + g + T) + v² / (2 a),

with τ its reaction time, within which the drive may still do what it was told before; g how late
the next step may come and T the tick until it is due, through both of which the last command stays
in force; and a its acceleration limit. A joint that reaches θ at 1 rad/s with τ = 0.1 s, g =
0.005 s, T = 0.001 s and a = 2 rad/s² needs 0.106 + 0.25 rad beyond θ. The guard slows a motion down
as soon as |θ| + r(v) passes its limit. Where the speed of arrival is bounded by u < v, it keeps
(1/b − 1) (v² − u²) / (2 a) more, with b the part of a by which it then brakes from v to u.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidimeter.core.settings import GAP_S, SOFTLY, ControllerSettings, GuardSettings, Settings
from rigidimeter.core.units import deg_from_rad, rad_from_deg
from rigidimeter.model import JointDynamics, arm_response


@dataclass(frozen=True)
class Demand:
    """The extremes of a motion.

    Attributes
    ----------
    angle_sd_rad : float
        Standard deviation of the angle.
    peak_angle_rad, peak_speed_rad_s, peak_acceleration_rad_s2 : float
        Largest magnitudes; the acceleration from tick to tick, starting from rest.
    reach_rad : float
        The largest angle including the room r(v) that the guard keeps free in the direction of the
        motion: it slows the motion where this passes its position limit.
    lowest_rad, highest_rad : float
        The same toward negative and toward positive angles.
    """

    angle_sd_rad: float
    peak_angle_rad: float
    peak_speed_rad_s: float
    peak_acceleration_rad_s2: float
    reach_rad: float
    lowest_rad: float
    highest_rad: float


def time_constant_s(controller: ControllerSettings) -> float:
    """Return J_c / B_c, in which the velocity of the free arm settles, in s; inf without B_c."""
    if controller.damping_nm_s_rad == 0.0:
        return math.inf
    return controller.inertia_kg_m2 / controller.damping_nm_s_rad


def ideal_response(
    perturbation_nm: ArrayLike,
    controller: ControllerSettings,
    joint: JointDynamics | None,
    rate_hz: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return angle and velocity of the arm under a perturbation, in the ideal loop.

    Exact for a torque that is held from tick to tick, from rest.

    Parameters
    ----------
    perturbation_nm : array, shape (n,)
        M_PRBS of Eq. 5.
    controller : ControllerSettings
        J_c and B_c.
    joint : JointDynamics or None
        J_p, B_p and K_p; None for the free arm.
    rate_hz : float
        Ticks a second.

    Returns
    -------
    angle_rad, velocity_rad_s : array, shape (n,)
    """
    J, B, K = joint.parameters if joint is not None else (0.0, 0.0, 0.0)
    together = JointDynamics(
        controller.inertia_kg_m2 + J, controller.damping_nm_s_rad + B, stiffness_nm_rad=K
    )
    return arm_response(together, perturbation_nm, 1.0 / rate_hz)


def demand(
    angle_rad: ArrayLike, velocity_rad_s: ArrayLike, rate_hz: float, guard: GuardSettings
) -> Demand:
    """Return the extremes of a motion that starts from rest.

    Parameters
    ----------
    angle_rad, velocity_rad_s : array, shape (n,)
        One value a tick.
    rate_hz : float
        Ticks a second.
    guard : GuardSettings
        Whose reaction time, acceleration limit and speed of arrival set the room to stop.

    Examples
    --------
    >>> guard = GuardSettings(acceleration_limit_deg_s2=math.degrees(2.0), reaction_time_s=0.1)
    >>> round(demand([0.5], [1.0], 1000.0, guard).reach_rad, 9)
    0.856
    """
    angle = np.asarray(angle_rad, dtype=np.float64)
    velocity = np.asarray(velocity_rad_s, dtype=np.float64)
    speed = np.abs(velocity)
    braking_rad_s2 = rad_from_deg(guard.acceleration_limit_deg_s2)
    tick_s = 1.0 / rate_hz
    held_s = guard.reaction_time_s + max(GAP_S, tick_s) + tick_s
    room = speed * held_s + speed**2 / (2.0 * braking_rad_s2)
    arrival_rad_s = rad_from_deg(guard.arrival_speed_deg_s)
    softly = (1.0 / SOFTLY - 1.0) * (speed**2 - arrival_rad_s**2) / (2.0 * braking_rad_s2)
    room += np.maximum(softly, 0.0)
    highest_rad = float(np.max(angle + np.where(velocity > 0.0, room, 0.0)))
    lowest_rad = float(np.min(angle - np.where(velocity < 0.0, room, 0.0)))
    acceleration = np.diff(velocity, prepend=0.0) * rate_hz
    return Demand(
        angle_sd_rad=float(np.std(angle)),
        peak_angle_rad=float(np.max(np.abs(angle))),
        peak_speed_rad_s=float(np.max(speed)),
        peak_acceleration_rad_s2=float(np.max(np.abs(acceleration))),
        reach_rad=max(highest_rad, -lowest_rad),
        lowest_rad=lowest_rad,
        highest_rad=highest_rad,
    )


def beyond_limits(what: str, needs: Demand, guard: GuardSettings) -> tuple[str, ...]:
    """Return a sentence for each of the guard's limits that a motion would pass; none if it fits.

    Parameters
    ----------
    what : str
        What moves, as the sentences begin: for example ``"the sinusoid"``.
    needs : Demand
        Of that motion.
    guard : GuardSettings
        The limits.
    """
    rows = (
        (
            "position_limit_deg",
            "reaches an angle (with the room to stop) of",
            needs.reach_rad,
            "deg",
        ),
        ("speed_limit_deg_s", "reaches a speed of", needs.peak_speed_rad_s, "deg/s"),
        (
            "acceleration_limit_deg_s2",
            "needs an acceleration of",
            needs.peak_acceleration_rad_s2,
            "deg/s²",
        ),
    )
    return tuple(
        f"{what} {verb} {deg_from_rad(value):.4g} {unit}, more than guard.{key} = "
        f"{getattr(guard, key):g} {unit}"
        for key, verb, value, unit in rows
        if deg_from_rad(value) > getattr(guard, key)
    )


def beyond_range(
    what: str, needs: Demand, lowest_rad: float, highest_rad: float
) -> tuple[str, ...]:
    """Return a sentence for each end of a range that a motion would pass; none if it fits.

    Parameters
    ----------
    what : str
        What moves, as the sentences begin.
    needs : Demand
        Of that motion, from where it begins.
    lowest_rad, highest_rad : float
        The ends of the range, from there too.
    """
    rows = (
        ("toward negative angles", -needs.lowest_rad, -lowest_rad),
        ("toward positive angles", needs.highest_rad, highest_rad),
    )
    return tuple(
        f"{what} reaches {deg_from_rad(reach_rad):.4g} deg {way} (with the room to stop), and the "
        f"range of motion of this person ends {deg_from_rad(end_rad):.4g} deg from where the joint "
        "stands"
        for way, reach_rad, end_rad in rows
        if reach_rad > end_rad
    )


def too_few_cycles(settings: Settings) -> tuple[str, ...]:
    """Return a sentence if the sinusoid holds fewer whole cycles than are to be scored."""
    sinusoid, scores = settings.sinusoid, settings.scores
    ends_s = 2.0 * scores.discard_s
    found = scores.cycles_in(sinusoid.motion_s - ends_s, sinusoid.frequency_hz)
    if found >= scores.cycles:
        return ()
    wanted_s = scores.cycles / sinusoid.frequency_hz + ends_s
    return (
        f"sinusoid.motion_s = {sinusoid.motion_s:g} s less scores.discard_s = "
        f"{scores.discard_s:g} s at each end holds {max(found, 0)} of the scores.cycles = "
        f"{scores.cycles} cycles to be scored; {wanted_s:g} s hold all of them",
    )
