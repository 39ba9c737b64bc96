"""The plan: counts, days, seeds, and an examiner who feels the joint and not its name."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.model import JointDynamics
from rigidimeter.paper import TABLE_1, Context
from rigidimeter.virtual import (
    DESIGNS,
    NULL,
    PAPER,
    PUSHING,
    draw_ratings,
    plan_study,
    spread_evenly,
)


@pytest.mark.parametrize("name", list(DESIGNS))
def test_counts_are_those_of_table_1(name: str) -> None:
    assert Context(5, design=DESIGNS[name]).counts == TABLE_1


def test_off_on_nine_days_and_dbs_on_four_of_them_in_turns() -> None:
    plans = plan_study(PAPER, 5)
    order = [(plan.day, plan.condition) for plan in plans]
    off = [day for day, condition in order if condition == "OFF"]
    assert off == [str(day) for day in range(1, 10)]
    both = [day for day, condition in order if condition == "DBS"]
    assert both == ["2", "4", "6", "8"]
    first = [next(name for other, name in order if other == day) for day in both]
    assert first == ["OFF", "DBS", "OFF", "DBS"]
    stamps = [plan.created_utc for plan in plans]
    assert stamps == sorted(stamps)
    assert len(set(stamps)) == len(stamps)
    assert all("15 min after switching on" in p.note for p in plans if p.condition == "DBS")


@pytest.mark.parametrize(("total", "days"), [(78, 9), (92, 9), (23, 4), (46, 4), (2, 3)])
def test_epochs_are_spread_as_evenly_as_numbers_go(total: int, days: int) -> None:
    spread = spread_evenly(total, days)
    assert sum(spread) == total
    assert len(spread) == days
    assert max(spread) - min(spread) <= 1


def test_a_plan_is_the_same_for_the_same_seed_and_no_two_sessions_share_one() -> None:
    assert plan_study(PAPER, 5) == plan_study(PAPER, 5)
    seeds = {plan.settings.seed for seed in (5, 6) for plan in plan_study(PAPER, seed)}
    assert len(seeds) == 2 * 13


def test_the_factors_of_a_day_are_those_of_both_conditions() -> None:
    """ln B_OFF − ln B_DBS of one day is that of the medians, whatever the day."""
    by_day: dict[str, dict[str, JointDynamics]] = {}
    for plan in plan_study(PAPER, 5):
        by_day.setdefault(plan.day, {})[plan.condition] = plan.joint
    both = [joints for joints in by_day.values() if len(joints) == 2]
    assert len(both) == 4
    for joints in both:
        ratio = joints["DBS"].damping_nm_s_rad / joints["OFF"].damping_nm_s_rad
        assert ratio == pytest.approx(0.119 / 0.1368)
        assert joints["DBS"].inertia_kg_m2 == pytest.approx(joints["OFF"].inertia_kg_m2)
    assert len({joints["OFF"].damping_nm_s_rad for joints in by_day.values()}) == 9


def test_days_scatter_as_much_as_the_design_says() -> None:
    logs = np.log(
        [
            (plan.joint.inertia_kg_m2, plan.joint.damping_nm_s_rad, plan.joint.stiffness_nm_rad)
            for seed in range(40)
            for plan in plan_study(PAPER, seed)
            if plan.condition == "OFF"
        ]
    )
    wanted = [math.sqrt(math.log1p(cv**2)) for cv in (0.02, 0.09, 0.12)]
    assert logs.std(axis=0) == pytest.approx(wanted, rel=0.12)  # SE of 360 days: 4 %
    assert logs.mean(axis=0) == pytest.approx(np.log([0.0045, 0.1368, 1.751]), abs=0.02)


def test_the_session_has_the_medians_of_its_day() -> None:
    for plan in plan_study(PUSHING, 5):
        (subject,) = plan.settings.subject.values()
        assert subject.damping_nm_s_rad == plan.joint.damping_nm_s_rad
        assert subject.damping_cv_percent == 12.0
        assert subject.voluntary_sd_nm == {"OFF": 0.01, "DBS": 0.2}[plan.condition]
        assert plan.settings.rig.torque.rate_hz == 100.0
        assert plan.settings.rig.motion.jitter_s == 0.005


def test_designs_differ_where_they_should() -> None:
    for design in (NULL, PUSHING):
        off, dbs = design.conditions
        assert (off.damping_nm_s_rad, off.stiffness_nm_rad) == (
            dbs.damping_nm_s_rad,
            dbs.stiffness_nm_rad,
        )
    assert NULL.conditions[1].voluntary_sd_nm == NULL.conditions[0].voluntary_sd_nm


def test_a_stiffer_joint_is_not_rated_lower_by_the_same_examiner() -> None:
    """The rating is a monotone function of the joint: the closed form, without noise."""
    sharp = replace(PAPER, examiner_sd=0.0, rating_noise_sd=0.0, rating_step=1e-6)
    joints = [JointDynamics(0.0045, f * 0.1368, f * 1.751) for f in (0.5, 0.8, 1.0, 1.3)]
    scores = [next(iter(r.values())) for r in draw_ratings(sharp, joints, np.random.default_rng(1))]
    assert scores == pytest.approx([2.0 + 2.0 * math.log(f) for f in (0.5, 0.8, 1.0, 1.3)])
    coarse = draw_ratings(PAPER, joints * 50, np.random.default_rng(1))
    given = [score for ratings in coarse for score in ratings.values()]
    assert set(given) <= {0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0}
    assert set(coarse[0]) == {"A", "B", "C"}


def test_ratings_do_not_know_the_condition() -> None:
    plans = {design.name: plan_study(design, 5) for design in (NULL, PUSHING)}
    scores = {name: [plan.ratings for plan in found] for name, found in plans.items()}
    assert scores["null"] == scores["pushing"]
