"""Verdict and margins against the real loop, and against one another."""

import math

import numpy as np
import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import (
    JointDynamics,
    loop_margins,
    loop_stability,
    median_joint,
    refuse_unstable,
    spectral_radius,
)

JOINT = JointDynamics(0.0045, 0.1368, 1.751)
PER_RADIAN = {"inertia_kg_m2": 0.0008, "damping_nm_s_rad": 0.028}


def controller(inertia_kg_m2: float) -> dict[str, float]:
    return {"inertia_kg_m2": inertia_kg_m2, "damping_nm_s_rad": 35.0 * inertia_kg_m2}


@pytest.mark.parametrize(
    ("inertia_kg_m2", "torque", "stable"),
    [
        (0.0458, {}, True),
        (0.0020, {}, True),
        (0.0016, {}, False),
        (0.0030, {"latency_s": 0.0024}, True),
        (0.0020, {"latency_s": 0.0024}, False),
        (0.0030, {"rate_hz": 100.0, "latency_s": 0.0037}, True),
        (0.0027, {"rate_hz": 100.0, "latency_s": 0.0037}, False),
    ],
)
def test_the_real_loop_grows_or_dies_out_at_that_rate(
    noiseless, run_loop, inertia_kg_m2: float, torque: dict, stable: bool
) -> None:
    settings = noiseless(torque=torque, controller=controller(inertia_kg_m2))
    pulse = np.zeros(2500)
    pulse[:20] = 1e-10  # so small that the guard stays out of it
    command = np.abs(run_loop(settings, pulse)["velocity_command_rad_s"])
    envelope = command[500:].reshape(4, 500).max(axis=1)
    growth = (envelope[3] / envelope[1]) ** (1 / 1000)
    margins = loop_margins(settings, JOINT)
    assert margins.stable is stable
    assert bool(growth < 1.0) is stable
    assert margins.spectral_radius == pytest.approx(growth, abs=1.5e-3)


def test_the_papers_controller_is_stable_per_degree_and_not_per_radian() -> None:
    slow = {"drive_bandwidth_hz": 40.0}
    guard = {"reaction_time_s": 0.03}
    per_degree = parse_settings({"rig": slow, "guard": guard})
    per_radian = parse_settings({"rig": slow, "guard": guard, "controller": PER_RADIAN})
    assert loop_margins(per_degree, JOINT).stable
    assert loop_margins(per_degree, JOINT).gain_margin_db > 20.0
    found = loop_margins(per_radian, JOINT)
    assert not found.stable
    assert found.gain_margin_db < 0.0
    assert found.phase_margin_deg < 0.0
    assert found.delay_margin_s == 0.0
    refuse_unstable(per_degree)
    with pytest.raises(
        UserError, match=r"unstable with subject OFF: a disturbance doubles every 1[0-9.]+ ms"
    ):
        refuse_unstable(per_radian)


def test_a_loop_that_is_nearly_unstable_is_refused_too() -> None:
    near = parse_settings({"controller": {"inertia_kg_m2": 0.003, "damping_nm_s_rad": 0.06}})
    found = loop_margins(near, JOINT)
    assert found.stable
    assert found.gain_margin_db < 6.0
    with pytest.raises(UserError, match=r"gain margin of [0-9.]+ dB, less than margins.gain_marg"):
        refuse_unstable(near)
    refuse_unstable(
        parse_settings(
            {
                "controller": {"inertia_kg_m2": 0.003, "damping_nm_s_rad": 0.06},
                "margins": {"gain_margin_db": 0.0, "phase_margin_deg": 0.0},
            }
        )
    )


