"""Drives of several structures in continuous time, independent of `rigidimeter.model`.

Runge–Kutta of fourth order at 20 kHz. At every tick torque and motion are sampled, and
`edge_s` later the new command reaches the drive and is held. With J_m the inertia of the motor and
M the torque that drives the joint, M = J v' + B v + K θ:

    second order    v'' = ω² (c − v) − 2 ζ ω v', whatever the load
    PI              J_m v' = k_p (r − v) + k_i ∫(r − v) dt − M, with r = c
    PI with lag     the same through the current loop, τ' = (asked − τ) / τ_i
    position loop   r = c + k_θ (∫c dt − θ)
    friction        PI, less friction of 3 N·m in the drive
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.signal import butter

from rigidimeter.core.records import Channel, Epoch

Array = NDArray[np.float64]

FINE_HZ = 20_000
STRUCTURES = ("second order", "PI", "PI with lag", "position loop", "friction")
TRUTH = np.array([0.0045, 0.1368, 1.751])
"""J in kg·m², B in N·m·s/rad, K in N·m/rad."""

MOTOR_KG_M2 = 0.5
INTEGRAL_SHARE = 0.2
"""k_i over k_p, as a share of the bandwidth in rad/s."""
LAG_S = 0.0015
POSITION_PER_S = 6.0
FRICTION_NM = 3.0
STUCK_RAD_S = 0.005
"""Friction is F tanh(v / this)."""

CHIP_S, AMPLITUDE_NM = 0.05, 1.0
ADMITTANCE = (0.0008 * 180 / math.pi, 0.028 * 180 / math.pi)
"""J_c and B_c, as the defaults of the settings are."""
CUTOFF_HZ = 20.0


@dataclass(frozen=True)
class DriveRig:
    """A rig; `lowpass_hz` is the torque sensor's Butterworth filter of second order, 0 for none."""

    structure: str
    rate_hz: float = 1000.0
    bandwidth_hz: float = 50.0
    lowpass_hz: float = 0.0
    edge_s: float = 0.0
    noise_nm: float = 0.005


@njit(cache=True)
def _derivative(x, dx, command, kind, omega, lowpass, joint):
    """Write the derivative of x = (θ, v, v' or ∫(r − v), τ, ∫c, two of the filter); return M."""
    angle, velocity = x[0], x[1]
    dx[0], dx[3], dx[4] = velocity, 0.0, command
    J, B, K = joint
    if kind == 0:
        dx[1] = x[2]
        dx[2] = omega * omega * (command - velocity) - 2.0 * 0.7071 * omega * x[2]
    else:
        wanted = command
        if kind == 3:
            wanted += POSITION_PER_S * (x[4] - angle)
        gain = MOTOR_KG_M2 * omega
        asked = gain * (wanted - velocity + INTEGRAL_SHARE * omega * x[2])
        if kind == 2:
            dx[3] = (asked - x[3]) / LAG_S
            asked = x[3]
        if kind == 4:
            asked -= FRICTION_NM * math.tanh(velocity / STUCK_RAD_S)
        dx[1] = (asked - B * velocity - K * angle) / (MOTOR_KG_M2 + J)
        dx[2] = wanted - velocity
    torque = J * dx[1] + B * velocity + K * angle
    dx[5], dx[6] = 0.0, 0.0
    if lowpass > 0.0:
        dx[5] = x[6]
        dx[6] = lowpass * lowpass * (torque - x[5]) - math.sqrt(2.0) * lowpass * x[6]
        torque = x[5]
    return torque


@njit(cache=True)
def _run(
    perturbation, noise, steps, edge, kind, omega, lowpass, decay, gain, filter_b, filter_a, joint
):
    n = perturbation.size
    h = 1.0 / FINE_HZ
    x, y = np.zeros(7), np.zeros(7)
    k1, k2, k3, k4 = np.zeros(7), np.zeros(7), np.zeros(7), np.zeros(7)
    out = np.zeros((4, n))
    command, held = 0.0, 0.0
    s1, s2 = 0.0, 0.0
    for tick in range(n):
        torque = _derivative(x, k1, held, kind, omega, lowpass, joint) + noise[tick]
        torque = round(torque / 0.0005) * 0.0005
        smooth = filter_b[0] * torque + s1
        s1 = filter_b[1] * torque - filter_a[1] * smooth + s2
        s2 = filter_b[2] * torque - filter_a[2] * smooth
        command = decay * command + gain * (perturbation[tick] - smooth)
        out[0, tick], out[1, tick], out[2, tick], out[3, tick] = torque, x[0], x[1], command
        for step in range(steps):
            if step == edge:
                held = command
            _derivative(x, k1, held, kind, omega, lowpass, joint)
            for i in range(7):
                y[i] = x[i] + 0.5 * h * k1[i]
            _derivative(y, k2, held, kind, omega, lowpass, joint)
            for i in range(7):
                y[i] = x[i] + 0.5 * h * k2[i]
            _derivative(y, k3, held, kind, omega, lowpass, joint)
            for i in range(7):
                y[i] = x[i] + h * k3[i]
            _derivative(y, k4, held, kind, omega, lowpass, joint)
            for i in range(7):
                x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
    return out


def run(rig: DriveRig, seed: int, duration_s: float = 20.0) -> Epoch:
    """Return one epoch of a relaxed subject: two periods of a random binary perturbation."""
    rng = np.random.default_rng(seed)
    steps = round(FINE_HZ / rig.rate_hz)
    rate_hz = FINE_HZ / steps
    n = round(duration_s * rate_hz)
    time_s = np.arange(n) / rate_hz
    chips = np.random.default_rng(99).choice([-1.0, 1.0], round(0.5 * duration_s / CHIP_S))
    chip = np.floor(time_s / CHIP_S + 1e-9).astype(int) % chips.size
    perturbation = AMPLITUDE_NM * chips[chip]
    J_c, B_c = ADMITTANCE
    decay = math.exp(-B_c / J_c / rate_hz)
    filter_b, filter_a = butter(2, CUTOFF_HZ, fs=rate_hz)
    torque, angle, velocity, command = _run(
        perturbation,
        rig.noise_nm * rng.standard_normal(n),
        steps,
        round(rig.edge_s * FINE_HZ),
        STRUCTURES.index(rig.structure),
        2.0 * math.pi * rig.bandwidth_hz,
        2.0 * math.pi * rig.lowpass_hz,
        decay,
        (1.0 - decay) / B_c,
        filter_b,
        filter_a,
        TRUTH,
    )
    least_rad, least_rad_s = math.radians(2.25e-4), math.radians(0.01)
    values = {
        "torque_nm": torque,
        "angle_rad": np.round(angle / least_rad) * least_rad,
        "velocity_rad_s": np.round(velocity / least_rad_s) * least_rad_s,
        "velocity_command_rad_s": command,
        "perturbation_nm": perturbation,
    }
    channels = {name: Channel(name, time_s, one) for name, one in values.items()}
    return Epoch(f"{rig.structure}", str(seed), channels, task="prbs", virtual=True)
