"""A plan of days is drawn on the page: the values, the table before it is written, the files."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest
from nicegui import Client, ui
from nicegui.page import page

from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import plan_of
from rigidimeter.planning import DESIGN_SCHEMA
from rigidimeter.rig.console.page import (
    CommandResult,
    DrawView,
    Jobs,
    Place,
    PlanView,
    ServerState,
    draw_view,
    empty_plan_form,
    read_plan_form,
)

NAMES = ("Zebra", "Quagga")
ENTERED = {
    "subjects": "S01, S02",
    "days": "3",
    "conditions": "Zebra,Quagga,Okapi",
    "stimulated": "Quagga",
    "days_of": "Quagga=2, Okapi=1",
    "sessions": "2",
    "seed": "7",
    "prbs_epochs": "4",
    "sinusoid_epochs": "0",
    "rests_s": "10; 20",
    "wait_after_on": "12,5",
    "wait_after_off": "30",
    "raters": "A,B",
    "order": "drawn",
}
OPTIONS = (
    "--subjects", "S01,S02", "--days", 3, "--conditions", "Zebra,Quagga,Okapi", "--stimulated",
    "Quagga", "--days-of", "Quagga=2", "--days-of", "Okapi=1", "--sessions", 2, "--seed", 7,
    "--prbs-epochs", 4, "--sinusoid-epochs", 0, "--rests", "10,20", "--wait-after-on", 12.5,
    "--wait-after-off", 30, "--raters", "A,B", "--order", "drawn",
)  # fmt: skip


class Form:
    """The form on one page, with its folder."""

    def __init__(self, client: Client, study: Path, jobs: Jobs | None = None) -> None:
        self.client, self.written = client, []
        self.state = ServerState(Place(study, Settings(), "the defaults"))
        with client:
            self.view = DrawView(
                self.state, jobs or Jobs(), lambda: True, lambda: self.written.append(study)
            )

    def named(self, mark: str):
        (one,) = (e for e in self.client.elements.values() if mark in getattr(e, "_markers", ()))
        return one

    def field(self, key: str):
        if key in ("order", "blinded"):
            return self.named(key)
        return next(
            e
            for e in self.client.elements.values()
            if isinstance(e, ui.input) and e.props.get("data-field") == f"plan_{key}"
        )

    def enter(self, **values: object) -> None:
        for key, value in values.items():
            self.field(key).value = value

    def click(self, mark: str):
        with self.client:
            for one in self.named(mark)._event_listeners.values():
                one.handler(None)

    def table(self) -> str:
        return next(
            e.content
            for e in self.client.elements.values()
            if isinstance(e, ui.html) and "plan" in e.classes and e.parent_slot.parent.visible
        )

    def errors(self) -> dict[str, str]:
        fields = {key: self.field(key).error for key in ENTERED}
        return {key: text for key, text in fields.items() if text}


@pytest.fixture
def client():
    with Client(page("/draw")) as client:
        yield client
    client.delete()


def files(folder: Path) -> dict[str, bytes]:
    found = {p.relative_to(folder).as_posix(): p for p in folder.rglob("*") if p.is_file()}
    return {name: path.read_bytes() for name, path in found.items()}


@pytest.mark.parametrize("blinded", [False, True])
def test_page_and_command_write_the_same_files(client, tmp_path, rigidimeter, blinded):
    shown = Form(client, tmp_path / "page" / "study")
    shown.enter(**ENTERED, blinded=blinded)
    shown.click("draw")
    assert not (tmp_path / "page").exists()
    shown.click("write")
    assert shown.written
    ran = rigidimeter(
        "study", "plan", tmp_path / "command" / "study", *OPTIONS, *["--blinded"][: int(blinded)]
    )
    assert ran.status == 0, ran.err
    of_page, of_command = files(tmp_path / "page/study"), files(tmp_path / "command/study")
    assert of_page["plan.csv"] == of_command["plan.csv"]
    assert of_page == of_command


def test_a_form_as_it_is_asks_for_what_the_command_does(tmp_path, rigidimeter):
    form = empty_plan_form() | {"subjects": "S01"}
    plan = read_plan_form(form, Settings()).plan
    assert plan is not None
    plan.write(tmp_path / "page")
    assert rigidimeter("study", "plan", tmp_path / "command", "--subjects", "S01").status == 0
    assert files(tmp_path / "page")["plan.csv"] == files(tmp_path / "command")["plan.csv"]


def test_the_plan_is_shown_before_it_is_written_and_taken_back_by_a_change(client, tmp_path):
    shown = Form(client, tmp_path / "study")
    shown.enter(subjects="S01", days="2", order="given", given="DBS,OFF", wait_after_off="30")
    assert not shown.named("write").parent_slot.parent.visible
    shown.click("draw")
    assert shown.named("summary").text == (
        "4 sessions on 2 days, 2 h of waits, order given, seed 2023. Nothing is written yet."
    )
    assert "<td>1</td><td>1</td><td>DBS</td><td>prbs sinusoid</td><td>15</td>" in shown.table()
    shown.enter(days="3")
    shown.click("write")
    assert not (tmp_path / "study").exists()


def test_what_the_wait_leaves_is_said_for_named_and_other_waits(client, tmp_path):
    shown = Form(client, tmp_path)
    assert "the effect of stimulation is gone" in shown.named("leaves").text
    shown.named("named-wait").value = "15"
    assert shown.field("wait_after_off").value == "15"
    assert "as in the paper" in shown.named("leaves").text
    shown.enter(wait_after_off="45")
    assert "some of the effect may be left" in shown.named("leaves").text
    assert shown.named("named-wait").value is None


@pytest.mark.parametrize(
    ("values", "key", "sentence"),
    [
        ({"subjects": ""}, "subjects", "write different names with commas between, such as A,B"),
        ({"subjects": "../S01"}, "subjects", "'../S01' is not allowed; use 1 to 40 letters"),
        ({"days": "two"}, "days", "Days of each subject: 'two' is no number"),
        ({"days": "0"}, "days", "must be from 1 to 1000"),
        ({"conditions": "OFF,OFF"}, "conditions", "write different names"),
        ({"stimulated": "ON"}, "stimulated", "is not one of the conditions OFF, DBS"),
        ({"days_of": "DBS"}, "days_of", "write each condition once with its days, such as DBS=4"),
        ({"days_of": "DBS=9"}, "days_of", "must be from 1 to the 8 days of the study"),
        ({"sessions": "7"}, "sessions", "must be from 1 to 6"),
        ({"conditions": "1,2,3,4,5,6,7,8,9"}, "order", "too many orders to draw one"),
        ({"prbs_epochs": "0", "sinusoid_epochs": "0"}, "prbs_epochs", "a session needs an epoch"),
        ({"rests_s": "-1"}, "rests_s", "rests_s"),
        ({"wait_after_off": "1500"}, "wait_after_off", "must be from 0 to 1440"),
        ({"raters": "Dr A"}, "raters", "'Dr A' is not allowed"),
        ({"seed": "-1"}, "seed", "must be from 0 to 2147483648"),
    ],
)
def test_what_is_wrong_is_said_at_its_field(client, tmp_path, values, key, sentence):
    shown = Form(client, tmp_path / "study")
    shown.enter(**{"subjects": "S01", **values})
    shown.click("draw")
    assert list(shown.errors()) == [key]
    assert sentence in shown.errors()[key]
    assert shown.named("draw-problem").text == "1 field needs correction"
    shown.click("write")
    assert not (tmp_path / "study").exists()


def test_a_given_order_is_asked_for_and_checked(client, tmp_path):
    shown = Form(client, tmp_path)
    shown.enter(subjects="S01", order="given")
    shown.click("draw")
    assert "such as OFF,DBS" in shown.field("given").error
    shown.enter(given="OFF")
    shown.click("draw")
    assert "must name each of the conditions OFF, DBS once" in shown.field("given").error


def test_a_plan_that_came_meanwhile_is_not_written_over(client, tmp_path, rigidimeter):
    shown = Form(client, tmp_path / "study")
    shown.enter(subjects="S01")
    shown.click("draw")
    assert rigidimeter("study", "plan", tmp_path / "study", "--subjects", "S09").status == 0
    shown.click("write")
    assert "is there already" in shown.named("draw-problem").text
    assert plan_of(tmp_path / "study").about.subjects == ["S09"]
    assert not shown.written


def test_a_plan_that_the_command_wrote_is_gone_on_to(client, tmp_path, rigidimeter):
    shown = Form(client, tmp_path / "study")
    (timer,) = (one for one in client.elements.values() if isinstance(one, ui.timer))
    timer.callback()
    assert not shown.written
    assert rigidimeter("study", "plan", tmp_path / "study", "--subjects", "S09").status == 0
    timer.callback()
    assert shown.written


def test_days_and_epochs_are_those_of_the_prediction(client, tmp_path, monkeypatch):
    monkeypatch.setattr(draw_view, "prediction_lines", lambda *_: ["5 days"])
    asked = []

    class Predicting(Jobs):
        async def command(self, *words, folder):
            asked.append(words)
            detection = [{"planned": {"days_needed": 5, "epochs_a_day": [4, 4]}}]
            text = json.dumps({"schema": DESIGN_SCHEMA, "detection": detection})
            (folder / "design.json").write_text(text)
            return CommandResult(True, "")

    shown = Form(client, tmp_path, Predicting())
    shown.enter(subjects="S01")
    with client:
        asyncio.run(shown.view._predict())
    assert (shown.field("days").value, shown.field("prbs_epochs").value) == ("5", "4")
    assert asked[0][0] == "design"
    assert "--detect" in asked[0]


def test_a_blinded_plan_is_shown_and_led_in_codes(client, tmp_path):
    """The form holds the names that were entered; neither the drawn plan nor what follows does."""
    shown = Form(client, tmp_path / "study")
    shown.enter(subjects="S01", days="2", conditions=",".join(NAMES), blinded=True)
    shown.click("draw")
    assert "<td>code-A</td>" in shown.table()
    assert not any(name in shown.table() for name in NAMES)
    shown.click("write")
    with Client(page("/after-drawing")) as other:

        class Steps(Jobs):
            def rig_steps(self, *_):
                return ()

        PlanView(shown.state, Steps(), lambda: True)
        words = " ".join(
            f"{getattr(e, 'text', '')} {getattr(e, 'content', '')} {e.props}"
            for e in other.elements.values()
        )
    other.delete()
    assert "day 1, number 1, code-" in words
    assert not any(name in words for name in NAMES)


def test_nothing_is_drawn_while_a_session_runs(client, tmp_path):
    """Drawing takes seconds, in which no page could stop the session."""
    shown = Form(client, tmp_path)
    shown.enter(subjects="S01")
    assert shown.state.begin_check("check")
    shown.click("draw")
    assert not shown.named("write").parent_slot.parent.visible
    shown.state.checking = ""
    shown.click("draw")
    assert shown.named("write").parent_slot.parent.visible
