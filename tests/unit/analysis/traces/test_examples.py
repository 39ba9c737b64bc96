"""Which fits a report shows: those of conditions together, and those that stand for one."""

import dataclasses
import math

import pytest

from rigidimeter.analysis.study import StudyResult, split_pooled
from rigidimeter.analysis.study.examples import representative_fits
from rigidimeter.core.records import Outcome


def test_estimates_bring_their_intervals(study: StudyResult) -> None:
    included = [fit for fit in study.analysis.fits if fit.outcome.included]
    off = [fit for fit in included if fit.condition == "OFF"]
    stiffness = study.comparison("stiffness_nm_rad")
    assert [o.low for o in stiffness.of("OFF")] == [fit.stiffness_nm_rad_low for fit in off]
    pooled, _ = split_pooled(study.analysis)
    assert stiffness.pooled["DBS"].high == pooled["DBS"].stiffness_nm_rad_high
    assert all(math.isnan(o.low) for o in study.comparison("work_j").of("OFF"))
    assert study.comparison("work_j").pooled == {}


@pytest.mark.parametrize(
    ("recorded", "pooled", "named", "overall"),
    [
        (["OFF", "DBS"], ["OFF", "DBS", ""], ["OFF", "DBS"], True),
        (["OFF"], ["OFF"], ["OFF"], False),
        ([""], [""], [""], False),
        (["", "OFF"], ["", "OFF", ""], ["", "OFF"], True),
        (["OFF", "DBS"], ["OFF", "DBS"], ["OFF", "DBS"], False),
        (["OFF"], [], [], False),
    ],
)
def test_the_fit_to_all_conditions_is_distinguished_from_that_without_a_name(
    recorded, pooled, named, overall, make_analysis
) -> None:
    analysis = make_analysis(dict.fromkeys(recorded, 2))
    fits = tuple(
        dataclasses.replace(analysis.fits[0], condition=name, epoch="pooled", n_samples=place)
        for place, name in enumerate(pooled)
    )
    by_condition, everything = split_pooled(dataclasses.replace(analysis, pooled=fits))
    assert list(by_condition) == named
    assert everything is (fits[-1] if overall else None)


def test_conditions_keep_one_order(study: StudyResult) -> None:
    assert study.condition_names == ("OFF", "DBS")


def test_the_representative_is_the_included_fit_with_the_median_stiffness(
    make_study, make_analysis
) -> None:
    analysis = make_analysis({"OFF": 5, "DBS": 4})
    values = [2.3, 1.6, 1.8, 2.9, 1.7, 1.5, 1.1, 1.3, 1.2]
    fits = [
        dataclasses.replace(fit, value=(0.004, 0.1, stiffness))
        for fit, stiffness in zip(analysis.fits, values, strict=True)
    ]
    fits[3] = dataclasses.replace(fits[3], outcome=Outcome("excluded", "limit"))
    fits[0] = dataclasses.replace(fits[0], outcome=Outcome("excluded", "limit"))
    made = make_study([], analysis=dataclasses.replace(analysis, fits=tuple(fits)))
    chosen = [(fit.condition, fit.stiffness_nm_rad) for fit in representative_fits(made)]
    # Three are left of OFF; of the four of DBS the lower middle one is taken.
    assert chosen == [("OFF", 1.7), ("DBS", 1.2)]
