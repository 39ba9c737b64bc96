"""The table of states and commands, line by line."""

import math

import pytest

from rigidimeter.rig.acquisition import NOTHING, Command, Run, State, after, epoch_over

RUNNING, PAUSED = Run(State.RUNNING), Run(State.PAUSED)


def test_a_pause_waits_for_the_end_of_the_epoch():
    run = after(RUNNING, Command.PAUSE)
    assert run.state is State.RUNNING
    assert not run.at_once
    assert epoch_over(run).state is State.PAUSED


def test_a_pause_now_ends_the_epoch():
    run = after(RUNNING, Command.PAUSE_NOW)
    assert run.at_once
    assert run.state is State.PAUSED
    assert epoch_over(run) == PAUSED


def test_a_pause_that_has_not_come_can_be_taken_back():
    assert after(after(RUNNING, Command.PAUSE), Command.RESUME) == RUNNING


def test_stop_waits_and_abort_does_not():
    stopping = after(RUNNING, Command.STOP)
    assert not stopping.at_once
    assert epoch_over(stopping) == Run(State.STOPPING)
    aborting = after(RUNNING, Command.ABORT)
    assert aborting.at_once
    assert aborting.aborted
    assert aborting.state is State.STOPPING


def test_a_stop_is_not_forgotten_over_a_pause_now():
    assert after(after(RUNNING, Command.STOP), Command.PAUSE_NOW).stop_next


@pytest.mark.parametrize("state", list(State))
def test_halt_goes_before_everything(state):
    run = after(Run(state), Command.HALT)
    assert run.state is State.FAULTED
    assert run.at_once


@pytest.mark.parametrize("command", [c for c in Command if c not in (Command.RESET, Command.HALT)])
def test_a_fault_is_latched(command):
    faulted = Run(State.FAULTED)
    assert after(faulted, command) == faulted


def test_reset_leads_to_idle_and_moves_nothing():
    assert after(Run(State.FAULTED), Command.RESET) == Run(State.IDLE)
    assert after(Run(State.IDLE), Command.RESUME) == Run(State.IDLE)
    assert after(Run(State.IDLE), Command.START) == RUNNING


def test_from_a_pause_one_goes_on_stops_or_aborts():
    assert after(PAUSED, Command.RESUME) == RUNNING
    assert after(PAUSED, Command.STOP) == Run(State.STOPPING)
    assert after(PAUSED, Command.ABORT) == Run(State.STOPPING, at_once=True, aborted=True)
    assert after(Run(State.PAUSED, stop_next=True), Command.RESUME).stop_next
    assert after(PAUSED, Command.PAUSE) == PAUSED


def test_stopping_cannot_be_taken_back():
    stopping = Run(State.STOPPING)
    for command in (Command.RESUME, Command.START, Command.PAUSE, Command.STOP, Command.RESET):
        assert after(stopping, command) == stopping


def test_the_numbers_that_other_processes_read_stay():
    assert [state.value for state in State] == list(range(5))
    assert [command.value for command in Command] == list(range(11))
    assert (NOTHING.command, NOTHING.name) == (Command.NONE, "")
    assert math.isnan(NOTHING.value)
