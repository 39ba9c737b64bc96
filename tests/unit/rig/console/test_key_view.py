"""Line and keys on a pseudo-terminal: orders, widths, a terminal that takes nothing, the end."""

import fcntl
import json
import os
import pty
import select
import struct
import termios
import time
from contextlib import suppress

import pytest
from tests.unit.rig.console.test_session_progress import EPOCHS, ended, started

from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition import NOTHING, Command, Order, Phase, State
from rigidimeter.rig.acquisition.processes import (
    Flag,
    LoopStatus,
    ProcessCondition,
    Role,
    SessionMemory,
)
from rigidimeter.rig.console import (
    BELL,
    LEAVE,
    KeyView,
    LineView,
    Observer,
    SessionPlan,
    Tty,
    discard_typed,
    terminal_view,
)
from rigidimeter.rig.guard import Cause

PLAN = SessionPlan(Settings(), EPOCHS, virtual=True)
RUNNING = LoopStatus(
    State.RUNNING, 30_000, 1, time_s=30.0, angle_rad=0.1, until_s=45.0, phase=Phase.EPOCH
)


class Person:
    """Who sits at the other end of the terminal."""

    def __init__(self) -> None:
        self.far, self.near = pty.openpty()
        os.set_blocking(self.far, False)
        self.resize(80)
        self.shared = SessionMemory.create(100.0, 1.0)
        self.status = self.shared.status
        self.now_s = 100.0
        self.before = termios.tcgetattr(self.near)
        self.tty = Tty(self.near, self.near)
        self.tty.__enter__()
        self.view = KeyView(self.tty, PLAN, lambda: self.now_s)

    def resize(self, width: int) -> None:
        fcntl.ioctl(self.near, termios.TIOCSWINSZ, struct.pack("HHHH", 24, width, 0, 0))

    def press(self, keys: bytes) -> None:
        os.write(self.far, keys)
        self.look()

    def look(self) -> None:
        self.now_s += 1.0
        self.view(self.shared)

    def sees(self) -> bytes:
        """Return what came on the screen since."""
        seen = b""
        while select.select([self.far], [], [], 0.05)[0]:
            seen += os.read(self.far, 1 << 20)
        return seen

    def reads(self) -> list[str]:
        """Return what stands on the terminal: lines that stay, and the one in place."""
        self.look()
        rows = self.sees().decode().replace("\r\n", "\n").split("\n")
        return [row.rpartition("\r\x1b[K")[2].strip() for row in rows]

    def orders(self) -> list[Command]:
        found = []
        while (order := self.status.take()) is not NOTHING:
            found.append(order.command)
        return found

    def close(self) -> None:
        os.close(self.far)
        os.close(self.near)
        self.shared.unlink()
        self.shared.close()


@pytest.fixture
def person():
    person = Person()
    person.status.show_loop(RUNNING)
    person.look()
    yield person
    person.close()


def test_the_status_is_overwritten_in_place_with_the_nearest_limit(person):
    for event in (started(1, "1"), ended(1), started(2, "2")):
        assert person.shared.events.push(0, event)
    person.resize(200)
    person.status.show_loop(RUNNING._replace(energy_j=3.0))
    lines = [person.reads()[-1] for _ in range(3)]
    assert lines[-1].startswith(
        "30.0 s | epoch 2 of 3: OFF, sinusoid | energy 3.00 of 5 J (60 %) | epoch: 15 s left"
    )
    assert b"\n" not in person.sees()


def test_keys_are_named_at_the_start():
    person = Person()
    assert person.reads()[0].startswith("SPACE or e: EMERGENCY STOP, h: halt")
    person.close()


@pytest.mark.parametrize("width", [200, 40, 20, 1])
def test_whatever_the_width_the_line_is_one_line(person, width):
    person.sees()
    person.resize(width)
    (line,) = person.reads()
    assert len(line) <= max(width - 1, 1)


