"""A joint of known J, B and K, moved by known lines: torque and motion in closed form."""

from __future__ import annotations

import numpy as np

INERTIA_KG_M2, DAMPING_NM_S_RAD, STIFFNESS_NM_RAD = 0.0063, 0.14, 1.8
TRUTH = np.array([INERTIA_KG_M2, DAMPING_NM_S_RAD, STIFFNESS_NM_RAD])


def lines(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return frequencies in Hz, amplitudes in rad and phases of a motion of 0.05 rad r.m.s."""
    rng = np.random.default_rng(seed)
    hz = np.arange(4, 200) * 0.05
    amplitudes = 1.0 / (1.0 + hz**1.2)
    amplitudes *= 0.05 / np.sqrt(0.5 * np.sum(amplitudes**2))
    return hz, amplitudes, rng.uniform(0, 2 * np.pi, hz.size)


def angle_rad(time_s: np.ndarray, seed: int = 0, derivative: int = 0) -> np.ndarray:
    """Return the angle, or its derivative of some order, at given times."""
    values = np.zeros(time_s.size)
    for hz, amplitude, phase in zip(*lines(seed), strict=True):
        omega = 2 * np.pi * hz
        at = omega * time_s + phase + derivative * np.pi / 2
        values += amplitude * omega**derivative * np.cos(at)
    return values


def torque_nm(time_s: np.ndarray, seed: int = 0, noise_nm: float = 0.002) -> np.ndarray:
    """Return J θ″ + B θ′ + K θ, with noise."""
    exact = sum(
        value * angle_rad(time_s, seed, order)
        for value, order in zip(TRUTH, (2, 1, 0), strict=True)
    )
    return exact + noise_nm * np.random.default_rng(seed + 1).normal(size=time_s.size)
