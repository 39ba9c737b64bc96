"""Bounds of a drive: shown by a slow move that each ends, or written and not shown."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from tests.unit.rig.commissioning.conftest import at_hand

from rigidimeter.rig.commissioning import Operator, Setup, Timebase, as_numbers, bound_checks
from rigidimeter.rig.devices import BoundFound
from rigidimeter.rig.guard import DriveModel

NAMES = ("torque", "position", "speed", "motor speed", "slippage")


def bounds_of(record: Any) -> dict[str, Any]:
    checks = {check.name: check for check in record.checks}
    return {name: checks[f"bound of the {name}"] for name in NAMES}


def test_each_bound_that_ends_a_move_is_shown(commissioned: Any) -> None:
    record = commissioned(bounds=dict.fromkeys(NAMES, "obeyed"))
    found = bounds_of(record)
    assert {name: check.outcome for name, check in found.items()} == dict.fromkeys(NAMES, "passed")
    assert record.passed
    assert not any(name.startswith("bound") for name in record.not_tried)
    assert found["motor speed"].value == "at most 5.01 of 10 deg/s (0x1)"


@pytest.mark.parametrize("name", NAMES)
def test_a_bound_that_sleeps_is_written_and_not_shown(commissioned: Any, name: str) -> None:
    record = commissioned(bounds={**dict.fromkeys(NAMES, "obeyed"), name: "asleep"})
    found = bounds_of(record)
    assert {n for n, check in found.items() if not check.passed} == {name}
    assert (found[name].value, found[name].outcome) == ("written, not shown", "not possible here")
    assert found[name].name in record.not_tried
    assert record.passed  # as without that bound: the guard is still there


def test_a_bound_that_is_not_there_says_what_is_lost(commissioned: Any) -> None:
    record = commissioned(bounds={**dict.fromkeys(NAMES, "obeyed"), "torque": "absent"})
    check = bounds_of(record)["torque"]
    assert (check.value, check.outcome) == ("not written", "not possible here")
    assert check.remedy == "w; so l"


@pytest.mark.parametrize(("bound_nm", "enough"), [(30.0, True), (29.9, False)])
def test_the_bound_of_the_torque_is_held_against_the_drive_as_measured(
    settings: Any, bound_nm: float, enough: bool
) -> None:
    """((0.0755 + 0.0045) 100 + 2 + 20) N·m / 1 = 30 N·m takes a stop; a scale of 2 halves it."""
    bound = BoundFound("torque", "0x6072", "", "", bound_nm, 100.0)
    rig = SimpleNamespace(bounds=(bound,))
    operator = Operator(ask=lambda _: False)
    setup = Setup(rig, settings, Timebase(lambda: 0.0, float), operator)
    measured = DriveModel(scale=1.0, inertia_kg_m2=0.0755, friction_nm=2.0)
    checks = {c.name: c for c in bound_checks(setup, as_numbers(measured))}
    check = checks["bound of the torque above a quick stop's"]
    assert check.passed is enough
    assert check.limit == "at least 30 N·m"
    halved = bound_checks(setup, as_numbers(measured._replace(scale=2.0)))[-1]
    assert halved.limit == "at least 15 N·m"
    assert len(bound_checks(setup, {})) == 1  # nothing was measured: nothing to hold it against


def test_a_person_who_does_not_agree_sees_no_move(commissioned: Any) -> None:
    def refuses(question: str, world: Any) -> bool:
        return not question.startswith("Bounds") and at_hand(question, world)

    record = commissioned(ask=refuses, bounds=dict.fromkeys(NAMES, "obeyed"))
    found = bounds_of(record)
    assert {check.value for check in found.values()} == {"written, not shown"}
    assert "did not agree" in found["torque"].remedy


def test_a_move_that_something_else_ended_shows_nothing(commissioned: Any) -> None:
    """A joint that is pushed is held by the guard before the bound is reached."""

    def pushes(question: str, world: Any) -> bool:
        if question.startswith("Bounds"):
            until_s = world.time.now() + 0.2
            world.arm.voluntary_nm = lambda _: -15.0 if world.time.now() < until_s else 0.0
        return at_hand(question, world)

    record = commissioned(ask=pushes, bounds={"position": "asleep"})
    check = next(c for c in record.checks if c.name == "bound of the position")
    assert check.value == "written, not shown"
    assert "the move tells nothing: the guard held the rig" in check.remedy


def test_a_driver_without_bounds_is_named(commissioned: Any) -> None:
    record = commissioned()
    check = next(c for c in record.checks if c.name == "bounds in the drive")
    assert check.outcome == "not possible here"
