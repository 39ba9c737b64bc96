"""Sessions of a plan in `run` and on the page: what they record, and what is left of one."""

from __future__ import annotations

from dataclasses import asdict, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from nicegui import Client, ui
from nicegui.page import page
from tests.small_study import tiny

from rigidimeter.cli.page_session import lead_session
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import toml_text
from rigidimeter.core.session import SessionWriter
from rigidimeter.core.settings import Settings, dump_settings
from rigidimeter.core.study_files import (
    PlanToml,
    StimulationChange,
    add_change,
    begun_session,
    next_block,
    write_plan,
)
from rigidimeter.planning import StudyDays, draw_days, plan
from rigidimeter.rig.acquisition.processes import Ended, Realtime
from rigidimeter.rig.console.page import AfterView, Jobs, Place, ServerState, StartRequest

NAMES = ("OFF", "DBS")
BEGUN = datetime.now(UTC) - timedelta(minutes=30)
"""When the session that is continued began; an hour after the stimulation was switched off."""


@pytest.fixture
def study(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    spec = StudyDays(("S01",), NAMES, 1, ("DBS",), order=NAMES, task="prbs")
    about = PlanToml(subjects=["S01"], days=1, conditions=list(NAMES), stimulated=["DBS"])
    protocols = {
        f"protocols/{name}.toml": toml_text(dump_settings(tiny(name, 1))) for name in NAMES
    }
    day = getattr(request, "param", "1")
    blocks = [replace(block, day=day) for block in draw_days(spec, 1)]
    return write_plan(tmp_path / "study", about, blocks, protocols).folder


def switched(study: Path, state: str, minutes_ago: float) -> StimulationChange:
    when = datetime.now(UTC) - timedelta(minutes=minutes_ago)
    change = StimulationChange("S01", when.replace(microsecond=0), state)
    add_change(study, change)
    return change


@pytest.fixture
def session(study: Path) -> Path:
    """The first session of the plan, aborted after one of its two epochs."""
    from rigidimeter.core.study_files import plan_of

    switched(study, "off", 90.0)
    planned = plan_of(study)
    due = next_block(planned, "S01")
    assert due is not None
    begun = begun_session(planned, due, BEGUN)
    settings = begun.settings
    epochs = plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed).epochs
    writer = SessionWriter(
        begun.folder, settings, [asdict(one) for one in epochs], {}, virtual=True,
        about=begun.about, created_utc=BEGUN.isoformat(),
    )  # fmt: skip
    facts = {"epoch": epochs[0].number, "label": epochs[0].label, "task": "prbs"}
    writer.event("epoch_started", time_s=0.0, condition="OFF", **facts)
    writer.event("epoch_ended", time_s=6.0, outcome="success", reason="", **facts)
    writer.close(6.0, "abort", "aborted by the operator")
    return begun.folder


@pytest.fixture
def ran(monkeypatch) -> list[dict]:
    """Give what would be recorded of each session that would be run."""
    found = []

    def supervise(target, recording, **_):
        found.append(dict(recording.about))
        raise UserError("that is enough")

    monkeypatch.setattr("rigidimeter.cli.planned_session.supervise", supervise)
    return found


def test_a_planned_session_keeps_the_range_of_motion_that_was_entered(study, rigidimeter, ran):
    """The wait comes after the range was entered; it is the guard that needs it."""
    rigidimeter(
        "run", "--next", study, "--range-deg", "-30", "60", "--unattended", "--stimulation", "off",
        "--clock-speed", "60000",
    )  # fmt: skip
    (about,) = ran
    assert (about["range"]["low_deg"], about["range"]["high_deg"]) == (-30.0, 60.0)
    assert about["plan"]["since_change_min"] >= 60.0


def continued(rigidimeter, session: Path, *options: str):
    return rigidimeter(
        "run", "--resume", session, "--out", session.with_name("rest"), "--unattended", *options
    )


def test_a_session_that_is_continued_records_the_minutes_of_its_own_beginning(
    session, rigidimeter, ran
):
    continued(rigidimeter, session)
    (about,) = ran
    assert about["plan"]["since_change_min"] == pytest.approx(90.0, abs=0.5)
    assert about["plan"]["wait_cut_short"] == ""
    assert (about["subject"], about["day"]) == ("S01", "1")


def test_a_session_is_not_continued_after_a_change_before_its_wait(
    study, session, rigidimeter, ran
):
    switched(study, "on", 10.0)
    refused = continued(rigidimeter, session)
    assert (refused.status, ran) == (1, [])
    assert "The stimulation was switched since this session began" in refused.out
    assert "the stimulation is not yet as this session needs it" in refused.err
    change = switched(study, "off", 5.0)
    continued(rigidimeter, session, "--begin-anyway", "the subject must leave")
    (about,) = ran
    assert about["plan"]["stimulation_changed_utc"] == change.changed_utc.isoformat()
    assert about["plan"]["since_change_min"] == pytest.approx(5.0, abs=0.5)
    assert about["plan"]["wait_cut_short"] == "the subject must leave"


def test_a_change_can_be_said_where_a_session_is_continued(session, rigidimeter, ran):
    refused = continued(rigidimeter, session, "--stimulation", "on")
    assert (refused.status, ran) == (1, [])
    assert "the stimulation is not yet as this session needs it" in refused.err
    assert (
        "stimulation 'half': write on or off"
        in continued(rigidimeter, session, "--stimulation", "half").err
    )


