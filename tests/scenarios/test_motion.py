"""The simulator against closed forms, and against the package's own virtual rig."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from tests.scenarios.limbs import LIMBS, setup_of
from tests.scenarios.motion import FINE_HZ, IMPOSED, resting, run
from tests.scenarios.perturbations import perturbation_nm
from tests.scenarios.plant import TORQUE_MOTOR, VELOCITY_PI, Controller, Drive, TorquePath
from tests.scenarios.recordings import simulate
from tests.scenarios.scenario import scenario

from rigidimeter.core.settings import parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_epochs

ELBOW = LIMBS["animal elbow"].joint
PLAIN = Drive()
STILL = Controller(1e9, 1.0)
"""An admittance that no torque moves: only imposed motion is left."""


def run_imposed(joint=ELBOW, drive=PLAIN, velocity=None, duration_s=1.0, asked_nm=0.0, **start):
    """Run with a constant perturbation; `velocity` gives the imposed one at times."""
    courses = resting(duration_s)
    if velocity is not None:
        courses[IMPOSED] = velocity(np.arange(courses.shape[1]) / 1000.0)
    ticks = round(duration_s * 1000)
    seen = np.full(ticks, -1)
    return run(
        joint,
        drive,
        TorquePath(),
        STILL,
        courses,
        np.full(ticks, asked_nm),
        seen,
        np.zeros(ticks),
        **start,
    )


def test_a_limb_in_a_cuff_swings_as_a_damped_oscillator() -> None:
    joint = ELBOW._replace(damping_nm_s_rad=0.01, cuff_nm_rad=5.0, cuff_nm_s_rad=0.02)
    _, _, torque, _ = run_imposed(joint, start_rad=0.1)
    J, B, K = joint.inertia_kg_m2, 0.01 + 0.02, joint.stiffness_nm_rad + 5.0
    decay, omega = B / (2 * J), np.sqrt(K / J - (B / (2 * J)) ** 2)
    t = np.arange(torque.size) / FINE_HZ
    envelope = 0.1 * np.exp(-decay * t)
    angle = envelope * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    velocity = -envelope * (omega + decay**2 / omega) * np.sin(omega * t)
    assert np.allclose(torque, -5.0 * angle - 0.02 * velocity, atol=1e-7)


def test_the_torque_of_a_sinusoid_is_that_of_inertia_damping_and_stiffness() -> None:
    """M / θ = K − J ω² + j ω B, by projection on whole cycles after the transient."""
    for hz in (1.0, 8.0):
        omega = 2 * np.pi * hz
        angle, _, torque, _ = run_imposed(velocity=lambda t, w=omega: np.sin(w * t), duration_s=3.0)
        last = slice(-round(2 * FINE_HZ), None)
        wave = np.exp(-1j * omega * np.arange(round(2 * FINE_HZ)) / FINE_HZ)
        ratio = np.sum(torque[last] * wave) / np.sum((angle[last] - angle[last].mean()) * wave)
        J, B, K = ELBOW[:3]
        assert ratio == pytest.approx(K - J * omega**2 + 1j * omega * B, rel=2e-4)


def test_the_drive_of_second_order_answers_a_step_by_its_formula() -> None:
    _, velocity, _, _ = run_imposed(
        drive=Drive(bandwidth_hz=20.0, delay_s=0.005), velocity=np.ones_like
    )
    omega = 2 * np.pi * 20.0
    t = np.maximum(np.arange(velocity.size) / FINE_HZ - 0.005, 0.0)
    damped = omega * np.sqrt(1 - 0.7071**2)
    expected = 1 - np.exp(-0.7071 * omega * t) * (
        np.cos(damped * t) + 0.7071 * omega / damped * np.sin(damped * t)
    )
    assert np.allclose(velocity, expected, atol=1e-7)


def test_the_drive_with_pi_answers_as_its_transfer_function_under_load() -> None:
    """(J_m + J) v'' ... of PI, current loop, and a limb of inertia, damping and stiffness."""
    drive = Drive(VELOCITY_PI, bandwidth_hz=20.0)
    _, velocity, _, _ = run_imposed(drive=drive, velocity=np.ones_like)
    mass, lag, omega = drive.inertia_kg_m2, drive.current_lag_s, 2 * np.pi * 20.0
    kp, ki = 2 * drive.damping_ratio * omega * mass, omega**2 * mass
    J, B, K = ELBOW[:3]
    forward = [kp, ki]  # over s
    load = np.polymul([lag, 1.0], [mass + J, B, K])  # (1 + lag s) (J s² + B s + K) / s
    closed = scipy.signal.lti(np.array(forward), np.polyadd(load, np.array(forward)))
    t = np.arange(velocity.size) / FINE_HZ
    _, expected = scipy.signal.step(closed, T=t)
    assert np.allclose(velocity, expected, atol=1e-6)


def test_a_reflex_is_the_velocity_of_before_and_only_of_a_stretch() -> None:
    def wave(t):
        return np.sin(2 * np.pi * 3 * t)

    _, velocity, quiet, _ = run_imposed(velocity=wave)
    joint = ELBOW._replace(reflex_nm_s_rad=0.2, reflex_delay_s=0.05)
    _, _, torque, _ = run_imposed(joint, velocity=wave)
    late = np.concatenate((np.zeros(500), velocity[:-500]))
    assert np.allclose(torque - quiet, 0.2 * np.maximum(late, 0.0), atol=1e-9)


def test_who_resists_does_so_against_the_displacement_of_before() -> None:
    def wave(t):
        return np.sin(2 * np.pi * 3 * t)

    angle, _, quiet, _ = run_imposed(velocity=wave)
    joint = ELBOW._replace(resist_nm_rad=0.5, reflex_delay_s=0.05)
    _, _, torque, _ = run_imposed(joint, velocity=wave)
    late = np.concatenate((np.zeros(500), angle[:-500]))
    assert np.allclose(torque - quiet, 0.5 * late, atol=1e-9)


def test_a_torque_motor_moves_itself_and_the_joint() -> None:
    """(J_m + J) θ'' + B θ' + K θ = p after a step of p, and M is what the motor leaves of it."""
    drive = Drive(TORQUE_MOTOR)
    angle, _, torque, _ = run_imposed(drive=drive, asked_nm=0.3)
    J, B, K = ELBOW[:3]
    t = np.arange(angle.size) / FINE_HZ
    both = scipy.signal.lti([1.0], [drive.inertia_kg_m2 + J, B, K])
    assert np.allclose(angle, 0.3 * scipy.signal.step(both, T=t)[1], atol=1e-6)
    share = scipy.signal.lti([J, B, K], [drive.inertia_kg_m2 + J, B, K])
    assert np.allclose(torque[1:], 0.3 * scipy.signal.step(share, T=t)[1][1:], atol=1e-5)


