"""The files of a plan: written, edited, damaged; and the wait before the session that is due."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.study_files import (
    PLAN_FILE,
    PLAN_TABLE,
    PlanToml,
    RecordedBlock,
    StudyPlan,
    add_change,
    due_block,
    next_words,
    parse_change,
    read_changes,
    read_plan,
    read_study_toml,
    wait_words,
    write_plan,
)
from rigidimeter.planning import StudyDays, draw_days

NOW = datetime(2026, 1, 5, 11, 0, tzinfo=UTC)
SPEC = StudyDays(("S01",), ("OFF", "DBS"), 2, ("DBS",), order=("OFF", "DBS"))
ABOUT = PlanToml(subjects=["S01"], days=2, conditions=["OFF", "DBS"], stimulated=["DBS"])


@pytest.fixture
def plan(tmp_path: Path) -> StudyPlan:
    protocols = {f"protocols/{name}.toml": "" for name in SPEC.conditions}
    return write_plan(tmp_path / "study", ABOUT, draw_days(SPEC, 1), protocols)


def test_plan_is_read_as_it_was_drawn_and_known_to_be_edited(plan: StudyPlan) -> None:
    again = read_plan(plan.folder)
    assert again == plan
    assert again is not None
    assert [block.key[1:] for block in again.blocks] == [("1", 1), ("1", 2), ("2", 1), ("2", 2)]
    assert not again.edited
    table = plan.folder / PLAN_TABLE
    table.write_text(table.read_text().replace("60.0", "30.0"))
    edited = read_plan(plan.folder)
    assert edited is not None
    assert edited.edited
    assert edited.blocks[0].wait_min == 30.0


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("60.0", "-1", "line 2: wait_min -1 must be from 0 to 1440 min"),
        ("60.0", "soon", "line 2: "),
        ("S01,1,1,", "S01,1,1e300,", "order 1e300 must be a whole number from 1 to 1000"),
        ("S01,1,1,", f"S01,{'d' * 300},1,", "day has 300 letters; at most 40"),
        ("S01,1,1,OFF", "S02,1,1,OFF", "subject S02 is not one of those in plan.toml: S01"),
        ("S01,1,1,OFF", "S01,1,1,ON", "condition ON is not one of those in plan.toml: OFF, DBS"),
        ("S01,1,2", "S01,1,1", "day 1, order 1 is planned twice"),
        ("S01,1,1,", "S01,1,0,", "order 0 must be a whole number from 1"),
        ("prbs sinusoid", "prbs sine", "task 'prbs sine' must be prbs, sinusoid or both"),
        ("protocols/OFF.toml", "../OFF.toml", "is outside the study folder"),
        ("protocols/OFF.toml", "protocols/ON.toml", "there is no such file"),
        ("wait_min", "wait", "there is no column wait_min"),
        ("S01,1,1,", "S01,,1,", "line 2: day is empty"),
    ],
)
def test_an_edited_plan_is_checked(plan: StudyPlan, old: str, new: str, sentence: str) -> None:
    table = plan.folder / PLAN_TABLE
    table.write_text(table.read_text().replace(old, new, 1))
    with pytest.raises(UserError) as refused:
        read_plan(plan.folder)
    assert sentence in str(refused.value)
    assert str(table) in str(refused.value)


def test_a_plan_is_never_written_over(plan: StudyPlan) -> None:
    with pytest.raises(UserError, match="is there already"):
        write_plan(plan.folder, ABOUT, plan.blocks, {})


def test_the_wait_runs_from_the_change(plan: StudyPlan) -> None:
    due = due_block(plan, (), "S01")
    assert due is not None
    assert due.left_min(NOW) is None  # nobody said when it was switched off
    add_change(plan.folder, parse_change("off since 10:42", "S01", NOW, zone=UTC))
    due = due_block(plan, (), "S01")
    assert due is not None
    assert due.since_min(NOW) == 18.0
    assert due.left_min(NOW) == 42.0
    assert due.left_min(NOW, speed=2.0) == 24.0
    assert due.left_min(NOW + timedelta(hours=1)) == 0.0
    # The same state once more is no change.
    add_change(plan.folder, parse_change("off", "S01", NOW))
    due = due_block(plan, (), "S01")
    assert due is not None
    assert due.since_min(NOW) == 18.0
    # Another state is not the one that the session needs.
    add_change(plan.folder, parse_change("on", "S01", NOW))
    due = due_block(plan, (), "S01")
    assert due is not None
    assert due.left_min(NOW) is None


def recorded(order: int, day: str, *, begun: bool = True) -> RecordedBlock:
    facts = {"subject": "S01", "day": day, "order": order}
    return RecordedBlock("sessions/x", NOW.isoformat(), facts, 1, 1, begun)


def test_what_was_switched_before_another_day_is_not_known(plan: StudyPlan) -> None:
    add_change(plan.folder, parse_change("off since 09:00", "S01", NOW, zone=UTC))
    done = [recorded(1, "1"), recorded(2, "1")]
    due = due_block(plan, done, "S01")
    assert due is not None
    assert (due.block.day, due.block.order) == ("2", 1)
    assert due.left_min(NOW + timedelta(days=1)) is None
    add_change(plan.folder, parse_change("off", "S01", NOW + timedelta(hours=23)))
    due = due_block(plan, done, "S01")
    assert due is not None
    assert due.since_min(NOW + timedelta(days=1)) == 60.0


def test_a_session_that_was_refused_is_still_due(plan: StudyPlan) -> None:
    due = due_block(plan, [recorded(1, "1", begun=False)], "S01")
    assert due is not None
    assert due.block.key == ("S01", "1", 1)
    assert due.folder.endswith("S01-day-1-1-2")  # the folder of the refused one is there


def test_what_is_next_and_what_is_said_when_nothing_is(tmp_path: Path) -> None:
    spec = replace(SPEC, subjects=("S01", "S02"), days=1)
    about = ABOUT.model_copy(update={"subjects": ["S01", "S02"]})
    protocols = {f"protocols/{name}.toml": "" for name in SPEC.conditions}
    plan = write_plan(tmp_path / "two", about, draw_days(spec, 1), protocols)
    done = [recorded(1, "1")]
    assert next_words(plan, "S01", done) == ("Next: Session 2 of 2 of S01: day 1, number 2, DBS")
    done.append(recorded(2, "1"))
    assert (
        next_words(plan, "S01", done) == "All sessions of S01 are recorded; some of S02 are left."
    )
    done += [replace(one, facts={**one.facts, "subject": "S02"}) for one in done]
    assert next_words(plan, "S01", done) == "All sessions of the plan are recorded."
    assert next_words(plan, "S09", done) == ""


def test_a_blinded_wait_runs_from_the_last_report(plan: StudyPlan) -> None:
    codes = {"OFF": "code-A", "DBS": "code-B"}
    blinded = replace(plan, about=plan.about.model_copy(update={"codes": codes}))
    add_change(plan.folder, parse_change("off since 10:42", "S01", NOW, zone=UTC))
    add_change(plan.folder, parse_change("off", "S01", NOW))
    due = due_block(blinded, (), "S01")
    assert due is not None
    assert due.left_min(NOW) == 60.0
    assert due.since_min(NOW) == 18.0


@pytest.mark.parametrize("text", ["", "maybe", "on since", "on since 25:00", "off since 10:75"])
def test_a_change_that_cannot_be_read_is_refused(text: str) -> None:
    with pytest.raises(UserError, match="write on or off, or since when on the clock"):
        parse_change(text, "S01", NOW, zone=UTC)


def test_changes_are_in_order(plan: StudyPlan) -> None:
    add_change(plan.folder, parse_change("on", "S01", NOW))
    with pytest.raises(UserError, match="is before its last change"):
        add_change(plan.folder, parse_change("off since 10:00", "S01", NOW, zone=UTC))
    with pytest.raises(UserError, match="11:45 has not come yet, it is 11:00"):
        parse_change("off since 11:45", "S02", NOW, zone=UTC)
    late = parse_change("off since 23:50", "S02", NOW, zone=UTC)
    assert late.changed_utc == datetime(2026, 1, 4, 23, 50, tzinfo=UTC)
    table = plan.folder / "stimulation.csv"
    table.write_text("# of the nurse\n" + table.read_text())
    add_change(plan.folder, late)
    assert table.read_text().startswith("# of the nurse")  # what stands there stays
    table.write_text(table.read_text().replace(",on,", ",half,"))
    with pytest.raises(UserError, match=r"line 4: .*half"):
        read_changes(plan.folder)


def test_a_study_file_does_not_say_who_a_subject_is(tmp_path: Path) -> None:
    about = 'schema = "rigidimeter.study/1"\ntitle = "T"\nreference = "OFF"\nother = "DBS"\n'
    path = tmp_path / "study.toml"
    path.write_text(f'{about}[subjects.S1]\nside = "R"\nmedication_since_h = 12\n')
    assert read_study_toml(path).subjects["S1"].side == "R"
    path.write_text(f"{about}[subjects.S1]\ndate_of_birth = 1950-01-01\n")
    with pytest.raises(UserError, match="date_of_birth would say who the subject is"):
        read_study_toml(path)


@pytest.mark.parametrize("left", [("protocols/OFF.toml",), ("protocols/OFF.toml", PLAN_TABLE)])
def test_a_plan_that_was_not_written_to_its_end_is_written_again(
    plan: StudyPlan, left: tuple[str, ...]
) -> None:
    protocols = {f"protocols/{name}.toml": "" for name in SPEC.conditions}
    for name in {*protocols, PLAN_TABLE, PLAN_FILE} - {*left}:
        (plan.folder / name).unlink()
    if PLAN_TABLE in left:
        assert read_plan(plan.folder) is None
    blocks = draw_days(SPEC, 1)
    with pytest.raises(UserError, match="is there already"):
        write_plan(plan.folder, ABOUT, blocks, {"protocols/OFF.toml": "seed = 2"})
    assert write_plan(plan.folder, ABOUT, blocks, protocols) == plan
    with pytest.raises(UserError, match="is there already"):
        write_plan(plan.folder, ABOUT, blocks, protocols)


@pytest.mark.parametrize(
    "codes",
    [
        {"OFF": "code-A"},
        {"OFF": "code-A", "DBS": "code-A"},
        {"OFF": "code-A", "DBS": ""},
        {"OFF": "DBS", "DBS": "OFF"},
    ],
)
def test_codes_that_would_show_or_mix_conditions_are_refused(codes: dict[str, str]) -> None:
    with pytest.raises(ValueError, match="another code for each condition"):
        PlanToml(subjects=["S01"], days=2, conditions=["OFF", "DBS"], codes=codes)


def test_a_wrong_row_does_not_tell_which_code_is_the_reference(tmp_path: Path) -> None:
    about = ABOUT.model_copy(update={"codes": {"OFF": "code-B", "DBS": "code-A"}})
    protocols = {f"protocols/{name}.toml": "" for name in SPEC.conditions}
    plan = write_plan(tmp_path / "study", about, draw_days(SPEC, 1), protocols)
    table = plan.folder / PLAN_TABLE
    table.write_text(table.read_text().replace("S01,1,1,OFF", "S01,1,1,X"))
    with pytest.raises(UserError, match=r"plan\.toml: code-A, code-B"):
        read_plan(plan.folder)


def test_no_wait_runs_from_a_change_that_has_not_come(plan: StudyPlan) -> None:
    """The table was edited by hand, or a clock was wrong: minutes since would be negative."""
    add_change(plan.folder, parse_change("off", "S01", NOW + timedelta(days=365)))
    due = due_block(plan, (), "S01")
    assert due is not None
    assert due.left_min(NOW, 100.0) is None
    assert due.since_min(NOW, 100.0) is None
    assert "2027-01-05 11:00 UTC, which is still to come" in wait_words(due, NOW)
