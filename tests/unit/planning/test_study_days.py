"""The orders and waits of a plan of days; closed forms, which no scenario of a study shows."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidimeter.core.errors import UserError
from rigidimeter.planning import StudyDays, draw_days


def _days(plan: StudyDays, seed: int) -> list[list[str]]:
    found: dict[str, list[str]] = {}
    for block in draw_days(plan, seed):
        found.setdefault(block.day, []).append(block.condition)
    return list(found.values())


@given(seed=st.integers(0, 10**6), days=st.integers(1, 12), sessions=st.integers(1, 4))
@settings(max_examples=60, deadline=None)
def test_each_order_occurs_as_often_as_its_reverse(seed: int, days: int, sessions: int) -> None:
    plan = StudyDays(("A",), ("OFF", "DBS"), 2 * days, ("DBS",), sessions_a_day=sessions)
    drawn = _days(plan, seed)
    assert drawn == _days(plan, seed)
    for first, second in zip(drawn[::2], drawn[1::2], strict=True):
        assert first == second[::-1]
    for day in drawn:
        assert sorted(day) == sorted(["OFF", "DBS"] * sessions)
        assert not any(a == b == c for a, b, c in zip(day, day[1:], day[2:], strict=False))


def test_seeds_and_subjects_have_their_own_orders() -> None:
    plan = StudyDays(("A", "B"), ("OFF", "DBS"), 20, ("DBS",), balanced=False)
    blocks = draw_days(plan, 1)
    of_each = [[b.condition for b in blocks if b.subject == name] for name in "AB"]
    assert of_each[0] != of_each[1]
    assert [b.condition for b in draw_days(plan, 2)] != [b.condition for b in blocks]


def test_paper_protocol_has_off_every_day_and_dbs_on_four() -> None:
    plan = StudyDays(("M",), ("OFF", "DBS"), 9, ("DBS",), days_of={"DBS": 4})
    drawn = _days(plan, 7)
    assert [len(day) for day in drawn] == [1, 2, 1, 2, 1, 2, 1, 2, 1]
    both = [day for day in drawn if len(day) == 2]
    assert sum(day[0] == "OFF" for day in both) == 2


def test_waits_follow_the_changes_of_the_stimulation() -> None:
    plan = StudyDays(
        ("A",), ("OFF", "DBS"), 3, ("DBS",), sessions_a_day=2, order=("OFF", "DBS"),
        wait_after_on_min=15.0, wait_after_off_min=60.0,
    )  # fmt: skip
    first = [block for block in draw_days(plan, 1) if block.day == "1"]
    assert [b.condition for b in first] == ["OFF", "DBS", "OFF", "DBS"]
    assert [b.wait_min for b in first] == [60.0, 15.0, 60.0, 15.0]
    drawn = StudyDays(("A",), ("OFF", "DBS"), 30, ("DBS",), sessions_a_day=3)
    blocks = draw_days(drawn, 3)
    same = [b for a, b in pairwise(blocks) if (a.day, a.condition) == (b.day, b.condition)]
    assert same
    assert all(block.wait_min == 0.0 for block in same)


def test_a_blinded_plan_gives_no_condition_away_by_its_wait() -> None:
    plan = StudyDays(("A",), ("OFF", "DBS"), 8, ("DBS",), sessions_a_day=3, codes={"OFF": "B"})
    assert {block.wait_min for block in draw_days(plan, 1)} == {60.0}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"days_of": {"ON": 2}}, "condition ON: is not one of OFF, DBS"),
        ({"days_of": {"DBS": 4}}, "condition DBS on 4 days: must be from 1 to the 3 days"),
        ({"order": ("OFF",)}, "order OFF: must name each of the conditions OFF, DBS once"),
        ({"sessions_a_day": 7}, "at most 12 sessions a day"),
    ],
)
def test_what_cannot_be_planned_is_refused(changes: dict[str, object], sentence: str) -> None:
    with pytest.raises(UserError, match=sentence):
        StudyDays(("A",), ("OFF", "DBS"), 3, **changes)  # type: ignore[arg-type]
