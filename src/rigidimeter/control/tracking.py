"""Following a position: the sinusoid of the scores, and the return to the initial position."""

from __future__ import annotations


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
