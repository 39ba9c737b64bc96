"""What the server does with the messages of a page, without a browser and without a clock."""

import asyncio
import json
import math
import time
from collections import deque
from types import SimpleNamespace

import numpy as np
import pytest
from starlette.websockets import WebSocketDisconnect
from tests.unit.rig.acquisition.exact_rig import LONGEST
from tests.unit.rig.acquisition.whole_session import RETURN, session
from tests.unit.rig.console.test_session_progress import EPOCHS

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.rig.acquisition import NOTHING, Command
from rigidimeter.rig.acquisition.processes import (
    Flag,
    ProcessCondition,
    Role,
    SessionMemory,
    SharedStatus,
    SharedSupervision,
    shared_memory,
)
from rigidimeter.rig.console import Alarm, SessionPlan
from rigidimeter.rig.console.page import (
    ORDERS,
    LiveSockets,
    OpenPage,
    Place,
    ServerState,
    StartRequest,
)


@pytest.fixture
def said(tmp_path, monkeypatch):
    """Let a page in control say something while a session runs; return what it is told."""
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)
    status = SharedStatus.create()
    state = ServerState(Place(tmp_path, Settings(), "defaults"))
    state.presence.arrive("page", "tab", 1, session=False)
    sockets = LiveSockets(state)
    memory = SimpleNamespace(status=status)
    sockets._attached = SimpleNamespace(memory=memory, notes=deque(), post_notes=lambda: None)

    def say(message, page="page"):
        one = OpenPage(None, page)
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
    assert (answer["noted"], "this page watches" in answer["say"]) == (False, True)


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
    status.set_condition(Role.RECORDER, ProcessCondition.TROUBLE, "the disk is full")
    assert "this page watches" in say(order, "another")
    assert "full path" in say(order | {"folder": "disk"})
    assert status.asked_folder() is None
    assert say(order) == f"ordered: save to {tmp_path / 'disk'}"
    assert status.asked_folder() == tmp_path / "disk"


@pytest.mark.parametrize("presses", ["page", "a page that watches"])
def test_the_emergency_stop_counts_while_a_session_starts(tmp_path, monkeypatch, presses):
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)
    state = ServerState(Place(tmp_path, Settings(), "defaults"))
    state.presence.arrive("page", "tab", 1, session=False)
    sockets, page = LiveSockets(state), OpenPage(None, presses)
    press = json.dumps({"kind": "emergency"})
    sockets._hear(page, press)
    assert state.ask(StartRequest("first"))
    state.refuse_stopped()  # what was pressed before is not of this session
    look = state.console(None, tmp_path)
    sockets._hear(page, press)
    with pytest.raises(UserError, match="emergency stop was pressed while"):
        state.refuse_stopped()
    status = SharedStatus.create()
    look(SimpleNamespace(status=status, names=("", "", "")))
    assert status.flag(Flag.EMERGENCY_STOP)
    status.close()
    state.over(tmp_path, "not run", ())
    assert state.ask(StartRequest("second"))
    state.refuse_stopped()


class Operator:
    """A page in control, and one that only looks, beside a session in shared memory."""

    def __init__(self, place):
        self.memory = SessionMemory.create(tick_rate_hz=50.0, ring_s=1.0)
        self.status = self.memory.status
        self.state = ServerState(Place(place, Settings(), "defaults"))
        self.state.presence.arrive("page", "tab", 1, session=False)
        self.sockets = LiveSockets(self.state)
        self.sockets._attached = SimpleNamespace(memory=self.memory, notes=deque())
        self.told = []

    def sends(self, kind, page="page", **values):
        one = OpenPage(None, page)
        self.sockets._hear(one, json.dumps({"kind": kind, **values}))
        self.told += one.waiting

    def orders(self):
        """Return the commands that wait for the loop."""
        return list(iter(lambda: self.status.take().command, Command.NONE))

    def session(self, messages):
        """Run a session in which the page sends each of these at its tick."""

        def change(tick, reading):
            assert tick < LONGEST, "it goes on for ever"
            for message in messages.get(tick, ()):
                self.sends(**message)
            return reading

        for role in (Role.CONSOLE, Role.RECORDER):
            self.status.beat(role, 1)
        still = {"now_ns": lambda: 1, "boot_ns": lambda: 1}
        return session(SharedSupervision(self.memory, **still), change=change)


