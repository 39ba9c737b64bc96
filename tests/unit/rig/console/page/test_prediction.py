"""From a design to sentences that say what to do."""

import pytest

from rigidimeter.core.settings import MarginsSettings, parse_settings
from rigidimeter.core.study_files import primary_named
from rigidimeter.planning import design, design_document
from rigidimeter.rig.console.page import detected, dry_run_lines, prediction_lines

KEYS = ("days_needed", "days_needed_alone", "subjects_needed")
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
    one = document["detection"][0]
    days, alone, subjects = (one["planned"][key] for key in KEYS)
    assert said[3] == (
        "To detect 20 % less stiffness among stiffness and damping, by Holm (chance 80 %): "
        f"{days} days with 4 + 4 epochs ({alone} if it were the only primary measure), or "
        f"{subjects} subjects with one day each. Assumed SD: 16 % between epochs (Table 2 of the "
        "paper), 8.5 % of condition by day (chosen); between subjects 50 % of the difference "
        "(chosen)."
    )
    assert 3 < alone < days < 20


def test_a_single_primary_measure_and_one_after_another_are_named():
    settings = parse_settings({"protocol": {"blocks": TWO}})
    alone = design(settings, differences=["damping=20%"], primary="damping")
    (one,) = design_document(alone)["detection"]
    assert one["sentence"].startswith("To detect 20 % less damping (chance 80 %): ")
    assert "only primary" not in one["sentence"]
    second = design(
        settings, differences=["damping=20%"], primary="stiffness,damping", rule="sequence"
    )
    (one,) = design_document(second)["detection"]
    assert one["after"] == ["stiffness"]
    assert " less damping after stiffness is shown (chance 80 %): " in one["sentence"]


def test_a_difference_that_a_thousand_days_do_not_show_is_said():
    _, said = lines(("damping=-0.1%",), protocol={"blocks": TWO})
    assert said[-1].startswith("To detect 0.1 % more damping among")
    assert "(chance 80 %): > 1000 days with 4 + 4 epochs, or > 1000 subjects" in said[-1]


def test_one_condition_cannot_be_compared_and_one_without_prbs_tells_no_stiffness():
    _, said = lines(protocol={"blocks": [{"condition": "OFF", "task": "sinusoid"}]})
    assert "no epoch of PRBS" in said[1]
    assert said[2] == (
        "To detect 20 % less stiffness, a day needs PRBS epochs in two conditions; the protocol "
        "has them in one or none."
    )


def test_predict_plans_for_the_primary_measures_of_the_study():
    primary = primary_named("damping,work", "sequence", difference_percent=15.0)
    assert detected(primary) == [
        *("--primary", "damping_nm_s_rad,work_j", "--rule", "sequence"),
        *("--detect", "damping=15%"),
    ]


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
