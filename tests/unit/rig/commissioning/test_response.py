from __future__ import annotations

import math

import numpy as np
import pytest

from rigidimeter.model import DriveState, arm_torque_nm, drive, drive_step
from rigidimeter.rig.commissioning import Readings, fit_arm, following, velocity_per_angle

J, B, K = 0.0045, 0.137, 1.75
RATE_HZ, FINE = 200.0, 20


def readings(
    *, bandwidth_hz: float = 20.0, delay_ticks: int = 0, scale: float = 1.0, torque_late: int = 0
) -> Readings:
    """Return what a loop would hear of a drive, tick by tick; delays in twentieths of a tick."""
    rng = np.random.default_rng(1)
    sent = np.concatenate(
        [np.zeros(20), np.repeat(rng.choice([-0.15, 0.15], 100), 8), np.zeros(20)]
    )
    step = drive(bandwidth_hz, 0.7071, 1.0 / (RATE_HZ * FINE))
    fine = np.concatenate([np.zeros(delay_ticks), np.repeat(sent, FINE)])
    state, states = DriveState(), []
    for command in fine:
        states.append(state)
        state = drive_step(step, state, float(command))
    ticks = np.arange(len(sent))
    now = [states[k * FINE] for k in ticks]
    then = [states[max(k * FINE - torque_late, 0)] for k in ticks]
    torque = np.array([arm_torque_nm(J, B, K, *x, 0.0) for x in then])
    time_s = ticks / RATE_HZ
    return Readings(
        time_s=time_s,
        lateness_s=np.zeros(len(sent)),
        torque_nm=torque + 0.001 * rng.standard_normal(len(sent)),
        torque_time_s=time_s,
        angle_rad=scale * np.array([x.angle_rad for x in now]),
        velocity_rad_s=scale * np.array([x.velocity_rad_s for x in now]),
        motion_time_s=time_s,
        sent_rad_s=sent,
        cause=np.zeros(len(sent), dtype=np.int64),
    )


@pytest.mark.parametrize("delay_ticks", [0, 30, 100])
@pytest.mark.parametrize("scale", [1.0, -1.0, 0.0175])
def test_delay_scale_and_bandwidth_are_found(delay_ticks: int, scale: float) -> None:
    found = following(readings(delay_ticks=delay_ticks, scale=scale), 0.7071, highest_hz=100.0)
    assert found.scale == pytest.approx(scale, rel=2e-3)
    assert found.bandwidth_hz == pytest.approx(20.0, rel=0.03)
    assert found.delay_s == pytest.approx(delay_ticks / (RATE_HZ * FINE), abs=5e-4)


def test_what_is_too_quick_to_tell_becomes_delay() -> None:
    found = following(readings(bandwidth_hz=400.0), 0.7071, highest_hz=50.0)
    assert found.bandwidth_hz <= 50.0
    lag_s = 2 * 0.7071 / (2 * math.pi * found.bandwidth_hz) + found.delay_s
    assert lag_s < 0.008


@pytest.mark.parametrize("late", [0, 17, 60])
@pytest.mark.parametrize("resists", [False, True])
def test_the_arm_and_the_whole_delay_show_in_the_torque(late: int, resists: bool) -> None:
    seen = fit_arm(readings(torque_late=late), 20.0, 0.7071, 1.0, resists=resists)
    assert seen.delay_s == pytest.approx(late / (RATE_HZ * FINE), abs=3e-4)
    assert seen.inertia_kg_m2 == pytest.approx(J, rel=0.03)
    assert seen.damping_nm_s_rad == pytest.approx(B, rel=0.03)
    assert seen.stiffness_nm_rad == pytest.approx(K, rel=0.05)
    assert seen.explained > 0.99


def test_an_arm_that_pushes_looks_negative() -> None:
    turned = readings()
    turned = turned._replace(torque_nm=-turned.torque_nm)
    seen = fit_arm(turned, 20.0, 0.7071, 1.0)
    assert seen.inertia_kg_m2 == pytest.approx(-J, rel=0.03)


def test_noise_shows_no_arm() -> None:
    rng = np.random.default_rng(2)
    noise = readings()
    noise = noise._replace(torque_nm=rng.standard_normal(len(noise.torque_nm)))
    assert fit_arm(noise, 20.0, 0.7071, 1.0).explained < 0.1


@pytest.mark.parametrize("wrong", [1.0, -1.0, 57.3, 1.05])
def test_the_velocity_is_held_against_the_angle(wrong: float) -> None:
    sample = readings()
    sample = sample._replace(velocity_rad_s=wrong * sample.velocity_rad_s)
    assert velocity_per_angle(sample) == pytest.approx(wrong, rel=5e-3)
