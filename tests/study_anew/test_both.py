"""The room built anew says of every study what the room says that it replaces."""

import pytest
from tests.study_anew.both import (
    apart,
    concluded_study,
    new_answers,
    of_ratings,
    of_table,
    old_answers,
)
from tests.study_anew.designs import random_study
from tests.study_anew.old_cohorts import Design, made_study

from rigidimeter.analysis.study import conclusion_rows

SEEDS = range(40)
VERDICTS = {"lower", "higher", "no difference shown", "not supported", "cannot be decided"}
REASONS = {
    *("flagged_epochs", "groups_differ", "inertia_of_conditions", "no_test", "wide_interval"),
    *("unknown_days", "examiners_of_one_condition", "unused_recordings", "order_of_conditions"),
    *("earlier_in_sequence", "within_accuracy"),
}


STUDIES = [(seed, True) for seed in SEEDS] + [(seed, False) for seed in SEEDS[:12]]


@pytest.mark.parametrize(("seed", "known_days"), STUDIES)
def test_of_a_random_study(seed: int, known_days: bool) -> None:
    result = random_study(seed, known_days=known_days)
    assert not list(apart(old_answers(result), new_answers(concluded_study(result))))


@pytest.mark.slow
def test_the_random_studies_reach_every_verdict_and_reason() -> None:
    found: set[str] = set()
    for seed, known_days in STUDIES:
        for row in conclusion_rows(random_study(seed, known_days=known_days)):
            found |= {row["verdict"], row["finding"]}
    assert found >= VERDICTS | REASONS


@pytest.mark.parametrize(
    "design",
    [Design(), Design(effect=0.0), Design(effect=-1.0, days=(4, 5)), Design(subjects=("M1", "M2"))],
)
def test_of_a_made_study(design: Design) -> None:
    result = made_study(design)
    assert not list(apart(old_answers(result), new_answers(concluded_study(result))))


@pytest.mark.parametrize("seed", range(60))
def test_of_a_random_table(seed: int) -> None:
    assert not list(apart(*of_table(seed)))


@pytest.mark.parametrize("seed", range(200))
def test_of_random_ratings(seed: int) -> None:
    assert not list(apart(*of_ratings(seed)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1000, 1250))
def test_of_many_random_studies(seed: int) -> None:
    for known_days in (True, False):
        result = random_study(seed, known_days=known_days)
        assert not list(apart(old_answers(result), new_answers(concluded_study(result))))
