"""Faults 24 to 27: readings that do not agree with each other or with what was commanded."""

import math

import numpy as np
import pytest
from tests.faults.rigs import ASCII, CANOPEN, RIGS, Wrong, bench
from tests.faults.trials import assert_came_to_rest, assert_recorded, run

from rigidimeter.rig.guard import Cause

AGREE_S = 0.5
"""How long a wrong motion may last, unless it is shorter than `AGREE_DEG`."""

AGREE_DEG = 5.0
LONG = {"prbs": {"duration_s": 4.0}, "protocol": {"rests_s": [2.5], "return_s": 0.5}}


def moved_deg(trial, until_s):
    """Return how far the arm itself was from where it was when the fault came, until then."""
    after = (trial.trace[:, 0] >= trial.fault_s) & (trial.trace[:, 0] <= until_s)
    angle_rad = trial.trace[after, 1]
    return math.degrees(np.abs(angle_rad - angle_rad[0]).max())


def assert_found(trial, causes, within_s):
    """Assert that one of the causes was named in time, and that the arm came to rest."""
    named = Cause(int(trial.samples["cause"][trial.first]))
    assert named in causes, named.name
    assert trial.detected_s <= within_s + trial.slack_s, (named, trial.detected_s, within_s)
    assert_came_to_rest(trial, more_s=0.05)
    return named


DRIFT = math.radians(4.5)
DRIFTING = (Cause.MOVED_AT_REST, Cause.NOT_FOLLOWING)


@pytest.mark.parametrize("rig", ["virtual", CANOPEN])
@pytest.mark.parametrize("case", ["hold", "run"])
def test_fault_24_motion_that_nobody_commanded(rig, case, tmp_path, measured):
    """The zero offset of a drive: 4.5 deg/s on top of every command."""
    with bench(rig, zeroing={"duration_s": 2.0}, **LONG) as made:
        drifts = Wrong("drive", "drifts", DRIFT)
        # Told to stand still while the sensor is zeroed; or following what the perturbation asks.
        options = {"zero_first": True, "at_s": 0.5} if case == "hold" else {"task": "prbs"}
        trial = run(made, tmp_path / "s", drifts, **options)
        within_s = made.settings.guard.following_limit_deg / 4.5 + 0.2
        named = assert_found(trial, DRIFTING, within_s)
        if case == "hold":
            assert trial.detected_s <= AGREE_S + trial.slack_s
            assert moved_deg(trial, trial.fault_s + trial.rest_s) <= AGREE_DEG
            assert not trial.of("epoch_started")
        else:
            assert_recorded(trial, named)
            # The wrong part of the motion: 4.5 deg/s for so long.
            assert 4.5 * trial.detected_s <= AGREE_DEG
        reached = f"{4.5 * trial.detected_s:.1f} deg of drift in a {case}, {named.name}"
        measured(24, rig, reached, trial, within_s)


@pytest.mark.parametrize("rig", ["virtual", CANOPEN])
@pytest.mark.parametrize("speed_deg_s", [2.0, 4.0])
def test_fault_24_no_zero_is_made_of_a_joint_that_moves(rig, speed_deg_s, tmp_path, measured):
    with bench(rig) as made:
        drifts = Wrong("drive", "drifts", math.radians(speed_deg_s))
        trial = run(made, tmp_path / "s", drifts, at_s=0.0, zero_first=True)
        assert trial.result.outcome == "fail"
        assert not [e for e in trial.of("sensor_zeroed") if not e["refused"]]
        assert not trial.of("epoch_started")
        assert not trial.powered
        degrees = math.degrees(np.abs(trial.trace[:, 1]).max())
        assert degrees < 2.0
        measured(24, rig, f"zeroing at {speed_deg_s:g} deg/s: {degrees:.1f} deg", trial)


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("gain", [0.0, -1.0, 2.0])
def test_fault_25_a_velocity_that_is_not_the_angles(rig, gain, tmp_path, measured):
    """In a tremor, whose energy such a velocity hides."""
    with bench(rig, prbs={"duration_s": 3.0}) as made:
        if made.virtual:
            tremor = Wrong("arm", "tremor", (3.0, 4.0))
        else:
            tremor = Wrong("arm", "", lambda t: 3.0 * math.sin(2 * math.pi * 4.0 * t))
        name = "velocity_gain" if rig == ASCII else "velocity gain"
        options = {"task": "prbs", "at_s": 1.0, "then": {0.1: lambda: made.misbehave(tremor)}}
        trial = run(made, tmp_path / "s", Wrong("drive", name, gain), **options)
        # Twice the velocity may be above the speed limit first.
        causes = (Cause.VELOCITY_WRONG, Cause.OVERSPEED)[: 2 if gain > 1.0 else 1]
        named = assert_found(trial, causes, AGREE_S)
        assert_recorded(trial, named)
        case = {0.0: "reported as 0", -1.0: "sign turned", 2.0: "of twice the size"}[gain]
        measured(25, rig, case, trial, AGREE_S)


