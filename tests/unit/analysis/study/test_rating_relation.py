"""Ratings against measures by day, and how examiners agree, from values made by hand."""

from dataclasses import replace

import pytest
from scipy.stats import spearmanr
from tests.study_anew.old_cohorts import Design, made_study, ratings_found

from rigidimeter.analysis.study import StudyResult, agreement, relations, result_tables


@pytest.fixture(scope="module")
def study() -> StudyResult:
    return made_study(Design(days=(5, 4), epochs=(4, 4), scores=(3, 3)))


def test_a_point_is_a_day_in_a_condition(study: StudyResult) -> None:
    found = relations(study)
    assert [one.measure.name for one in found] == [
        "stiffness_nm_rad",
        "damping_nm_s_rad",
        "work_j",
    ]
    for one in found:
        assert len(one.visits) == len(set(one.visits)) == 9
        assert one.over_all.rho == pytest.approx(spearmanr(one.values, one.ratings).statistic)
        c = study.comparison(one.measure.name)
        assert c is not None
        subject, day, condition = one.visits[0]
        own = [o.value for o in c.of(condition) if o.day == day and o.subject == subject]
        assert one.values[0] == pytest.approx(sum(own) / len(own))


def test_conditions_that_change_both_relate_them_over_all(study: StudyResult) -> None:
    stiffness = relations(study)[0]
    assert stiffness.over_all.low > 0
    assert stiffness.within.low < 0 < stiffness.within.high


def test_without_ratings_there_is_nothing(study: StudyResult) -> None:
    assert relations(replace(study, ratings=None)) == ()
    assert result_tables(replace(study, ratings=None))["rating_relation"] == []


def test_pairs_of_examiners_of_one_day_and_condition() -> None:
    rows = (
        ("OFF", "A", "M", "1", 2.0),
        ("OFF", "B", "M", "1", 2.0),
        ("OFF", "C", "M", "1", 3.0),
        ("DBS", "A", "M", "1", 1.0),
        ("DBS", "A", "M", "2", 1.0),
        ("DBS", "B", "M", "2", 1.5),
        ("OFF", "A", "M", "2", 2.0),
        ("OFF", "B", "M", "2", 2.5),
    )
    found = agreement(ratings_found(rows, ("OFF", "DBS")))
    assert (found.pairs, found.equal) == (5, 1)
    assert found.mean_difference == pytest.approx((0 + 1 + 1 + 0.5 + 0.5) / 5)
