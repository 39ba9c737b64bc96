"""The states of a run, and what an operator's command makes of them: a table, nothing else.

    idle ── start ──> running ── pause, pause_now ──> paused ── resume ──> running
    running, paused ── stop, abort ──> stopping ──> idle
    any ── fault, halt ──> faulted ── reset ──> idle

`pause` and `stop` wait for the end of the epoch, `pause_now` and `abort` end it. `halt` takes the
power away. A fault is latched: nothing but `reset` leaves it, and `reset` moves nothing.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple


class State(IntEnum):
    """Where a run is."""

    IDLE = 0
    RUNNING = 1
    PAUSED = 2
    STOPPING = 3
    FAULTED = 4


class Phase(IntEnum):
    """What the loop asks of the joint."""

    HOLD = 0
    ZEROING = 1
    EPOCH = 2
    RETURN = 3
    REST = 4


class Command(IntEnum):
    """What an operator can ask for."""

    NONE = 0
    START = 1
    PAUSE = 2
    PAUSE_NOW = 3
    RESUME = 4
    STOP = 5
    ABORT = 6
    HALT = 7
    RESET = 8
    CHANGE = 9
    NOTE = 10


class Order(NamedTuple):
    """A command; for CHANGE which parameter becomes what, for NOTE a JSON object to be recorded."""

    command: Command = Command.NONE
    name: str = ""
    value: float = math.nan


NOTHING = Order()


class Run(NamedTuple):
    """The state, and what is to come: a pause or the end after this epoch.

    `at_once` says that the epoch that runs ends now; `aborted` that the session was aborted rather
    than stopped.
    """

    state: State = State.IDLE
    pause_next: bool = False
    stop_next: bool = False
    at_once: bool = False
    aborted: bool = False


def after(run: Run, command: Command) -> Run:
    """Return the run after a command; the same run where the command means nothing there."""
    state = run.state
    if command is Command.HALT:
        return Run(State.FAULTED, at_once=True)
    if state is State.FAULTED:
        return Run() if command is Command.RESET else run
    if state is State.IDLE:
        return Run(State.RUNNING) if command is Command.START else run
    if state is State.RUNNING:
        if command is Command.PAUSE:
            return run._replace(pause_next=True)
        if command is Command.PAUSE_NOW:
            return Run(State.PAUSED, at_once=True, stop_next=run.stop_next)
        if command is Command.RESUME:  # a pause that has not come yet is taken back
            return run._replace(pause_next=False)
        if command is Command.STOP:
            return run._replace(stop_next=True)
        if command is Command.ABORT:
            return Run(State.STOPPING, at_once=True, aborted=True)
    if state is State.PAUSED:
        if command is Command.RESUME:
            return Run(State.RUNNING, stop_next=run.stop_next)
        if command is Command.STOP:
            return Run(State.STOPPING)
        if command is Command.ABORT:
            return Run(State.STOPPING, at_once=True, aborted=True)
    return run


def epoch_over(run: Run) -> Run:
    """Return the run at the end of an epoch or a rest: what was to come, comes."""
    if run.state is not State.RUNNING:
        return run._replace(at_once=False)
    if run.stop_next:
        return Run(State.STOPPING)
    if run.pause_next:
        return Run(State.PAUSED)
    return run
