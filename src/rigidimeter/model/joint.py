"""A joint as inertia, viscous damping and stiffness (Eq. 3), both ways round.

    J θ'' + B θ' + K θ = M

with θ the angle in rad, M the torque in N·m that drives the joint, J in kg·m², B in N·m·s/rad and
K in N·m/rad. M and θ are positive in the same direction: the torque is the one applied *to* the
joint, the negative of its reaction.

On the rig the drive imposes the motion and the arm answers with a torque: `arm_torque_nm`. Left to
a torque, the arm moves: `arm_response`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from rigidimeter.core.settings import SubjectSettings
from rigidimeter.model.velocity_drive import held_response


@dataclass(frozen=True)
class JointDynamics:
    """Inertia, damping and stiffness of a joint about one axis.

    Parameters
    ----------
    inertia_kg_m2 : float
        J, in kg·m². Greater than zero.
    damping_nm_s_rad : float
        B, in N·m·s/rad.
    stiffness_nm_rad : float
        K, in N·m/rad.

    Raises
    ------
    ValueError
        If a value is not finite or the inertia is not greater than zero.
    """

    inertia_kg_m2: float
    damping_nm_s_rad: float
    stiffness_nm_rad: float

    def __post_init__(self) -> None:
        values = (self.inertia_kg_m2, self.damping_nm_s_rad, self.stiffness_nm_rad)
        if not all(math.isfinite(value) for value in values):
            raise ValueError(f"joint parameters must be finite, got {values}")
        if self.inertia_kg_m2 <= 0:
            raise ValueError(f"inertia must be greater than 0 kg·m², got {self.inertia_kg_m2}")

    @property
    def parameters(self) -> tuple[float, float, float]:
        """J, B and K."""
        return self.inertia_kg_m2, self.damping_nm_s_rad, self.stiffness_nm_rad

    def torque_nm(
        self, angle_rad: ArrayLike, velocity_rad_s: ArrayLike, acceleration_rad_s2: ArrayLike
    ) -> NDArray[np.float64]:
        """Return the torque of Eq. 3 for a motion; arrays of one shape give that shape."""
        return np.asarray(
            self.inertia_kg_m2 * np.asarray(acceleration_rad_s2, dtype=np.float64)
            + self.damping_nm_s_rad * np.asarray(velocity_rad_s, dtype=np.float64)
            + self.stiffness_nm_rad * np.asarray(angle_rad, dtype=np.float64)
        )

    def compliance_rad_nm(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """Return θ/M at the given frequencies, in rad/N·m (the transfer function of Eq. 3)."""
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        J, B, K = self.parameters
        return np.asarray(1.0 / (J * s**2 + B * s + K))

    def bandwidth_hz(self) -> float:
        """Return the frequency at which |θ/M| is 3 dB below its value at rest.

        The compliance is 1 / √2 of its static value, 1/K, where
        ``J² ω⁴ + (B² − 2 J K) ω² − K² = 0``, a quadratic in ω² with one positive root.

        Raises
        ------
        ValueError
            If the stiffness is not greater than zero: the static value is then unbounded.
        """
        J, B, K = self.parameters
        if K <= 0:
            raise ValueError(f"bandwidth needs a stiffness greater than 0 N·m/rad, got {K}")
        middle = B**2 - 2 * J * K
        root = math.sqrt(middle**2 + 4 * J**2 * K**2)
        # Of the two equal forms of the root, the one that does not subtract like numbers.
        omega_squared = 2 * K**2 / (middle + root) if middle > 0 else (root - middle) / (2 * J**2)
        return math.sqrt(omega_squared) / (2 * math.pi)


def median_joint(subject: SubjectSettings) -> JointDynamics:
    """Return the median joint of a virtual subject in one condition."""
    return JointDynamics(subject.inertia_kg_m2, subject.damping_nm_s_rad, subject.stiffness_nm_rad)


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


def arm_response(
    joint: JointDynamics, torque_nm: ArrayLike, interval_s: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return angle and velocity at the ticks under torques held from tick to tick, from rest.

    Eq. 3 discretised exactly, by the matrix exponential of state and input together.
    """
    J, B, K = joint.parameters
    augmented = np.array([[0.0, 1.0, 0.0], [-K / J, -B / J, 1.0 / J], [0.0, 0.0, 0.0]])
    step = scipy.linalg.expm(augmented * interval_s)
    return held_response(step[:2, :2], step[:2, 2], np.asarray(torque_nm, dtype=np.float64))
