"""A study that was not carried out as planned: every deviation is reported, no verdict changes."""

from __future__ import annotations

import shutil
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from tests.replayed import assert_folder_replayed
from tests.small_study import tiny

import rigidimeter as rm
from rigidimeter.analysis.study import comparison_document
from rigidimeter.core.files import toml_text
from rigidimeter.core.settings import dump_settings
from rigidimeter.core.study_files import (
    PlanToml,
    StimulationChange,
    add_change,
    begun_session,
    extend_study,
    named_block,
    read_plan,
    recorded_blocks,
    write_plan,
)
from rigidimeter.planning import StudyDays, draw_days
from rigidimeter.virtual import rehearse, run_virtual_session

BEGIN = datetime(2026, 1, 5, 9, 0, tzinfo=UTC)
NAMES = ("OFF", "DBS")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three days: the first as planned, the second in another order, the third too early."""
    folder = tmp_path_factory.mktemp("planned")
    spec = StudyDays(("S01",), NAMES, 3, ("DBS",), order=NAMES, task="prbs")
    about = PlanToml(subjects=["S01"], days=3, conditions=list(NAMES), stimulated=["DBS"])
    protocols = {
        f"protocols/{name}.toml": toml_text(dump_settings(tiny(name, 1, epochs=1)))
        for name in NAMES
    }
    plan = write_plan(folder, about, draw_days(spec, 1), protocols)
    waits = {("1", 1): 60, ("1", 2): 15, ("2", 2): 15, ("2", 1): 60, ("3", 1): 4}
    for place, ((day, order), wait_min) in enumerate(waits.items()):
        now = BEGIN + timedelta(hours=2 * place)
        before, state = ("off", "on") if order == 2 else ("on", "off")
        add_change(folder, StimulationChange("S01", now - timedelta(hours=1), before))
        add_change(folder, StimulationChange("S01", now, state))
        due = named_block(plan, recorded_blocks(folder), ("S01", day, order))
        assert due is not None
        now += timedelta(minutes=wait_min)
        begun = begun_session(plan, due, now, reason="late")
        run_virtual_session(
            begun.settings, begun.folder, created_utc=now.isoformat(), about=begun.about
        )
        assert_folder_replayed(begun.folder)
        extend_study(folder, [begun.folder])
    return folder


def test_every_deviation_is_reported_and_no_verdict_changes(study: Path) -> None:
    found = rm.compare(study, resamples=0)
    # Of each epoch, from the change to its own beginning.
    first = [epoch for epoch in found.epochs if "day-1-1" in epoch.source]
    assert [epoch.since_change_min for epoch in first] == pytest.approx([60.0], abs=0.05)
    assert {(one.day, one.order, one.kind) for one in found.deviations} == {
        ("3", 2, "not done"),
        ("2", 2, "out of order"),
        ("3", 1, "short wait"),
    }
    (short,) = [one for one in found.deviations if one.kind == "short wait"]
    assert short.detail == "begun 4 min after the change; 60 planned (late)"
    document = comparison_document(found)
    assert document["plan"]["words"].startswith(
        "Sessions not as planned: 1 out of order, 1 not recorded and 1 begun too early."
    )
    assert [row["detail"] for row in document["plan"]["deviations"]] == [
        one.detail for one in found.deviations
    ]


def test_an_edited_plan_and_another_protocol_are_reported(study: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(study, tmp_path / "study")
    protocol = copy / "protocols" / "OFF.toml"
    protocol.write_text(protocol.read_text().replace("duration_s = 6.0", "duration_s = 7.0", 1))
    table = copy / "plan.csv"
    table.write_text(table.read_text().replace("15.0", "10.0"))
    kinds = [one.kind for one in rm.compare(copy, resamples=0).deviations]
    assert kinds.count("plan edited") == 5
    assert kinds.count("other protocol") == 3


def test_a_rehearsed_plan_has_no_deviation(study: Path, tmp_path: Path) -> None:
    plan = read_plan(study)
    assert plan is not None
    folder = tmp_path / "again"
    protocols = {
        f"protocols/{name}.toml": (study / f"protocols/{name}.toml").read_text() for name in NAMES
    }
    rehearsed = write_plan(folder, plan.about, plan.blocks[:4], protocols)
    assert len(rehearse(rehearsed, BEGIN)) == 4
    assert rm.compare(folder, resamples=0).deviations == ()


def test_a_session_outside_of_the_plan_is_listed(study: Path, tmp_path: Path) -> None:
    folder = tmp_path / "planned"
    shutil.copytree(study, folder)
    run_virtual_session(
        tiny("OFF", 9, epochs=1),
        folder / "S01-20260108",
        created_utc=(BEGIN + timedelta(days=3)).isoformat(),
        about={"subject": "S01", "operator": "Kim", "day": "extra"},
    )
    extend_study(folder)
    found = [one for one in rm.compare(folder, resamples=0).deviations if one.kind == "not planned"]
    assert [(one.day, one.path, one.detail) for one in found] == [
        ("extra", "S01-20260108", "was recorded and was not planned")
    ]
