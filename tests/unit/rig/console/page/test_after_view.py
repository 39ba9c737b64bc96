"""The list of sessions on the page, without a browser: the server's side of its rows."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from nicegui import Client, ui
from nicegui.page import page

from rigidimeter.core.session import SessionWriter
from rigidimeter.core.settings import Settings
from rigidimeter.rig.console.page import AfterView, CommandResult, Jobs, Place, ServerState

BEGUN = {"task": "prbs", "condition": "OFF", "time_s": 0.0}


def session(root: Path, name: str, **about: object) -> SessionWriter:
    writer = SessionWriter(root / name, Settings(), [], {}, virtual=True, about=about)
    writer.event("epoch_started", epoch=1, label="1", **BEGUN)
    return writer


def ended(writer: SessionWriter) -> None:
    writer.event("session_ended", outcome="success", reason="")
    writer.close_files()


@pytest.fixture
def client():
    with Client(page("/after")) as client:
        yield client
    client.delete()


def shown(client: Client, kind: type[ui.element]) -> dict[int, str]:
    """Return the words of what can be seen of a kind, by the number a click names."""
    return {
        number: one.text for number, one in client.elements.items()
        if isinstance(one, kind) and one.visible
    }  # fmt: skip


def test_a_row_stays_when_a_session_ends_so_that_no_click_on_it_is_lost(client, tmp_path):
    ended(session(tmp_path, "S01-1"))
    state = ServerState(Place(tmp_path, Settings(), "the protocol"))
    AfterView(state, Jobs(), lambda: True, ui.label())
    (timer,) = (one for one in client.elements.values() if isinstance(one, ui.timer))
    (first,) = (one for one in client.elements.values() if isinstance(one, ui.expansion))
    before = shown(client, ui.button)
    assert list(before.values()).count("Leave out") == 1
    assert "Recover" not in before.values()

    second = session(tmp_path, "S01-2")
    ended(second)
    state.over(second.folder, "success", ())
    timer.callback()
    assert before.items() <= shown(client, ui.button).items()
    rows = first.parent_slot.children
    assert [row.text.split(":")[0] for row in rows] == ["S01-2", "S01-1"]
    assert [row.value for row in rows] == [True, False]


def test_rows_say_what_is_known_now(client, tmp_path):
    writer = session(tmp_path, "S01-1")
    state = ServerState(Place(tmp_path, Settings(), "the protocol"))
    AfterView(state, Jobs(), lambda: True, ui.label())
    (timer,) = (one for one in client.elements.values() if isinstance(one, ui.timer))
    assert "still being recorded" in shown(client, ui.label).values()
    assert "Repeat" not in shown(client, ui.button).values()
    writer.event("epoch_ended", epoch=1, outcome="success", reason="", time_s=1.0)
    writer.event("epoch_started", epoch=2, label="2", **BEGUN)
    ended(writer)
    state.over(writer.folder, "success", ())
    timer.callback()
    words = list(shown(client, ui.label).values())
    assert "epoch 1 · OFF · prbs · success" in words
    assert "epoch 2 · OFF · prbs · not ended" in words
    assert "still being recorded" not in words
    assert list(shown(client, ui.button).values()).count("Repeat") == 2


@pytest.mark.parametrize("name", ["S01-1", "sessions/S01-day-1-1"])
def test_leaving_out_is_cancelled_confirmed_and_taken_back(client, tmp_path, name):
    ended(session(tmp_path, name))
    AfterView(ServerState(Place(tmp_path, Settings(), "")), Jobs(), lambda: True, ui.label())

    def click(words: str) -> None:
        """Click the newest button of these words: that of the dialogue, if one is open."""
        number = max(n for n, text in shown(client, ui.button).items() if text == words)
        handlers = client.elements[number]._event_listeners.values()
        with client:
            for one in handlers:
                one.handler(None)

    def answer(reason: str, by: str) -> None:
        fields = [one for one in client.elements.values() if isinstance(one, ui.input)]
        for name, value in (("reason", reason), ("by", by)):
            [one for one in fields if one.props.get("data-field") == name][-1].value = value

    def dialogue() -> bool:
        return [one for one in client.elements.values() if isinstance(one, ui.dialog)][-1].value

    table = tmp_path / "exclusions.csv"
    click("Leave out")
    answer("coughed", "Kim")
    click("Cancel")
    assert not dialogue()
    assert not table.exists()
    click("Leave out")
    answer("coughed", "Kim")
    click("Leave out")
    assert not dialogue()
    assert "left out: coughed (Kim)" in " ".join(shown(client, ui.label).values())
    click("Include again")
    assert "It was left out: coughed (Kim)." in " ".join(shown(client, ui.label).values())
    answer("in the rest", "Lee")
    click("Include again")
    assert not dialogue()
    assert f"by Lee (in the rest): {name},1,coughed,Kim" in table.read_text("utf-8")
    assert "left out: coughed" not in " ".join(
        words for words in shown(client, ui.label).values() if words.startswith("epoch 1")
    )


def test_the_planned_raters_rate_a_session_after_it(client, tmp_path):
    name = "sessions/S01-day-1-1"
    ended(session(tmp_path, name, subject="S01", day="1", plan={"raters": "A B"}))
    AfterView(ServerState(Place(tmp_path, Settings(), "")), Jobs(), lambda: True, ui.label())

    def click(words: str) -> None:
        number = max(n for n, text in shown(client, ui.button).items() if text == words)
        with client:
            for one in client.elements[number]._event_listeners.values():
                one.handler(None)

    def score(text: str) -> None:
        click("Rate")
        fields = [one for one in client.elements.values() if isinstance(one, ui.input)]
        [one for one in fields if one.props.get("data-field") == "rating"][-1].value = text
        click("Save")

    assert "Ratings: A: not rated yet; B: not rated yet" in shown(client, ui.label).values()
    score("bad")
    score("1,5")
    assert "Ratings: A: 1.5; B: not rated yet" in shown(client, ui.label).values()
    score("2")  # once alone
    assert f"S01,1,OFF,A,1.5,{name}" in (tmp_path / "ratings.csv").read_text()
    assert (tmp_path / "ratings.csv").read_text().count(name) == 1


def test_a_double_click_runs_a_command_once(client, tmp_path):
    asked = []

    class Slow(Jobs):
        async def command(self, *arguments, **_):
            asked.append(arguments)
            await asyncio.sleep(0.01)
            return CommandResult(True, "done")

    view = AfterView(ServerState(Place(tmp_path, Settings(), "")), Slow(), lambda: True, ui.label())

    async def run(command):
        with client:
            return await view._command(command, "S01-1")

    async def twice():
        return await asyncio.gather(run("estimate"), run("estimate"))

    assert asyncio.run(twice()) == [True, False]
    assert asyncio.run(run("report"))
    assert [command for command, _ in asked] == ["estimate", "report"]
