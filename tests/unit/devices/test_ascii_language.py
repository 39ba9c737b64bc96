from __future__ import annotations

import pytest

from rigidimeter.devices.ascii.language import get, move_target, parse, seconds, set_


@pytest.mark.parametrize("text", ["", "v", "v 1 2", "ok!", "x 3", "v one", "e"])
def test_what_is_no_reply_is_said_so(text):
    assert parse(text).kind == "?"


def test_requests():
    assert (get(0x32), set_(0xCA, -5)) == ("g r0x32", "s r0xca -5")
    assert seconds(96, 9600) == pytest.approx(0.1)


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
