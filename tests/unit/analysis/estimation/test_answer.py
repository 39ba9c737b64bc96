"""J, B and K beside what else the torque holds, of recordings that the scenarios' rig made.

What the rows of `benchmarks.scenarios` do not have: conditions and epochs that differ in what they
hold, and what is said of a fit that terms were taken from.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest
from tests.scenarios.recordings import measured_alone
from tests.scenarios.scenario import Scenario, scenario

import rigidimeter as rm
from rigidimeter.core.records import Epoch, Fit

REFLEX = {"reflex_nm_s_rad": 0.1, "reflex_delay_s": 0.058, "reflex_sides": 1.0}
STRONG, WEAK = ({**REFLEX, "reflex_nm_s_rad": gain} for gain in (0.3, 0.15))
PUSHING = {"voluntary_nm": 0.2}
RELAXED = scenario("a joint")


def with_reflex(**joint: float) -> Scenario:
    return scenario("a joint with a reflex", joint={**REFLEX, **joint})


def estimated(epochs: Iterable[Epoch], row: Scenario = RELAXED, method: str = "iv"):
    return rm.estimate([*epochs], method, settings=row.analysed_with())


def names(fit: Fit) -> set[str]:
    return {one.name for one in fit.findings}


def assert_right(fits: Iterable[Fit], truth: np.ndarray, percent: float = 1.0) -> None:
    """Assert that there are fits that count, each near the truth by its own interval and by %."""
    for fit in (found := [*fits]):
        assert fit.outcome.included, fit.outcome
        apart = np.abs(fit.value - truth)
        assert np.all(apart < fit.high - fit.low), (fit.epoch, fit.value / truth)
        assert np.all(apart < 0.01 * percent * truth), (fit.epoch, fit.value / truth)
    assert found


@pytest.mark.parametrize("method", ["iv", "bandlimited"])
def test_a_reflex_beside_torque_of_the_subject_is_answered(method):
    row = scenario("a joint", joint=REFLEX, subject=PUSHING)
    (epochs, truth), known = row.simulated(0, 2), method == "iv"
    epochs = epochs if known else [measured_alone(one) for one in epochs]
    found = estimated(epochs, row, method)
    for fit in found.fits:
        (told,) = (one for one in fit.findings if one.name == "missing_term")
        assert told.facts["late_ms"] == pytest.approx(58, abs=1 if known else 3)
        assert told.level == ("note" if known else "caution")
    if known:
        assert_right([*found.fits, *found.pooled], truth[0], percent=1.5)


def test_no_reflex_is_named_where_no_person_is_on_the_axis():
    row = scenario("a bench", joint=REFLEX, settings={"diagnostics": {"subject_present": False}})
    for fit in estimated(row.simulated(0, 2).epochs, row).fits:
        assert "reflex" not in " ".join(one.headline for one in fit.findings)


def test_what_has_no_name_is_told_and_moves_little_or_the_answer_is_withheld():
    row = scenario("a joint", joint={"resist_nm_rad": 0.5, "reflex_delay_s": 0.12, "reflex_hz": 2})
    epochs, truth = row.simulated(0, 2)
    found = estimated(epochs, row)
    for fit in found.fits:
        near = np.abs(fit.value - truth[0]) < fit.high - fit.low + 0.01 * truth[0]
        assert np.all(near) or not fit.outcome.included
        assert "lack_of_fit" in names(fit)


@pytest.mark.parametrize("method", ["iv", "bandlimited"])
def test_an_interval_beside_friction_holds_what_its_form_is_off(method):
    """Without the error of its width B would seem to be known better than it is."""
    epochs, truth = scenario("a joint", joint={"coulomb_nm": 0.1}).simulated(0, 4)
    epochs = epochs if method == "iv" else [measured_alone(one) for one in epochs]
    found = estimated(epochs, method=method)
    assert_right([*found.fits, *found.pooled], truth[0])


@pytest.mark.parametrize(
    "between",
    [
        {"torque": {"late_s": 0.006}},
        {"path": {"lowpass_hz": 100.0}},
        {"joint": {"cuff_nm_rad": 60.0, "cuff_nm_s_rad": 0.05}},
    ],
    ids=["delay", "filter", "coupling"],
)
def test_what_lies_between_the_joint_and_the_sensor_is_undone(between):
    epochs, truth = scenario("a joint", **between).simulated(0, 2)
    found = estimated(epochs)
    assert_right([*found.fits, *found.pooled], truth[0], percent=0.5)
    assert ("missing_term" in names(found.fits[0])) == ("joint" in between)


def test_the_pool_of_all_conditions_has_the_terms_of_each():
    plain, truth = RELAXED.simulated(0, 2)
    reflex = [
        replace(one, condition="ON", label=f"ON {one.label}")
        for one in with_reflex(**STRONG).simulated(0, 2).epochs
    ]
    found = estimated([*plain, *reflex])
    assert [one.condition for one in found.pooled] == ["OFF", "ON", ""]
    assert_right([*found.fits, *found.pooled], truth[0])
    assert ["missing_term" in names(one) for one in found.pooled] == [False, True, True]


def test_reflexes_that_differ_between_epochs_are_answered_epoch_by_epoch():
    strong, weak = (with_reflex(**one).simulated(0, 2) for one in (STRONG, WEAK))
    epochs = [
        replace(one, label=f"{k} {one.label}")
        for k, made in enumerate((strong, weak))
        for one in made.epochs
    ]
    found = estimated(epochs)
    assert_right([*found.fits, *found.pooled], strong.truth[0], percent=0.5)
    sizes = [one.value for fit in found.fits for one in fit.findings if one.name == "missing_term"]
    assert len(sizes) == 4
    assert min(sizes[:2]) > max(sizes[2:])


def test_one_perturbation_among_four_epochs_changes_nothing_for_the_others():
    epochs, truth = with_reflex().simulated(0, 4)
    blind = [measured_alone(one) for one in epochs[:3]]
    alone, beside = (estimated(one, method="bandlimited") for one in (blind, [*blind, epochs[3]]))
    assert len(beside.fits) == 4
    for one, other in zip(alone.fits, beside.fits[:3], strict=True):
        assert names(one) == names(other)
        assert np.all(np.abs(one.value - other.value) < 0.25 * (one.high - one.low))
        assert one.high - one.low == pytest.approx(other.high - other.low, rel=0.5)
    assert_right([*beside.fits, *beside.pooled], truth[0])


@pytest.mark.parametrize("method", ["iv", "bandlimited", "spectral"])
def test_a_soft_finger_is_not_excluded(method):
    soft = {"inertia_kg_m2": 4e-6, "damping_nm_s_rad": 0.0005, "stiffness_nm_rad": 0.03}
    row = scenario("a soft finger", limb="finger", joint=soft)
    epochs, truth = row.simulated(0, 2)
    found = estimated(epochs, row, method)
    assert len(found.fits) == 2
    for fit in [*found.fits, *found.pooled]:
        assert fit.outcome.included, fit.outcome
        assert fit.value[1:] == pytest.approx(truth[0, 1:], rel=0.03)
        (small,) = (one for one in fit.findings if one.level != "note")
        assert (small.name, small.facts["side"]) == ("implausible_parameters", "small")


WEIGHT = {"gravity_nm": 0.5, "gravity_angle_rad": np.pi / 4}
KNOWN = {"diagnostics": {"gravity_nm": 0.5, "gravity_angle_deg": 45.0}}


def test_nothing_is_said_beside_terms_of_what_was_without_them():
    row = scenario("a limb", joint={**STRONG, **WEIGHT}, settings=KNOWN)
    epochs, truth = row.simulated(0, 2)
    known = estimated(epochs, row)
    blind = estimated([measured_alone(one) for one in epochs], row, "bandlimited")
    for fit in [*known.fits, *blind.fits]:
        assert "missing_term" in names(fit)
        assert not names(fit) & {"residual_perturbation", "unweighted_fit", "torque_delay"}
        (weight,) = (one for one in fit.findings if one.name == "gravity")
        assert weight.value == pytest.approx(truth[0, 2], rel=0.01)


def test_what_a_strong_reflex_takes_is_no_movement_of_the_subject_and_no_low_r_squared():
    both = {"reflex_nm_s_rad": 0.4, "reflex_delay_s": 0.06, "reflex_sides": 2.0}
    epochs, _ = scenario("a joint", joint=both).simulated(0, 2)
    for fit in estimated(epochs).fits:
        assert fit.r_squared > 0.99
        assert not names(fit) & {"active_movement", "r_squared"}


@pytest.mark.parametrize("joint", [{}, STRONG], ids=["no term", "a reflex"])
def test_the_error_of_two_clocks_is_in_the_intervals_beside_terms_too(joint):
    """A torque late by δ takes K δ from B, and B δ from J."""
    error_s = 1e-3
    epochs, truth = scenario("two clocks", joint=joint).simulated(0, 2)
    found = estimated([replace(one, clock_error_s=error_s) for one in epochs])
    for fit in [*found.fits, *found.pooled]:
        assert ("missing_term" in names(fit)) == bool(joint)
        assert fit.se[1] > 0.5 * truth[0, 2] * error_s
        assert fit.se[0] > 0.5 * truth[0, 1] * error_s
    assert all(fit.se[1] > 0.2 * truth[0, 2] * error_s for fit in found.fixed_inertia)


def test_epochs_without_a_condition_beside_named_ones_have_their_own_terms():
    plain, _ = RELAXED.simulated(0, 2)
    other, _ = with_reflex(reflex_nm_s_rad=0.3).simulated(1, 2)
    epochs = [replace(one, condition=name) for own, name in ((plain, ""), (other, "ON"))
              for one in own]  # fmt: skip
    for fit in estimated(epochs).fits:
        assert ("missing_term" in names(fit)) == (fit.condition == "ON")


@pytest.mark.parametrize("depth", [0.0, 0.4], ids=["friction", "and damping by the phase"])
def test_friction_turns_with_an_imposed_movement(depth):
    """By the caused motion alone it was damping by the phase, B 115 % too large."""
    moved = {"imposed_rad": 0.2, "imposed_hz": 0.5, "damping_depth": depth}
    made = scenario("friction", joint={"coulomb_nm": 0.1}, subject=moved)
    epochs, truth = made.simulated(0, 2)
    for fit in estimated(epochs).fits:
        assert ("varying_with_phase" in names(fit)) == bool(depth)
        assert fit.value == pytest.approx(truth[0], rel=0.01)


@pytest.mark.parametrize("clock_hz", [20.0, 25.4])
def test_friction_turns_with_a_tremor(clock_hz):
    """Of 1 N·m, which shakes the joint: by the caused motion alone B was 139 % too large.

    Intervals of 45 of 48 such recordings hold B. At 25.4 chips a second the perturbation comes four
    times in an epoch: a quarter later it is the same.
    """
    tremor, again = {"tremor_nm": 1.0}, {"clock_hz": clock_hz}
    made = scenario("friction", joint={"coulomb_nm": 0.1}, subject=tremor, perturbation=again)
    epochs, truth = made.simulated(2, 4)
    (fit,) = estimated(epochs).pooled
    (told,) = (one for one in fit.findings if one.name == "missing_term")
    assert told.facts["size"] == pytest.approx(0.1, rel=0.1)
    error, half = fit.value[1] - truth[0, 1], (fit.high[1] - fit.low[1]) / 2
    assert abs(error) < half < 0.3 * truth[0, 1]


def test_stiffness_by_angle_is_found_beside_a_tremor():
    """By few other times their mean is noise: by three, K was 23 % too large in the mean."""
    made = scenario("e", joint={"cubic_nm_rad3": 40.0}, subject={"tremor_nm": 0.7})
    for recording in range(1, 3):
        epochs, truth = made.simulated(recording, 4)
        (fit,) = estimated(epochs).pooled
        assert "varying_with_angle" in names(fit)
        assert_right([fit], truth[0], percent=12.0)


def test_a_perturbation_that_the_motion_does_not_follow_is_no_instrument_of_terms():
    made = scenario("friction", joint={"coulomb_nm": 0.1})
    epochs, truth = made.simulated(0, 2)
    rng = np.random.default_rng(3)
    other = []
    for one in epochs:
        channel = one.channels["perturbation_nm"]
        unlike = replace(channel, values=rng.permutation(channel.values))
        other.append(replace(one, channels={**one.channels, channel.name: unlike}))
    found = estimated(other, made, "auto")
    assert found.method == "bandlimited"
    assert_right(found.fits, truth[0])


def test_without_a_perturbation_a_late_torque_is_told_and_friction_stays():
    """1 ms late takes K times that, 1.3 %, from B, and what it does by the loop; friction 183 %."""
    made = scenario("friction", joint={"coulomb_nm": 0.1}, torque={"late_s": 0.001})
    epochs, truth = made.simulated(0, 2)
    found = estimated([measured_alone(one) for one in epochs], made, "bandlimited")
    for fit in found.fits:
        assert {"missing_term", "torque_delay"} <= names(fit)
        assert abs(fit.value[1] / truth[0, 1] - 1) < 0.25
