"""Who answers a command that asks before something moves: a terminal, an option, or the page."""

from __future__ import annotations

import os
import queue
import signal
import sys
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

import typer

from rigidimeter.cli.output import echo

if TYPE_CHECKING:
    from rigidimeter.rig.commissioning import Operator


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
        `rig.console.QUESTION`, its answer the line ``yes`` or anything else. When that
        program is gone the check is ended as by SIGTERM.
    known_torque_nm, known_angle_deg : float, optional
        As an `Operator` has them.
    """
    from rigidimeter.rig.commissioning import Operator

    ask: Callable[[str], bool] = _ask
    if yes:
        ask = _consent
    elif piped:
        ask = _Piped().ask
    return Operator(ask, _say, not yes, known_torque_nm, known_angle_deg)


def _say(what: str) -> None:
    echo(what, err=True)


def _consent(_: str) -> bool:
    return True


def _ask(question: str) -> bool:
    """Put a question at the terminal; anything but yes is no."""
    return typer.confirm(question, default=False, err=True)


class _Piped:
    """Questions and answers as lines; the end of the input ends the process."""

    def __init__(self) -> None:
        self._answers: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=self._listen, name="answers", daemon=True).start()

    def ask(self, question: str) -> bool:
        from rigidimeter.rig.console import QUESTION

        echo(f"{QUESTION}{question}", err=True)
        return self._answers.get() == "yes"

    def _listen(self) -> None:
        # Not through `sys.stdin`, whose lock a thread must not hold when the program ends.
        with os.fdopen(os.dup(sys.stdin.fileno()), "rb", buffering=0) as answers:
            for line in answers:
                self._answers.put(line.decode(errors="replace").strip())
        os.kill(os.getpid(), signal.SIGTERM)