@pytest.mark.parametrize("torque", [{}, {"latency_s": 0.0024}])
def test_the_gain_margin_is_what_the_loop_bears(noiseless, torque: dict) -> None:
    """A gain of the controller higher by the margin puts a pole on the unit circle."""
    own = controller(0.004)
    settings = noiseless(torque=torque, controller=own)
    gain = 10.0 ** (loop_margins(settings, JOINT).gain_margin_db / 20.0)
    for factor, beyond in ((gain * 0.999, False), (gain * 1.001, True)):
        scaled = {name: value / factor for name, value in own.items()}
        radius = spectral_radius(noiseless(torque=torque, controller=scaled), JOINT)
        assert (radius > 1.0) is beyond
        assert radius == pytest.approx(1.0, abs=1e-4)


def test_the_delay_margin_is_the_latency_that_the_loop_bears(noiseless) -> None:
    own = controller(0.003)
    delay_s = loop_margins(noiseless(controller=own), JOINT).delay_margin_s
    assert 0.005 < delay_s < 0.01
    for part, beyond in ((0.98, False), (1.02, True)):
        torque = {"latency_s": 0.001 + part * delay_s}
        radius = spectral_radius(noiseless(torque=torque, controller=own), JOINT)
        assert (radius > 1.0) is beyond


def test_a_phase_margin_is_a_delay_at_its_frequency(noiseless) -> None:
    found = loop_margins(noiseless(controller=controller(0.003)), JOINT)
    assert found.delay_margin_hz == pytest.approx(found.phase_margin_hz)
    assert found.delay_margin_s == pytest.approx(
        math.radians(found.phase_margin_deg) / (2 * math.pi * found.phase_margin_hz)
    )


def test_the_modulus_margin_bounds_the_gain_margin() -> None:
    found = loop_margins(Settings(), JOINT)
    # At the crossing L is −10^(−GM/20), a point on the curve.
    assert found.modulus_margin <= 1.0 - 10.0 ** (-found.gain_margin_db / 20.0) + 1e-6


def test_a_joint_without_stiffness_may_drift() -> None:
    found = loop_margins(Settings(), JointDynamics(0.0045, 0.1368, 0.0))
    assert found.stable
    assert math.isinf(found.phase_margin_deg)  # |L| = B/B_c < 1 everywhere
    assert math.isnan(found.phase_margin_hz)


def test_the_worst_joint_is_the_heaviest_and_worse_than_the_own_one() -> None:
    found = loop_stability(Settings())
    assert list(found.conditions) == list(found.worst) == ["OFF", "DBS"]
    assert found.conditions["OFF"].joint == JOINT
    worst = found.worst["OFF"]
    assert worst.joint.inertia_kg_m2 == pytest.approx(4 * 0.0045)
    assert worst.modulus_margin < found.conditions["OFF"].modulus_margin
    assert worst.gain_margin_db < found.conditions["OFF"].gain_margin_db
    assert found.warnings == ()


def test_margins_below_the_thresholds_are_said() -> None:
    settings = parse_settings({"controller": controller(0.003)})
    own, around, *_ = loop_stability(settings).warnings
    assert own.startswith("the loop with subject OFF (J 0.0045 kg·m², B 0.137 N·m·s/rad, K 1.75")
    assert "a gain margin of 4.6 dB, less than margins.gain_margin_db = 6 dB" in own
    assert "worst joint around subject OFF" in around
    assert around.endswith("is unstable")
    strict = parse_settings({"margins": {"gain_margin_db": 40.0, "phase_margin_deg": 90.0}})
    assert len(loop_stability(strict).warnings) == 4
    both = parse_settings({"controller": controller(0.003), "margins": {"phase_margin_deg": 60.0}})
    assert "and a phase margin of" in loop_stability(both).warnings[0]


def test_a_range_of_one_joint_has_no_other_worst() -> None:
    one = {"joint_factor_low": 1.0, "joint_factor_high": 1.0}
    found = loop_stability(parse_settings({"margins": one}))
    assert found.worst == found.conditions


def test_the_joint_is_that_of_the_condition() -> None:
    assert median_joint(Settings().subject["DBS"]) == JointDynamics(0.0045, 0.119, 1.44)
