"""The session of a plan on the page, without a browser: what it shows, and what a start asks."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

import pytest
from nicegui import Client, ui
from nicegui.page import page
from tests.small_study import tiny

from rigidimeter.core.files import toml_text
from rigidimeter.core.session import SessionWriter
from rigidimeter.core.settings import Settings, dump_settings
from rigidimeter.core.study_files import add_change, parse_change, plan_of, session_scan
from rigidimeter.rig.console.page import (
    BeforeView,
    Jobs,
    OutsideView,
    Place,
    PlanView,
    ServerState,
    StartRequest,
    empty_form,
)

NAMES = ("Zebra", "Quagga")


class Steps(Jobs):
    """Nothing has to be done before a session."""

    def rig_steps(self, *_):
        return ()


class Page:
    """The view of one page of a study folder."""

    def __init__(self, client: Client, study: Path, speed: float = 1.0) -> None:
        self.client, self.asked = client, []
        self.state = ServerState(Place(study, Settings(), "", clock_speed=speed))
        self.state.ask = self.asked.append
        with client:
            PlanView(self.state, Steps(), lambda: True)
            OutsideView(self.state, Steps(), lambda: True, BeforeView)

    def named(self, mark: str):
        return next(e for e in self.client.elements.values() if mark in getattr(e, "_markers", ()))

    def field(self, key: str, outside: bool = False):
        found = [
            e
            for e in self.client.elements.values()
            if isinstance(e, ui.input) and e.props.get("data-field") == key
        ]
        return found[-1 if outside else 0]

    def outside(self) -> None:
        """Unfold the form of a session outside of the plan."""
        with self.client:
            self.named("outside").value = True

    def click(self, mark: str) -> None:
        with self.client:
            for one in self.named(mark)._event_listeners.values():
                one.handler(None)

    def start_outside(self) -> None:
        with self.client:
            found = [e for e in self.client.elements.values() if isinstance(e, ui.button)]
            (start,) = (e for e in found if e.text == "Start outside the plan")
            for one in start._event_listeners.values():
                one.handler(None)

    def tick(self) -> None:
        timers = [e for e in self.client.elements.values() if isinstance(e, ui.timer)]
        with self.client:
            for timer in timers:
                timer.callback()

    def words(self) -> str:
        """Return all that the page holds, shown or not: text, properties and choices."""
        return " ".join(
            f"{getattr(e, 'text', '')} {getattr(e, 'content', '')} {e.props}"
            for e in self.client.elements.values()
        )


@pytest.fixture
def study(tmp_path, rigidimeter):
    def made(*options: str) -> Path:
        shared = tmp_path / "shared.toml"
        shared.write_text(toml_text(dump_settings(tiny("OFF", 1, epochs=1))))
        ran = rigidimeter(
            "study", "plan", tmp_path / "study", "--subjects", "S01", "--days", "2", "--conditions",
            ",".join(NAMES), "--order", "Quagga,Zebra", "--prbs-epochs", "1", "--sinusoid-epochs",
            "0", "--raters", "A,B", "--settings", shared, *options,
        )  # fmt: skip
        assert ran.status == 0, ran.err
        return tmp_path / "study"

    return made


@pytest.fixture
def client():
    with Client(page("/plan")) as client:
        yield client
    client.delete()


def test_the_due_session_waits_from_the_change_that_was_entered(client, study):
    shown = Page(client, study())
    assert shown.named("due").text == (
        "Session 1 of 4 of S01: day 1, number 1, Quagga, rated by A, B"
    )
    assert "has not begun" in shown.named("wait").text
    assert not shown.named("start").enabled
    shown.field("stimulation").value = "on"
    shown.click("enter-change")
    assert "Wait 15 min more, of 15 min" in shown.named("wait").text
    assert shown.named("countdown").text.startswith(("15:00", "14:5"))
    shown.field("stimulation").value = "on since 25:00"
    shown.click("enter-change")
    assert shown.field("stimulation").value == "on since 25:00"  # it is refused with its reason
    shown.click("start")
    assert shown.asked == []


def test_a_start_has_everything_from_the_plan(client, study):
    folder = study()
    shown = Page(client, folder, speed=60000.0)
    shown.field("stimulation").value = "on"
    shown.click("enter-change")
    shown.tick()
    shown.field("operator").value = "Kim"
    while shown.named("wait").text != "No wait is left":  # at most 15 ms of this clock
        shown.tick()
    shown.click("start")
    (request,) = shown.asked
    assert isinstance(request, StartRequest)
    assert request.folder == "sessions/S01-day-1-1"
    assert request.source == folder / "protocols/Quagga.toml"
    assert request.settings.protocol.blocks[0].condition == "Quagga"
    about = request.about
    assert (about["subject"], about["operator"], about["day"]) == ("S01", "Kim", "1")
    place = about["plan"]
    assert (place["clock_speed"], place["wait_cut_short"]) == (60000.0, "")
    assert place["since_change_min"] >= 15.0


def test_a_wait_is_cut_short_with_a_reason_alone_and_another_session_can_be_chosen(client, study):
    shown = Page(client, study())
    shown.field("operator").value = "Kim"
    shown.click("anyway")
    assert shown.asked == []
    shown.named("session").value = "2/1"
    assert "Session 3 of 4 of S01: day 2, number 1" in shown.named("due").text
    shown.field("begin_anyway").value = "the subject must leave"
    shown.click("anyway")
    (request,) = shown.asked
    assert request.folder == "sessions/S01-day-2-1"
    assert request.about["plan"]["wait_cut_short"] == "the subject must leave"
    assert request.about["plan"]["since_change_min"] is None


def test_the_folder_is_read_once_for_what_is_due_and_the_table(client, study, monkeypatch):
    folder = study()
    writer = SessionWriter(folder / "sessions" / "S01-day-9-1", Settings(), [], {}, virtual=True)
    writer.close(0.0, "success", "")
    read = []
    manifest = session_scan.read_manifest
    monkeypatch.setattr(session_scan, "read_manifest", lambda at: read.append(at) or manifest(at))
    Page(client, folder)
    assert len(read) == 1


def test_a_blinded_page_names_no_condition_and_takes_no_change(client, study):
    folder = study("--blinded")
    assert not any(name in path.name for path in folder.rglob("*") for name in NAMES)
    shown = Page(client, folder)
    code = shown.named("due").text.split(", ")[2]
    assert code.startswith("code-")
    assert not shown.named("enter-change").parent_slot.parent.visible
    assert "rigidimeter study stimulation" in shown.named("switched").text
    add_change(folder, parse_change("on", "S01", datetime.now(UTC)))  # in another program
    shown.tick()
    assert "Wait 60 min more" in shown.named("wait").text
    protocol = folder / f"protocols/{code}.toml"
    wrong = protocol.read_text().replace('condition = "Quagga"', 'condition = "Zebra"')
    assert not any(name in shown.words() for name in NAMES)
    protocol.write_text(wrong)
    (folder / "plan.csv").touch()
    shown.tick()
    assert "names condition 'code-" in shown.named("refused").text
    assert not any(name in shown.words() for name in NAMES)


def test_a_session_outside_of_the_plan_has_no_place_in_it(client, study):
    shown = Page(client, study())
    shown.outside()
    shown.field("subject", outside=True).value = "S01"
    shown.field("operator", outside=True).value = "Kim"
    shown.start_outside()
    assert shown.asked == []  # without its day it would be a day of its own
    assert shown.field("day").error == "day of the study: must be given"
    shown.field("day").value = "2"
    shown.start_outside()
    (request,) = shown.asked
    assert request.folder.startswith("S01-")
    assert "plan" not in request.about
    assert request.about["day"] == "2"
    assert request.about["subject"] == "S01"
    assert request.settings.protocol.blocks[0].condition == "OFF"


def test_no_code_stands_in_place_of_a_condition_that_the_form_would_have(client, study):
    """Whoever knows the protocol of the console would know what the code stands for."""
    folder = study("--blinded")
    draft = empty_form(Settings()) | {"condition0": "Quagga", "condition1": "code-A"}
    (folder / "draft.json").write_text(json.dumps(draft))
    shown = Page(client, folder)
    shown.outside()
    assert [shown.field(f"condition{k}", outside=True).value for k in (0, 1)] == ["", "code-A"]
    buttons = [e.text for e in client.elements.values() if isinstance(e, ui.button)]
    assert not any(text.startswith(("Predict", "Dry run")) for text in buttons)


def test_a_session_outside_of_a_blinded_plan_takes_its_codes(client, study):
    folder = study("--blinded")
    shown = Page(client, folder)
    shown.outside()
    codes = plan_of(folder).about.codes
    assert not any(name in shown.words() for name in NAMES)
    shown.field("subject", outside=True).value = "S01"
    shown.field("operator", outside=True).value = "Kim"
    shown.start_outside()
    assert shown.asked == []
    error = shown.field("condition0", outside=True).error
    assert error == "condition: write a code of the plan: code-A, code-B"
    shown.field("condition0", outside=True).value = codes["Quagga"]
    shown.field("condition1", outside=True).value = codes["Zebra"]
    shown.field("epochs0", outside=True).value = "many"
    assert not any(name in shown.words() for name in NAMES)
    shown.field("epochs0", outside=True).value = "2"
    shown.field("day").value = "2"
    shown.start_outside()
    (request,) = shown.asked
    assert request.about["codes"] == codes
    assert request.about["blinded"] is True
    found = [block.condition for block in request.settings.protocol.blocks]
    assert found == ["Quagga", "Zebra"]
    assert not any(name in shown.words() for name in NAMES)
    assert not any(name in (folder / "draft.json").read_text() for name in NAMES)


def test_a_plan_that_was_not_written_to_its_end_is_none_and_can_be_drawn_again(study):
    folder = study()
    (folder / "plan.toml").unlink()  # it is written last
    assert not Place(folder, Settings(), "").planned
    study()
    assert Place(folder, Settings(), "").planned


def test_a_damaged_plan_is_an_error_on_the_page(client, study):
    folder = study()
    table = folder / "plan.csv"
    table.write_text(table.read_text().replace("S01,1,1,Quagga", "S01,1,1,Okapi"))
    shown = Page(client, folder)
    assert "condition Okapi is not one of those in plan.toml" in shown.named("refused").text
    assert not shown.named("start").enabled
