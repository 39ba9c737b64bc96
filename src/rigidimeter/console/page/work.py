"""What the page has computed beside a session: by the commands of this package, in processes.

A process cannot hold up the server, whatever it computes.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from html import escape

LONGEST_S = 300.0


@dataclass(frozen=True)
class Answer:
    """What a command printed, and whether it ended well."""

    good: bool
    text: str

    def html(self, hidden: str = "") -> str:
        """Return it for the page, without the name of a folder that is gone by then."""
        text = self.text.replace(hidden, "…") if hidden else self.text
        sign = "" if self.good else "<p><b>✗ not good:</b></p>"
        return f'{sign}<pre tabindex="0">{escape(text)}</pre>'


class Work:
    """Runs commands of `rigidimeter`, one at a time.

    Parameters
    ----------
    rig_lines : tuple of str
        What is known of the rig: whether it is virtual, when it was commissioned and checked.
    """

    def __init__(self, rig_lines: tuple[str, ...] = ()) -> None:
        self.rig_lines = rig_lines
        self._one = asyncio.Lock()

    async def command(self, *arguments: str, timeout_s: float = LONGEST_S) -> Answer:
        """Run a command and return what it printed; arguments come from this program alone."""
        async with self._one:
            process = await asyncio.create_subprocess_exec(
                *_python(), *arguments,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.STDOUT,
            )  # fmt: skip
            try:
                out, _ = await asyncio.wait_for(process.communicate(), timeout_s)
            except TimeoutError:
                return Answer(False, f"it took longer than {timeout_s:g} s and was ended")
            finally:
                if process.returncode is None:
                    with suppress(ProcessLookupError):
                        process.kill()
        return Answer(process.returncode == 0, out.decode(errors="replace").strip())


def _python() -> Sequence[str]:
    return sys.executable, "-m", "rigidimeter"
