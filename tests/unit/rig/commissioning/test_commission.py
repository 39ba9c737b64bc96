from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.unit.rig.commissioning.conftest import at_hand

from rigidimeter.core.settings import Settings, SubjectSettings, changed_settings, parse_settings
from rigidimeter.planning import prbs_nm
from rigidimeter.rig.acquisition import ControlLoop, NoSupervision, SimulatedClock, perturb
from rigidimeter.rig.commissioning import A_PERSON_TELLS, as_measured
from rigidimeter.rig.devices import STOP_HIGH, STOP_LOW, SimulatedRig
from rigidimeter.rig.guard import Cause


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
    apart = "torque sensor against the drive's torque"
    unsaid = {"known torque", "known angle", "bounds in the drive", apart}
    assert set(record.not_tried) == unsaid


class Leaves(NoSupervision):
    """Somebody who is there for the first ticks of each trial."""

    def __init__(self, ticks: int) -> None:
        self.ticks = ticks

    def cause(self, now_s: float) -> int:
        self.ticks -= 1
        return int(Cause.NONE if self.ticks >= 0 else Cause.CONSOLE_LOST)


def test_a_trial_stops_where_nobody_is_there_any_more(commissioned: Any) -> None:
    """By the word of the program that leads it: a page that is gone, a server that hangs."""
    record = commissioned(supervise=lambda: Leaves(20))
    assert not record.passed
    assert any(Cause.CONSOLE_LOST.sentence in check.words for check in record.failed)
    assert "bandwidth_hz" not in record.numbers


def test_a_flag_answers_for_nobody(commissioned: Any) -> None:
    """With --yes what only a person can tell is not asked: good for an emulated rig only."""
    asked: list[str] = []

    def consent(question: str, _: Any) -> bool:
        asked.append(question)
        return True

    record = commissioned(ask=consent, present=False)
    outcomes = {check.name: check.outcome for check in record.checks}
    assert {outcomes[name] for name in A_PERSON_TELLS} == {"not tried"}
    assert len(asked) == 2  # to the motions, and to power after the watchdog
    assert failed(record) == []
    assert not record.passed
    assert record.missing == A_PERSON_TELLS
    assert record.objection == (
        "the check 'mechanical stops' is missing: only a person can tell; commission again "
        "without --yes"
    )
    emulated = commissioned(ask=consent, present=False, emulated=True, signed_by="")
    assert emulated.passed
    assert set(A_PERSON_TELLS) < set(emulated.not_tried)


def test_what_was_known_is_not_compared_when_nobody_is_there(commissioned: Any) -> None:
    record = commissioned(present=False, emulated=True, known_torque_nm=2.0, known_angle_deg=10.0)
    outcomes = {check.name: check.outcome for check in record.checks}
    assert (outcomes["known torque"], outcomes["known angle"]) == ("not tried", "not tried")
    assert record.passed


def test_somebody_signs_for_hardware(commissioned: Any) -> None:
    assert commissioned().passed
    record = commissioned(signed_by=" ")
    assert not record.passed
    assert "--signed-by" in record.objection


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("mechanical stops", "mechanical stops"),
        ("power go by itself", "hardware enable drops the power"),
        ("joint move first", "the joint moved as described"),
    ],
)
def test_an_operator_who_says_no_fails_the_check(commissioned: Any, words: str, name: str) -> None:
    def ask(question: str, world: Any) -> bool:
        return at_hand(question, world) and words not in question

    assert failed(commissioned(ask=ask)) == [name]
    assert failed(commissioned(ask=ask, emulated=True)) == [name]


def test_the_angles_of_both_stops_are_kept_on_the_drives_scale(commissioned: Any) -> None:
    record = commissioned(delay_s=0.0)
    found = next(check for check in record.checks if check.name == "mechanical stops")
    assert found.words == "-28.6 and 43.0 deg"
    assert record.numbers[STOP_LOW] == pytest.approx(math.degrees(-0.5), abs=0.01)
    assert record.numbers[STOP_HIGH] == pytest.approx(math.degrees(0.75), abs=0.01)


def test_stops_that_were_read_at_one_place_fail_where_there_is_something_to_lead(
    commissioned: Any,
) -> None:
    def ask(question: str, world: Any) -> bool:
        return "end" in question or at_hand(question, world)

    record = commissioned(ask=ask)
    assert failed(record) == ["mechanical stops"]
    assert "read at one place" in record.objection
    assert STOP_LOW not in record.numbers
    emulated = commissioned(ask=ask, emulated=True)
    assert failed(emulated) == []
    assert STOP_LOW not in emulated.numbers