def test_why_it_stands_stays_above_the_line_once_and_in_full(person):
    person.sees()
    held = RUNNING._replace(state=State.PAUSED, cause=int(Cause.TORQUE_HIGH))
    person.status.show_loop(held)
    person.look()
    person.look()
    lines = person.reads()
    assert [line for line in lines if line == f"held: {Cause.TORQUE_HIGH.sentence}"] == lines[:-1]
    assert "held by the guard" in lines[-1]


def bells(person):
    person.look()
    person.look()
    return person.sees().count(BELL.encode())


def test_stops_and_cautions_ring_once_and_cautions_can_be_silenced(person, monkeypatch):
    cautions = []
    monkeypatch.setattr(Observer, "cautions", property(lambda _: tuple(cautions)))
    bells(person)  # those of a session without a recorder
    cautions.append("epoch 1: J is too small")
    assert bells(person) == 1
    person.press(b"c")
    assert person.orders() == []
    assert person.reads()[-1].startswith("cautions silent | ")
    cautions.append("epoch 2: J is too small")
    assert bells(person) == 0
    person.status.show_loop(RUNNING._replace(state=State.PAUSED, cause=int(Cause.TORQUE_HIGH)))
    assert bells(person) == 1  # a stop is always heard
    person.press(b"c")
    assert not person.reads()[-1].startswith("cautions silent")
    cautions.append("epoch 3: J is too small")
    person.status.show_loop(RUNNING)
    assert bells(person) == 1