SIGN_S = {"virtual": 0.5, CANOPEN: 0.5, ASCII: 1.1}
"""A wrong sign shows once a window of 24 rows of 16 ms is full, over a slow line one of 48 rows of
20 ms; up to 6 rows more until the next look."""

TURNED_S = {"virtual": 0.7, CANOPEN: 0.7, ASCII: 1.25}
"""A sign that turns in a run: 5 rows more, and 6 of the fast ones."""

UNTRUE = {
    "sign": (Wrong("sensor", "gain", -1.0), (Cause.TORQUE_SIGN,), SIGN_S["virtual"]),
    "gain 0": (Wrong("sensor", "gain", 0.0), (Cause.TORQUE_SILENT,), 0.75),
    "last bit toggles": (Wrong("sensor", "toggles"), (Cause.TORQUE_SILENT,), 0.75),
    "axis constant": (Wrong("sensor", "axis_constant"), (Cause.TORQUE_SILENT,), 0.75),
    "a second late": (Wrong("sensor", "late", 1.0), (Cause.TORQUE_SILENT,), 0.75),
}


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("case", UNTRUE)
def test_fault_26_a_torque_that_does_not_answer(rig, case, tmp_path, measured):
    wrong, causes, within_s = UNTRUE[case]
    if case == "sign":
        within_s = SIGN_S[rig]
    with bench(rig, **LONG) as made:
        trial = run(made, tmp_path / "s", wrong, at_s=0.0, task="prbs")
        assert_recorded(trial, assert_found(trial, causes, within_s))
        assert np.degrees(np.abs(trial.trace[:, 1])).max() < 20.0
        deg = moved_deg(trial, trial.fault_s + trial.rest_s)
        measured(26, rig, f"{case}: {deg:.1f} deg", trial, within_s)


@pytest.mark.parametrize(
    ("rig", "at_s"),
    [
        *(("virtual", at_s) for at_s in (0.9, 1.3)),
        *((CANOPEN, 0.9), (ASCII, 1.3)),
        *(pytest.param(*other, marks=pytest.mark.slow) for other in ((CANOPEN, 1.3), (ASCII, 0.9))),
    ],
)
def test_fault_26_a_sign_that_turns_in_a_run(rig, at_s, tmp_path, measured):
    wrong, causes, _ = UNTRUE["sign"]
    with bench(rig, **LONG) as made:
        trial = run(made, tmp_path / "s", wrong, at_s=at_s, task="prbs")
        assert_recorded(trial, assert_found(trial, causes, TURNED_S[rig]))
        deg = moved_deg(trial, trial.fault_s + trial.rest_s)
        measured(26, rig, f"sign, after {at_s:g} s: {deg:.1f} deg", trial, TURNED_S[rig])


@pytest.mark.parametrize(
    ("rig", "case", "pause_s"),
    [
        *((rig, "bursts", 0.095) for rig in RIGS),
        ("virtual", "pauses", 0.03),
        (CANOPEN, "pauses", 0.03),  # at 50 Hz a pause of 30 ms is hardly more than a tick
    ],
)
def test_fault_27_torques_that_come_in_bursts(rig, case, pause_s, tmp_path, measured):
    with bench(rig, **LONG) as made:
        trial = run(made, tmp_path / "s", Wrong("sensor", case, pause_s), task="prbs")
        within_s = 0.6
        causes = (Cause.SELDOM_FRESH, Cause.TORQUE_FROZEN, Cause.TORQUE_STALE)
        assert_recorded(trial, assert_found(trial, causes, within_s))
        measured(27, rig, f"{1e3 * pause_s:g} ms, {trial.result.cause.name}", trial, within_s)
