"""A plan from the values that command and page collect."""

from __future__ import annotations

import inspect
from dataclasses import replace
from pathlib import Path

import pytest

from rigidimeter.cli.study_plan import plan_days
from rigidimeter.core.settings import Settings, load_settings
from rigidimeter.planning import (
    BOUNDS,
    PlanValues,
    WrongValue,
    day_settings,
    draw_plan,
    plan_days_of,
)


def test_the_command_has_the_defaults_and_the_bounds_of_the_plan(tmp_path, rigidimeter) -> None:
    options = inspect.signature(plan_days).parameters
    names = {"wait_after_on": "wait_on_min", "wait_after_off": "wait_off_min"}
    usual = PlanValues(("S01",))
    for key, (_, high) in BOUNDS.items():
        option = options[names.get(key, key)].default
        assert option.default == getattr(usual, key), key
        beyond = (f"--{key.replace('_', '-')}", f"{high + 1:.0f}")
        refused = rigidimeter("study", "plan", tmp_path / "s", "--subjects", "S01", *beyond)
        assert f"{' '.join(beyond)}: must be from" in refused.err
        assert refused.status == 1


def test_a_plan_that_its_file_does_not_hold_is_refused_in_a_sentence(tmp_path, rigidimeter) -> None:
    options = ("--subjects", "S01", "--conditions", "code-A,code-B", "--blinded")
    refused = rigidimeter("study", "plan", tmp_path / "study", *options)
    assert refused.status == 1
    assert "codes must hold another code for each condition" in refused.err


def test_codes_are_others_in_each_study_and_those_of_its_seed() -> None:
    """Else whoever knows the codes of one study knows those of all."""
    values = PlanValues(("S01",), conditions=tuple("ABCDEFGH"), blinded=True)
    first, second = (draw_plan(values, Settings()).about for _ in range(2))
    assert first.seed != second.seed
    assert first.codes != second.codes
    assert draw_plan(replace(values, seed=first.seed), Settings()).about == first
    assert draw_plan(replace(values, blinded=False), Settings()).about.seed == 2023


@pytest.mark.parametrize(("key", "value"), [(key, high + 1) for key, (_, high) in BOUNDS.items()])
def test_a_number_out_of_its_bounds_is_refused_by_name(key: str, value: float) -> None:
    with pytest.raises(
        WrongValue, match=f"--{key.replace('_', '-')} {value:.10g}: must be"
    ) as wrong:
        PlanValues(("S01",), **{key: value})  # type: ignore[arg-type]
    assert wrong.value.key == key


def test_a_plan_that_is_shown_is_the_one_that_is_written(tmp_path: Path) -> None:
    values = PlanValues(("S01",), days=2, rests_s=(30.0, 20.0), sessions=2)
    drawn = draw_plan(values, Settings())
    shown = drawn.shown(tmp_path / "study")
    assert not shown.folder.exists()
    written = drawn.write(shown.folder)
    assert written.blocks == shown.blocks
    assert load_settings(shown.folder / "protocols/DBS.toml").protocol.rests_s == [30.0, 20.0]


def test_a_day_for_the_prediction_has_epochs_of_each_condition() -> None:
    found = day_settings(PlanValues(("S01",), conditions=("A", "B"), prbs_epochs=2), Settings())
    blocks = [(one.task, one.condition, one.epochs) for one in found.protocol.blocks]
    assert blocks == [
        ("prbs", "A", 2), ("sinusoid", "A", 3), ("prbs", "B", 2), ("sinusoid", "B", 3)
    ]  # fmt: skip


@pytest.mark.parametrize("text", ["DBS=\N{SUPERSCRIPT TWO}", "DBS=" + "9" * 5000, "DBS=", "4"])
def test_days_of_a_condition_are_a_plain_number(text: str) -> None:
    with pytest.raises(WrongValue, match="write each condition once with its days"):
        plan_days_of([text])


def test_a_condition_has_its_days_once() -> None:
    with pytest.raises(WrongValue, match="write each condition once with its days"):
        plan_days_of(["DBS=1", "DBS=2"])


def test_a_plan_that_would_stop_the_page_for_a_minute_is_refused() -> None:
    many = tuple(f"S{k}" for k in range(50))
    with pytest.raises(WrongValue, match="have 600000 sessions: at most 10000") as wrong:
        draw_plan(PlanValues(many, days=1000, sessions=6), Settings())
    assert wrong.value.key == "days"
    with pytest.raises(WrongValue, match="1001 subjects: at most 1000") as wrong:
        draw_plan(PlanValues(tuple(map(str, range(1001))), days=1), Settings())
    assert wrong.value.key == "subjects"
