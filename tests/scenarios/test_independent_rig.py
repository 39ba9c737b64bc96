"""The independent rig against closed forms, and what the estimation makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import butter, freqz, welch
from tests.scenarios.independent_rig import (
    STEP_S,
    TICK_HZ,
    Rig,
    matrices,
    perturbation_nm,
    register,
    run,
    simulate,
    tremor_nm,
    voluntary_nm,
)

from rigidimeter import identify

EXACT = Rig(torque_step_nm=0.0)
"""`run` adds no other error."""


def ran(rig: Rig, perturbation: np.ndarray, subject: np.ndarray | float = 0.0):
    none = np.zeros(perturbation.shape)
    return run(rig, perturbation, none + subject, none)


def response(rig: Rig, frequency_hz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return angle and torque over p at the ticks.

    Between ticks the command is held, so that the state goes by a matrix exponential; the torque is
    sampled before the command changes.
    """
    A, U = (one[:3, :width] for one, width in zip(matrices(rig), (3, 1), strict=True))
    held = expm(np.block([[A, U], [np.zeros((1, 4))]]) / TICK_HZ)
    z = np.exp(2j * np.pi * frequency_hz / TICK_HZ)
    state = np.array([np.linalg.solve(one * np.eye(3) - held[:3, :3], held[:3, 3]) for one in z])
    J, B, K = rig.joint
    torque = state @ (J * A[1] + [K, B, 0.0]) + J * U[1, 0] / z
    F = freqz(*butter(2, rig.cutoff_hz, fs=TICK_HZ), frequency_hz, fs=TICK_HZ)[1]
    J_c, B_c = rig.controller
    G = 1.0 / (J_c * TICK_HZ * (1 - 1 / z) + B_c)
    command = 1.0 if rig.drive == "torque" else G / (1.0 + G * F * torque)
    return command * state[:, 0], command * torque


HELD = replace(EXACT, drive="torque", motor_kg_m2=0.0)
"""The joint bears the torque that is asked for, and nothing else."""


def stepped_rad(rig: Rig, since_s: np.ndarray, torque_nm: float) -> np.ndarray:
    """Return the angle after a step of torque."""
    J, B, K = rig.joint
    decay, omega = B / (2 * J), np.sqrt(K / J - (B / (2 * J)) ** 2)
    t = np.maximum(since_s, 0.0)
    swing = np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    return torque_nm / K * (1.0 - swing)


@pytest.mark.parametrize("latency_s", [0.0, 0.0003])
def test_a_step_of_torque_moves_the_joint_as_its_differential_equation_says(latency_s):
    rig = replace(HELD, latency_s=latency_s)
    found = ran(rig, np.full((1, 2000), 0.5))
    expected = stepped_rad(rig, found.time_s - latency_s, 0.5)
    np.testing.assert_allclose(found.angle_rad, expected, atol=1e-9)
    np.testing.assert_allclose(found.torque_nm[:, 1:], 0.5, atol=1e-12)


@pytest.mark.parametrize("drive", ["PI", "second order"])
def test_at_rest_the_joint_bears_the_whole_perturbation(drive):
    rig = replace(EXACT, drive=drive)
    found = ran(rig, np.full((1, 20_000), 0.9))
    assert found.torque_nm[0, -1] == pytest.approx(0.9, rel=1e-6)
    assert found.angle_rad[0, -1] == pytest.approx(0.9 / rig.joint[2], rel=1e-6)


@pytest.mark.parametrize("drive", ["PI", "second order", "torque"])
def test_the_loop_answers_a_sine_as_the_held_command_has_it(drive):
    rig = replace(EXACT, drive=drive, motor_kg_m2=0.02 if drive == "torque" else 0.4)
    frequency_hz = np.array([0.5, 2.0, 7.0, 20.0])
    time_s = np.arange(20_000) / TICK_HZ
    p = np.sin(2 * np.pi * frequency_hz[:, None] * time_s)
    found = ran(rig, p)
    turning = np.exp(-2j * np.pi * frequency_hz[:, None] * time_s)[:, -10_000:]
    for measured, expected in zip(
        (found.angle_rad, found.torque_nm), response(rig, frequency_hz), strict=True
    ):
        seen = 2j * (measured[:, -10_000:] * turning).mean(axis=1)
        np.testing.assert_allclose(seen, expected, rtol=1e-4)


