"""Torque and angle alone, in closed form: what is reported of them is right, or is not reported.

A servo with friction, a pendulum, a wrong sign beside a slow movement, noise of the angle: no rig
of the scenarios has them.
"""

from __future__ import annotations

import numpy as np
import pytest
from tests.scenarios.catalogue import SCENARIOS
from tests.scenarios.recordings import measured_alone

import rigidimeter as rm

RATE_HZ = 500.0
TIME_S = np.arange(int(20 * RATE_HZ)) / RATE_HZ
TRUTH = np.array([0.02, 0.3, 7.5])
HZ = np.arange(2, 300) * 0.05
SIZE_RAD = 1.0 / (1.0 + HZ**1.5)
SIZE_RAD *= 0.1 / np.sqrt(0.5 * np.sum(SIZE_RAD**2))
PHASE = np.random.default_rng(0).uniform(0, 2 * np.pi, HZ.size)
NOISE = np.random.default_rng(1).standard_normal((2, TIME_S.size))


def motion(order: int) -> np.ndarray:
    omega = 2 * np.pi * HZ
    at = omega * TIME_S[:, None] + PHASE + order * np.pi / 2
    return np.sum(SIZE_RAD * omega**order * np.cos(at), axis=1)


ANGLE, VELOCITY, ACCELERATION = (motion(order) for order in range(3))
TORQUE = TRUTH @ np.array([ACCELERATION, VELOCITY, ANGLE]) + 0.003 * NOISE[0]


def fitted(torque_nm, angle_rad=ANGLE, angle_noise_rad=1e-5, **more):
    noisy = angle_rad + angle_noise_rad * NOISE[1]
    fit = rm.identify(torque_nm=torque_nm, angle_rad=noisy, rate_hz=RATE_HZ, **more)
    return fit, {finding.name: finding for finding in fit.findings}


def test_a_joint_of_j_b_and_k_is_found():
    fit, found = fitted(TORQUE)
    np.testing.assert_allclose(fit.value, TRUTH, rtol=2e-3)
    (caution,) = (one for one in found.values() if one.level != "note")
    assert caution.name == "between_samples"  # nobody stated the drive: J alone is concerned
    assert caution.value < 5.0


def test_friction_of_a_servo_is_no_noise_of_the_motion_and_b_is_that_beside_it():
    fit, found = fitted(TORQUE + np.sign(VELOCITY))
    assert "noise_of_motion" not in found
    assert fit.outcome.included
    assert fit.value[1] == pytest.approx(TRUTH[1], rel=0.01)
    assert found["missing_term"].effect.percent[1] > 100


def test_a_pendulum_is_no_noise_of_the_motion():
    torque = 0.02 * ACCELERATION + 0.01 * VELOCITY + 5 * np.sin(8 * ANGLE) / 8
    fit, found = fitted(torque + 0.003 * NOISE[0])
    assert "noise_of_motion" not in found
    assert fit.outcome.included
    assert fit.value[0] == pytest.approx(0.02, rel=0.01)


def test_noise_of_the_motion_is_measured_by_its_samples():
    assert "noise_of_motion" not in fitted(TORQUE, angle_noise_rad=1e-4)[1]
    slow = np.convolve(ANGLE, np.hanning(301) / np.sum(np.hanning(301)), "same")
    noisy, found = fitted(TRUTH[2] * slow + 0.003 * NOISE[0], slow, angle_noise_rad=3e-3)
    assert found["noise_of_motion"].level == "caution"
    assert "noise" not in noisy.outcome.reason


def test_a_wrong_sign_beside_a_slow_movement_is_excluded():
    slow = 2 * np.sin(2 * np.pi * 0.03 * TIME_S)
    fit, found = fitted(-TORQUE - TRUTH[2] * slow, ANGLE + slow)
    assert not fit.outcome.included
    assert "the torque's sign is wrong. Add --reaction" in fit.outcome.reason
    assert found["negative_parameters"].level == "exclude"


def test_where_no_loop_is_known_none_is_assumed():
    push = np.convolve(NOISE[0], np.hanning(15) / 4, "same")  # over all of the band
    bare, found = fitted(TORQUE + push)
    finding = found["loop_bias"]
    assert finding.level == "note"
    assert finding.headline.startswith("Loop not known")
    assert np.isnan(finding.effect.percent).all()
    controller = {"inertia_kg_m2": 0.0458, "damping_nm_s_rad": 1.6}
    stated, found = fitted(TORQUE + push, settings={"controller": controller})
    assert "not_known" not in str(found["loop_bias"].facts if "loop_bias" in found else "")
    assert stated.high[2] - stated.low[2] > 1.01 * (bare.high[2] - bare.low[2])


@pytest.mark.parametrize(
    ("name", "follows"),
    [("tremor 1.0 N·m", False), ("voluntary 0.2 N·m, soft skirts", False),
     ("cogwheel 0.3 N·m", True)],
)  # fmt: skip
def test_what_the_subject_adds_comes_back_by_the_loop_and_is_no_misfit(name, follows):
    one = SCENARIOS[name]
    epochs = [measured_alone(epoch) for epoch in one.simulated(0, 4)[0]]
    fits = rm.estimate(epochs, settings=one.analysed_with()).fits
    raised = {finding.name for fit in fits for finding in fit.findings if finding.level != "note"}
    assert ("lack_of_fit" in raised) is follows
