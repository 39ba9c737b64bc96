"""The control step: low-pass, admittance, and following a position; no clock, no I/O.

A step is a plain function of (coefficients, state, input) that only adds, multiplies and compares;
what needs a transcendental function is computed once, when the coefficients are made. So the same
source runs in the interpreter and compiled, with the same bits.

The admittance takes a torque and gives a velocity command (Eq. 5, Fig. 2c):

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


class Biquad(NamedTuple):
    """H(z) = (b0 + b1 z⁻¹ + b2 z⁻²) / (1 + a1 z⁻¹ + a2 z⁻²)."""

    b0: float
    b1: float
    b2: float
    a1: float
    a2: float


class BiquadState(NamedTuple):
    """The two delays of the transposed direct form II."""

    first: float = 0.0
    second: float = 0.0


def butterworth_lowpass(cutoff_hz: float, rate_hz: float) -> Biquad:
    """Return a second-order Butterworth low-pass, bilinear with the cutoff prewarped.

    Raises
    ------
    ValueError
        If the cutoff is not between 0 and half the rate.
    """
    if not 0 < cutoff_hz < rate_hz / 2:
        raise ValueError(f"cutoff must be between 0 and {rate_hz / 2:g} Hz, got {cutoff_hz:g} Hz")
    w = math.tan(math.pi * cutoff_hz / rate_hz)
    norm = 1.0 / (1.0 + math.sqrt(2.0) * w + w * w)
    b0 = w * w * norm
    return Biquad(
        b0=b0,
        b1=2.0 * b0,
        b2=b0,
        a1=2.0 * (w * w - 1.0) * norm,
        a2=(1.0 - math.sqrt(2.0) * w + w * w) * norm,
    )


def biquad_step(
    coefficients: Biquad, state: BiquadState, value: float
) -> tuple[BiquadState, float]:
    """Advance one sample; return the new state and the output."""
    b0, b1, b2, a1, a2 = coefficients
    output = b0 * value + state[0]
    return BiquadState(b1 * value - a1 * output + state[1], b2 * value - a2 * output), output


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


def tracking_step(
    gain_per_s: float, target_rad: float, target_velocity_rad_s: float, angle_rad: float
) -> float:
    """Return the velocity command v = v_target + k (θ_target − θ), in rad/s.

    The error decays as e^(−k t) while the drive follows its command.
    """
    return target_velocity_rad_s + gain_per_s * (target_rad - angle_rad)


def minimum_jerk(start_rad: float, duration_s: float, elapsed_s: float) -> tuple[float, float]:
    """Return angle and velocity on the smoothest way from `start_rad` to zero.

    The minimum-jerk polynomial of Flash and Hogan (1985): θ = θ₀ (1 − 10τ³ + 15τ⁴ − 6τ⁵) with
    τ = t/T; the peak speed is 1.875 θ₀/T.
    """
    if elapsed_s >= duration_s:
        return 0.0, 0.0
    tau = elapsed_s / duration_s
    cubed = tau * tau * tau
    angle = start_rad * (1.0 - cubed * (10.0 - 15.0 * tau + 6.0 * tau * tau))
    velocity = -start_rad / duration_s * 30.0 * tau * tau * (1.0 - tau) * (1.0 - tau)
    return angle, velocity