def test_the_register_has_its_longest_period_and_the_correlation_of_one():
    for bits in range(5, 11):
        chips = register(bits)
        assert np.sum(chips) == -1.0
        lines = np.abs(np.fft.fft(chips)) ** 2
        np.testing.assert_allclose(lines[1:], chips.size + 1.0)
    p = perturbation_nm(EXACT, np.array([0, 5]), 10_000)
    np.testing.assert_array_equal(p[0, 200:], p[1, :-200])


def test_voluntary_torque_has_its_size_and_soft_skirts():
    found = voluntary_nm(replace(EXACT, voluntary_nm=0.2), 40, 20_000, np.random.default_rng(1))
    assert found.std() == pytest.approx(0.2, rel=0.03)
    frequency_hz, power = welch(found, TICK_HZ, nperseg=10_000)
    power = power.mean(axis=0)
    gain = np.abs(
        freqz(*butter(2, (0.3, 4.0), "bandpass", fs=TICK_HZ), frequency_hz, fs=TICK_HZ)[1]
    )
    for ratio_of, per in ((8.0, 2.0), (16.0, 2.0)):
        i, j = (np.argmin(np.abs(frequency_hz - one)) for one in (ratio_of, per))
        assert power[i] / power[j] == pytest.approx((gain[i] / gain[j]) ** 2, rel=0.3)


def test_tremor_has_its_size_and_drifts():
    found = tremor_nm(replace(EXACT, tremor_nm=0.3), 40, 20_000, np.random.default_rng(2))
    assert found.std() == pytest.approx(0.3 * np.sqrt(0.5 * 1.04), rel=0.05)
    lines = np.abs(np.fft.rfft(found)) ** 2
    near = np.abs(np.fft.rfftfreq(20_000, 1 / TICK_HZ) - 5.5) < 2.5
    assert lines[:, near].sum() > 0.99 * lines.sum()
    share = lines.max(axis=1) / lines.sum(axis=1)
    assert np.median(share) < 0.5  # a sine has all of it in one line or two


def test_a_subject_who_resists_does_so_after_the_delay():
    found, relaxed = (
        ran(replace(HELD, resist_nm_rad=g), np.full((1, 8000), 0.5)) for g in (0.6, 0.0)
    )
    moved = np.flatnonzero(np.abs(found.angle_rad - relaxed.angle_rad)[0] > 1e-12)
    assert 500 < moved[0] < 510
    assert found.angle_rad[0, -1] == pytest.approx(0.5 / (HELD.joint[2] + 0.6), rel=1e-3)


def test_late_ticks_sample_late_and_change_nothing_else():
    late = np.zeros((2, 2000), int)
    late[1, 7::10] = 6
    none = np.zeros(late.shape)
    found = run(HELD, none + 0.5, none, none, late)
    np.testing.assert_allclose(found.time_s[1] - found.time_s[0], late[1] * STEP_S, atol=1e-12)
    np.testing.assert_allclose(found.angle_rad, stepped_rad(HELD, found.time_s, 0.5), atol=1e-9)


def test_the_same_seed_gives_the_same_recording_and_another_another():
    one, same, other = (simulate(Rig(tremor_nm=0.1), 1, seed, 1.0) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.torque_nm, same.torque_nm)
    assert not np.array_equal(one.torque_nm, other.torque_nm)


@pytest.mark.parametrize("drive", ["PI", "second order"])
def test_the_joint_is_found_from_the_arrays(drive):
    rig = Rig(drive=drive)
    found = simulate(rig, 1, 3)
    fit = identify(**found.epoch(0), settings=rig.settings())
    np.testing.assert_allclose(fit.value, rig.joint, rtol=0.005)
    assert set(found.epoch(0, measured_alone=True)) == {"time_s", "torque_nm", "angle_rad"}