def test_a_drive_must_brake_as_the_guard_counts_on(commissioned: Any, settings: Any) -> None:
    assert failed(commissioned(braking_rad_s2=60.0)) == ["braking of the drive"]
    record = commissioned(braking_rad_s2=None)
    assert failed(record) == []
    assert record.missing == ("braking of the drive",)
    slower = settings.guard.model_copy(update={"acceleration_limit_deg_s2": 3000.0})
    assert commissioned(braking_rad_s2=60.0, tables={"guard": slower}).passed


@pytest.mark.parametrize(("stall_s", "good"), [(0.099, True), (0.1, False), (0.2, False)])
def test_the_loop_notices_a_stall_before_the_drive_stops(
    commissioned: Any, settings: Any, stall_s: float, good: bool
) -> None:
    loop = settings.loop.model_copy(update={"stall_s": stall_s})
    record = commissioned(tables={"loop": loop})
    assert failed(record) == ([] if good else ["loop stalls before the watchdog"])
    assert good or "set loop.stall_s in the settings below 0.1 s" in record.failed[0].sentence


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
        ({"velocity_per_angle": 57.3}, "velocity per change of angle"),
        ({"velocity_per_angle": -1.0}, "velocity per change of angle"),
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

    def ask(question: str, world: Any) -> bool:
        arms.append(world.arm)
        return at_hand(question, world)

    commissioned(command_scale=57.3, ask=ask)
    assert abs(arms[0].motion()[0]) < 0.5


def test_nothing_moves_without_consent(commissioned: Any) -> None:
    moved: list[float] = []

    def ask(question: str, world: Any) -> bool:
        moved.append(world.arm.motion()[1])
        return at_hand(question, world) and "Nobody's arm" not in question

    record = commissioned(ask=ask)
    assert moved == [0.0] * 4
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
    # Nor would it say that the emergency stop was pressed.
    quiet = {"silent_watchdog": True, "present": False, "emulated": True}
    record = commissioned(**quiet)
    assert record.passed
    assert "watchdog reported" in record.not_tried
    assert "watchdog" in failed(commissioned(deaf_watchdog=True, **quiet))


@pytest.mark.parametrize("works", [True, False])
def test_a_hand_held_stop_is_pressed_where_the_rig_file_names_one(
    commissioned: Any, works: bool
) -> None:
    def presses(question: str, world: Any) -> bool:
        if question.startswith("Hand-held stop") and works:
            world.faults["button_at_s"] = world.time.now() + 1.0
        if question.startswith("Release the button"):
            world.faults.pop("button_at_s", None)
        return at_hand(question, world)

    record = commissioned(ask=presses, button_bit=0)
    checks = {check.name: check.outcome for check in record.checks}
    assert checks["hand-held stop"] == ("passed" if works else "failed")
    assert record.passed is works
    released = checks["stays stopped after the hand-held stop"]
    assert released == ("passed" if works else "not possible here")
    assert "hand-held stop" not in {check.name for check in commissioned().checks}


def test_a_hand_held_stop_that_nobody_pressed_is_missing_on_hardware(commissioned: Any) -> None:
    record = commissioned(present=False, button_bit=0, emulated=True)
    assert record.passed
    assert "hand-held stop" in record.not_tried
    assert "hand-held stop" in commissioned(present=False, button_bit=0).missing


@pytest.mark.parametrize(
    ("after_s", "reported", "stopped"),
    [(0.15, True, True), (0.25, False, True), (0.35, False, False)],
)
def test_a_drive_stops_within_its_watchdog_and_what_is_allowed_besides(
    commissioned: Any, after_s: float, reported: bool, stopped: bool
) -> None:
    """It says 0.1 s; 0.1 s more is the margin, and 0.1 s its reaction once it moves."""
    record = commissioned(stops_after_s=after_s)
    outcomes = {check.name: check.outcome for check in record.checks}
    assert outcomes["watchdog reported"] == ("passed" if reported else "not possible here")
    assert failed(record) == ([] if stopped else ["watchdog"])


@pytest.mark.parametrize("restarts", [False, True])
def test_the_emergency_stop_is_seen_and_its_release_restarts_nothing(
    commissioned: Any, restarts: bool
) -> None:
    def ask(question: str, world: Any) -> bool:
        if question.startswith("Release") and restarts:
            world.faults["restarts"] = True
        return at_hand(question, world)

    record = commissioned(ask=ask)
    outcomes = {check.name: check.outcome for check in record.checks}
    assert outcomes["emergency stop"] == "passed"
    assert failed(record) == (["stays stopped after the release"] if restarts else [])


