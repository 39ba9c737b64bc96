"""The paper's numbers on the perturbations and the arm's bandwidth."""

import math

import numpy as np
import pytest

from rigidimeter.core.settings import (
    ControllerSettings,
    GuardSettings,
    PrbsSettings,
    ScoreSettings,
    SinusoidSettings,
    parse_settings,
)
from rigidimeter.model import JointDynamics, loop_margins, loop_stability
from rigidimeter.planning import (
    APPENDIX_A,
    check_band,
    corners,
    demand,
    ideal_response,
    power_spectrum,
    prbs_nm,
    predicted_precision,
    sinusoid,
    time_constant_s,
)

MEDIAN_JOINT = JointDynamics(0.0045, 0.1368, 1.751)  # Sec. 3.4
APP_A_INERTIA_PARTS = (8.6625e-4, 4e-3, 0.0008)
APP_A_DAMPING_PARTS = (0.06, 0.028)


def test_equation_8_is_half_of_the_nominal_arm_and_has_3_44_hz() -> None:
    corner = corners().equation_8
    assert vars(corner.joint) == pytest.approx(
        {"inertia_kg_m2": 0.0026, "damping_nm_s_rad": 0.044, "stiffness_nm_rad": 0.75}
    )
    assert corner.bandwidth_hz == pytest.approx(3.44, abs=0.005)
    assert round(corner.bandwidth_hz * 2) / 2 == 3.5  # as printed, to half a hertz


def test_the_widest_corner_is_twice_as_wide_as_the_papers() -> None:
    table = corners()
    assert table.widest.signs == (-1, -1, 1)
    assert table.widest.bandwidth_hz == pytest.approx(6.84, abs=0.005)
    assert table.equation_8.bandwidth_hz == pytest.approx(table.nominal.bandwidth_hz)


def test_the_printed_slips_of_appendix_a() -> None:
    assert sum(APP_A_DAMPING_PARTS) == pytest.approx(APPENDIX_A.damping_nm_s_rad)
    assert APPENDIX_A.damping_nm_s_rad == 0.088  # printed: 0.0088
    assert sum(APP_A_INERTIA_PARTS) == pytest.approx(0.00567, abs=5e-6)
    assert APPENDIX_A.inertia_kg_m2 == 0.0052


def test_both_corners_lie_inside_the_excited_band() -> None:
    table = corners()
    assert check_band(PrbsSettings(), 1000.0).half_power_hz > table.widest.bandwidth_hz


def test_seven_bits_at_20_hz_cover_0_15_to_10_hz() -> None:
    check = check_band(PrbsSettings(), 1000.0)
    assert check.line_spacing_hz == pytest.approx(0.1575, abs=5e-5)
    assert check.lines_in_band == 63
    assert check.power_high_db == pytest.approx(-3.92, abs=0.005)
    assert check.half_power_hz == pytest.approx(8.86, abs=0.005)
    assert check.drop_edge_hz == pytest.approx(12.05, abs=0.005)
    assert check.covered


def test_a_clock_of_22_6_hz_puts_half_power_at_10_hz() -> None:
    check = check_band(PrbsSettings(clock_hz=22.6), 1000.0)
    assert check.half_power_hz == pytest.approx(10.0, abs=0.02)
    assert check.covered


def test_most_of_the_power_lies_in_the_band() -> None:
    # ∫ sinc² from 0 to half the clock is 0.387 of 0.5
    torque = prbs_nm(PrbsSettings(), 1000.0)
    assert power_spectrum(torque, 1000.0).share(0.15, 10.0) == pytest.approx(0.774, abs=0.01)
    assert np.std(torque) == pytest.approx(1.0, abs=0.001)


