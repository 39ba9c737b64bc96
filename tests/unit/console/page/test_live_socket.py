"""What the server does with the words of a page."""

import json
from collections import deque
from types import SimpleNamespace

import pytest

from rigidimeter.acquisition.processes import shared_memory
from rigidimeter.acquisition.processes.shared_status import SharedStatus
from rigidimeter.acquisition.processes.status_values import Condition, Flag, Role
from rigidimeter.console.page.desk import Desk, Place, StartRequest
from rigidimeter.console.page.live_socket import LiveSockets, _Page
from rigidimeter.errors import UserError
from rigidimeter.settings import Settings


@pytest.fixture
def said(tmp_path, monkeypatch):
    """Let a page in control say something while a session runs; return what it is told."""
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)
    status = SharedStatus.create()
    desk = Desk(Place(tmp_path, Settings(), "defaults"))
    desk.presence.arrive("page", "tab", 1, session=False)
    sockets = LiveSockets(desk)
    memory = SimpleNamespace(status=status)
    sockets._attached = SimpleNamespace(memory=memory, notes=deque(), post_notes=lambda: None)

    def say(message, page="page"):
        one = _Page(None, page)
        sockets._hear(one, json.dumps(message, separators=(",", ":")))
        answers = [json.loads(answer) for answer in one.waiting]
        return answers[0]["say"] if "noted" not in answers[0] else answers

    yield say, status
    status.close()


def test_a_note_has_one_answer_that_says_whether_it_was_taken(said):
    say, _ = said
    note = {"kind": "note", "what": "note", "text": "coughs", "by": ""}
    assert say(note) == [{"noted": True}]
    for wrong, why in (
        ("a\u200fb", "cannot be shown"),
        ("", "needs a text"),
        ("x" * 400, "possible"),
    ):
        (answer,) = say(note | {"text": wrong})
        assert answer["noted"] is False
        assert why in answer["say"]
    (answer,) = say(note, "another")
    assert (answer["noted"], "only look" in answer["say"]) == (False, True)


def test_a_rating_outside_the_scale_of_the_study_is_noted_and_said(said, tmp_path):
    say, _ = said
    rating = {"kind": "note", "what": "rating", "text": "", "by": "E1", "epoch": 1, "score": 4}
    assert say(rating) == [{"noted": True}]  # there is no study yet
    study = 'schema = "rigidimeter.study/1"\ntitle = "E"\nreference = "OFF"\nother = "DBS"\n'
    (tmp_path / "study.toml").write_text(f"{study}[rating]\nscale = [0, 3]\n", encoding="utf-8")
    (answer,) = say(rating)
    assert answer["noted"]
    assert "4 is outside the scale of 0 to 3" in answer["say"]
    assert str(tmp_path / "study.toml") in answer["say"]
    assert say(rating | {"score": 3}) == [{"noted": True}]


def test_another_folder_is_taken_when_the_disk_takes_nothing(said, tmp_path):
    say, status = said
    order = {"kind": "save", "folder": str(tmp_path / "disk")}
    assert "the recorder can write" in say(order)
    assert status.asked_folder() is None
    status.set_condition(Role.RECORDER, Condition.TROUBLE, "the disk is full")
    assert "can only look" in say(order, "another")
    assert "whole path" in say(order | {"folder": "disk"})
    assert status.asked_folder() is None
    assert say(order) == f"ordered: save to {tmp_path / 'disk'}"
    assert status.asked_folder() == tmp_path / "disk"


def test_the_emergency_stop_counts_while_a_session_starts(tmp_path, monkeypatch):
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)
    desk = Desk(Place(tmp_path, Settings(), "defaults"))
    desk.presence.arrive("page", "tab", 1, session=False)
    sockets, page = LiveSockets(desk), _Page(None, "page")
    press = json.dumps({"kind": "emergency"})
    sockets._hear(page, press)
    assert desk.ask(StartRequest("first"))
    desk.refuse_stopped()  # what was pressed before is not of this session
    look = desk.console(None, tmp_path)
    sockets._hear(page, press)
    with pytest.raises(UserError, match="emergency stop was pressed while"):
        desk.refuse_stopped()
    status = SharedStatus.create()
    look(SimpleNamespace(status=status, names=("", "", "")))
    assert status.flag(Flag.EMERGENCY_STOP)
    status.close()
    desk.over(tmp_path, "not run", ())
    assert desk.ask(StartRequest("second"))
    desk.refuse_stopped()
