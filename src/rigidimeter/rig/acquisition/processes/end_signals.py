"""What the signals of a terminal or a service manager mean to the processes of a session.

SIGINT is the operator's abort; SIGTERM, SIGHUP and SIGQUIT stop the rig as for a fault. Both end
with a ramp. It is the same in console, loop and recorder, and whatever the program that started
them did with these signals: `nohup` ignores SIGHUP, a shell that runs a program in the background
ignores SIGINT, but a rig that moves must obey both.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from multiprocessing import resource_tracker
from types import FrameType

from rigidimeter.rig.acquisition.processes.shared_status import SharedStatus
from rigidimeter.rig.acquisition.processes.status_values import Flag

ENDINGS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
"""What ends a session."""

HELD_BACK = (*ENDINGS, signal.SIGTSTP)
"""What does not reach a process that still loads."""


def raise_flags(status: SharedStatus) -> None:
    """Have signals to this process, the loop or the recorder, ask the session to end.

    SIGTSTP (Ctrl-Z) is ignored: it would leave the last command in force.
    """

    def asked(number: int, _: FrameType | None) -> None:
        status.raise_flag(Flag.ABORT_ASKED if number == signal.SIGINT else Flag.END_ASKED)

    for number in ENDINGS:
        signal.signal(number, asked)
    signal.signal(signal.SIGTSTP, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, HELD_BACK)


def leave_to_the_others() -> None:
    """Ignore what reaches a whole group, in a process that ends with the others; not SIGTERM."""
    for number in HELD_BACK:
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, HELD_BACK)


@contextlib.contextmanager
def held_back() -> Iterator[None]:
    """Start a process that the signals of a group do not reach while it still loads.

    A new process has not yet come to where it handles them. It inherits what is blocked here, and
    takes what came meanwhile once it has.
    """
    # Started with the first process otherwise, after which SIGINT and SIGTERM are let through.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, HELD_BACK)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def signals_are_orders(status: SharedStatus) -> Iterator[list[int]]:
    """Turn the signals to the console into orders; a second SIGINT stops as for a fault.

    Gives the signals that came, a list that grows until the end.
    """
    came: list[int] = []

    def asked(number: int, _: FrameType | None) -> None:
        first = signal.SIGINT not in came
        came.append(number)
        abort = number == signal.SIGINT and first
        status.raise_flag(Flag.ABORT_ASKED if abort else Flag.END_ASKED)

    main = threading.current_thread() is threading.main_thread()
    before = {number: signal.signal(number, asked) for number in ENDINGS} if main else {}
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
