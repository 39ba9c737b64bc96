"""What the page has computed beside a session: by the commands of this package, in processes.

A process cannot hold up the server, whatever it computes.
"""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from html import escape
from pathlib import Path

from rigidimeter.core.settings import Settings
from rigidimeter.rig.console import BEAT, BEAT_S, QUESTION
from rigidimeter.rig.console.page.rig_steps import RigStep

LONGEST_S = 300.0

NICENESS = 10
"""Of a command that computes: a session that is started beside it comes first."""

RigSteps = Callable[[Settings, Path | None], tuple[RigStep, ...]]


@dataclass(frozen=True)
class CommandResult:
    """What a command printed, and whether it ended well."""

    good: bool
    text: str

    @property
    def last_lines(self) -> str:
        """What it said at its end: the value, and the refusal if there is one."""
        return " ".join(self.text.splitlines()[-2 if not self.good else -1 :])

    def html(self, hidden: str = "", lines: Sequence[str] = ()) -> str:
        """Return it for the page.

        Parameters
        ----------
        hidden : str
            The name of a folder that is gone by then; it is left out.
        lines : sequence of str
            What it comes to; the whole text is folded up below. Of one that did not end well, if
            none are given, what it says was wrong.
        """
        text = self.text.replace(hidden, "…") if hidden else self.text
        if not self.good:
            lines = lines or [line for line in text.splitlines() if line.startswith("error: ")]
        sign = "" if self.good else "<p><b>✗ not good:</b></p>"
        full_text = f'<pre tabindex="0">{escape(text)}</pre>'
        if not lines:
            return sign + full_text
        listed = "".join(f"<li>{escape(line)}</li>" for line in lines)
        begin = "<details>" if self.good else "<details open>"
        return f"{sign}<ul>{listed}</ul>{begin}<summary>All numbers</summary>{full_text}</details>"


class Jobs:
    """Runs commands of `rigidimeter`, one at a time.

    Parameters
    ----------
    rig_steps : callable
        Gives what is to be done with the rig before a session of these settings, and their file.
    """

    def __init__(self, rig_steps: RigSteps = lambda *_: ()) -> None:
        self.rig_steps = rig_steps
        self.zero_read: CommandResult | None = None
        self._one = asyncio.Lock()

    async def command(
        self, *arguments: str, timeout_s: float = LONGEST_S, folder: Path | None = None
    ) -> CommandResult:
        """Run a command in a folder and return what it printed.

        Its arguments come from this program alone.
        """
        async with self._one:
            process = await asyncio.create_subprocess_exec(
                *_python(), *arguments,
                cwd=folder,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.STDOUT,
            )  # fmt: skip
            with suppress(ProcessLookupError):  # a session may be started meanwhile
                os.setpriority(os.PRIO_PROCESS, process.pid, NICENESS)
            try:
                out, _ = await asyncio.wait_for(process.communicate(), timeout_s)
            except TimeoutError:
                return CommandResult(False, f"it took longer than {timeout_s:g} s and was ended")
            finally:
                if process.returncode is None:
                    with suppress(ProcessLookupError):
                        process.kill()
        return CommandResult(process.returncode == 0, out.decode(errors="replace").strip())

    async def conversation(
        self,
        *arguments: str,
        on_output: Callable[[str], None],
        on_question: Callable[[str], Awaitable[bool]],
        going_on: Callable[[], bool],
    ) -> CommandResult:
        """Run a command that moves a rig and asks before.

        Parameters
        ----------
        *arguments : str
            They come from this program alone.
        on_output : callable
            Takes all that it has printed so far.
        on_question : callable
            Takes a question; True is consent.
        going_on : callable
            Whether it may go on: it is told so some twenty times a second, and stops the rig where
            it does not hear it. If not it is told to end, and stops the rig as it does so.
        """
        lines: list[str] = []
        async with self._one:
            process = await asyncio.create_subprocess_exec(
                *_python(), *arguments,
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.STDOUT,
            )  # fmt: skip
            watch = asyncio.create_task(_beat_while(process, going_on))
            try:
                assert process.stdout is not None
                async for raw in process.stdout:
                    line = raw.decode(errors="replace").rstrip()
                    if line.startswith(QUESTION):
                        await _answer(process, on_question(line.removeprefix(QUESTION)))
                    else:
                        lines.append(line)
                        on_output("\n".join(lines))
                await process.wait()
            finally:
                watch.cancel()
                if process.returncode is None:
                    with suppress(ProcessLookupError):
                        process.terminate()
        return CommandResult(process.returncode == 0, "\n".join(lines).strip())


async def _answer(process: asyncio.subprocess.Process, asked: Awaitable[bool]) -> None:
    """Give a command the answer; one that ended meanwhile needs none."""
    question, ended = asyncio.ensure_future(asked), asyncio.create_task(process.wait())
    await asyncio.wait({question, ended}, return_when=asyncio.FIRST_COMPLETED)
    if question.done() and process.stdin is not None:
        process.stdin.write(b"yes\n" if question.result() else b"no\n")
        with suppress(ConnectionError):
            await process.stdin.drain()
    question.cancel()
    ended.cancel()


async def _beat_while(process: asyncio.subprocess.Process, going_on: Callable[[], bool]) -> None:
    """Tell a command that somebody is there as long as that is so, then to end."""
    while going_on():
        if process.stdin is not None and not process.stdin.is_closing():
            process.stdin.write(f"{BEAT}\n".encode())
        await asyncio.sleep(BEAT_S)
    with suppress(ProcessLookupError):
        process.terminate()


def _python() -> Sequence[str]:
    return sys.executable, "-m", "rigidimeter"
