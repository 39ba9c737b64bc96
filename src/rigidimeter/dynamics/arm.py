"""The arm of Eq. 3, both ways round.

On the rig the drive imposes the motion and the arm answers with a torque: `arm_torque_nm`. Left to
a torque, the arm moves: `arm_step`, exact for a torque held between two ticks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.dynamics.joint import JointDynamics

__all__ = ["Arm", "arm", "arm_step", "arm_torque_nm"]


def arm_torque_nm(
    inertia_kg_m2: float,
    damping_nm_s_rad: float,
    stiffness_nm_rad: float,
    angle_rad: float,
    velocity_rad_s: float,
    acceleration_rad_s2: float,
    voluntary_nm: float,
) -> float:
    """Return the torque the drive must apply, M_meas = J θ'' + B θ' + K θ − M_sub (Eq. 5)."""
    return (
        inertia_kg_m2 * acceleration_rad_s2
        + damping_nm_s_rad * velocity_rad_s
        + stiffness_nm_rad * angle_rad
        - voluntary_nm
    )


class Arm(NamedTuple):
    """One exact step of Eq. 3 under a held torque: x⁺ = A x + b M with x = (θ, θ')."""

    a11: float
    a12: float
    a21: float
    a22: float
    b1: float
    b2: float


def arm(joint: JointDynamics, interval_s: float) -> Arm:
    """Discretise Eq. 3 exactly, by the matrix exponential of state and input together."""
    J, B, K = joint.inertia_kg_m2, joint.damping_nm_s_rad, joint.stiffness_nm_rad
    augmented = np.array([[0.0, 1.0, 0.0], [-K / J, -B / J, 1.0 / J], [0.0, 0.0, 0.0]])
    e = scipy.linalg.expm(augmented * interval_s)
    return Arm(*(float(e[i, j]) for i, j in ((0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (1, 2))))


def arm_step(
    step: Arm, angle_rad: float, velocity_rad_s: float, torque_nm: float
) -> tuple[float, float]:
    """Return angle and velocity after one interval of the given torque."""
    return (
        step.a11 * angle_rad + step.a12 * velocity_rad_s + step.b1 * torque_nm,
        step.a21 * angle_rad + step.a22 * velocity_rad_s + step.b2 * torque_nm,
    )
