"""What checks of a rig share: who answers, the rig for this process alone, and what is shown."""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from types import FrameType

import typer

from rigidimeter.cli.output import echo
from rigidimeter.cli.terminal_tables import Table
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition import DeadlineClock
from rigidimeter.rig.acquisition.processes import LoneSupervision, prepare_loop_process
from rigidimeter.rig.commissioning import Operator, RigCheck, Setup, Timebase
from rigidimeter.rig.console import BEAT, QUESTION
from rigidimeter.rig.devices import RigFile, drive_bounds


def require_answers(*, yes: bool, piped: bool = False) -> None:
    """Refuse to ask where nobody can answer.

    Raises
    ------
    UserError
    """
    if not yes and not piped and not sys.stdin.isatty():
        raise UserError(
            "nobody can answer the questions; use a terminal, or --yes on an emulated rig"
        )


def operator(
    *,
    yes: bool = False,
    piped: bool = False,
    known_torque_nm: float | None = None,
    known_angle_deg: float | None = None,
) -> Operator:
    """Return the operator of a check.

    Parameters
    ----------
    yes : bool
        Whether everything is consented to in advance, with nobody present.
    piped : bool
        Whether another program asks somebody: each question is a line that begins with
        `rig.console.QUESTION`, its answer the line ``yes`` or anything else. The line
        `rig.console.BEAT`, some twenty times a second, says that somebody is there: the rig stops
        where it is missing. When that program is gone the check is ended as by SIGTERM.
    known_torque_nm, known_angle_deg : float, optional
        As an `Operator` has them.
    """
    ask: Callable[[str], bool] = partial(typer.confirm, default=False, err=True)
    seen_ns = None
    if yes:
        ask = _consent
    elif piped:
        there = _Piped()
        ask, seen_ns = there.ask, there.seen_ns
    say = partial(echo, err=True)
    return Operator(ask, say, not yes, known_torque_nm, known_angle_deg, seen_ns)


def _consent(_: str) -> bool:
    return True


class _Piped:
    """Questions, answers and beats as lines; the end of the input ends the process."""

    def __init__(self) -> None:
        self._seen_ns = time.monotonic_ns()
        self._answers: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=self._listen, name="answers", daemon=True).start()

    def ask(self, question: str) -> bool:
        echo(f"{QUESTION}{question}", err=True)
        return self._answers.get() == "yes"

    def seen_ns(self) -> int:
        """Return when somebody was last known to be there."""
        return self._seen_ns

    def _listen(self) -> None:
        # Not through `sys.stdin`, whose lock a thread must not hold when the program ends.
        with os.fdopen(os.dup(sys.stdin.fileno()), "rb", buffering=0) as answers:
            for line in answers:
                self._seen_ns = time.monotonic_ns()
                text = line.decode(errors="replace").strip()
                if text != BEAT:
                    self._answers.put(text)
        os.kill(os.getpid(), signal.SIGTERM)


@contextlib.contextmanager
def claimed(
    rigfile: RigFile,
    settings: Settings,
    record: Path | None,
    again: str,
    asked: Operator,
) -> Iterator[Setup]:
    """Prepare this process for the loop and claim the rig; give it, not connected yet.

    An interrupt says that `record` was not written, and to do it `again`; where there is no record
    it is the end that was waited for.
    """
    for line in str(prepare_loop_process()).splitlines():
        echo(line, err=True)
    clock = DeadlineClock()
    with rigfile.claim() as lock, interrupted_once(record, again):
        bounds = drive_bounds(settings)
        rig = rigfile.build(clock.now_s, settings.rig.tick_rate_hz, lock=lock, bounds=bounds)
        limits = settings.loop
        supervise = partial(
            LoneSupervision,
            asked.seen_ns,
            console_lost_s=limits.console_lost_s,
            stall_s=limits.stall_s,
        )
        yield Setup(rig, settings, Timebase(clock.now_s, clock.wait_until), asked, supervise)


@contextlib.contextmanager
def interrupted_once(record: Path | None, again: str) -> Iterator[None]:
    """Let Ctrl-C, Ctrl-\\, Ctrl-Z, SIGTERM and the end of the terminal end it, once.

    A second one would break off the steps that bring the drive to rest and take its power away.
    """
    # A stopped program (Ctrl-Z) would leave the last command in force.
    signals = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)
    before = {}

    def ended(_: int, __: FrameType | None) -> None:
        for number in signals:
            signal.signal(number, signal.SIG_IGN)
        raise KeyboardInterrupt

    if threading.current_thread() is threading.main_thread():
        before = {number: signal.signal(number, ended) for number in signals}
    try:
        yield
    except (KeyboardInterrupt, typer.Abort):
        if record is not None:
            raise UserError(
                f"interrupted: the rig was stopped, and {record} was not written; {again}"
            ) from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def table(checks: Sequence[RigCheck]) -> Table:
    """Return the checks, each with its remedy below where it has one."""
    marks = {"passed": "ok", "failed": "FAIL"}
    rows: list[Sequence[str] | str] = []
    for check in checks:
        found = "" if check.value is None else check.words
        rows.append((marks.get(check.outcome, "–"), check.name, found, check.limit))
        if check.remedy:
            rows.append(f"      {check.remedy}")
    return Table(("", "check", "found", "must be"), rows, "=<<<", indent=0)