def test_an_emergency_stop_that_does_nothing_fails(commissioned: Any) -> None:
    def ask(question: str, world: Any) -> bool:
        return question.startswith(("Emergency", "Release")) or at_hand(question, world)

    assert failed(commissioned(ask=ask)) == ["emergency stop"]


def test_a_driver_that_gives_up_is_no_emergency_stop(commissioned: Any) -> None:
    """The drive says nothing of it: nobody has pressed yet."""

    def ask(question: str, world: Any) -> bool:
        if question.startswith("Emergency"):
            world.faults["given_up_s"] = world.time.now() + 1.0
            return True
        return at_hand(question, world)

    assert failed(commissioned(ask=ask)) == ["emergency stop"]


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
        return at_hand(question, world)

    record = commissioned(ask=ask, known_torque_nm=2.0, known_angle_deg=10.0, **faults)
    assert failed(record) == wrong


def test_hands_are_asked_for_only_after_the_drive_said_that_it_has_no_power(
    commissioned: Any,
) -> None:
    asked: list[str] = []

    def ask(question: str, world: Any) -> bool:
        asked.append(question)
        return at_hand(question, world)

    record = commissioned(ask=ask, known_torque_nm=2.0, keeps_power=True)
    assert failed(record) == ["devices answer"]
    assert "keep hands off the joint" in record.failed[0].sentence
    assert not any("torque of" in question for question in asked)


def test_no_hand_is_asked_for_while_a_drive_has_power_from_before(commissioned: Any) -> None:
    asked: list[str] = []

    def ask(question: str, world: Any) -> bool:
        asked.append(question)
        return at_hand(question, world)

    record = commissioned(ask=ask, known_angle_deg=10.0, on_before=True)
    assert failed(record) == ["devices answer"]
    assert "keep hands off the joint" in record.failed[0].sentence
    assert asked == []


def test_a_drive_quicker_than_the_settings_say_is_no_silent_torque(
    commissioned: Any, settings: Any
) -> None:
    """100 Hz at 100 ticks/s where the settings say 50 Hz: it is at its velocity before each tick.

    With half the joint's inertia as the floor the guard stopped the first epoch at 0.03 s.
    """
    found = commissioned(bandwidth_hz=100.0)
    assert failed(found) == []
    today: Any = SimpleNamespace(reference=SimpleNamespace(inertia_kg_m2=0.0045))
    told = parse_settings({"rig": settings.rig.model_dump(), "guard": {"reaction_time_s": 0.1}})
    measured = as_measured(told, found, today)
    floor = {"min_inertia_kg_m2": 0.5 * 0.0045}
    assert perturbed_by_100_hz(changed_settings(told, {"guard": floor})) == (
        Cause.TORQUE_SILENT,
        pytest.approx(0.03),
    )
    assert perturbed_by_100_hz(measured) == (Cause.NONE, pytest.approx(2.0))


def perturbed_by_100_hz(settings: Settings) -> tuple[Cause, float]:
    """Return the cause that ended 2 s of perturbation on a simulated drive of 100 Hz, and when."""
    quick = settings.rig.model_copy(update={"drive_bandwidth_hz": 100.0})
    rig = SimulatedRig(quick, settings.subject["OFF"], np.random.default_rng(1))
    loop = ControlLoop(settings, rig, SimulatedClock(), lambda _: None)
    rig.enable()
    perturb(loop, 0, prbs_nm(settings.prbs, 100.0)[:200].tolist())
    return loop.cause, loop.time_s


@pytest.mark.parametrize(("told_hz", "remarked"), [(20.0, True), (50.0, False), (200.0, False)])
def test_the_bandwidth_is_compared_with_what_the_settings_say(
    commissioned: Any, settings: Any, told_hz: float, remarked: bool
) -> None:
    """Nothing above 53 Hz can be told apart at 100 ticks/s."""
    rig = settings.rig.model_copy(update={"drive_bandwidth_hz": told_hz})
    found = commissioned(tables={"rig": rig})
    check = next(check for check in found.checks if check.name == "bandwidth of the drive")
    assert check.passed
    assert (
        f"rig.drive_bandwidth_hz = {told_hz:g} Hz is not this drive's" in check.remedy
    ) is remarked


def test_stamps_of_times_to_come_are_caught_at_rest(commissioned: Any) -> None:
    """The guard allows a stamp to be wrong by the reaction time, so it says nothing of 15 ms."""
    record = commissioned(stamp_ahead_s=0.015)
    assert failed(record) == ["age of torque samples"]
    assert record.failed[0].sentence.startswith(
        "age of torque samples: -15 ms, at most -15 ms, must be above 0, at most 100 ms; a stamp"
    )
    names = [check.name for check in record.checks]
    assert "motion when enabled" not in names
