"""Faults 7 to 10 and 13 to 15: what a drive can do to a person's arm."""

import math
import time
from contextlib import ExitStack

import numpy as np
import pytest
from tests.faults.rigs import (
    ASCII,
    CANOPEN,
    CANOPEN_DRIVE,
    JOINT,
    RIGS,
    WIRES,
    WatchedArm,
    Wrong,
    bench,
)
from tests.faults.trials import (
    AT_REST_RAD_S,
    Desk,
    assert_stopped,
    assert_whole,
    run,
)

from rigidimeter.rig.acquisition import Command
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause, guard_limits
from rigidimeter.testing import Cia402Emulator

HORIZON_S = 0.1
"""Of the serial drive: its moves end by themselves after that."""

CYCLES = 4
"""Ticks until a serial drive was asked for its status: every other cycle, and a late answer."""

FAULTS = [
    ("virtual", "reports", Cause.DRIVE_FAULT, 1),
    ("virtual", "reports", Cause.DRIVE_STATE, 1),
    (CANOPEN, "fault", Cause.DRIVE_FAULT, 2),
    (CANOPEN, "emergency", Cause.DRIVE_FAULT, 2),
    (CANOPEN, "leave operation", Cause.DRIVE_STATE, 2),
    (CANOPEN, "fall to switched on", Cause.DRIVE_STATE, 2),
    (CANOPEN, "change mode", Cause.DRIVE_STATE, 2),
    (CANOPEN, "reboot", Cause.DRIVE_FAULT, 2),
    (ASCII, "fault", Cause.DRIVE_FAULT, CYCLES),
    (ASCII, "power_lost", Cause.DRIVE_STATE, CYCLES),
    (ASCII, "changes_state", Cause.DRIVE_STATE, CYCLES),
]
VALUES = {(ASCII, "changes_state"): 0, (ASCII, "fault"): 3}


@pytest.mark.parametrize(("rig", "case", "cause", "ticks"), FAULTS)
def test_fault_07_drive_fault(rig, case, cause, ticks, tmp_path, measured):
    with bench(rig) as made:
        value = cause if made.virtual else VALUES.get((rig, case))
        trial = run(made, tmp_path / "s", Wrong("drive", case, value))
        bound_s = ticks / made.rate_hz
        assert_stopped(trial, cause, bound_s)
        status = int(trial.samples["motion_status"][-1])
        if (rig, case) in ((CANOPEN, "fault"), (CANOPEN, "emergency")):
            assert status >> 16 == {"fault": 0x2310, "emergency": 0x4210}[case]  # logged
        elif (rig, case) == (ASCII, "fault"):
            assert trial.samples["motion_status"].any()
        measured(7, rig, f"{case}, {cause.name}", trial, bound_s)


def test_fault_07_a_second_node_of_the_same_id(tmp_path, measured):
    """Switched on in a run, it says that it has booted, and answers for the drive from then on."""
    with bench(CANOPEN) as made, ExitStack() as ended:

        def switched_on():
            channel = made.drive._settings.channel
            other = Cia402Emulator(WatchedArm(JOINT), interface="virtual", channel=channel)
            ended.callback(other.close)

        trial = run(made, tmp_path / "s", switched_on)
        bound_s = 2 / made.rate_hz
        assert_stopped(trial, (Cause.DRIVE_FAULT, Cause.DRIVE_STATE), bound_s)
        measured(7, CANOPEN, f"second node, {trial.result.cause.name}", trial, bound_s)


def test_fault_07_no_drive_is_configured_where_two_answer():
    with bench(CANOPEN, connected=False) as made:
        channel = made.drive._settings.channel
        other = Cia402Emulator(WatchedArm(JOINT), interface="virtual", channel=channel)
        try:
            made.rig.connect()
            with pytest.raises(DeviceError, match="another node"):
                made.rig.configure()
            assert not made.powered
            assert not other.state()["power"]
        finally:
            other.close()


LOST = [
    ("virtual", "motion stops", Cause.MOTION_STALE, 0.1),
    ("virtual", "reports", Cause.DRIVE_LOST, 0.0),
    (CANOPEN, "stop measurements", Cause.DRIVE_LOST, CANOPEN_DRIVE["lost_s"] + 0.002),
    (CANOPEN, "stop heartbeat", Cause.DRIVE_LOST, CANOPEN_DRIVE["lost_s"] + 0.02 + 0.002),
    (CANOPEN, "die", Cause.DRIVE_LOST, CANOPEN_DRIVE["lost_s"] + 0.002),
    # The driver's 0.1 s without an answer, on top of a cycle.
    (ASCII, "silent", Cause.DRIVE_LOST, 0.1 + 0.02),
    (ASCII, "half_replies", Cause.DRIVE_LOST, 0.1 + 0.02),
    (ASCII, "garbage", Cause.DRIVE_LOST, 0.02 * 3),
    # One register alone: the third in a row, or 0.1 s.
    (ASCII, "damaged_register", Cause.DRIVE_LOST, 0.1 + 0.02),
    (ASCII, "status_is", Cause.DRIVE_LOST, 0.1 + 0.02),
]


