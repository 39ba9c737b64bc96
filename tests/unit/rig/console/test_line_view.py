"""What an operator types, and what comes of a keyboard or a screen that is gone."""

from __future__ import annotations

import math
import os

import pytest
from tests.unit.rig.console.test_live_values import estimate
from tests.unit.rig.console.test_session_progress import EPOCHS, started, told

from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.rig.acquisition import NOTHING, Command, Order, Phase, State
from rigidimeter.rig.acquisition.processes import (
    Flag,
    LiveEstimate,
    LoopStatus,
    ProcessCondition,
    Role,
    SessionMemory,
)
from rigidimeter.rig.console import (
    KEYS,
    LineView,
    RecentSamples,
    SessionPlan,
    facts,
    order_of,
    status_line,
)
from rigidimeter.rig.guard import Cause

PLAN = SessionPlan(Settings(), EPOCHS)


@pytest.mark.parametrize(
    ("typed", "command"),
    [
        *KEYS.items(),
        ("P", Command.PAUSE),
        ("  n ", Command.PAUSE_NOW),
        ("pause", Command.PAUSE),
        ("Resume", Command.RESUME),
        ("pause  now", Command.PAUSE_NOW),
        ("ABORT", Command.ABORT),
        ("halt", Command.HALT),
        ("stop", Command.ABORT),  # the word is typed in a hurry
        ("s", Command.STOP),  # the letter ends the session after the epoch
    ],
)
def test_a_letter_or_a_word_is_an_order(typed, command):
    order = order_of(typed)
    assert order is not None
    assert order.command is command
    assert not order.name


@pytest.mark.parametrize("typed", ["", "   ", "x", "p p", "stop it", "start", "reset", "change"])
def test_anything_else_is_none(typed):
    assert order_of(typed) is None


def test_a_parameter_is_set_by_its_name():
    assert order_of("set damping_nm_s_rad 2.5") == Order(Command.CHANGE, "damping_nm_s_rad", 2.5)
    assert order_of("SET perturbation_scale 0") == Order(Command.CHANGE, "perturbation_scale", 0.0)
    for typed in ("set", "set damping_nm_s_rad", "set damping_nm_s_rad much", "set a 1 2"):
        assert order_of(typed) is None


def test_the_status_says_where_the_run_is_and_why_it_stands():
    progress = told(started(1, "1"))
    loop = LoopStatus(
        State.RUNNING, 5, 1, time_s=12.25, angle_rad=0.1, until_s=20.0, phase=Phase.EPOCH
    )
    recent = RecentSamples(10, -1.5, torque_age_s=1e-3, motion_age_s=1e-3)

    def line(loop, history=()):
        return status_line(facts(PLAN, progress, loop, history, recent))

    assert line(loop).startswith(
        "    12.2 s | epoch 1 of 3: OFF, prbs | epoch: 8 s left |   +5.7 deg |  -1.50 N·m"
    )
    assert "drive" not in line(loop)
    reports = recent._replace(drive_torque_nm=2.25)
    assert "|  -1.50 N·m (drive +2.25)" in status_line(facts(PLAN, progress, loop, (), reports))
    assert "live" not in line(loop, [LiveEstimate()])
    known = [estimate(0.1 * k, epoch=1) for k in range(1, 100)]
    assert "epoch 1, live: J (4.500 ± 0.020)·10⁻³ kg·m², B" in line(loop, known)
    wild = LiveEstimate(5, 0, 0, 1, 0.0, 0.2, 0.4701, 0.1, -341.779, 99.0, 75761.14, 9e3, 0.2)
    assert "live" not in line(loop, [wild])
    stopped = loop._replace(epoch=-1, missed_ticks=4, cause=int(Cause.STALLED))
    assert line(stopped).split(" | ")[2] == f"stopped: {Cause.STALLED.sentence}"
    near = RecentSamples(10, -1.5, 0.2, 0.5, 1.0, 18.0)
    words = status_line(facts(PLAN, progress, loop, (), near)).split(" | ")
    assert words[2:4] == ["▲ limits ■ sensor ■ drive", "power 18.0 of 20 W (90 %)"]
    assert words[-1] == "drive: no angle that is a number"


