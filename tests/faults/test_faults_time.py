"""Faults 11 and 12: late ticks, a loop that stalls, a wall clock that jumps; what stops nothing."""

import math
import time

import numpy as np
import pytest
from tests.faults.rigs import ASCII, RIGS, WIRES, Wrong, bench
from tests.faults.trials import Desk, assert_stopped, assert_whole, run

from rigidimeter.rig.guard import Cause


def late_from_now(made, seconds, ticks=1):
    """Make the next ticks late."""
    now = round(made.clock.now_s() * made.rate_hz)
    for k in range(2, 2 + ticks):
        made.clock.late[now + k] = seconds


def assert_no_catch_up(trial):
    """Assert that no tick was run before its time, and none twice."""
    due_s = trial.samples["tick"] * trial.tick_s
    assert np.all(trial.samples["time_s"] >= due_s - 1e-6)
    assert np.all(np.diff(trial.samples["tick"]) >= 1)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_11_deadlines_missed_in_a_row(rig, tmp_path, measured):
    in_a_row = 20 if rig != ASCII else 5
    with bench(rig, loop={"missed_in_a_row": in_a_row}) as made:
        tick_s = 1.0 / made.rate_hz
        trial = run(made, tmp_path / "s", lambda: late_from_now(made, 1.2 * tick_s, 100))
        bound_s = (2 * in_a_row + 2) * tick_s
        assert_stopped(trial, Cause.DEADLINES_MISSED, bound_s)
        measured(11, rig, f"{in_a_row} in a row", trial, bound_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_11_stall(rig, tmp_path, measured):
    stall_s = 0.15
    with bench(rig, loop={"stall_s": 0.1}) as made:
        trial = run(made, tmp_path / "s", lambda: late_from_now(made, stall_s))
        bound_s = stall_s + 3 / made.rate_hz
        # On the wires the drive has stopped itself meanwhile; the stall is named, not its effect.
        assert_stopped(trial, Cause.STALLED, bound_s)
        row = trial.first
        assert trial.samples["velocity_command_rad_s"][row] == 0.0  # nothing is set going again
        assert_no_catch_up(trial)
        measured(11, rig, f"stall of {stall_s:g} s", trial, bound_s)


@pytest.mark.parametrize("rig", WIRES)
def test_fault_11_enabling_is_no_stall(rig, tmp_path):
    """A device may take long to come up; the first tick is on time all the same."""
    with bench(rig, loop={"stall_s": 0.1}) as made:
        time.sleep(0.3)
        desk = Desk(causes={round(0.1 * made.rate_hz): Cause.SIGNAL})
        trial = run(made, tmp_path / "s", desk=desk)
        assert trial.result.cause is Cause.SIGNAL
        assert trial.samples["lateness_s"][0] < 0.1


@pytest.fixture
def jump(monkeypatch):
    """Set the wall clock off by so many seconds."""
    true_time, true_ns, off_s = time.time, time.time_ns, [0.0]
    monkeypatch.setattr(time, "time", lambda: true_time() + off_s[0])
    monkeypatch.setattr(time, "time_ns", lambda: true_ns() + round(1e9 * off_s[0]))
    return lambda by_s: off_s.__setitem__(0, by_s)


@pytest.mark.parametrize("rig", RIGS)
def test_faults_5_11_and_12_that_stop_nothing(rig, tmp_path, jump, measured):
    """A late tick, few bad packets of which the newest win, a warning, and a wall clock set."""
    with bench(rig) as made:
        tick_s = 1.0 / made.rate_hz
        acts = {0.45: lambda: jump(3600.0), 0.7: lambda: jump(-3600.0)}
        if not made.virtual:
            acts[0.05] = lambda: made.misbehave(Wrong("sensor", "warning"))
            for k, name in enumerate(("lose_once", "duplicate_once", "reorder_once"), 1):
                acts[0.1 * k] = lambda name=name: made.misbehave(Wrong("sensor", name))
            # Backlogs of 10 ms; with longer ones the torque would be old too often.
            acts[0.5] = lambda: made.misbehave(Wrong("sensor", "backlog", 0.01))
            acts[0.8] = made.behave
        late = lambda: late_from_now(made, 2.5 * tick_s)  # noqa: E731
        trial = run(made, tmp_path / "s", late, then=acts)
        assert trial.result.outcome == "success", trial.result
        assert_whole(trial)
        assert not trial.samples["cause"].any()
        assert trial.of("epoch_ended")[0]["missed_ticks"] >= 2
        assert_no_catch_up(trial)
        sent = trial.samples["velocity_command_rad_s"]
        limit = math.radians(made.settings.guard.acceleration_limit_deg_s2) * tick_s
        if rig != ASCII:  # which skips a command when its line is busy
            assert np.abs(np.diff(sent)).max() <= limit * 1.01 + 1e-3
        age_s = trial.samples["time_s"] - trial.samples["motion_time_s"]
        assert age_s.max() < made.settings.guard.stale_s
        if not made.virtual:
            counts = made.rig.counts
            # One was lost, and one counted as lost until it came late.
            assert (counts["torque_lost"], counts["torque_repeated"]) == (2, 1)
            assert counts["torque_reordered"] == 1
            assert counts["torque_warnings"] > 100
            assert np.all(np.diff(trial.samples["torque_sequence"]) >= 0)
    if rig == "virtual":
        with bench(rig) as again:
            plain = run(again, tmp_path / "plain", lambda: late_from_now(again, 2.5 * tick_s))
        for name, values in plain.samples.items():
            np.testing.assert_array_equal(trial.samples[name], values)
    measured(12, rig, "an hour on, an hour back: no effect")