@pytest.mark.parametrize(("rig", "case", "cause", "within_s"), LOST)
def test_fault_08_drive_lost(rig, case, cause, within_s, tmp_path, measured):
    with bench(rig) as made:
        value = {"reports": cause, "damaged_register": 0x18, "status_is": 2**63}.get(case)
        trial = run(made, tmp_path / "s", Wrong("drive", case, value))
        bound_s = within_s + 1.0 / made.rate_hz
        # What no longer hears is stopped by its own watchdog.
        itself_s = {"die": CANOPEN_DRIVE["command_deadline_s"]}.get(case, 0.0)
        itself_s = HORIZON_S if rig == ASCII else itself_s
        # A silent drive's angle is stale at the same time; either law may be first.
        causes = (cause, Cause.MOTION_STALE)
        assert_stopped(trial, causes, bound_s, drive_stops_itself=itself_s)
        if made.line is not None:
            assert not made.line.closed  # the hardware enable is open
            opened_s = made.line.opened_s - trial.fault_s
            # Nothing waits for a drive that does not answer.
            assert opened_s <= trial.zero_s + 2 / made.rate_hz + trial.slack_s
            measured(8, rig, case, trial, bound_s, opened_s=opened_s)
        else:
            measured(8, rig, case, trial, bound_s)


@pytest.mark.slow
def test_fault_08_late_answers_while_enabling_are_the_drives():
    """The torque sensor's samples pile up and are lost meanwhile: it is not to blame."""
    with bench(CANOPEN) as made:
        made.misbehave(Wrong("drive", "slow answers", 0.1))
        with pytest.raises(DeviceError, match=r"drive: it took \d\.\d s to be enabled"):
            made.rig.enable()
        time.sleep(0.1)
        assert not made.powered
        assert not made.line.closed


