"""Commissioning finds the drive's side, or says why the guard does not compare two torques."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.unit.rig.commissioning.conftest import World, at_hand

from rigidimeter.core.settings import DriveSideSettings, GuardSettings
from rigidimeter.rig.commissioning import WITNESS, model_in, model_of_today, unseen_nm
from rigidimeter.rig.guard import TIMES_SCATTER, DriveModel

SCALE = "scale of the drive's torque"
LIGHT = DriveSideSettings()
HEAVY = DriveSideSettings(reflected_inertia_kg_m2=1.0, friction_nm=3.0, rated_torque_nm=30.0)


def with_weight(question: str, world: World) -> bool:
    """Hang a weight of 2 N·m on the joint when it is asked for, and take it off again."""
    if question.startswith("Put a torque"):
        world.push_nm[0] = 2.0
    if question.startswith("Take the torque off"):
        world.push_nm[0] = 0.0
    return at_hand(question, world)


def check(record: Any, name: str) -> Any:
    (found,) = [check for check in record.checks if check.name == name]
    return found


@pytest.fixture
def record(commissioned: Any) -> Any:
    return commissioned(ask=with_weight, known_torque_nm=2.0, drive_side=LIGHT)


def test_the_model_is_that_of_the_drive(record: Any) -> None:
    """a = 0.9, F_c = 0.3 N·m; at 100 ticks/s the torque at the ticks shows a part of J_d alone."""
    assert [one.name for one in record.failed] == []
    assert record.passed
    model = model_in(record.numbers)
    assert model.scale == pytest.approx(0.9, rel=0.01)
    assert model.friction_nm == pytest.approx(0.3, rel=0.05)
    assert 0.0 < model.inertia_kg_m2 < 0.06
    assert model.zero_nm == pytest.approx(0.0, abs=0.02)
    # A fifth of the friction comes and goes with the angle: 0.3 · 0.2/√2 at most.
    assert 0.01 < model.scatter_nm < 0.3 * 0.2 / np.sqrt(2.0)
    assert check(record, SCALE).passed
    assert check(record, WITNESS).passed
    assert check(record, WITNESS).remedy == ""
    assert unseen_nm(model) == TIMES_SCATTER * model.scatter_nm


def test_a_heavy_drive_says_how_large_a_fault_remains_unseen(commissioned: Any) -> None:
    guard = GuardSettings(reaction_time_s=0.1, torque_limit_nm=5.0)
    record = commissioned(
        ask=with_weight, known_torque_nm=2.0, drive_side=HEAVY, tables={"guard": guard}
    )
    assert record.passed
    model = model_in(record.numbers)
    found = check(record, WITNESS)
    assert model.friction_nm == pytest.approx(3.0, rel=0.05)
    assert unseen_nm(model) > 1.0
    assert f"of up to {unseen_nm(model):.2g} N·m remains unseen" in found.remedy
    assert f"{unseen_nm(model) + model.friction_nm:.2g} N·m while it stands still" in found.remedy
    guard = GuardSettings(reaction_time_s=0.1, torque_limit_nm=15.0, torque_stop_nm=25.0)
    record = commissioned(
        ask=with_weight, known_torque_nm=2.0, drive_side=HEAVY, tables={"guard": guard}
    )
    assert check(record, WITNESS).remedy == ""


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"drive_side": LIGHT}, "no torque is known"),
        ({"known_torque_nm": 2.0}, "reports no torque of its own"),
        ({"known_torque_nm": 2.0, "drive_side": HEAVY, "load": 0.02}, "hardly shows"),
    ],
)
def test_without_a_known_torque_or_one_of_the_drive_the_law_is_off(
    commissioned: Any, given: dict[str, Any], why: str
) -> None:
    given = dict(given)
    load = given.pop("load", None)
    ask = with_weight
    if load is not None:
        given["known_torque_nm"] = load

        def ask(question: str, world: World) -> bool:
            agreed = with_weight(question, world)
            world.push_nm[0] = min(world.push_nm[0], load)
            return agreed

    record = commissioned(ask=ask, noise_sd_nm=0.0002 if load else 0.005, **given)
    assert record.passed or load is not None
    found = check(record, WITNESS)
    assert found.outcome == "not possible here"
    assert why in found.remedy
    assert WITNESS in record.not_tried
    assert model_in(record.numbers) is None
    assert model_of_today(record.numbers, {}) is None


@pytest.mark.parametrize("scale", [0.4, 3.0])
def test_a_drive_whose_torque_is_of_another_size_is_refused(
    commissioned: Any, scale: float
) -> None:
    side = DriveSideSettings(torque_scale=scale)
    record = commissioned(ask=with_weight, known_torque_nm=2.0, drive_side=side)
    assert [one.name for one in record.failed] == [SCALE]
    assert check(record, SCALE).value == pytest.approx(scale, rel=0.02)
    assert model_in(record.numbers) is None


def test_nobody_wants_the_wide_moves(commissioned: Any) -> None:
    def ask(question: str, world: World) -> bool:
        return with_weight(question, world) and "friction of the drive" not in question

    record = commissioned(ask=ask, known_torque_nm=2.0, drive_side=LIGHT)
    assert check(record, WITNESS).outcome == "not possible here"
    assert "the moves were not made" in check(record, WITNESS).remedy


def test_the_zero_of_today_stands_in_for_that_of_the_record(record: Any) -> None:
    model = model_in(record.numbers)
    assert isinstance(model, DriveModel)
    assert model_of_today(record.numbers, {}) == model
    assert model_of_today(record.numbers, {"drive_side_zero_nm": 0.7}).zero_nm == 0.7
