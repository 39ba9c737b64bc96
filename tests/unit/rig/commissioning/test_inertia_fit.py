"""M = J θ'' + B θ' + K θ + M₀ with known values, sampled as a loop does."""

from __future__ import annotations

import numpy as np
import pytest

from rigidimeter.core.units import rad_from_deg
from rigidimeter.rig.commissioning import (
    FREQUENCIES_HZ,
    PERIOD_S,
    WEIGHTS,
    Readings,
    quick_motion,
    torque_answer,
)

RATE_HZ, SPEED_DEG_S, NOISE_NM = 250.0, 20.0, 0.005


def readings(
    J: float,
    B: float = 0.0,
    K: float = 0.0,
    *,
    delay_s: float = 0.0,
    sign: int = 1,
    seed: int | None = 1,
) -> Readings:
    """Return three periods of the quick motion, with the torque of this joint."""
    time_s = np.arange(round(3 * PERIOD_S * RATE_HZ)) / RATE_HZ

    def wave(at_s: np.ndarray, derivative: int) -> np.ndarray:
        """Return an integral, the value, or the derivative of the velocity."""
        speed = rad_from_deg(SPEED_DEG_S)
        total = np.zeros_like(at_s)
        for weight, frequency in zip(WEIGHTS, FREQUENCIES_HZ, strict=True):
            w = 2 * np.pi * frequency
            part = {0: (1 - np.cos(w * at_s)) / w, 1: np.sin(w * at_s), 2: w * np.cos(w * at_s)}
            total += speed * weight * part[derivative]
        return total

    then = time_s - delay_s
    torque = J * wave(then, 2) + B * wave(then, 1) + K * wave(then, 0) + 0.1
    rest = np.zeros_like(time_s)
    noise = rest
    if seed is not None:
        noise = NOISE_NM * np.random.default_rng(seed).standard_normal(len(time_s))
    return Readings(
        time_s=time_s,
        lateness_s=rest,
        torque_nm=sign * torque + noise,
        torque_time_s=time_s,
        angle_rad=wave(time_s, 0),
        velocity_rad_s=wave(time_s, 1),
        motion_time_s=time_s,
        sent_rad_s=wave(time_s, 1),
        cause=np.zeros(len(time_s), dtype=np.int64),
    )


@pytest.mark.parametrize("sign", [1, -1])
def test_a_bare_inertia_is_the_slope_of_torque_on_acceleration(sign: int) -> None:
    found = torque_answer(readings(0.002, sign=sign), RATE_HZ)
    assert found.inertia_kg_m2 == pytest.approx(sign * 0.002, rel=0.03)
    assert found.damping_nm_s_rad == pytest.approx(0.0, abs=0.005)
    assert found.stiffness_nm_rad == pytest.approx(0.0, abs=0.05)
    assert found.delay_s == pytest.approx(0.0, abs=0.003)
    assert found.explained > 0.9


@pytest.mark.parametrize("delay_s", [-0.01, 0.0, 0.0123, 0.05, 0.2])
def test_an_arm_and_its_delay_come_back(delay_s: float) -> None:
    found = torque_answer(readings(0.0045, 0.137, 1.75, delay_s=delay_s, seed=None), RATE_HZ)
    assert found.inertia_kg_m2 == pytest.approx(0.0045, rel=0.02)
    assert found.damping_nm_s_rad == pytest.approx(0.137, rel=0.02)
    assert found.stiffness_nm_rad == pytest.approx(1.75, rel=0.03)
    assert found.delay_s == pytest.approx(delay_s, abs=0.001)


def test_the_standard_error_is_the_scatter_over_repetitions() -> None:
    found = [torque_answer(readings(0.0045, 0.137, seed=seed), RATE_HZ) for seed in range(30)]
    scatter = np.std([each.inertia_kg_m2 for each in found], ddof=1)
    told = np.mean([each.inertia_se_kg_m2 for each in found])
    assert 0.6 < told / scatter < 1.5


def test_a_torque_that_does_not_answer_explains_nothing() -> None:
    found = torque_answer(readings(0.0), RATE_HZ)
    assert found.explained < 0.1
    assert abs(found.inertia_kg_m2) < 2e-4


def test_readings_of_a_moment_tell_nothing() -> None:
    short = Readings._make(column[:100] for column in readings(0.002))
    found = torque_answer(short, RATE_HZ)
    assert found.inertia_kg_m2 == 0.0
    assert np.isinf(found.inertia_se_kg_m2)


@pytest.mark.parametrize("rate_hz", [50.0, 60.0, 250.0, 1000.0])
def test_the_motion_ends_where_it_began_and_keeps_to_its_speed(rate_hz: float) -> None:
    velocity = quick_motion(rate_hz, 5.0, SPEED_DEG_S)
    assert len(velocity) == round(6.0 * rate_hz)
    assert abs(np.sum(velocity)) / rate_hz < 1e-9
    assert np.max(np.abs(velocity)) <= rad_from_deg(SPEED_DEG_S)
    assert np.ptp(np.cumsum(velocity)) / rate_hz < rad_from_deg(2.5)