@pytest.fixture
def recorded(monkeypatch) -> None:
    """Record of each session that would be run that its epochs were done, and no sample."""

    def supervise(target, recording, **_):
        writer = recording.writer()
        for epoch in recording.protocol:
            facts = {"epoch": epoch["number"], "label": epoch["label"], "task": epoch["task"]}
            writer.event("epoch_started", time_s=0.0, condition=epoch["condition"], **facts)
            writer.event("epoch_ended", time_s=6.0, outcome="success", reason="", **facts)
        writer.close(6.0, "success", "")
        return Ended(recording.folder, "success", "", 0, 0, None, ())

    monkeypatch.setattr("rigidimeter.cli.planned_session.supervise", supervise)


def test_what_is_left_of_a_planned_session_enters_the_study(study, session, rigidimeter, recorded):
    ran = rigidimeter("run", "--resume", session, "--unattended")
    assert ran.status == 0, ran.err
    rows = (study / "sessions.csv").read_text()
    assert "sessions/S01-day-1-1-2,S01,1,OFF" in rows
    assert "Next: Session 2 of 2 of S01" in ran.out
    assert "Run the next one" in rigidimeter("study", "plan", study).out
    rigidimeter("run", "--next", study, "--unattended", "--begin-anyway", "why")
    shown = rigidimeter("study", "plan", study).out
    assert "All sessions of the plan are recorded." in shown
    assert "Run the next one" not in shown


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--out", "elsewhere"), "--out elsewhere: is outside the study"),
        (("--subject", "S02"), "--subject S02: the session that is continued is of S01"),
        (("--day", "2"), "--day 2: the session that is continued is of 1"),
    ],
)
def test_what_is_left_of_a_planned_session_stays_what_the_plan_says(
    session, rigidimeter, ran, options, sentence
):
    refused = rigidimeter("run", "--resume", session, "--unattended", *options)
    assert (refused.status, ran) == (1, [])
    assert sentence in refused.err


@pytest.mark.parametrize("study", ["pre-op"], indirect=True)
def test_the_folder_of_what_is_left_is_that_of_the_plan_whatever_the_day_is_called(
    study, rigidimeter, monkeypatch
):
    """The command that runs the rest needs no folder; the page takes the same."""

    def supervise(target, recording, **_):
        recording.writer().close(0.0, "abort", "aborted by the operator")
        return Ended(recording.folder, "abort", "aborted by the operator", 0, 0, None, ())

    monkeypatch.setattr("rigidimeter.cli.planned_session.supervise", supervise)
    switched(study, "off", 90.0)
    ended = rigidimeter("run", "--next", study, "--unattended")
    first = study / "sessions" / "S01-day-pre-op-1"
    command = f"rigidimeter run --resume {first}"
    assert f"{command}  # run the 2 epochs that are left" in ended.out
    state, asked = ServerState(Place(study, Settings(), "the defaults")), []
    state.ask = asked.append
    with Client(page("/rest")) as client:
        AfterView(state, Jobs(), lambda: True, ui.label())
        buttons = [one for one in client.elements.values() if isinstance(one, ui.button)]
        (button,) = (one for one in buttons if one.text == "Run what is left: 2")
        for one in button._event_listeners.values():
            one.handler(None)
    client.delete()
    (request,) = asked
    assert request.folder == "sessions/S01-day-pre-op-1-2"
    rigidimeter(*command.split()[1:], "--unattended")
    assert (study / request.folder).is_dir()


def led(study: Path, **request: str) -> ServerState:
    state = ServerState(Place(study, Settings(), "the defaults"))
    asked = StartRequest("sessions/rest", resume="sessions/S01-day-1-1", **request)
    lead_session(state, asked, Realtime(), lambda: None)
    return state


def test_the_page_asks_why_a_session_is_continued_before_its_wait(study, session, ran):
    led(study)
    assert ran.pop()["plan"]["since_change_min"] == pytest.approx(90.0, abs=0.5)
    switched(study, "on", 10.0)
    switched(study, "off", 5.0)
    state = led(study)
    assert not ran
    assert state.finished is not None
    assert state.finished.sentences == (
        "The stimulation was switched since this session began. Wait 55 min more, of 60 min",
    )
    led(study, begin_anyway="the subject must leave")
    place = ran.pop()["plan"]
    assert place["since_change_min"] == pytest.approx(5.0, abs=0.5)
    assert place["wait_cut_short"] == "the subject must leave"


def test_the_list_of_sessions_asks_for_the_reason(study, session):
    switched(study, "on", 10.0)
    state, asked = ServerState(Place(study, Settings(), "the defaults")), []
    state.ask = asked.append
    with Client(page("/planned")) as client:
        AfterView(state, Jobs(), lambda: True, ui.label())

        def click(text: str) -> None:
            found = [one for one in client.elements.values() if isinstance(one, ui.button)]
            (button,) = (one for one in found if one.text == text and one.visible)
            for one in button._event_listeners.values():
                one.handler(None)

        click("Run what is left: 1")
        assert not asked
        (reason,) = (
            one
            for one in client.elements.values()
            if isinstance(one, ui.input) and one.props.get("data-field") == "continue_anyway"
        )
        click("Begin anyway")
        assert not asked  # without a reason
        reason.value = "the subject must leave"
        click("Begin anyway")
    client.delete()
    (request,) = asked
    assert (request.resume, request.begin_anyway) == ("sessions/S01-day-1-1", reason.value)


@pytest.mark.parametrize("option", [("--stimulation", "on"), ("--begin-anyway", "why")])
def test_a_wait_is_of_a_plan(tmp_path, rigidimeter, option):
    refused = rigidimeter("run", "--out", tmp_path / "s", *option)
    assert refused.status == 1
    assert f"{option[0]} goes with --next STUDY alone, or with --resume of" in refused.err
