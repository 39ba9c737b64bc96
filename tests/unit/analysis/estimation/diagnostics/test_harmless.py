"""A failure that does not move J, B and K of the method used is a note."""

from dataclasses import replace

import numpy as np
import pytest
from tests.scenarios.catalogue import SCENARIOS
from tests.scenarios.recordings import measured_alone

import rigidimeter as rm
from rigidimeter.analysis.estimation import fit_epochs
from rigidimeter.analysis.estimation.diagnostics import checked
from rigidimeter.analysis.estimation.diagnostics.least_squares_checks import loop_bias
from rigidimeter.analysis.estimation.found import found as made
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.core.findings import Effect
from rigidimeter.core.records import Fit, Outcome
from rigidimeter.core.settings import DiagnosticsSettings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_epochs

JOINT = JointDynamics(0.0045, 0.1368, 1.751)


def found(method, subject, levels=None):
    settings = parse_settings(
        {"subject": {"OFF": subject}, "diagnostics": {"levels": levels or {}}}
    )
    epochs = [simulate_epochs(settings, 1, joints=[JOINT], conditions="OFF", seed=3).epoch(0)]
    (fit,), _ = fit_epochs(epochs, method, settings)
    (prepared,) = prepare(epochs, settings)
    return {f.name: f for f in checked(prepared, fit).findings}


@pytest.mark.parametrize("level", ["note", "exclude"])
def test_a_level_that_was_set_is_used_in_any_case(level):
    by_iv = found("iv", {"voluntary_sd_nm": 0.2}, {"voluntary_torque": level})
    assert by_iv["voluntary_torque"].level == level


@pytest.mark.parametrize(
    ("push_nm", "r_squared", "doubted"), [(0.5, 0.29, True), (0.5, 0.31, False), (0.0, 0.29, True)]
)
def test_a_small_r_squared_asks_for_caution_without_weights(push_nm, r_squared, doubted):
    settings = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": push_nm}}})
    epochs = [simulate_epochs(settings, 1, joints=[JOINT], conditions="OFF", seed=3).epoch(0)]
    (prepared,) = prepare(epochs, settings)
    for method, level in (("published", "caution"), ("bandlimited", "note"), ("iv", "note")):
        (fit,), _ = fit_epochs(epochs, method, settings)
        findings = checked(prepared, replace(fit, r_squared=r_squared)).findings
        assert [f.level for f in findings if f.name == "r_squared"] == [level] * doubted
    assert np.isfinite(fit.value).all()


SMALL = Effect((0.4, -0.9, 0.0), (0.8, -0.7, 0.0))


@pytest.mark.parametrize(
    ("effect", "levels", "level"),
    [
        (SMALL, {}, "note"),
        (Effect((0.4, 1.2, 0.0), (0.8, 0.7, 0.0)), {}, "caution"),
        (Effect((0.4, 0.9, 0.0), (0.8, 1.7, 0.0)), {}, "caution"),
        (Effect((0.4, 0.9, np.nan), (0.8, 0.7, np.nan)), {}, "caution"),
        (SMALL, {"loop_bias": "exclude"}, "exclude"),
    ],
    ids=["small", "over 1 %", "beyond the interval", "one unknown", "set by the user"],
)
def test_the_level_follows_what_a_finding_does_to_the_answer(effect, levels, level):
    settings = DiagnosticsSettings.model_validate({"levels": levels})
    finding = made("loop_bias", settings, 80.0, 50.0, effect=effect)
    assert finding.level == level
    assert ("below 1 % of each" in finding.details) == (level == "note")


def test_a_bias_of_the_loop_below_a_percent_and_the_interval_is_a_note():
    """80 % of half the interval passes the limit of 50 %, and is 0.8 % of K."""
    value = np.array([0.0045, 0.1368, 1.751])
    fit = Fit(
        "a", "1", "OFF", "bandlimited", Outcome(), value=value, low=0.99 * value, high=1.01 * value
    )
    for percent, level in ((0.8, "note"), (1.2, "caution")):
        unbiased = value * [1.0, 1.0, 1 - percent / 100]
        look = loop_bias(fit, unbiased, False, DiagnosticsSettings())
        assert look.failed
        beside = percent / (1 - percent / 100)
        assert look.effect.percent == pytest.approx((0.0, 0.0, beside))
        assert look.effect.half_intervals == pytest.approx((0.0, 0.0, percent))
        finding = made(
            "loop_bias", DiagnosticsSettings(), look.value, look.limit, effect=look.effect
        )
        assert finding.level == level


@pytest.mark.parametrize(("percent", "failed"), [(4.9, False), (5.1, True)])
def test_a_bias_that_the_interval_holds_fails_above_five_percent(percent, failed):
    """All of half the interval is bias, which passes the limit of 50 %."""
    value, share = np.array([0.0045, 0.1368, 1.751]), percent / 100
    ends = {"low": (1 - share) * value, "high": (1 + share) * value}
    fit = Fit("a", "1", "OFF", "bandlimited", Outcome(), value=value, **ends)
    unbiased = value * [1.0, 1 - share, 1.0]
    assert loop_bias(fit, unbiased, True, DiagnosticsSettings()).failed == failed
    assert loop_bias(fit, unbiased, False, DiagnosticsSettings()).failed


@pytest.mark.parametrize("method", ["iv", "published"])
def test_a_push_says_what_it_does_to_the_method_used(method):
    push = found(method, {"voluntary_sd_nm": 0.3})
    effect = push["voluntary_torque"].effect
    if method == "iv":
        assert effect.percent == effect.half_intervals == (0.0, 0.0, 0.0)
    else:
        assert effect == push["loop_bias"].effect
        assert 100 * np.max(np.abs(effect.half_intervals)) == pytest.approx(push["loop_bias"].value)


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("relaxed", False),
        ("voluntary 0.2 N·m", False),
        ("tremor 0.3 N·m", False),
        ("reflex 60 ms, 0.15", True),
    ],
)
def test_weights_move_the_answer_only_where_the_model_lacks_something(row, said):
    scenario = SCENARIOS[row]
    epochs, _ = scenario.simulated(0, 4)
    analysis = rm.estimate(
        [measured_alone(epoch) for epoch in epochs],
        "bandlimited",
        settings=scenario.analysed_with(),
    )
    names = [[finding.name for finding in fit.findings] for fit in analysis.fits]
    assert ["unweighted_fit" in own for own in names] == [said] * 4
