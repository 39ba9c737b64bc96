"""What the server does with the words of a page."""

import json
from types import SimpleNamespace

import pytest

from rigidimeter.acquisition.processes import shared_memory
from rigidimeter.acquisition.processes.shared_status import SharedStatus
from rigidimeter.acquisition.processes.status_values import Condition, Role
from rigidimeter.console.page.desk import Desk, Place
from rigidimeter.console.page.live_socket import LiveSockets, _Page
from rigidimeter.settings import Settings


@pytest.fixture
def said(tmp_path, monkeypatch):
    """Let a page in control say something while a session runs; return what it is told."""
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)
    status = SharedStatus.create()
    desk = Desk(Place(tmp_path, Settings(), "defaults"))
    desk.presence.arrive("page", "tab", 1, session=False)
    sockets = LiveSockets(desk)
    sockets._attached = SimpleNamespace(memory=SimpleNamespace(status=status))

    def say(message, page="page"):
        one = _Page(None, page)
        sockets._hear(one, json.dumps(message))
        return json.loads(one.waiting[-1])["say"]

    yield say, status
    status.close()


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
