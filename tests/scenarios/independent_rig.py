"""A whole rig in continuous time that takes nothing from the package: numpy and scipy alone.

Angles in rad, torques in N·m, positive toward positive angle. M is the torque between rig and
limb, which the sensor measures; m the subject's own, both driving the joint:

    joint       J θ'' + B θ' + K θ = M + m
    controller  J_c c' + B_c c = p − F M, at each tick by the backward difference; F is a
                Butterworth low-pass of second order by the bilinear transform
    drive       "PI": J_m θ'' = k_p (c − θ') + k_i ∫(c − θ') dt − M, which its load slows down
                "second order": θ''' = ω² (c − θ') − 2 ζ ω θ'', whatever the load
                "torque": J_m θ'' = p − M, a torque motor without a loop
    subject     m = voluntary + tremor − r;  r'' = ω_r² (g θ(t − τ) − r) − 2 ω_r r'

What runs at a tick is held to the next: samples, and after `latency_s` the command (of the torque
motor the torque). A late tick does all of it later. p is a maximal-length shift register's, started
at a place of its own in every epoch. Voluntary torque is white noise through a Butterworth
band-pass, whose skirts are soft; the frequency and size of the tremor drift.

Runge–Kutta of fourth order at 10 kHz, all epochs at once; m and θ(t − τ) are linear within a
thousandth of a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfilt, sosfreqz

Array = NDArray[np.float64]

TICK_HZ, STEPS = 1000, 10
"""Ticks in a second, and steps of the integration in a tick."""
STEP_S = 1.0 / (TICK_HZ * STEPS)

ANGLE, VELOCITY, INNER, RESISTED, RESISTED_RATE = range(5)
"""The state: θ, θ', what is the drive's own (θ'' or ∫(c − θ') dt), r, r'."""


@dataclass(frozen=True)
class Rig:
    """Everything that is not chance; SI units.

    Attributes
    ----------
    joint : (float, float, float)
        J in kg·m², B in N·m·s/rad, K in N·m/rad.
    drive : {"PI", "second order", "torque"}
    drive_hz, motor_kg_m2, integral_share : float
        Bandwidth; J_m; k_i over k_p as a share of the bandwidth in rad/s.
    controller : (float, float)
        J_c in kg·m², B_c in N·m·s/rad.
    cutoff_hz : float
        Of F.
    bits, chip_s, amplitude_nm : int, float, float
        Of the shift register.
    latency_s : float
        From the samples to the command.
    late_share, late_s : float
        Share of the ticks that run late, and the mean of how much; at most to the next tick.
    torque_noise_nm, torque_step_nm : float
        SD of white noise, and resolution.
    coloured_nm, coloured_hz : float
        SD and corner of further noise of the torque sensor, of first order.
    angle_noise_rad, angle_step_rad, velocity_noise_rad_s : float
    voluntary_nm, voluntary_hz : float, (float, float)
        SD and corners of the voluntary torque.
    tremor_nm : float
        Mean amplitude.
    resist_nm_rad, resist_delay_s, resist_hz : float
        g, τ, and ω_r / 2π.
    """

    joint: tuple[float, float, float] = (0.006, 0.14, 1.8)
    drive: str = "PI"
    drive_hz: float = 50.0
    motor_kg_m2: float = 0.4
    integral_share: float = 0.15
    controller: tuple[float, float] = (0.055, 1.8)
    cutoff_hz: float = 25.0
    bits: int = 8
    chip_s: float = 0.04
    amplitude_nm: float = 0.9
    latency_s: float = 0.0
    late_share: float = 0.0
    late_s: float = 0.0005
    torque_noise_nm: float = 0.004
    torque_step_nm: float = 0.001
    coloured_nm: float = 0.0
    coloured_hz: float = 2.0
    angle_noise_rad: float = 0.0
    angle_step_rad: float = 2 * np.pi / 2**20
    velocity_noise_rad_s: float = 2e-4
    voluntary_nm: float = 0.0
    voluntary_hz: tuple[float, float] = (0.3, 4.0)
    tremor_nm: float = 0.0
    resist_nm_rad: float = 0.0
    resist_delay_s: float = 0.5
    resist_hz: float = 2.0

    def settings(self) -> dict[str, Any]:
        """Return what the settings of the package say of this rig."""
        inertia, damping = self.controller
        return {
            "controller": {
                "inertia_kg_m2": inertia,
                "damping_nm_s_rad": damping,
                "torque_cutoff_hz": self.cutoff_hz,
            },
            "rig": {
                "torque": {
                    "noise_sd_nm": self.torque_noise_nm,
                    "resolution_nm": self.torque_step_nm,
                }
            },
        }


class Recorded(NamedTuple):
    """The channels of some epochs, each of shape (epochs, samples); stamps in s."""

    time_s: Array
    torque_nm: Array
    angle_rad: Array
    velocity_rad_s: Array
    velocity_command_rad_s: Array
    perturbation_nm: Array

    def epoch(self, number: int, *, measured_alone: bool = False) -> dict[str, Array]:
        """Return an epoch as `rigidimeter.identify` takes it.

        With `measured_alone` as a file of torque and angle holds it.
        """
        names = Recorded._fields[:3] if measured_alone else Recorded._fields
        return {name: getattr(self, name)[number] for name in names}


def register(bits: int) -> Array:
    """Return the 2^bits − 1 chips, ±1, of a Fibonacci shift register of maximal length."""
    taps = {5: (5, 3), 6: (6, 5), 7: (7, 6), 8: (8, 6, 5, 4), 9: (9, 5), 10: (10, 7)}[bits]
    state, chips = [1] * bits, []
    for _ in range(2**bits - 1):
        chips.append(1.0 - 2.0 * state[-1])
        state = [sum(state[tap - 1] for tap in taps) % 2, *state[:-1]]
    return np.array(chips)


def perturbation_nm(rig: Rig, begins: NDArray[np.int64], ticks: int) -> Array:
    """Return p of epochs that begin at these chips, shape (epochs, ticks)."""
    chip = np.floor(np.arange(ticks) / TICK_HZ / rig.chip_s + 1e-9).astype(int)
    chips = register(rig.bits)
    return rig.amplitude_nm * chips[(chip + begins[:, None]) % chips.size]


def voluntary_nm(rig: Rig, epochs: int, ticks: int, rng: np.random.Generator) -> Array:
    """Return voluntary torque, shape (epochs, ticks)."""
    sos = butter(2, rig.voluntary_hz, "bandpass", fs=TICK_HZ, output="sos")
    gain = np.sqrt(np.mean(np.abs(sosfreqz(sos, 2**17)[1]) ** 2))
    settled = 10 * TICK_HZ
    white = rng.standard_normal((epochs, settled + ticks))
    return np.asarray(rig.voluntary_nm / gain * sosfilt(sos, white)[:, settled:])


def tremor_nm(rig: Rig, epochs: int, ticks: int, rng: np.random.Generator) -> Array:
    """Return tremor of 4.5 to 6.5 Hz, which drifts by 0.3 Hz, and 20 % in size, within seconds."""
    drift = [_first_order(0.1, epochs, ticks, rng) for _ in range(2)]
    frequency_hz = rng.uniform(4.5, 6.5, (epochs, 1)) + 0.3 * drift[0]
    phase = rng.uniform(0, 2 * np.pi, (epochs, 1)) + 2 * np.pi / TICK_HZ * frequency_hz.cumsum(1)
    return np.asarray(rig.tremor_nm * (1.0 + 0.2 * drift[1]) * np.sin(phase))


def _first_order(corner_hz: float, epochs: int, ticks: int, rng: np.random.Generator) -> Array:
    """Return stationary noise of unit variance through a pole."""
    pole = np.exp(-2 * np.pi * corner_hz / TICK_HZ)
    white = rng.standard_normal((epochs, ticks))
    white[:, 1:] *= np.sqrt(1 - pole**2)
    return np.asarray(lfilter([1.0], [1.0, -pole], white))


def matrices(rig: Rig) -> tuple[Array, Array]:
    """Return A and U of x' = A x + U (command, voluntary and tremor, g θ(t − τ))."""
    J, B, K = rig.joint
    omega = 2 * np.pi * rig.drive_hz
    A, U = np.zeros((5, 5)), np.zeros((5, 3))
    A[ANGLE, VELOCITY] = 1.0
    moved = J + rig.motor_kg_m2
    if rig.drive == "second order":
        A[VELOCITY, INNER] = 1.0
        A[INNER, VELOCITY], A[INNER, INNER], U[INNER, 0] = -(omega**2), -1.4 * omega, omega**2
    else:
        A[VELOCITY, [ANGLE, VELOCITY, RESISTED]] = -K / moved, -B / moved, -1.0 / moved
        U[VELOCITY, :2] = 1.0 / moved
    if rig.drive == "PI":
        gain = rig.motor_kg_m2 * omega
        A[VELOCITY, VELOCITY] -= gain / moved
        A[VELOCITY, INNER] = gain * rig.integral_share * omega / moved
        U[VELOCITY, 0] = gain / moved
        A[INNER, VELOCITY], U[INNER, 0] = -1.0, 1.0
    omega_r = 2 * np.pi * rig.resist_hz
    A[RESISTED, RESISTED_RATE] = 1.0
    A[RESISTED_RATE, [RESISTED, RESISTED_RATE]] = -(omega_r**2), -2 * omega_r
    U[RESISTED_RATE, 2] = omega_r**2
    return A, U


def simulate(rig: Rig, epochs: int, seed: int, duration_s: float = 20.4) -> Recorded:
    """Return what was recorded in some epochs from rest."""
    rng = np.random.default_rng(seed)
    ticks = round(duration_s * TICK_HZ)
    asked = perturbation_nm(rig, rng.integers(2**rig.bits - 1, size=epochs), ticks)
    shape = epochs, ticks
    subject = voluntary_nm(rig, *shape, rng) + tremor_nm(rig, *shape, rng)
    noise = rig.torque_noise_nm * rng.standard_normal(shape)
    noise += rig.coloured_nm * _first_order(rig.coloured_hz, *shape, rng)
    late = rng.exponential(rig.late_s / STEP_S, shape) * (rng.random(shape) < rig.late_share)
    found = run(rig, asked, subject, noise, np.minimum(np.rint(late).astype(int), STEPS - 1))
    angle = found.angle_rad + rig.angle_noise_rad * rng.standard_normal(shape)
    if rig.angle_step_rad > 0:
        angle = np.rint(angle / rig.angle_step_rad) * rig.angle_step_rad
    velocity = found.velocity_rad_s + rig.velocity_noise_rad_s * rng.standard_normal(shape)
    return found._replace(angle_rad=angle, velocity_rad_s=velocity)


def run(rig: Rig, perturbation: Array, subject: Array, noise: Array, late: Any = 0) -> Recorded:
    """Integrate; the motion is recorded as it is.

    Parameters
    ----------
    rig : Rig
    perturbation, subject, noise : array, shape (epochs, ticks)
        p, voluntary torque with tremor, and what the torque sensor adds, in N·m.
    late : int or array of int, shape (epochs, ticks)
        Steps by which each tick is late.
    """
    epochs, ticks = perturbation.shape
    late = np.broadcast_to(late, perturbation.shape)
    A, U = matrices(rig)
    J, B, K = rig.joint
    latency, delay = round(rig.latency_s / STEP_S), round(rig.resist_delay_s * TICK_HZ)
    x, controller = np.zeros((5, epochs)), np.zeros((3, epochs))
    held, arrives = np.zeros(epochs), np.full(epochs, -1)
    ends = np.zeros((ticks + 1, 3, epochs))  # the inputs at even times
    ends[:-1, 1], ends[-1, 1] = subject.T, subject[:, -1]
    kept = np.zeros((4, ticks, epochs))  # torque, angle, velocity, command
    for k in range(ticks):
        if k + 1 + delay <= ticks:
            ends[k + delay, 2] = rig.resist_nm_rad * x[ANGLE]
        change = (ends[k + 1] - ends[k]) / STEPS
        due = set(late[:, k].tolist())
        for step in range(STEPS):
            now, inputs = k * STEPS + step, ends[k] + step * change
            inputs[0] = held
            if step in due:
                runs = late[:, k] == step
                acceleration = A[VELOCITY] @ x + U[VELOCITY] @ inputs
                torque = J * acceleration + B * x[VELOCITY] + K * x[ANGLE]
                torque += x[RESISTED] - inputs[1] + noise[:, k]
                if rig.torque_step_nm > 0:
                    torque = np.rint(torque / rig.torque_step_nm) * rig.torque_step_nm
                new = _controlled(rig, controller, perturbation[:, k], torque)
                controller = np.where(runs, new, controller)
                sample = np.array([torque, x[ANGLE], x[VELOCITY], controller[0]])
                kept[:, k] = np.where(runs, sample, kept[:, k])
                arrives = np.where(runs, now + latency, arrives)
            inputs[0] = held = np.where(arrives == now, controller[0], held)
            x = _stepped(A, U, x, inputs, change)
    torque, angle, velocity, command = (np.ascontiguousarray(one.T) for one in kept)
    stamps = np.arange(ticks) / TICK_HZ + late * STEP_S
    return Recorded(stamps, torque, angle, velocity, command, perturbation)


def _controlled(rig: Rig, before: Array, perturbation: Array, torque: Array) -> Array:
    """Return the command, and what F remembers in direct form II transposed."""
    b, a = _low_pass(rig.cutoff_hz)
    smooth = b[0] * torque + before[1]
    kept = b[1] * torque - a[1] * smooth + before[2], b[2] * torque - a[2] * smooth
    J_c, B_c = rig.controller
    command = (J_c * before[0] + (perturbation - smooth) / TICK_HZ) / (J_c + B_c / TICK_HZ)
    return np.array([perturbation if rig.drive == "torque" else command, *kept])


@cache
def _low_pass(cutoff_hz: float) -> tuple[Array, Array]:
    b, a = butter(2, cutoff_hz, fs=TICK_HZ)
    return b, a


def _stepped(A: Array, U: Array, x: Array, inputs: Array, change: Array) -> Array:
    """Return the state a step later, with inputs that go linearly by `change`."""
    f0 = U @ inputs
    half = f0 + U @ (0.5 * change)
    k1 = A @ x + f0
    k2 = A @ (x + 0.5 * STEP_S * k1) + half
    k3 = A @ (x + 0.5 * STEP_S * k2) + half
    k4 = A @ (x + STEP_S * k3) + (2.0 * half - f0)
    return np.asarray(x + STEP_S / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))
