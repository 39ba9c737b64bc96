"""The plans among the examples are as they were drawn, and are carried out on the virtual rig."""

from __future__ import annotations

import shutil
from datetime import UTC, datetime
from pathlib import Path

import pytest

import rigidimeter as rm
from rigidimeter.core.files import csv_text, toml_text
from rigidimeter.core.settings import changed_settings, dump_settings, load_settings
from rigidimeter.core.study_files import StudyPlan, read_plan
from rigidimeter.planning import StudyDays, draw_days
from rigidimeter.virtual import rehearse

STUDIES = Path(__file__).parents[3] / "examples" / "studies"
COLUMNS = ("subject", "day", "order", "condition", "task", "protocol", "wait_min", "raters")
SHORT = {
    "seed": 1,
    "rig": {"tick_rate_hz": 250.0, "torque": {"rate_hz": 250.0}, "motion": {"rate_hz": 125.0}},
    "prbs": {"duration_s": 6.0},
    "zeroing": {"duration_s": 0.2},
    "protocol": {"rests_s": [0.5], "return_s": 0.5},
}


def _plan(folder: Path) -> StudyPlan:
    plan = read_plan(folder)
    assert plan is not None
    return plan


@pytest.mark.parametrize(
    ("name", "spec"),
    [
        (
            "paper",
            StudyDays(
                ("M1",), ("OFF", "DBS"), 9, ("DBS",), {"DBS": 4},
                wait_after_off_min=15.0, raters=("A", "B", "C"),
            ),
        ),
        (
            "elbow-medication",
            StudyDays(
                ("S01", "S02"), ("OFF", "ON"), 4, ("ON",), order=("OFF", "ON"),
                wait_after_on_min=60.0, wait_after_off_min=720.0, raters=("A", "B"),
            ),
        ),
    ],
)  # fmt: skip
def test_an_example_is_as_it_was_drawn_and_can_be_carried_out(
    name: str, spec: StudyDays, tmp_path: Path
) -> None:
    plan = _plan(STUDIES / name)
    assert not plan.edited
    assert plan.blocks == draw_days(spec, plan.about.seed)
    # The shortest form: the first day with both conditions, one short epoch each.
    study = Path(shutil.copytree(STUDIES / name, tmp_path / "study"))
    day = next(block.day for block in plan.blocks if block.order == 2)
    first = [block for block in plan.blocks if block.day == day][:2]
    (study / "plan.csv").write_text(csv_text(COLUMNS, [vars(block) for block in first]))
    for block in first:
        path = study / block.protocol
        blocks = [{"task": "prbs", "condition": block.condition, "epochs": 1}]
        protocol = {**SHORT["protocol"], "blocks": blocks}
        short = changed_settings(load_settings(path), {**SHORT, "protocol": protocol})
        path.write_text(toml_text(dump_settings(short)))
    done = rehearse(_plan(study), datetime(2026, 1, 5, tzinfo=UTC))
    assert [path.name for path in done] == [
        f"{block.subject}-day-{day}-{block.order}" for block in first
    ]
    found = rm.compare(study, resamples=0)
    assert not found.study.deviations
    assert {fit.condition for fit in found.study.analysis.fits} == set(spec.conditions)
