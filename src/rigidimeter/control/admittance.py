"""The admittance: torque in, velocity command out (Eq. 5, Fig. 2c).

    J_c v' + B_c v = M_PRBS − M_meas

with v the velocity command in rad/s, M_PRBS the perturbation and M_meas the torque that the drive
applies to the joint, both in N·m. Between two ticks the torques are held, and the equation is
solved exactly:

    v⁺ = e^(−B_c Δt/J_c) v + (1 − e^(−B_c Δt/J_c))/B_c · (M_PRBS − M_meas)

Without B_c the gain tends to Δt/J_c. A push of the subject toward positive angle makes M_meas
negative, so the drive yields to it.
"""

from __future__ import annotations

import math
from typing import NamedTuple


class Admittance(NamedTuple):
    """Coefficients of one step: `decay` is a pure number, `gain` in rad/s per N·m."""

    decay: float
    gain: float


def admittance(inertia_kg_m2: float, damping_nm_s_rad: float, interval_s: float) -> Admittance:
    """Discretise the admittance for torques held over `interval_s`.

    Raises
    ------
    ValueError
        If the inertia or the interval is not greater than zero, or the damping is negative.
    """
    if not (inertia_kg_m2 > 0 and interval_s > 0 and damping_nm_s_rad >= 0):
        raise ValueError(
            "the admittance needs an inertia and an interval greater than 0 and a damping of at "
            f"least 0, got {inertia_kg_m2} kg·m², {interval_s} s and {damping_nm_s_rad} N·m·s/rad"
        )
    rate = damping_nm_s_rad / inertia_kg_m2
    if rate == 0.0:
        return Admittance(1.0, interval_s / inertia_kg_m2)
    return Admittance(
        math.exp(-rate * interval_s), -math.expm1(-rate * interval_s) / damping_nm_s_rad
    )


def admittance_step(
    coefficients: Admittance, velocity_rad_s: float, perturbation_nm: float, torque_nm: float
) -> float:
    """Return the next velocity command.

    The state is the velocity last *sent*, so that after a limit has cut the command the admittance
    goes on from what the drive really got.
    """
    return coefficients.decay * velocity_rad_s + coefficients.gain * (perturbation_nm - torque_nm)
