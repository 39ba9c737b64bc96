from __future__ import annotations

import math
from typing import Any

import pytest

from rigidimeter.settings import SubjectSettings


def failed(record: Any) -> list[str]:
    return [check.name for check in record.failed]


def test_a_healthy_rig_passes_and_its_numbers_are_right(commissioned: Any) -> None:
    record = commissioned(delay_s=0.02)
    assert failed(record) == []
    assert record.missing == ()
    assert record.passed
    assert record.numbers["angle_per_command"] == pytest.approx(1.0, abs=1e-3)
    assert record.numbers["motion_delay_s"] == pytest.approx(0.02, abs=1e-3)
    assert record.numbers["torque_delay_s"] == pytest.approx(0.02, abs=2e-3)
    assert record.numbers["bandwidth_hz"] == pytest.approx(50.0, rel=0.05)
    assert set(record.not_tried) == {
        "known torque",
        "known angle",
        "emergency stop",
        "stays stopped after the release",
    }


@pytest.mark.parametrize(
    ("faults", "name"),
    [
        ({"torque_scale": -1.0}, "torque against motion"),
        ({"angle_scale": -1.0}, "angle per command"),
        ({"angle_scale": -1.0, "command_scale": -1.0}, "torque against motion"),
        ({"angle_scale": 2.0}, "angle per command"),
        ({"angle_scale": 57.3}, "angle per command"),
        ({"angle_scale": 1.05}, "angle per command"),
        ({"command_scale": 57.3}, "angle per command"),
        ({"velocity_scale": 57.3}, "velocity per change of angle"),
        ({"velocity_scale": -1.0}, "velocity per change of angle"),
        ({"watchdog_s": None}, "watchdog configured"),
        ({"watchdog_s": 3.0}, "watchdog configured"),
        ({"deaf_watchdog": True}, "watchdog"),
        ({"restarts": True}, "stays stopped after the watchdog"),
        ({"torque_interval_s": 0.03}, "torque samples"),
        ({"dead": True}, "different torque values"),
        ({"no_answer": True}, "devices read back"),
        ({"bias_nm": 1.5}, "torque at rest"),
        ({"lost_each": 1}, "lost or damaged messages"),
        ({"noise_sd_nm": 0.3}, "torque noise (SD)"),
        ({"delay_s": 0.15}, "delay from command to motion"),
    ],
)
def test_a_fault_fails_its_check(commissioned: Any, faults: dict[str, Any], name: str) -> None:
    record = commissioned(**faults)
    assert name in failed(record)
    assert not record.passed
    check = next(check for check in record.failed if check.name == name)
    assert check.remedy


def test_a_wrong_scale_moves_the_joint_by_little(commissioned: Any) -> None:
    """57 times too far is met by the nudge and the guard, not by the swing."""
    arms = []

    def ask(_: str, world: Any) -> bool:
        arms.append(world.arm)
        return True

    commissioned(command_scale=57.3, ask=ask)
    assert abs(arms[0].motion()[0]) < 0.5


def test_nothing_moves_without_consent(commissioned: Any) -> None:
    moved: list[float] = []

    def ask(_: str, world: Any) -> bool:
        moved.append(world.arm.motion()[0])
        return False

    record = commissioned(ask=ask)
    assert moved == [0.0]
    assert failed(record) == []
    assert not record.passed
    assert "watchdog" in record.missing


def test_a_controller_too_quick_for_the_delay_is_refused(commissioned: Any, settings: Any) -> None:
    heavy = {"OFF": SubjectSettings(inertia_kg_m2=0.08, damping_nm_s_rad=0.5)}
    block = settings.protocol.model_copy(
        update={"blocks": [settings.protocol.blocks[0].model_copy(update={"condition": "OFF"})]}
    )
    record = commissioned(torque_delay_s=0.04, tables={"subject": heavy, "protocol": block})
    assert "stability with OFF" in failed(record)
    assert record.numbers["torque_delay_s"] == pytest.approx(0.04, abs=5e-3)
    assert commissioned(tables={"protocol": block}).passed


def test_an_arm_that_does_not_show_leaves_the_rig_unfit(commissioned: Any) -> None:
    record = commissioned(joint=(1e-6, 0.0, 0.0))
    assert failed(record) == []
    assert "torque against motion" in record.missing
    assert not record.passed


def test_a_drive_that_says_nothing_is_watched_in_motion(commissioned: Any) -> None:
    record = commissioned(silent_watchdog=True)
    assert record.passed
    assert "watchdog reported" in record.not_tried
    assert "watchdog" in failed(commissioned(silent_watchdog=True, deaf_watchdog=True))


@pytest.mark.parametrize("restarts", [False, True])
def test_the_emergency_stop_is_seen_and_its_release_restarts_nothing(
    commissioned: Any, restarts: bool
) -> None:
    def ask(question: str, world: Any) -> bool:
        if question.startswith("Emergency"):
            world.faults["pressed_at_s"] = world.time.now() + 1.0
        if question.startswith("Release"):
            del world.faults["pressed_at_s"]
            world.faults.update({"restarts": True} if restarts else {})
        return True

    record = commissioned(ask=ask, presses=True)
    outcomes = {check.name: check.outcome for check in record.checks}
    assert outcomes["emergency stop"] == "passed"
    assert failed(record) == (["stays stopped after the release"] if restarts else [])


def test_an_emergency_stop_that_does_nothing_fails(commissioned: Any) -> None:
    assert failed(commissioned(presses=True)) == ["emergency stop"]


@pytest.mark.parametrize(
    ("faults", "wrong"),
    [
        ({}, []),
        ({"torque_scale": 1.1}, ["known torque"]),
        # Command and reading are wrong alike, so nothing inside the rig shows it.
        ({"angle_scale": 2.0, "command_scale": 0.5}, ["known angle"]),
    ],
)
def test_what_the_operator_knows_is_compared(
    commissioned: Any, faults: dict[str, Any], wrong: list[str]
) -> None:
    def ask(question: str, world: Any) -> bool:
        if "turn the joint by" in question:
            world.arm.place(math.radians(10.0))
        elif question.startswith("Turn it back"):
            world.arm.place(0.0)
        elif question.startswith("Put a torque"):
            world.push_nm[0] = 2.0
        elif question.startswith("Take the torque off"):
            world.push_nm[0] = 0.0
        return True

    record = commissioned(ask=ask, known_torque_nm=2.0, known_angle_deg=10.0, **faults)
    assert failed(record) == wrong