@pytest.fixture
def operator(tmp_path, monkeypatch):
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)
    made = Operator(tmp_path)
    yield made
    made.memory.close()


@pytest.mark.parametrize("muscles", [["biceps", "triceps"], []])
def test_the_page_gets_each_point_of_the_envelope_once_and_nothing_without_emg(
    operator, muscles, tmp_path
):
    source = "virtual" if muscles else "none"
    settings = parse_settings({"emg": {"source": source, "muscles": muscles}})
    follow = operator.state.console(SessionPlan(settings, EPOCHS), tmp_path)
    follow(operator.memory)
    operator.sockets._attached = None
    operator.sockets._follow()
    sent = []
    for points in ([[0.02, 4.0, 5.0]], [[0.02, 4.0, 5.0], [0.04, 4.0, 6.0]]):
        operator.status.show_envelope(np.array(points).tobytes())
        sent.append(operator.sockets._attached.state().get("emg"))
    operator.sockets._attached.memory.close()
    if muscles:
        points = [[[0.02, 4.0, 5.0]], [[0.04, 4.0, 6.0]]]
        assert sent == [{"muscles": muscles, "points": one} for one in points]
    else:
        assert sent == [None, None]


SENT = 30
"""A tick in the first epoch, in which the arm moves."""


def commands(ran):
    return [sample.velocity_command_rad_s for sample in ran.sink.samples]


@pytest.mark.parametrize("page", ["page", "a page that watches"])
def test_the_emergency_stop_takes_the_power_and_nothing_is_commanded_after_it(operator, page):
    ran = operator.session({SENT: [{"kind": "emergency", "page": page}]})
    assert ran.error is None
    assert commands(ran)[SENT - 1] != 0.0  # it had to be stopped
    assert set(commands(ran)[SENT:]) == {0.0}
    read = [k for k, call in enumerate(ran.rig.calls) if call[0] == "read"][SENT]
    after = ran.rig.calls[read + 1 :]
    assert after[0] == ("disable",)
    assert {call for call in after if call[0] in ("write", "enable")} == {("write", 0.0)}
    assert ran.epochs == [(1, "fail")]
    assert "the emergency stop was pressed" in ran.result.reason
    assert operator.told == []


def test_a_page_that_is_left_has_the_arm_held_until_it_says_to_go_on(operator):
    resumed = SENT + 100  # longer than what was left of the epoch
    ran = operator.session(
        {
            SENT: [{"kind": "leave"}],
            resumed: [{"kind": "order", "command": "resume"}],
        }
    )
    assert ran.error is None
    paused, went_on = ran.sink.of("order")
    assert (paused["command"], paused["state"]) == ("pause_now", "paused")
    assert went_on["command"] == "resume"
    assert any(commands(ran)[SENT - 5 : SENT])
    assert not any(sample.perturbation_nm for sample in ran.sink.samples[SENT + 1 : resumed])
    assert not any(commands(ran)[SENT + RETURN + 2 : resumed])  # once it is back at the start
    assert any(commands(ran)[resumed:])
    assert ran.rig.of("disable") == [None]  # at the end


def test_the_stop_and_a_page_that_leaves_also_end_a_check_of_the_rig(operator):
    for kind, page, stops in (
        ("emergency", "page", True),
        ("emergency", "another", True),
        ("leave", "page", True),
        ("leave", "another", False),
    ):
        assert operator.state.begin_check("daily check")
        operator.sends("beat")
        assert not operator.state.check_stopped
        operator.sends(kind, page)
        assert operator.state.check_stopped == stops, (kind, page)
        operator.state.end_check()


def test_each_message_does_what_it_says_and_nothing_else(operator):
    status = operator.status
    for name, command in ORDERS.items():
        operator.sends("order", command=name)
        assert operator.orders() == [command]
    operator.sends("leave")
    assert operator.orders() == [Command.PAUSE_NOW]
    assert not any(status.flag(flag) for flag in Flag)
    operator.sends("emergency")
    assert status.take() is NOTHING
    assert [flag for flag in Flag if status.flag(flag)] == [Flag.EMERGENCY_STOP]
    assert operator.told == []


