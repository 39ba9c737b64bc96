"""Each check on an epoch that is sound, and on one in which what it looks for was put."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.analysis.estimation.diagnostics.sound_epoch import (
    SETTINGS,
    TRUTH,
    N,
    T,
    assert_failed,
    fitted,
    judged,
    passed,
    pushed,
    sound,
    with_channel,
)

from rigidimeter.analysis.estimation import fit_inertia_damping_stiffness
from rigidimeter.analysis.estimation.bandlimited import BANDLIMITED
from rigidimeter.analysis.estimation.diagnostics import (
    CHECKS,
    Case,
    Check,
    at_most,
    channel_checks,
    diagnose,
    fit_checks,
    reconstructed_torque_nm,
)
from rigidimeter.core.records import Channel, Ticks
from rigidimeter.core.settings import (
    ControllerSettings,
    DiagnosticLevels,
    DiagnosticsSettings,
    RigSettings,
)
from rigidimeter.model import Loop

__all__ = ["pushed", "sound"]

LOOP = Loop(ControllerSettings(), RigSettings())
frozen = judged(channel_checks.frozen)
guard_limited = judged(channel_checks.guard_limited)
held_out_vaf = judged(fit_checks.held_out_vaf)
implausible_parameters = judged(fit_checks.implausible_parameters)
negative_parameters = judged(fit_checks.negative_parameters)
position_limit = judged(channel_checks.position_limit)
residual_perturbation = judged(fit_checks.residual_perturbation)
residual_whiteness = judged(fit_checks.residual_whiteness)
saturation = judged(channel_checks.saturation)


def test_a_sound_epoch_passes_every_check(sound):
    findings = diagnose(Case(*sound, SETTINGS, 1.0))
    assert [finding for finding in findings if not passed(finding)] == []
    assert len(findings) > 12


def test_every_level_that_can_be_set_belongs_to_a_check(sound):
    epoch, signals, parameters = sound
    emg = with_channel(epoch, "emg_v", 1e-5 * np.random.default_rng(1).standard_normal(N))
    case = Case(
        replace(
            with_channel(emg, "velocity_command_rad_s", emg.channels["velocity_rad_s"].values),
            ticks=Ticks(N, 0, 0),
        ),
        signals,
        parameters,
        SETTINGS.model_copy(update={"gravity_nm": 0.1}),
        1.0,
        fit=fit_inertia_damping_stiffness(signals),
        method=BANDLIMITED,
        loop=LOOP,
        unbiased=TRUTH,
    )
    findings = diagnose(case)
    names = [finding.name for finding in findings]
    # What is found where epochs are fitted; what varies within one, terms that are missing, and the
    # controller are looked for in a prepared epoch (test_varying, test_missing_term,
    # test_controller_checks).
    varying = [name for name in DiagnosticLevels.model_fields if name.startswith("varying_")]
    of_fits = [
        "lack_of_fit",
        "band_sensitivity",
        "between_samples",
        "torque_delay",
        "missing_term",
        "controller_misfit",
        *varying,
    ]
    assert sorted([*names, *of_fits]) == sorted(DiagnosticLevels.model_fields)


def test_what_was_not_recorded_is_not_checked(sound):
    epoch, signals, parameters = sound
    bare = replace(epoch, channels={n: epoch.channels[n] for n in ("torque_nm", "angle_rad")})
    names = {finding.name for finding in diagnose(Case(bare, signals, parameters, SETTINGS))}
    assert not names & {
        "coherence", "residual_perturbation", "emg_activity", "guard_limited", "position_limit",
    }  # fmt: skip


def test_white_in_the_band_is_flat_and_tremor_is_not(sound):
    signals = sound[1]
    rng = np.random.default_rng(6)
    n = signals.time_s.size
    flat = [residual_whiteness(rng.standard_normal(n), signals, SETTINGS).value for _ in range(40)]
    assert min(flat) > 0.85
    assert 0.97 < np.mean(flat) <= 1.0
    tremor = rng.standard_normal(n) + 3.0 * np.sin(2 * np.pi * 5.0 * signals.time_s)
    assert_failed(residual_whiteness(tremor, signals, SETTINGS), "coloured")
    assert_failed(residual_whiteness(np.zeros(n), signals, SETTINGS))


def test_a_delay_that_the_model_lacks_follows_the_perturbation(sound):
    epoch, signals, parameters = sound
    residual = -reconstructed_torque_nm(signals, parameters)
    assert passed(residual_perturbation(epoch, residual, signals, SETTINGS))
    late = with_channel(epoch, "torque_nm", np.roll(epoch.channels["torque_nm"].values, 6))
    signals, parameters = fitted(late)
    residual = -reconstructed_torque_nm(signals, parameters)
    assert_failed(residual_perturbation(late, residual, signals, SETTINGS), "the model lacks")


def test_the_lag_of_what_is_left_over_is_told(sound):
    epoch, signals, _ = sound
    rate = signals.rate_hz
    cause = np.interp(signals.time_s - 0.2, T, epoch.channels["perturbation_nm"].values)
    finding = residual_perturbation(epoch, cause, signals, SETTINGS)
    lag_s = float(finding.text.split("lag of ")[1].split(" s")[0])
    assert lag_s == pytest.approx(0.2, abs=2 / rate)


def test_what_does_not_last_is_not_foreseen(sound):
    signals = sound[1]
    assert held_out_vaf(signals, SETTINGS).value > 95.0
    half = signals.time_s.size // 2
    turned = np.concatenate([signals.torque_nm[:half], -signals.torque_nm[half:]])
    finding = held_out_vaf(replace(signals, torque_nm=turned), SETTINGS)
    assert_failed(finding, "explain")
    assert finding.value == pytest.approx(-300.0, rel=0.1)  # 1 − var(2 M)/var(M)


def test_a_clipped_channel_is_excluded(sound):
    epoch = sound[0]
    torque = epoch.channels["torque_nm"].values
    clipped = np.clip(torque, -0.6 * np.max(torque), 0.6 * np.max(torque))
    finding = saturation(with_channel(epoch, "torque_nm", clipped), SETTINGS)
    assert_failed(finding, "torque_nm repeats its extreme values")
    assert finding.level == "exclude"
    assert saturation(epoch, SETTINGS).value == 0.0


def test_a_sensor_that_hung_is_excluded_and_the_place_is_told(sound):
    epoch = sound[0]
    velocity = epoch.channels["velocity_rad_s"].values.copy()
    velocity[1000:1101] = velocity[1000]
    finding = frozen(with_channel(epoch, "velocity_rad_s", velocity), SETTINGS)
    assert_failed(finding, "velocity_rad_s", "from 5 s")
    assert finding.value == pytest.approx(0.5)
    assert finding.level == "exclude"


def test_the_guard_and_the_position_limit_are_counted(sound):
    limited = guard_limited(Ticks(1000, 0, 0, limited=50), SETTINGS)
    assert limited.value == pytest.approx(5.0)
    assert_failed(limited, "5 % of the commands")
    angle = Channel("angle_rad", T, 0.5 * np.sin(T))
    assert_failed(position_limit(angle, 0.5, SETTINGS), "100 % of the position limit of 28.6 deg")
    assert passed(position_limit(angle, 0.7, SETTINGS))


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


def test_a_level_is_what_the_settings_say():
    levels = DiagnosticLevels(negative_parameters="exclude")
    settings = DiagnosticsSettings(levels=levels)
    assert negative_parameters((1.0, -1.0, 1.0), settings=settings).level == "exclude"


def test_a_subject_who_pushes_raises_doubt(pushed):
    found = {f.name: f.level for f in diagnose(Case(*pushed, SETTINGS))}
    assert found["voluntary_torque"] == "doubt"
    assert found["active_movement"] == "doubt"
    assert found["frozen"] == found["saturation"] == "note"


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
