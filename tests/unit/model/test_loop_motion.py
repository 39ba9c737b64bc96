"""Predicted motion in the closed loop against the real loop."""

import numpy as np
import pytest

from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import closed_loop_motion, median_joint, voluntary_motion_sd
from rigidimeter.planning import ideal_response, prbs_nm

RATE_HZ = 1000.0


@pytest.mark.parametrize(
    ("torque", "subject", "apart"),
    [
        ({}, {}, 1e-8),
        ({"latency_s": 0.0024}, {}, 1e-8),
        ({}, {"stiffness_nm_rad": 0.02}, 1e-6),
        ({}, {"stiffness_nm_rad": 0.0}, 1e-8),
        ({"rate_hz": 100.0, "latency_s": 0.0037}, {}, 0.005),
    ],
    ids=["defaults", "part of a tick", "soft", "no stiffness", "slow sensor"],
)
def test_the_motion_is_that_of_the_real_loop(noiseless, run_loop, torque, subject, apart) -> None:
    settings = noiseless(
        torque=torque, subject={"OFF": subject}, prbs={"duration_s": 5.0, "amplitude_nm": 0.5}
    )
    perturbation = prbs_nm(settings.prbs, RATE_HZ)
    real = run_loop(settings, perturbation)
    found = closed_loop_motion(perturbation, settings, median_joint(settings.subject["OFF"]))
    for name, values in (
        ("angle_rad", found.angle_rad),
        ("velocity_rad_s", found.velocity_rad_s),
        ("velocity_command_rad_s", found.command_rad_s),
    ):
        largest = np.max(np.abs(real[name]))
        np.testing.assert_allclose(values, real[name], rtol=0, atol=apart * largest)


def test_acceleration_is_the_derivative_of_the_velocity() -> None:
    settings = Settings()
    perturbation = prbs_nm(settings.prbs, RATE_HZ)
    found = closed_loop_motion(perturbation, settings, median_joint(settings.subject["OFF"]))
    between = np.diff(found.velocity_rad_s) * RATE_HZ
    middle = (found.acceleration_rad_s2[1:] + found.acceleration_rad_s2[:-1]) / 2
    np.testing.assert_allclose(middle, between, atol=0.03 * np.max(np.abs(between)))


def test_the_ideal_loop_is_near() -> None:
    settings = Settings()
    perturbation = prbs_nm(settings.prbs, RATE_HZ)
    joint = median_joint(settings.subject["OFF"])
    found = closed_loop_motion(perturbation, settings, joint).angle_rad
    ideal, _ = ideal_response(perturbation, settings.controller, joint, RATE_HZ)
    assert np.std(found) == pytest.approx(np.std(ideal), rel=0.02)


def test_what_the_subject_moves(noiseless, run_loop) -> None:
    settings = noiseless(subject={"OFF": {"voluntary_sd_nm": 0.2}})
    real = run_loop(settings, np.zeros(60_000), seed=3)
    angle_sd, velocity_sd = voluntary_motion_sd(settings, settings.subject["OFF"])
    assert np.std(real["angle_rad"]) == pytest.approx(angle_sd, rel=0.1)
    assert np.std(real["velocity_rad_s"]) == pytest.approx(velocity_sd, rel=0.1)
    quiet = parse_settings({})
    assert voluntary_motion_sd(quiet, quiet.subject["OFF"]) == (0.0, 0.0)