def test_a_page_that_watches_can_stop_and_nothing_else_and_its_beat_is_nobodys(operator):
    for kind in ("beat", "leave"):
        operator.sends(kind, "another")
    operator.sends("order", "another", command="abort")
    assert operator.orders() == []
    assert not any(operator.status.flag(flag) for flag in Flag)
    assert operator.status.age_s(Role.CONSOLE) == math.inf
    assert ["this page watches" in said for said in operator.told] == [True] * 2
    operator.sends("emergency", "another")
    assert [flag for flag in Flag if operator.status.flag(flag)] == [Flag.EMERGENCY_STOP]
    assert len(operator.told) == 2
    operator.sends("beat")
    assert operator.status.age_s(Role.CONSOLE) < math.inf


def test_a_page_is_there_by_its_beat_and_may_be_away_once_it_said_so(operator):
    presence = operator.state.presence
    later_ns = time.monotonic_ns() + 5_000_000_000
    operator.sends("beat")
    beat_ns = presence.seen_ns(later_ns, still=True)
    assert 1 < beat_ns < later_ns
    operator.sends("leave")
    assert presence.seen_ns(later_ns, still=True) == later_ns
    assert presence.seen_ns(later_ns, still=False) == beat_ns


def heard(sockets):
    """Return how many stops and cautions a page is told of."""
    page = OpenPage(None, "page")
    sockets._pages = {page}
    sockets._send_state()
    return json.loads(page.waiting[-1])["state"]["alarms"]


def test_a_session_that_did_not_run_or_ended_badly_is_heard_once(tmp_path):
    state = ServerState(Place(tmp_path, Settings(), "defaults"))
    sockets = LiveSockets(state)
    assert heard(sockets) == {"stop": 0, "caution": 0}
    for outcome, stops in (("not run", 1), ("success", 1), ("fail", 2), ("abort", 3)):
        state.over(tmp_path, outcome, ("why",))
        assert heard(sockets) == {"stop": stops, "caution": 0}, outcome
        assert heard(sockets) == {"stop": stops, "caution": 0}, outcome


def test_what_is_heard_of_a_session_that_runs_is_counted_for_all_pages(operator, tmp_path):
    """Of a stop that was heard the end is not heard again; of one that was only a hold it is."""
    sockets, state = operator.sockets, operator.state
    attached = sockets._attached
    attached.state, attached.running = dict, None
    attached.heard, attached.stopped = Alarm.CAUTION, False
    assert heard(sockets) == {"stop": 0, "caution": 1}
    attached.heard = Alarm.STOP
    for stopped, stops in ((False, 2), (True, 3)):
        sockets._attached, attached.stopped = attached, stopped
        heard(sockets)
        sockets._attached = None
        state.over(tmp_path, "fail", ("why",))
        assert heard(sockets)["stop"] == stops


class Socket:
    """Says these messages and is closed then."""

    def __init__(self, *messages):
        self.messages, self.closed = [json.dumps(one) for one in messages], None

    async def accept(self):
        pass

    async def receive_text(self):
        if not self.messages:
            raise WebSocketDisconnect(1001)
        return self.messages.pop(0)

    async def close(self, code):
        self.closed = code


HELLO = {"kind": "hello", "page": "page", "tab": "tab"}


def test_nobody_is_there_once_the_connection_is_closed(operator):
    presence, sockets = operator.state.presence, operator.sockets
    presence.gone("page")
    sockets.admit("page")
    asyncio.run(sockets.serve(Socket(HELLO, {"kind": "beat"}, {"kind": "leave"})))
    assert operator.orders() == [Command.PAUSE_NOW]
    assert operator.status.age_s(Role.CONSOLE) < math.inf
    assert not presence.has_control("page")
    operator.sends("order", command="abort")
    assert operator.orders() == []


def test_a_page_that_was_not_sent_from_here_is_turned_away(operator):
    socket = Socket(HELLO, {"kind": "emergency"})
    operator.state.presence.gone("page")
    asyncio.run(operator.sockets.serve(socket))
    assert (socket.closed, len(socket.messages)) == (1008, 1)
    assert not operator.status.flag(Flag.EMERGENCY_STOP)
