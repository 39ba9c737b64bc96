"""What signals mean to the processes of a session, and which wait while a process loads."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigidimeter.rig.acquisition.processes import (
    HELD_BACK,
    Flag,
    SharedStatus,
    leave_to_the_others,
    raise_flags,
    shared_memory,
    signals_are_orders,
)

FIRST_PROCESS = """
import multiprocessing, signal
from rigidimeter.rig.acquisition.processes.end_signals import HELD_BACK, held_back

if __name__ == "__main__":
    process = multiprocessing.get_context("spawn").Process(target=len, args=("",))
    with held_back():
        process.start()
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    process.join()
    print(sorted(set(HELD_BACK) - blocked))
"""


def test_the_first_process_is_started_with_all_of_them_held_back() -> None:
    # multiprocessing starts its resource tracker before the first process that it spawns, and
    # after that lets SIGINT and SIGTERM through; so only a new interpreter shows it.
    ran = subprocess.run([sys.executable, "-c", FIRST_PROCESS], capture_output=True, text=True)
    assert (ran.stdout.strip(), ran.stderr) == ("[]", "")


@pytest.fixture
def status(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[SharedStatus]:
    """Give a shared status; the signals mean what they did before once it is gone."""
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)
    before = {number: signal.getsignal(number) for number in HELD_BACK}
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    made = SharedStatus.create()
    yield made
    for number, handler in before.items():
        signal.signal(number, handler)
    signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
    made.close()


def raised(status: SharedStatus) -> list[Flag]:
    return [flag for flag in Flag if status.flag(flag)]


ENDS = (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


@pytest.mark.parametrize(
    ("number", "flag"),
    [(signal.SIGINT, Flag.ABORT_ASKED), *[(number, Flag.END_ASKED) for number in ENDS]],
)
def test_a_signal_to_loop_or_recorder_asks_for_the_end(
    status: SharedStatus, number: signal.Signals, flag: Flag
) -> None:
    raise_flags(status)
    signal.raise_signal(number)
    assert raised(status) == [flag]


@pytest.mark.parametrize("number", ENDS)
def test_a_signal_to_the_console_ends_the_session(
    status: SharedStatus, number: signal.Signals
) -> None:
    with signals_are_orders(status) as came:
        signal.raise_signal(number)
    assert (raised(status), came) == ([Flag.END_ASKED], [number])


def test_the_second_ctrl_c_does_not_abort_again_but_stops_as_for_a_fault(
    status: SharedStatus,
) -> None:
    with signals_are_orders(status) as came:
        signal.raise_signal(signal.SIGINT)
        assert raised(status) == [Flag.ABORT_ASKED]
        signal.raise_signal(signal.SIGINT)
    assert set(raised(status)) == {Flag.ABORT_ASKED, Flag.END_ASKED}
    assert came == [signal.SIGINT] * 2


def test_ctrl_z_stops_no_process_of_a_session(status: SharedStatus) -> None:
    """A process that is stopped leaves the drive with its last command."""
    raise_flags(status)
    assert signal.getsignal(signal.SIGTSTP) is signal.SIG_IGN
    signal.signal(signal.SIGTSTP, signal.SIG_DFL)
    leave_to_the_others()
    assert signal.getsignal(signal.SIGTSTP) is signal.SIG_IGN