@pytest.mark.parametrize("limb", ["animal elbow", "ankle"])
def test_the_plain_rig_is_the_virtual_rig(limb: str) -> None:
    """Same perturbation, no noise, no rounding: the records agree to rounding errors."""
    setup = setup_of(LIMBS[limb])
    quiet = {"noise": 0.0, "step": 0.0}
    plain = scenario("plain", limb=limb, torque=quiet, motion={"step": 0.0, "rate_step": 0.0},
                     perturbation={"duration_s": 5.0})  # fmt: skip
    (ours,), _ = simulate(plain.setup, 1, np.random.SeedSequence(1))
    exact = {"noise_sd_nm": 0.0, "resolution_nm": 0.0}
    steps = {"angle_resolution_deg": 0.0, "velocity_resolution_deg_s": 0.0}
    settings = parse_settings(
        {
            "controller": {
                "inertia_kg_m2": setup.controller.inertia_kg_m2,
                "damping_nm_s_rad": setup.controller.damping_nm_s_rad,
            },
            "guard": {"torque_limit_nm": 200.0, "torque_stop_nm": 400.0, "power_limit_w": 1000.0},
            "rig": {"torque": exact, "motion": steps},
        }
    )
    asked = perturbation_nm(plain.setup.perturbation, 1000.0)
    batch = simulate_epochs(
        settings, 1, perturbation_nm=asked, joints=[JointDynamics(*setup.joint[:3])]
    )
    theirs = batch.epoch(0)
    for name, channel in ours.channels.items():
        other = theirs.channels[name]
        values = np.interp(channel.time_s, other.time_s, other.values)
        inside = channel.time_s <= other.time_s[-1]
        error = np.max(np.abs(values - channel.values)[inside]) / np.std(channel.values)
        assert error < 1e-6, name


def test_joints_of_all_sizes_stay_in_range() -> None:
    for name, limb in LIMBS.items():
        setup = scenario(name, limb=name, perturbation={"duration_s": 5.0}).setup
        (epoch,), truth = simulate(setup, 1, np.random.SeedSequence(1))
        assert 1.0 < np.degrees(np.std(epoch.channels["angle_rad"].values)) < 8.0, name
        assert np.allclose(truth[0], limb.joint[:3])
