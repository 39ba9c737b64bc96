"""The dose of a session: what a protocol asks for, and when no further epoch may begin."""

import pytest

from rigidimeter.core.settings import DoseSettings, parse_settings
from rigidimeter.planning import (
    NO_DOSE,
    Dose,
    design,
    dose_objection,
    dose_part,
    dose_reached,
    plan,
)

LIMITS = DoseSettings(epochs=10, motion_min=4.0, arrivals=5)


def planned(count, dose):
    """Return dose limits and a protocol of so many epochs of 20 s, each with a return of 3 s."""
    values = {"protocol": {"blocks": [{"epochs": count}], "return_s": 3.0}, "dose": dose}
    settings = parse_settings(values)
    return settings.dose, plan(settings.protocol, settings.prbs, settings.sinusoid, 1)


@pytest.mark.parametrize(
    ("epochs", "dose", "words"),
    [
        (10, {"epochs": 10}, ""),
        (11, {"epochs": 10}, "has 11 epochs, more than dose.epochs = 10"),
        (10, {"motion_min": 3.84}, ""),  # 10 · 23 s = 3.83 min
        (10, {"motion_min": 3.8}, "moves the arm for 3.8 min, longer than dose.motion_min = 3.8"),
        (100, {}, ""),
        (121, {}, "dose.epochs = 120"),
    ],
)
def test_a_protocol_beyond_the_dose_is_named_with_its_limit(epochs, dose, words):
    objection = dose_objection(*planned(epochs, dose))
    assert words in objection
    assert bool(objection) is bool(words)


@pytest.mark.parametrize(
    ("dose", "words"),
    [
        (NO_DOSE, ""),
        (Dose(9, 217.0, 4), ""),  # and 23 s are 4 min
        (Dose(10, 0.0, 0), "10 epochs were run"),
        (Dose(9, 217.1, 0), "with another epoch for more than 4 min"),
        (Dose(0, 0.0, 5), "came to its position limit 5 times"),
    ],
)
def test_no_epoch_begins_that_would_go_beyond_the_dose(dose, words):
    why = dose_reached(LIMITS, dose, 23.0)
    assert words in why
    assert bool(why) is bool(words)


def test_a_dose_is_as_near_to_its_limits_as_the_nearest():
    assert dose_part(LIMITS, NO_DOSE) == 0.0
    assert dose_part(LIMITS, Dose(5, 60.0, 1)) == 0.5
    assert dose_part(LIMITS, Dose(1, 180.0, 1)) == 0.75
    assert dose_part(LIMITS, Dose(1, 60.0, 5)) == 1.0


@pytest.mark.parametrize("facts", [{}, {"epochs": "3", "motion_s": None, "arrivals": float("nan")}])
def test_what_a_record_does_not_hold_counts_as_nothing(facts):
    assert Dose.of_record(facts) == NO_DOSE
    assert Dose.of_record({"epochs": 3, "motion_s": 4.5, "arrivals": 2}) == Dose(3, 4.5, 2)


def test_a_design_warns_of_a_protocol_beyond_the_dose():
    few = {"protocol": {"blocks": [{"epochs": 2}]}}
    assert not any("dose" in text for text in design(few).warnings)
    warned = design({**few, "dose": {"epochs": 1}}).warnings
    assert any("more than dose.epochs = 1" in text for text in warned)
