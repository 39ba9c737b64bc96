from __future__ import annotations

import pytest

from rigidimeter.rig.devices import (
    Exchange,
    Feedback,
    line_time_s,
    move_target,
    parse,
    read_request,
    set_request,
)
from rigidimeter.rig.guard import Cause


@pytest.mark.parametrize("text", ["", "v", "v 1 2", "ok!", "x 3", "v one", "e", "v 1_0", "v 007"])
def test_what_is_no_reply_is_said_so(text):
    assert parse(text).kind == "?"


def test_requests():
    assert (read_request(0x32), set_request(0xCA, -5)) == ("g r0x32", "s r0xca -5")
    assert line_time_s(96, 9600) == pytest.approx(0.1)


def brake(velocity, deceleration=1000.0):
    return velocity**2 / (2.0 * deceleration)


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize(
    ("moving", "wanted", "expected"),
    [
        (0.0, 200.0, 20.0 + brake(200.0)),
        (200.0, 200.0, 20.0 + brake(200.0)),
        (300.0, 100.0, 10.0 + brake(300.0)),
        (100.0, 300.0, 30.0 + brake(300.0)),
        (-300.0, 100.0, 10.0 + brake(100.0) - brake(300.0)),
    ],
)
def test_a_move_is_the_horizon_and_the_way_to_brake(way, moving, wanted, expected):
    target = move_target(0.0, way * moving, way * wanted, 1000.0, 0.1)
    assert target == pytest.approx(way * expected, abs=1.0)


@pytest.mark.parametrize("wanted", [0.1, -0.1])
def test_the_slowest_move_still_moves(wanted):
    assert move_target(0.0, 0.0, wanted, 1000.0, 0.1) == (1 if wanted > 0 else -1)


@pytest.mark.parametrize("value", [2**32, 2**63, -(2**31) - 1, 10**30])
def test_what_no_register_can_hold_is_no_reply(value):
    """The recorded status is a 64-bit column: a damaged digit must not reach it."""
    assert parse(f"v {value}").kind == "?"
    assert [parse(f"v {most}").value for most in (2**32 - 1, -(2**31))] == [2**32 - 1, -(2**31)]


CYCLE = {read_request(0x32): "v 5", read_request(0x18): "v 0", read_request(0xA0): "v 0"}


def cycle(feedback, at_s, **damaged):
    feedback.asked(CYCLE, at_s)
    for request, reply in CYCLE.items():
        text = damaged.get(request[2:], reply)
        feedback.take(Exchange(request, text, at_s + 0.01), commanding=True)


@pytest.fixture
def feedback():
    made = Feedback(115200, 100.0, 1000.0, 21)
    made.begin(5, 0, 0, 0.0)
    return made


@pytest.mark.parametrize("register", ["r0x32", "r0x18", "r0xa0"])
def test_the_third_damaged_reply_of_a_register_is_too_many_whatever_others_say(feedback, register):
    for k in range(3):
        assert feedback.cause is Cause.NONE
        cycle(feedback, 0.02 * k, **{register: "v 1#"})
    assert feedback.cause is Cause.DRIVE_LOST


def test_a_register_read_now_and_then_is_unanswered_only_since_it_was_read_last(feedback):
    for k in range(10):
        cycle(feedback, 0.1 * k, **({"r0x18": "#"} if k % 3 else {}))
        assert feedback.unanswered_s(0.1 * k + 0.05) == pytest.approx(
            0.0 if k % 3 == 0 else 0.1 * (k % 3 - 1) + 0.05
        )
    assert feedback.cause is Cause.NONE
    feedback.forget_requests()
    assert feedback.unanswered_s(99.0) == 0.0