@pytest.mark.parametrize("rig", WIRES)
def test_fault_09_loop_hangs(rig, tmp_path, measured):
    """The loop stands still inside a tick: the drive must not wait for it."""
    with bench(rig) as made:
        trial = run(made, tmp_path / "s", lambda: time.sleep(0.6))
        if rig == CANOPEN:
            watchdog_s = CANOPEN_DRIVE["command_deadline_s"]
            braking_s = math.radians(126.0) / CANOPEN_DRIVE["quick_stop_rad_s2"]
        else:
            watchdog_s = HORIZON_S
            braking_s = 50.0 / 2000.0
        bound_s = watchdog_s + braking_s + made.settings.guard.reaction_time_s
        assert trial.rest_s <= bound_s + trial.slack_s, trial.rest_s
        moving = trial.trace[np.abs(trial.trace[:, 2]) > AT_REST_RAD_S, 0]
        assert moving[-1] < trial.fault_s + 0.6  # at rest before the loop came back, and for good
        assert trial.result.outcome == "fail"
        assert not trial.powered
        measured(9, rig, "loop hangs", rest_s=trial.rest_s, bound_s=bound_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_10_stale_target(rig, measured):
    with bench(rig) as made:
        if made.virtual:
            made.rig.write(1.0)  # left over from a session before
            made.rig.enable()
            for _ in range(200):
                made.rig.read()
        else:
            name = "stale target" if rig == CANOPEN else "stale_target"
            made.misbehave(Wrong("drive", name, 0.5 if rig == CANOPEN else 300_000))
            with pytest.raises(DeviceError):
                made.rig.enable()
            assert not made.powered
            assert not made.line.closed
            time.sleep(0.1)
        assert np.abs(made.trace()[:, 1]).max() < 1e-3
        measured(10, rig, "no motion on enable")


@pytest.mark.parametrize("rig", RIGS)
def test_fault_10_enabling_after_a_stop_moves_nothing(rig, tmp_path):
    with bench(rig) as made:
        desk = Desk(causes={round(0.25 * made.rate_hz): Cause.SIGNAL})
        run(made, tmp_path / "s", desk=desk)
        where = made.trace()[-1, 1]
        if not made.virtual:
            made.rig.configure()
        made.rig.enable()
        if made.virtual:
            for _ in range(100):
                made.rig.read()
        else:
            made.rig.write(0.0)
            time.sleep(0.05)
            made.rig.read()
        after = made.trace()[-20:, 1]
        assert np.abs(after - where).max() < math.radians(0.2)
        made.rig.disable()


@pytest.mark.parametrize("rig", RIGS)
def test_fault_13_position_limit_at_full_speed(rig, tmp_path, measured):
    limit_deg = 20.0
    with bench(rig, guard={"position_limit_deg": limit_deg}) as made:
        push = Wrong("arm", "push", 5.0 if made.virtual else lambda _: 5.0)
        trial = run(made, tmp_path / "s", push, at_s=0.1, task="prbs")
        (epoch,) = trial.of("epoch_ended")
        assert epoch["outcome"] == "fail"
        assert "position limit" in epoch["reason"]
        assert trial.result.outcome == "success", trial.result  # no fault: the session went on
        assert_whole(trial)
        sent = trial.samples["velocity_command_rad_s"]
        full = math.radians(made.settings.guard.speed_limit_deg_s)
        assert sent.max() > 0.7 * full  # at full speed, or what this push gives
        reached_deg = math.degrees(trial.trace[:, 1].max())
        # What a drive of second order overshoots its command by is beyond the guard's reckoning.
        assert reached_deg <= limit_deg + 0.001
        assert reached_deg > 0.7 * limit_deg
        at = float(trial.samples["time_s"][np.argmax(sent > 0.5 * full)] - trial.fault_s)
        measured(13, rig, f"reached {reached_deg:.4f} of {limit_deg:g} deg", after_s=at)


JUMPS = {
    "virtual": ("encoder jump", 1.0, 0.2),
    CANOPEN: ("encoder jump", 1.0, 0.2),
    ASCII: ("encoder_jump", 57_296, 11_459),
}


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("case", ["beyond the limit", "within it", "sign flip"])
def test_fault_14_encoder_jump_or_limit_exceeded(rig, case, tmp_path, measured):
    with bench(rig) as made:
        name, far, near = JUMPS[rig]
        if case == "sign flip":
            wrong = Wrong("drive", "encoder_sign_flip" if rig == ASCII else "encoder sign")
        else:
            wrong = Wrong("drive", name, far if case == "beyond the limit" else near)
        # An operator who insists gets nothing: what was stopped stays stopped.
        n = round(0.25 * made.rate_hz)
        desk = Desk({n + k: Command.RESUME for k in range(1, 40)}, attended=True)
        trial = run(made, tmp_path / "s", wrong, desk=desk)
        limits = guard_limits(made.settings)
        ticks = 4 if rig == ASCII else 2
        bound_s = ticks / made.rate_hz
        if case == "sign flip":
            # Where the encoder is goes the other way, at twice the speed.
            speed_rad_s = math.radians(50.0 if rig == ASCII else 125.0)
            bound_s += limits.following_rad / (2 * speed_rad_s) + limits.reaction_time_s
        causes = (Cause.POSITION_LIMIT_EXCEEDED, Cause.NOT_FOLLOWING)
        assert_stopped(trial, causes, bound_s)
        measured(14, rig, case, trial, bound_s)


ASTRAY = [
    *((rig, "does not follow") for rig in RIGS),
    *((rig, "encoder frozen") for rig in RIGS),
    *((rig, "runs away") for rig in RIGS),
]
RUNAWAY_RAD_S = {"virtual": 6.0, CANOPEN: 6.0, ASCII: 2.0}


@pytest.mark.parametrize(("rig", "case"), ASTRAY)
def test_fault_15_not_as_commanded(rig, case, tmp_path, measured):
    with bench(rig) as made:
        name = case.replace(" ", "_") if rig == ASCII else case
        value = RUNAWAY_RAD_S[rig] if case == "runs away" else None
        trial = run(made, tmp_path / "s", Wrong("drive", name, value))
        limits = guard_limits(made.settings)
        speed_rad_s = math.radians(50.0 if rig == ASCII else 125.0)
        bound_s = limits.following_rad / speed_rad_s + limits.reaction_time_s + 2 / made.rate_hz
        more_s = 0.01 if case == "runs away" else 0.0  # it stops from three times the speed
        causes = (Cause.NOT_FOLLOWING, Cause.OVERSPEED)
        if case == "encoder frozen":  # the velocity goes on, or repeats itself as well
            causes += (Cause.VELOCITY_WRONG, Cause.MOTION_STALE)
        assert_stopped(trial, causes, bound_s, more_s=more_s)
        if case == "runs away":
            # A drive that does not obey is not waited for: the power goes once zero was sent.
            assert trial.disabled_s - trial.fault_s <= trial.zero_s + 2 / made.rate_hz
        measured(15, rig, case, trial, bound_s)


# On the ASCII line, as the name of the test does not say.
@pytest.mark.realtime(priority=10, resolves_s=0.05, ordinary_probe=True)
def test_a_port_that_vanishes_as_the_session_ends_leaves_the_power_unconfirmed(tmp_path):
    """When all epochs are done: nobody may believe that the drive is off."""
    with bench(ASCII) as made:

        def sink(writer):
            note = writer.event

            def event(kind, **details):
                note(kind, **details)
                if kind == "epoch_ended":
                    made.drive_emulator.close()

            writer.event = event
            return writer

        trial = run(made, tmp_path / "s", sink=sink)
        assert [event["outcome"] for event in trial.of("epoch_ended")] == ["success"]
        assert trial.result.outcome == "fail"
        assert "that its power is off: keep hands off the joint" in trial.result.reason
        assert trial.of("session_ended")[0]["reason"] == trial.result.reason
        assert made.drive._line._thread.is_alive()  # it answers nothing, and fails nothing
