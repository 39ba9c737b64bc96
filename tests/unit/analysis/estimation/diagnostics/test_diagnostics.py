"""Each check on an epoch that is sound, and on one in which what it looks for was put."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.analysis.estimation.diagnostics.sound_epoch import (
    SETTINGS,
    TRUTH,
    T,
    assert_failed,
    judged,
    passed,
    sound,
)

from rigidimeter.analysis.estimation.diagnostics import (
    CHECKS,
    Case,
    Check,
    at_most,
    channel_checks,
    diagnose,
    fit_checks,
    movement_checks,
)
from rigidimeter.core.records import Channel

__all__ = ["sound"]
active_movement = judged(movement_checks.active_movement)
implausible_parameters = judged(fit_checks.implausible_parameters)
negative_parameters = judged(fit_checks.negative_parameters)
position_limit = judged(channel_checks.position_limit)


def test_a_sound_epoch_passes_every_check(sound):
    findings = diagnose(Case(*sound, SETTINGS, 1.0))
    assert [finding for finding in findings if not passed(finding)] == []
    assert len(findings) > 12


def test_a_value_beyond_its_limit_does_not_read_as_the_limit():
    most, least = SETTINGS.max_position_percent, SETTINGS.min_r_squared
    assert (most, least) == (98.0, 0.3)
    near = Channel("angle_rad", T, np.full(T.size, 0.49021))
    assert_failed(position_limit(near, 0.5, SETTINGS), "98.04 % of the position", "(at most 98 %)")
    low = fit_checks.r_squared(0.2996, SETTINGS)
    assert (low.failed, low.fact) == (True, "R² is 0.2996 (at least 0.3)")
    assert fit_checks.r_squared(0.3, SETTINGS).fact == "R² is 0.3 (at least 0.3)"


def test_negative_parameters_are_named_with_what_is_likely():
    assert passed(negative_parameters(TRUTH))
    one = negative_parameters((0.0045, -0.1, 1.7))
    assert_failed(one, "B is not above zero", "something but the robot may have pushed")
    turned = negative_parameters((-0.0045, -0.1, -1.7))
    assert_failed(turned, "J and B and K", "sign of the joint's reaction")
    assert "--reaction" in turned.remedy
    assert negative_parameters((math.nan, 1.0, 1.0)).value == 1.0
    by_noise = negative_parameters((-4e-4, -0.007, -0.12), np.array([8e-4, 0.03, 0.14]))
    assert_failed(by_noise, "J and B and K", "the torque says little of a joint")
    assert "--reaction" not in by_noise.remedy


@pytest.mark.parametrize(
    ("parameters", "words", "factor"),
    [
        ((5.0, 0.1, 1.0), "J = 5 kg·m² is large", 5.0),
        ((1e-6, 0.1, 1.0), "J = 1e-06 kg·m² is small", 10.0),
        ((-1e-6, 0.1, 1.0), "J = -1e-06 kg·m² is small", 10.0),
        ((0.01, 100.0, 1.0), "B = 100 N·m·s/rad is large", 2.0),
        ((0.01, 0.1, 6000.0), "K = 6e+03 N·m/rad is large", 3.0),
    ],
)
def test_sizes_that_no_joint_has_are_told(parameters, words, factor):
    finding = implausible_parameters(parameters, SETTINGS)
    assert_failed(finding, words)
    assert finding.value == pytest.approx(factor)


def test_a_check_from_outside_is_one_entry(sound):
    def loud(case):
        peak_nm = float(np.max(np.abs(case.epoch.channels["torque_nm"].values)))
        return at_most(peak_nm, 0.01, f"the torque reaches {peak_nm:.1f} N·m")

    toy = Check("loud", ("torque_nm",), loud, "that is much", "push less")
    never = Check("never", ("emg_v",), loud, "", "")
    CHECKS.extend([toy, never])
    try:
        found = {f.name: f for f in diagnose(Case(*sound, SETTINGS))}
    finally:
        del CHECKS[-2:]
    assert (found["loud"].level, found["loud"].remedy) == ("doubt", "push less")
    assert found["loud"].text.endswith("N·m: that is much")
    assert "never" not in found


def test_sentences_of_findings_hold_for_an_axis_on_a_bench_too():
    """Only an EMG says that there is a person."""
    for check in CHECKS:
        if check.name != "emg_activity":
            assert "subject" not in f"{check.meaning} {check.remedy}"


def test_what_is_much_for_an_elbow_is_little_for_an_ankle(sound):
    signals = sound[1]
    own = 0.5 * np.sin(2 * np.pi * signals.time_s)
    assert active_movement(own, signals, SETTINGS).value > 80.0
    ankle = replace(signals, torque_nm=20 * signals.torque_nm)
    assert active_movement(own, ankle, SETTINGS).value == 0.0