@pytest.mark.parametrize("clock_hz", [20.0, 22.6])
def test_position_sd_tells_per_degree_from_per_radian(clock_hz: float) -> None:
    """Sec. 2.4.3 reports about 4 deg: 4–6 read per degree, 15–22 read per radian."""
    torque = prbs_nm(PrbsSettings(clock_hz=clock_hz), 1000.0)
    sd_deg = []
    for controller in (
        ControllerSettings(),
        ControllerSettings(inertia_kg_m2=0.0008, damping_nm_s_rad=0.028),
    ):
        motion = ideal_response(torque, controller, MEDIAN_JOINT, 1000.0)
        needs = demand(*motion, 1000.0, GuardSettings())
        sd_deg.append(math.degrees(needs.angle_sd_rad))
    assert 4.0 < sd_deg[0] < 6.0
    assert 15.0 < sd_deg[1] < 22.0


def test_the_loop_tells_per_degree_from_per_radian() -> None:
    """20 Hz filter and 40 Hz drive: stable read per degree, unstable read per radian."""
    rig = {"rig": {"drive_bandwidth_hz": 40.0}, "guard": {"reaction_time_s": 0.03}}
    per_radian = {"controller": {"inertia_kg_m2": 0.0008, "damping_nm_s_rad": 0.028}}
    per_degree = loop_stability(parse_settings(rig))
    for margins in (*per_degree.conditions.values(), *per_degree.worst.values()):
        assert margins.stable
        assert margins.gain_margin_db > 10.0
    assert not loop_margins(parse_settings({**rig, **per_radian}), MEDIAN_JOINT).stable


def test_voluntary_torque_puts_least_squares_off_as_predicted() -> None:
    """0.2 N·m in 0.3–4 Hz makes B come out 64 % and J 40 % too low, by how wide the band is.

    Above the voluntary torque the motion is the perturbation's own, and more of it helps.
    """
    off = []
    for high_hz in (10.0, 50.0):
        settings = parse_settings(
            {
                "subject": {"OFF": {"voluntary_sd_nm": 0.2}},
                "estimation": {"band_high_hz": high_hz},
            }
        )
        torque = prbs_nm(settings.prbs, 1000.0)
        found = predicted_precision(torque, settings, settings.subject["OFF"])
        off.append(np.array(found.least_squares_bias) / found.values)
    narrow, wide = off
    assert narrow[0] < -0.40 < wide[0] < 0.0
    assert narrow[1] < -0.64 < wide[1] < -0.60


def test_white_noise_gives_the_cramer_rao_ratio_and_not_that_of_section_3_4() -> None:
    """SD(J) : SD(B) : SD(K) is about 0.005 : 0.19 : 1; the printed SDs are nearly equal."""
    settings = parse_settings({})
    torque = prbs_nm(settings.prbs, 1000.0)
    found = predicted_precision(torque, settings, settings.subject["OFF"]).bound.free
    assert found[0] / found[2] == pytest.approx(0.005, rel=0.2)
    assert found[1] / found[2] == pytest.approx(0.19, rel=0.1)
    printed = (9.6e-7, 1.05e-6, 1.4e-6)
    assert printed[0] / printed[2] > 100 * found[0] / found[2]


def test_controller_per_radian_and_its_time_constant() -> None:
    controller = ControllerSettings()
    assert controller.inertia_kg_m2 == pytest.approx(0.0458, abs=5e-5)
    assert controller.damping_nm_s_rad == pytest.approx(1.604, abs=5e-4)
    assert time_constant_s(controller) == pytest.approx(0.0008 / 0.028)


def test_the_sinusoid_leaves_eight_pure_cycles() -> None:
    """Sec. 2.3: ±20 deg at 1 Hz, 10 s of motion, first and last second discarded."""
    settings, scores = SinusoidSettings(), ScoreSettings()
    angle, velocity = sinusoid(settings, 1000.0)
    kept = slice(
        round(scores.discard_s * 1000), round((settings.motion_s - scores.discard_s) * 1000)
    )
    time_s = np.arange(angle.size)[kept] / 1000.0
    pure = math.radians(20.0) * np.sin(2 * np.pi * time_s)
    np.testing.assert_allclose(angle[kept], pure, atol=1e-14)
    assert time_s.size / 1000.0 * settings.frequency_hz == scores.cycles == 8
    assert np.max(np.abs(velocity)) == pytest.approx(math.radians(125.66), rel=1e-4)
