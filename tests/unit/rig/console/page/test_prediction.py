"""From a design to sentences that say what to do."""

import pytest

from rigidimeter.core.settings import MarginsSettings, parse_settings
from rigidimeter.planning import design, design_document
from rigidimeter.rig.console.page import dry_run_lines, prediction_lines

TWO = [{"condition": "OFF", "epochs": 4}, {"condition": "DBS", "epochs": 4}]


def lines(differences=("stiffness=20%",), **tables):
    settings = parse_settings(tables)
    document = design_document(design(settings, differences=list(differences)))
    return document, prediction_lines(document, settings.margins)


def test_the_planned_epochs_of_a_condition_have_an_interval():
    """1.96 SE of the mean of four epochs, as a share of the value."""
    document, said = lines(protocol={"blocks": TWO})
    found = document["precision"]["OFF"]
    share = 1.96 * found["iv"]["free"]["stiffness_nm_rad"] / 4**0.5 / 1.751
    assert f"OFF: 4 epochs give J ± 0.061 %, B ± 0.062 %, K ± {100 * share:.2g} %" in said[1]
    assert said[2].startswith("DBS: 4 epochs give J ± ")
    assert said[0].startswith("✓ The loop is stable; smallest margins 28.3 dB and 92 deg (6 dB")
    assert said[3].startswith("✓ 4 epochs a condition show a difference of 0.35 in the stiffness")
    assert said[3].endswith("the 4 and 4 planned are enough.")


def test_too_few_epochs_are_said_with_the_number_that_is_needed():
    subject = {
        "OFF": {"stiffness_cv_percent": 30.0},
        "DBS": {"stiffness_nm_rad": 1.4, "stiffness_cv_percent": 30.0},
    }
    document, said = lines(protocol={"blocks": TWO}, subject=subject)
    needed = document["detection"][0]["epochs_needed"]
    assert needed > 20
    assert said[-1].startswith("! ")
    assert said[-1].endswith(f"%: plan {needed}.")


def test_one_condition_cannot_be_compared_and_one_without_prbs_tells_no_stiffness():
    _, said = lines(protocol={"blocks": [{"condition": "OFF", "task": "sinusoid"}]})
    assert "no epoch of PRBS" in said[1]
    assert "there are not two conditions with PRBS" in said[2]


@pytest.mark.parametrize(
    ("margins", "words"),
    [
        ({"stable": False, "gain_margin_db": 0.0}, "✗ Unstable with OFF: raise the controller's"),
        ({"gain_margin_db": 5.1}, "✗ The loop is nearly unstable: raise"),
        ({"gain_margin_db": None}, "✓ The loop is stable; smallest margins any gain and 60 deg"),
    ],
)
def test_an_unstable_loop_comes_first(margins, words):
    found = {"stable": True, "gain_margin_db": 9.0, "phase_margin_deg": 60.0} | margins
    document = {
        "stability": {"conditions": {"OFF": found}},
        **{"precision": {}, "detection": [], "warnings": ["a limit"], "remarks": []},
    }
    said = prediction_lines(document, MarginsSettings())
    assert said[0].startswith(words)
    assert said[-1] == "! a limit."


def test_a_dry_run_says_how_many_epochs_were_good():
    assert dry_run_lines(8, 8) == ["✓ All 8 epochs end with success on the virtual rig."]
    assert dry_run_lines(7, 8)[0].startswith("✗ Only 7 of 8")
