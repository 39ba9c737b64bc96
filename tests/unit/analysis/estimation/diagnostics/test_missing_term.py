"""What a term that is left out does to J, B and K, and what the finding says of it."""

from dataclasses import replace

import numpy as np
import pytest
from tests.scenarios.catalogue import SCENARIOS
from tests.scenarios.recordings import measured_alone
from tests.scenarios.scenario import scenario

from rigidimeter.analysis.estimation.diagnostics import checked
from rigidimeter.analysis.estimation.methods import method_named
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.analysis.reading import data
from rigidimeter.analysis.study import estimate

JOINTS = {
    "friction": {"coulomb_nm": 0.1},
    "reflex": {"reflex_nm_s_rad": 0.15, "reflex_delay_s": 0.045},
    "directional damping": {"damping_asymmetry": 0.5},
    "cubic stiffness": {"cubic_nm_rad3": 40.0},
    "coupling": {"cuff_nm_rad": 60.0, "cuff_nm_s_rad": 0.05},
    "a reflex": {
        "reflex_nm_s_rad": 0.3,
        "reflex_delay_s": 0.06,
        "reflex_sides": 2.0,
    },
}


def fitted(method, joint=None, subject=None, seed=1):
    made = scenario("one", joint=joint or {}, subject=subject or {})
    (epoch,), (truth,) = made.simulated(seed, 1)
    if method == "bandlimited":
        epoch = measured_alone(epoch)
    (prepared,) = prepare([epoch], made.analysed_with())
    (fit,), _ = method_named(method).fit([prepared], None, lambda _: None, False)
    found = {finding.name: finding for finding in checked(prepared, fit).findings}
    return fit, truth, found


@pytest.mark.parametrize("method", ["iv", "bandlimited"])
@pytest.mark.parametrize("term", list(JOINTS))
def test_a_term_is_named_and_its_bias_told(method, term):
    fit, truth, found = fitted(method, JOINTS[term])
    finding = found["missing_term"]
    assert finding.facts.get("terms", finding.facts.get("variant")) == term
    assert finding.level == "caution"
    asked = f"inertia,{'' if term == 'directional damping' else 'damping,'}stiffness,"
    assert term == "coupling" or finding.facts["asked"].startswith(asked)
    # The effect is a share of what the parameter is beside the term.
    included = fit.value / (1.0 + np.array(finding.effect.percent) / 100.0)
    error, corrected = fit.value / truth - 1, included / truth - 1
    for i in range(3):
        assert abs(corrected[i]) < max(0.4 * abs(error[i]), 0.06), "JBK"[i]


def test_each_epoch_of_a_recording_without_velocity_has_its_bias_told():
    """Epochs that begin later on one clock too: the reflex takes a third off B in all three."""
    fits = estimate(data("reflex"), "iv").fits
    effects = [f.effect.percent for fit in fits for f in fit.findings if f.name == "missing_term"]
    assert len(effects) == len(fits) == 3
    for fit, (_, percent_b, _) in zip(fits, effects, strict=True):
        assert percent_b == pytest.approx(-34.0, abs=4.0)
        assert fit.damping_nm_s_rad / (1.0 + percent_b / 100.0) == pytest.approx(0.1368, rel=0.05)


def test_what_follows_the_perturbation_is_not_said_to_leave_the_estimate_unbiased():
    """A reflex of both directions: K of `iv` is more than twice the joint's own."""
    fit, truth, found = fitted("iv", JOINTS["a reflex"])
    assert fit.value[2] > 2 * truth[2]
    assert found["residual_perturbation"].facts["variant"] == "chance"
    assert np.isnan(found["residual_perturbation"].effect.percent).all()


@pytest.mark.parametrize("method", ["iv", "bandlimited"])
@pytest.mark.parametrize("subject", [{}, {"voluntary_nm": 0.2}, {"tremor_nm": 0.3}])
def test_no_term_is_missing_in_a_joint_of_j_b_and_k(method, subject):
    *_, found = fitted(method, subject=subject, seed=2)
    assert "missing_term" not in found


def test_a_term_that_moves_less_than_the_intervals_is_a_note():
    made = scenario("one", joint={"coulomb_nm": 0.02})
    (epoch,), _ = made.simulated(1, 1)
    (prepared,) = prepare([epoch], made.analysed_with())
    (fit,), _ = method_named("iv").fit([prepared], None, lambda _: None, False)
    for width, level in ((0.05, "caution"), (0.5, "note")):
        wide = replace(fit, low=(1 - width) * fit.value, high=(1 + width) * fit.value)
        (finding,) = (f for f in checked(prepared, wide).findings if f.name == "missing_term")
        assert finding.level == level
        assert (finding.facts.get("variant") == "within") == (level == "note")
        assert np.max(np.abs(finding.effect.half_intervals)) == pytest.approx(finding.value / 100)


class TestTremor:
    @pytest.mark.parametrize("method", ["iv", "bandlimited", "published"])
    def test_a_tremor_is_told_with_its_frequency_and_size(self, method):
        *_, found = fitted(method, subject={"tremor_nm": 0.3, "tremor_hz": (5.0, 5.0)})
        finding = found["tremor"]
        assert finding.facts["frequency_hz"] == pytest.approx(5.0, abs=0.3)
        assert finding.facts["amplitude_nm"] == pytest.approx(0.3, rel=0.25)
        # Where each frequency counts by its noise, it does not bias the estimate.
        assert finding.level == ("caution" if method == "published" else "note")

    @pytest.mark.parametrize(
        "subject", [{}, {"voluntary_nm": 0.2}, {"voluntary_nm": 0.5}, {"bursts_nm": 0.3}]
    )
    def test_what_is_no_tremor_is_none(self, subject):
        *_, found = fitted("bandlimited", subject=subject, seed=4)
        assert "tremor" not in found


@pytest.mark.parametrize(("coulomb_nm", "said"), [(0.002, True), (0.02, False)])
def test_so_little_friction_may_be_the_drives(coulomb_nm, said):
    _, _, found = fitted("bandlimited", {"coulomb_nm": coulomb_nm})
    finding = found["missing_term"]
    assert finding.facts["terms"] == "friction"
    assert (finding.facts.get("variant") == "of_drive") == said


@pytest.mark.parametrize(
    ("name", "doubted"),
    [("friction in the drive 3 N·m", True), ("friction in the joint 0.02 N·m", False)],
)
def test_without_the_command_friction_of_the_drive_leaves_the_inertia_uncertain(name, doubted):
    """J is 6 % too small with that drive, and its interval does not say so."""
    (epoch,), _ = SCENARIOS[name].simulated(0, 1)
    settings = SCENARIOS[name].analysed_with()
    (fit,) = estimate([measured_alone(epoch)], "bandlimited", settings=settings).fits
    doubts = {finding.name for finding in fit.findings if finding.level == "caution"}
    assert "missing_term" in doubts
    assert ("between_samples" in doubts) == doubted


def test_what_goes_with_the_angle_and_misses_a_term_may_have_one_cause():
    _, _, found = fitted("iv", JOINTS["cubic stiffness"])
    finding = found["varying_with_angle"]
    assert finding.level == "caution"
    assert (finding.facts["variant"], finding.facts["terms"]) == ("with_term", "cubic stiffness")
