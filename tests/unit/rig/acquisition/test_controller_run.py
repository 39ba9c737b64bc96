"""How a run is led: its states, and the outcome and reason that are told at its end."""

import pytest
from tests.unit.rig.acquisition.exact_rig import Desk, ExactRig, LateClock
from tests.unit.rig.acquisition.whole_session import RATE_HZ, VALUES, ListSink

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.acquisition import ControllerRun, Run, State
from rigidimeter.rig.guard import Cause


def controller_run(desk=None):
    sink, states = ListSink(), []
    settings = parse_settings(VALUES)
    rig = ExactRig(interval_s=1.0 / RATE_HZ)
    clock = LateClock(interval_s=1.0 / RATE_HZ)
    run = ControllerRun(settings, rig, clock, sink, lambda _: None, desk, states.append)
    return run, states


def test_a_run_begins_idle_and_a_state_is_told_once():
    run, states = controller_run()
    assert (run.run, run.open_epoch, run.outcome, run.reason) == (Run(), None, "success", "")
    assert run.cause is Cause.NONE
    run.change_state(Run(State.RUNNING))
    run.change_state(Run(State.RUNNING))
    assert states == [Run(State.RUNNING)]
    assert run.is_in(State.RUNNING)
    assert not run.is_in(State.PAUSED)


def test_a_reason_that_stands_is_not_overwritten_at_the_end():
    run, _ = controller_run()
    run.fail(Cause.SIGNAL, "told to end")
    run.conclude(3)
    assert (run.outcome, run.reason, run.cause) == ("fail", "told to end", Cause.SIGNAL)


@pytest.mark.parametrize(
    ("state", "left", "outcome", "reason"),
    [
        (Run(State.RUNNING), 0, "success", ""),
        (Run(State.RUNNING), 2, "fail", "ended with 2 epochs left"),
        (Run(State.STOPPING), 2, "success", "stopped by the operator with 2 epochs left"),
        (
            Run(State.STOPPING, aborted=True),
            1,
            "abort",
            "aborted by the operator with 1 epochs left",
        ),
    ],
)
def test_how_a_run_ends_that_nothing_ended(state, left, outcome, reason):
    run, _ = controller_run()
    run.change_state(state)
    run.conclude(left)
    assert (run.outcome, run.reason, run.cause) == (outcome, reason, Cause.NONE)


def test_a_hold_keeps_the_stop_that_was_ordered_before():
    run, states = controller_run(Desk())
    run.change_state(Run(State.RUNNING, stop_next=True))
    run.loop.guard = run.loop.guard._replace(cause=int(Cause.POWER_HIGH), reaction=1)
    assert run.may_go_on()
    assert states[-1] == Run(State.PAUSED, stop_next=True)


def test_a_hold_in_the_last_epoch_is_told_though_all_was_run():
    run, _ = controller_run()
    run.loop.guard = run.loop.guard._replace(cause=int(Cause.POWER_HIGH), reaction=1)
    run.conclude(0)
    assert run.outcome == "success"
    assert run.cause is Cause.POWER_HIGH
    assert run.reason == f"the guard held the rig in the last epoch: {Cause.POWER_HIGH.sentence}"


def test_a_run_that_the_guard_stopped_does_not_go_on_whoever_is_there():
    run, states = controller_run(Desk())
    run.change_state(Run(State.RUNNING))
    run.loop.guard = run.loop.guard._replace(cause=int(Cause.DRIVE_FAULT), reaction=2)
    assert not run.may_go_on()
    assert states[-1] == Run(State.FAULTED)
    assert (run.outcome, run.cause) == ("fail", Cause.DRIVE_FAULT)
