"""Wanted differences, epochs needed, and the multisine beside the PRBS."""

import math

import numpy as np
import pytest

from rigidimeter.errors import UserError
from rigidimeter.experiment import (
    Wanted,
    compare_multisine,
    detect,
    epoch_sd,
    foresee,
    planned_epochs,
    prbs_nm,
    predicted_precision,
    ranksum_power,
)
from rigidimeter.settings import Settings, parse_settings

VARIED = {
    "subject": {"OFF": {"voluntary_sd_nm": 0.1, "damping_cv_percent": 20.0}, "DBS": {}},
    "protocol": {"blocks": [{"epochs": 40}, {"epochs": 12, "condition": "DBS"}]},
}


def perturbation(settings: Settings) -> np.ndarray:
    return prbs_nm(settings.prbs, settings.rig.tick_rate_hz)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("damping=20%", Wanted("damping", 20.0, True)),
        ("stiffness=0.3", Wanted("stiffness", 0.3, False)),
        ("inertia = -5 %", Wanted("inertia", -5.0, True)),
    ],
)
def test_a_difference_is_read(text: str, wanted: Wanted) -> None:
    assert Wanted.parse(text) == wanted


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("damping", "names no difference; write inertia, damping or stiffness"),
        ("mass=2", "names no difference"),
        ("damping=", "nothing is not a number other than 0"),
        ("damping=much", "much is not a number other than 0"),
        ("damping=0%", "0% is not a number other than 0"),
        ("damping=nan", "nan is not a number"),
    ],
)
def test_what_is_no_difference_is_a_sentence(text: str, words: str) -> None:
    with pytest.raises(UserError, match=words):
        Wanted.parse(text)


def test_epochs_needed_follow_from_error_and_variation() -> None:
    settings = parse_settings(VARIED)
    found = detect(settings, perturbation(settings), Wanted.parse("damping=20%"))
    off = predicted_precision(perturbation(settings), settings, settings.subject["OFF"])
    assert found.condition == "OFF"
    assert found.cv_percent == 20.0
    assert found.effect.difference == pytest.approx(0.2 * 0.1368)
    assert found.effect.sd_x == pytest.approx(epoch_sd(off.iv.fixed_inertia[0], 0.1368, 20.0))
    assert found.effect.sd_y < found.effect.sd_x
    assert found.needed.power >= 0.8
    assert found.powers[20] == ranksum_power(found.effect, 20, 20)
    assert found.planned == (40, 12)
    assert found.planned_power == ranksum_power(found.effect, 40, 12)
    same = detect(settings, perturbation(settings), Wanted("damping", 0.2 * 0.1368, False))
    assert same.effect.difference == pytest.approx(found.effect.difference)
    assert same.needed.epochs == found.needed.epochs


def test_a_stricter_wish_needs_more() -> None:
    settings = parse_settings(VARIED)
    torque, wanted = perturbation(settings), Wanted.parse("damping=20%")
    base = detect(settings, torque, wanted).needed.epochs
    assert detect(settings, torque, wanted, power=0.95).needed.epochs > base
    assert detect(settings, torque, wanted, alpha=0.01).needed.epochs > base
    assert detect(settings, torque, Wanted.parse("damping=10%")).needed.epochs > 3 * base


def test_the_inertia_has_the_error_of_the_whole_fit() -> None:
    settings = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": 0.1}, "DBS": {}}})
    found = detect(settings, perturbation(settings), Wanted.parse("inertia=10%"))
    whole = predicted_precision(perturbation(settings), settings, settings.subject["OFF"])
    assert found.effect.sd_x == pytest.approx(whole.iv.free[0])
    assert found.planned is None  # the default protocol runs OFF alone
    assert math.isnan(found.planned_power)


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("damping=100%", {}, "leaves nothing of subject.OFF.damping_nm_s_rad = 0.1368"),
        ("stiffness=2", {}, "leaves nothing of subject.OFF.stiffness_nm_rad = 1.751"),
        ("damping=5%", {"power": 1.0}, "--power 1 and --alpha 0.05 must both be between 0 and 1"),
        ("damping=5%", {"alpha": 0.0}, "--power 0.8 and --alpha 0 must both"),
    ],
)
def test_wishes_that_cannot_be_met_are_sentences(text: str, options: dict, words: str) -> None:
    settings = Settings()
    with pytest.raises(UserError, match=words):
        detect(settings, perturbation(settings), Wanted.parse(text), **options)


def test_planned_epochs_are_those_of_the_prbs() -> None:
    assert planned_epochs(Settings()) == {"OFF": 4, "DBS": 0}
    assert planned_epochs(parse_settings(VARIED)) == {"OFF": 40, "DBS": 12}


def test_an_unstable_loop_has_no_precision() -> None:
    settings = parse_settings({"controller": {"inertia_kg_m2": 0.0008, "damping_nm_s_rad": 0.028}})
    found = foresee(settings, perturbation(settings))
    assert found.precision == {}
    assert found.remarks[0] == "subject OFF: no standard errors, since the loop is unstable"


def test_a_condition_without_errors_has_a_remark() -> None:
    settings = parse_settings({"prbs": {"duration_s": 2.0}})
    found = foresee(settings, perturbation(settings))
    assert found.precision == {}
    assert "since estimation.trim_s = 1 s at either end leaves nothing" in found.remarks[0]


def test_the_multisine_beside_the_prbs() -> None:
    settings = Settings()
    found = compare_multisine(settings, perturbation(settings))
    assert 1.4 < found.crest < 1.6
    ours = predicted_precision(perturbation(settings), settings, settings.subject["OFF"])
    its = predicted_precision(found.torque_nm, settings, settings.subject["OFF"])
    errors = found.errors["OFF"]
    assert errors["prbs"] == ours.iv.free
    # Its peak is the amplitude; the PRBS's is that less its mean.
    np.testing.assert_allclose(errors["same_peak_torque"], its.iv.free, rtol=0.02)
    np.testing.assert_allclose(
        errors["same_angle_sd"],
        np.array(its.iv.free) * its.angle_sd_rad / ours.angle_sd_rad,
    )
    np.testing.assert_allclose(
        errors["same_peak_angle"],
        np.array(its.iv.free) * its.peak_angle_rad / ours.peak_angle_rad,
    )
