"""A plan from the values that command and page collect."""

from __future__ import annotations

import inspect
from pathlib import Path

import pytest

from rigidimeter.cli.study_plan import plan_days
from rigidimeter.core.settings import Settings, load_settings
from rigidimeter.planning import BOUNDS, PlanValues, WrongValue, day_settings, draw_plan


def test_the_command_has_the_bounds_of_the_plan() -> None:
    """They stand there again, so that its help does not load all that a plan needs."""
    options = inspect.signature(plan_days).parameters
    names = {"wait_after_on": "wait_on_min", "wait_after_off": "wait_off_min"}
    for key, bounds in BOUNDS.items():
        option = options[names.get(key, key)].default
        assert (option.min, option.max) == bounds, key


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