class Desk:
    """A terminal on a pipe for its keyboard and one for its screen."""

    def __init__(self, shared: SessionMemory) -> None:
        self.shared, self.shared_status = shared, shared.status
        keys, self.keys = os.pipe()
        self.screen, screen = os.pipe()
        os.set_blocking(self.screen, False)
        self.keyboard = os.fdopen(keys)
        self.out = os.fdopen(screen, "w")
        self.now_s = 0.0
        self.terminal = LineView(self.keyboard, self.out, PLAN, lambda: self.now_s)
        self.said()

    def type(self, text: str) -> None:
        os.write(self.keys, text.encode())
        self.look()

    def look(self) -> None:
        self.terminal(self.shared)

    def hang_up(self) -> None:
        os.close(self.keys)
        self.keys = -1

    def said(self) -> list[str]:
        """Return what came on the screen since."""
        try:
            return os.read(self.screen, 1 << 20).decode().splitlines()
        except BlockingIOError:
            return []

    def orders(self) -> list[Command | Order]:
        """Return the commands that were posted; a change whole."""
        found: list[Command | Order] = []
        while (order := self.shared_status.take()) is not NOTHING:
            found.append(order if order.name else order.command)
        return found

    def close(self) -> None:
        self.keyboard.close()
        self.out.close()
        os.close(self.screen)
        if self.keys >= 0:
            os.close(self.keys)


@pytest.fixture
def desk():
    shared = SessionMemory.create(100.0, 1.0)
    desk = Desk(shared)
    yield desk
    desk.close()
    shared.unlink()
    shared.close()


def test_an_order_goes_once_and_is_confirmed(desk):
    desk.type("p\n")
    desk.look()
    assert desk.orders() == [Command.PAUSE]
    assert desk.said() == ["ordered: pause"]


def test_emg_that_stalls_is_named_once_and_again_when_it_stalls_again(desk):
    with_emg = parse_settings({"emg": {"source": "virtual", "muscles": ["biceps"]}})
    desk.terminal = LineView(None, desk.out, SessionPlan(with_emg, EPOCHS), lambda: desk.now_s)
    status, said = desk.shared_status, []
    status.join(Role.EMG)
    for condition, note in (
        (ProcessCondition.RUNNING, None),
        (ProcessCondition.TROUBLE, "missing since 3.0 s"),
        (ProcessCondition.TROUBLE, None),
        (ProcessCondition.RUNNING, None),
        (ProcessCondition.TROUBLE, "missing since 9.0 s"),
    ):
        status.set_condition(Role.EMG, condition, note)
        desk.look()
        said += desk.said()
    assert said == ["EMG: missing since 3.0 s", "EMG: missing since 9.0 s"]


def test_lines_are_taken_when_they_are_whole(desk):
    desk.type("res")
    assert desk.orders() == []
    desk.type("ume\nset perturbation_scale 0.5\na")
    assert desk.orders() == [
        Command.RESUME,
        Order(Command.CHANGE, "perturbation_scale", 0.5),
    ]
    desk.type("bort\n")
    assert desk.orders() == [Command.ABORT]


@pytest.mark.parametrize("typed", ["e", "E", "emergency", "eeeh", "estop now"])
def test_whatever_begins_with_an_e_is_an_emergency(desk, typed):
    desk.type(f"{typed}\n")
    assert desk.shared_status.flag(Flag.EMERGENCY_STOP)
    assert desk.orders() == []


@pytest.mark.parametrize("typed", ["aargh", "stop it", "help", "p!", "\x1b[A", "ä"])
def test_what_is_no_order_pauses_now(desk, typed):
    desk.type(f"{typed}\n")
    assert desk.orders() == [Command.PAUSE_NOW]
    assert desk.said()[0].endswith("is no order: pausing now")