def test_a_bell_is_rung_when_the_terminal_takes_output_again(person):
    person.sees()
    screen = os.open(os.ttyname(person.near), os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
    for size in (1000, 1, 1):  # the system moves what was written on, which makes room again
        with suppress(BlockingIOError):
            while True:
                os.write(screen, b"x" * size)
        time.sleep(0.05)
    os.close(screen)
    person.look()  # a frame that waits
    person.status.show_loop(RUNNING._replace(state=State.FAULTED, cause=int(Cause.TORQUE_TOO_HIGH)))
    person.look()
    seen = person.sees()
    assert BELL.encode() not in seen
    for _ in range(3):
        person.look()
        seen += person.sees()
    assert seen.count(BELL.encode()) == 1


def test_the_next_session_is_heard(person):
    person.press(b"c")
    again = KeyView(person.tty, PLAN, lambda: person.now_s)
    again(person.shared)
    assert "cautions silent" not in person.sees().decode().rpartition("EMERGENCY")[2]


def test_a_torque_that_does_not_fit_is_printed_once_and_stays(person, monkeypatch):
    person.sees()
    caution = "epoch 1: J 0.001 kg·m² is less than the rig's alone"
    monkeypatch.setattr(Observer, "cautions", property(lambda _: (caution,)))
    person.look()
    assert person.reads()[:-1] == [caution]


@pytest.mark.parametrize("key", [b"e", b"E", b" "])
@pytest.mark.parametrize("before", [b"", b":", b":no\x1b", b"\x1b[A", b"x"])
def test_an_emergency_stop_never_asks(person, before, key):
    person.press(before)
    person.orders()
    person.press(key)
    assert person.status.flag(Flag.EMERGENCY_STOP)
    assert person.orders() == []
    person.press(b"p")  # and keys are orders
    assert person.orders() == [Command.PAUSE]


def test_the_space_bar_stops_while_a_text_is_typed_too(person):
    person.press(b":set perturbation_scale 0.5 ")
    assert not person.status.flag(Flag.EMERGENCY_STOP)
    person.press(b" ")
    assert person.status.flag(Flag.EMERGENCY_STOP)
    assert person.orders() == []


@pytest.mark.parametrize("state", [State.PAUSED, State.STOPPING, State.FAULTED])
def test_an_emergency_stop_needs_no_running_loop(person, state):
    person.status.show_loop(RUNNING._replace(state=state))
    person.press(b"r")  # in a pause, asks for r again
    person.press(b"e")
    assert person.status.flag(Flag.EMERGENCY_STOP)


def test_an_emergency_stop_works_before_the_first_tick():
    person = Person()
    person.press(b"e")
    assert person.status.flag(Flag.EMERGENCY_STOP)
    person.close()


@pytest.mark.parametrize(
    ("key", "command"),
    [
        *((b"p", Command.PAUSE), (b"n", Command.PAUSE_NOW), (b"s", Command.STOP)),
        *((b"a", Command.ABORT), (b"H", Command.HALT), (b"r", Command.RESUME)),
        *((b"x", Command.PAUSE_NOW), (b"\x1b", Command.PAUSE_NOW), (b"\xff", Command.PAUSE_NOW)),
    ],
)
def test_one_key_is_one_order(person, key, command):
    person.press(key)
    assert person.orders() == [command]
    assert any("pausing now" in line for line in person.reads()) is (key in b"x\x1b\xff")


@pytest.mark.parametrize("keys", [b"\x1b[A", b"\x1bOP", b"\x1b[5~", b"\x1b[<0;3;4M", b"\r", b"\n"])
def test_arrows_and_enter_are_no_orders(person, keys):
    person.press(keys)
    assert person.orders() == []


def test_what_sets_the_arm_going_asks_for_its_key_again(person):
    person.status.show_loop(RUNNING._replace(state=State.PAUSED))
    person.look()
    person.press(b"r")
    assert person.orders() == []
    assert any("press r again" in line for line in person.reads())
    person.press(b"r")
    assert person.orders() == [Command.RESUME]
    person.press(b"r")
    person.now_s += 10.0
    person.press(b"r")  # too late: it asks again
    assert person.orders() == []


def test_a_key_that_is_held_down_does_not_end_a_hold(person):
    """It repeats 10 to 30 times a second, and would answer its own question."""
    person.press(b"r")
    assert person.orders() == [Command.RESUME]
    person.status.show_loop(RUNNING._replace(state=State.PAUSED))
    for _ in range(100):
        person.now_s -= 0.95  # of the second that each look takes
        person.press(b"r")
    assert person.orders() == []
    person.press(b"rr")  # let go, and pressed again: the first of both
    assert person.orders() == [Command.RESUME]
    person.now_s += 10.0
    person.press(b"rr")
    assert person.orders() == []


def test_what_takes_more_than_a_key_is_typed_after_a_colon(person):
    person.press(b":set perturbation_scale 0.x\x7f5")
    assert person.reads()[-1].startswith(": set perturbation_scale 0.5_")
    assert not person.status.flag(Flag.EMERGENCY_STOP)
    person.press(b"\r")
    assert person.status.take() == Order(Command.CHANGE, "perturbation_scale", 0.5)
    person.press(b":note he coughed\r")
    order = person.status.take()
    assert json.loads(order.name) == {"what": "note", "text": "he coughed", "by": ""}
    person.press(b":nonsense\r:save to /tmp\r")
    lines = "\n".join(person.reads())
    assert "'nonsense' is neither" in lines
    assert "the recorder can write" in lines
    person.press(b":p\x1b")
    person.press(b"p")
    assert person.orders() == [Command.PAUSE]


def test_one_who_walks_away_while_typing_has_keys_again(person):
    person.press(b":no")
    person.now_s += 20.0
    person.press(b"e")
    assert person.status.flag(Flag.EMERGENCY_STOP)


def test_a_keyboard_that_is_gone_ends_the_run(person):
    os.close(person.far)
    person.look()
    assert person.status.flag(Flag.END_ASKED)
    person.look()
    person.far = os.open("/dev/null", os.O_RDWR)


def test_a_terminal_that_takes_nothing_holds_nobody_up(person):
    begin_s = time.monotonic()
    for _ in range(200):
        person.look()  # nobody reads: after some frames the terminal is full
    assert time.monotonic() - begin_s < 20.0
    os.write(person.far, b"p")
    person.look()
    assert person.orders() == [Command.PAUSE]
    # When it takes output again, the line that was begun is finished before the next.
    seen = person.sees()
    for _ in range(3):
        person.look()
        seen += person.sees()
    lines = {line for line in seen.split(b"\r\x1b[K") if b"30.0 s" in line}
    assert len(lines) == 1


def test_at_the_end_the_terminal_is_as_it_was_and_nothing_typed_is_left(person):
    person.sees()
    during = termios.tcgetattr(person.near)
    assert not during[3] & (termios.ICANON | termios.ECHO)
    assert during[3] & termios.ISIG  # Ctrl-C stays a signal
    os.write(person.far, b"rm -rf half an order\n")
    time.sleep(0.05)
    person.tty.__exit__()
    assert termios.tcgetattr(person.near) == person.before
    assert person.sees().endswith(LEAVE.replace(b"\n", b"\r\n"))
    assert not select.select([person.near], [], [], 0.1)[0]
    assert os.get_blocking(person.near)


def test_the_end_does_not_wait_for_a_terminal_that_takes_nothing(person):
    for _ in range(50):
        person.look()
    begin_s = time.monotonic()
    person.tty.__exit__()
    assert time.monotonic() - begin_s < 5.0
    assert termios.tcgetattr(person.near) == person.before


def test_what_a_note_or_a_name_holds_does_not_steer_the_terminal(person):
    person.status.set_condition(Role.RECORDER, ProcessCondition.TROUBLE, "full \x1b[2J\x07 disk")
    person.look()
    seen = person.sees()
    assert b"\x1b[2J" not in seen
    assert b"full ?[2J? disk" in seen


@pytest.mark.parametrize("after", [False, True])
def test_what_was_typed_and_not_read_goes_to_nobody(after):
    far, near = pty.openpty()
    with os.fdopen(os.dup(near)) as keyboard:
        screen = Tty(near, near)
        screen.__enter__()
        if after:
            screen.__exit__()
        os.write(far, b"half an order\n")
        assert select.select([near], [], [], 10.0)[0]
        if after:
            discard_typed(keyboard)
        else:
            screen.__exit__()
    assert not select.select([near], [], [], 0)[0]
    os.close(far)
    os.close(near)


@pytest.mark.parametrize("terminal", [True, False])
def test_a_view_of_lines_rings_a_terminal_and_no_file(person, tmp_path, terminal):
    person.tty.__exit__()
    typed, ours = os.pipe()
    name = os.ttyname(person.near) if terminal else tmp_path / "out"
    with open(name, "w") as screen, os.fdopen(typed) as keyboard:
        view = LineView(keyboard, screen, PLAN, lambda: person.now_s)
        stopped = RUNNING._replace(state=State.FAULTED, cause=int(Cause.TORQUE_TOO_HIGH))
        for state in (RUNNING, stopped, stopped):
            person.status.show_loop(state)
            view(person.shared)
        os.write(ours, b"c\n")
        view(person.shared)
        person.now_s += 2.0
        view(person.shared)
        screen.flush()
        seen = person.sees() if terminal else (tmp_path / "out").read_bytes()
    os.close(ours)
    assert person.orders() == []
    assert seen.count(BELL.encode()) == (1 if terminal else 0)
    assert b"cautions silent | " in seen


def test_without_a_terminal_there_are_lines(tmp_path, monkeypatch):
    far, near = pty.openpty()
    with os.fdopen(near, "r+b", buffering=0) as raw, (tmp_path / "out").open("w") as file:
        keyboard = open(os.dup(raw.fileno()))  # noqa: SIM115
        screen = open(os.dup(raw.fileno()), "w")  # noqa: SIM115
        with keyboard, screen:
            monkeypatch.setenv("TERM", "xterm")
            with terminal_view(keyboard, file, PLAN) as view:
                assert type(view) is LineView
            with terminal_view(None, screen, PLAN) as view:
                assert type(view) is LineView
            with terminal_view(keyboard, screen, PLAN) as view:
                assert isinstance(view, KeyView)
            monkeypatch.setenv("TERM", "dumb")
            with terminal_view(keyboard, screen, PLAN) as view:
                assert type(view) is LineView
    os.close(far)