@pytest.mark.parametrize("typed", ["", "set", "set damping_nm_s_rad much"])
def test_a_parameter_mistyped_and_an_empty_line_only_ask_for_help(desk, typed):
    desk.type(f"{typed}\n")
    assert desk.orders() == []
    assert desk.said()[0].startswith("p pause after this epoch")


def test_bytes_that_are_no_text_pause_too(desk):
    os.write(desk.keys, b"\xff\xfe\n")
    desk.look()
    assert desk.orders() == [Command.PAUSE_NOW]


def test_a_keyboard_that_is_gone_ends_the_run(desk):
    desk.hang_up()
    desk.look()
    assert desk.shared_status.flag(Flag.END_ASKED)
    assert desk.said() == ["the keyboard is gone: the rig stops"]
    desk.look()  # and is not asked again
    assert desk.said() == []


def test_what_was_typed_before_the_keyboard_went_still_counts(desk):
    os.write(desk.keys, b"e\n")
    desk.hang_up()
    desk.look()
    assert desk.shared_status.flag(Flag.END_ASKED)
    assert desk.shared_status.flag(Flag.EMERGENCY_STOP)


def test_without_an_operator_nothing_is_asked(desk):
    terminal = LineView(None, desk.out, PLAN)
    desk.said()
    os.write(desk.keys, b"e\n")
    terminal(desk.shared)
    assert not desk.shared_status.flag(Flag.EMERGENCY_STOP)


def test_orders_that_the_loop_does_not_take_are_said(desk):
    desk.type("p\n" * 17)
    assert desk.said()[-1].endswith("orders wait already; the loop does not take them")
    assert len(desk.orders()) == 16


def test_a_screen_that_takes_nothing_does_not_hold_the_operator_up(desk):
    descriptor = desk.out.fileno()
    os.set_blocking(descriptor, False)
    try:
        while True:
            os.write(descriptor, b"x" * 4096)
    except BlockingIOError:
        pass
    os.set_blocking(descriptor, True)  # a write that were tried would now wait for ever
    desk.type("h\n")
    assert desk.orders() == [Command.HALT]
    desk.said()


def test_the_loop_is_shown_once_a_second_and_trouble_once(desk):
    desk.shared_status.show_loop(LoopStatus(State.RUNNING, 1, 1, time_s=1.0, angle_rad=0.0))
    desk.shared_status.set_condition(Role.RECORDER, ProcessCondition.TROUBLE, "the disk is full")
    for _ in range(5):
        desk.look()
    assert [line.split(" | ")[0].strip() for line in desk.said()] == ["the disk is full", "1.0 s"]
    desk.now_s += 1.0
    desk.look()
    assert len(desk.said()) == 1
    desk.shared_status.set_condition(Role.RECORDER, ProcessCondition.RUNNING)
    desk.look()
    desk.shared_status.set_condition(Role.RECORDER, ProcessCondition.TROUBLE, "the disk is full")
    desk.look()
    assert desk.said() == ["the disk is full"]


def test_another_folder_is_asked_for_while_the_recorder_can_write_nothing(desk, tmp_path):
    folder = tmp_path / "Other One"
    desk.type(f"save to {folder}\n")
    assert desk.said() == ["the recorder can write: another folder is for when it cannot"]
    assert desk.shared_status.asked_folder() is None
    desk.shared_status.set_condition(Role.RECORDER, ProcessCondition.TROUBLE, "the disk is full")
    desk.type(f"save to  {folder} \n")
    assert desk.said()[0] == f"ordered: save to {folder}"
    assert desk.shared_status.asked_folder() == folder
    desk.type(f"save to {'x' * 5000}\n")
    assert desk.said()[-1].endswith("4080 are possible")
    assert desk.orders() == []


def test_before_the_first_tick_nothing_is_shown(desk):
    assert desk.shared_status.loop() is not None
    assert math.isnan(desk.shared_status.loop().angle_rad)
    desk.look()
    assert desk.said() == []
