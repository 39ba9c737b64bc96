"""Every command of a wheel that is installed with the core's packages alone.

`python -m tests.core_install` builds the source distribution and from that the wheel, installs it
into an empty environment, makes the demo there and runs the help of each command and the examples
in it. The table has what was run, its exit status and the first line that it printed. What takes
longer than `LIMIT_S`, as a session in real time does, is interrupted; examples that read what it
would have made are left out. The status is 1 if one ended in a traceback, or a command that needs
neither a rig nor an extra did not end with success within `HANGS_S`. The examples of `study`, which
take half of the time, run beside the others in a copy of the demo's folder.
"""

from __future__ import annotations

import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.packages import ENVIRONMENT, ROOT, built, environment
from typer.main import get_command

from rigidimeter.cli.main import app

LIMIT_S = 30.0
"""What may refuse and takes longer is interrupted, as by Ctrl-C."""

HANGS_S = 600.0
"""What needs neither a rig nor an extra and takes longer has failed."""

DEMO = "demo-study/"
"""Where `make demo` writes."""

MAY_REFUSE = {
    "run": "a terminal, and a rig",
    "console": "the extra console",
    "commission": "a rig",
    "check": "a rig",
    "emulate": "the extras of the drives",
    "reproduce": "the extra batch",
}
"""Commands whose examples need what is not there; they refuse in a sentence."""


@dataclass(frozen=True)
class Ran:
    """A command line that was run."""

    words: list[str]
    status: int
    out: str
    err: str
    interrupted: bool = False

    @property
    def first_line(self) -> str:
        """Of the answer, or of what stands in its place; not of the progress, which is in `err`."""
        lines = (self.out if self.out.strip() else self.err).splitlines()
        return next((line.strip() for line in lines if line.strip()), "")

    @property
    def failed(self) -> bool:
        allowed = self.words[0] in MAY_REFUSE or "--scheduler" in self.words
        return "Traceback (most recent call last)" in self.out + self.err or bool(
            self.status and not (allowed and self.status in (1, 130, -signal.SIGINT))
        )


def commands() -> Iterator[tuple[list[str], Any]]:
    """Yield the words of every command, with the command."""
    for name, command in get_command(app).commands.items():  # type: ignore[attr-defined]
        below = getattr(command, "commands", {})
        yield from (([name, each], one) for each, one in below.items())
        if not below:
            yield [name], command


def examples(command: Any) -> list[list[str]]:
    """Return the words of each example in a command's help, after `rigidimeter`."""
    lines = (command.help or "").partition("For example:\n")[2].split("\n\n")[0]
    joined = lines.replace("\\\n", " ")
    return [shlex.split(line)[1:] for line in joined.splitlines() if line.strip()]


def run(program: Path, words: list[str], folder: Path, limit_s: float | None) -> Ran:
    """Run a command line; interrupt it where it does not end within the limit."""
    started = subprocess.Popen(
        [str(program), *words],
        cwd=folder,
        env=ENVIRONMENT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        out, err = started.communicate(timeout=limit_s)
    except subprocess.TimeoutExpired:
        started.send_signal(signal.SIGINT)
        try:
            out, err = started.communicate(timeout=LIMIT_S)
        except subprocess.TimeoutExpired:
            started.kill()
            out, err = started.communicate()
        return Ran(words, started.returncode or 1, out, err, interrupted=True)
    return Ran(words, started.returncode, out, err)


def tried(program: Path, lines: list[list[str]], folder: Path) -> list[Ran]:
    """Run the lines one after the other, print each, and return those that failed."""
    failed = []
    unmade: set[str] = set()
    for words in lines:
        if any(word.split("/")[0] in unmade for word in words):
            print(f"             {shlex.join(words)}: needs what was interrupted", flush=True)
            continue
        began_s = time.monotonic()
        ran = run(program, words, folder, LIMIT_S if words[0] in MAY_REFUSE else HANGS_S)
        if ran.interrupted:
            named = words[2 if words[0] == "study" else 1 :]
            unmade |= {word for word in named if not word.startswith("-")}
        took_s = time.monotonic() - began_s
        shown = f"{shlex.join(words)}: {ran.first_line}"
        print(f"{ran.status:6}  {took_s:5.0f}  {shown}", flush=True)
        if ran.failed:
            failed.append(ran)
    return failed


def beside(program: Path, lists: list[list[list[str]]], folders: list[Path]) -> list[Ran]:
    """Run lists of lines beside each other, each in its folder, and return what failed."""
    with ThreadPoolExecutor(len(lists)) as pool:
        done = pool.map(lambda lines, folder: tried(program, lines, folder), lists, folders)
        return [ran for failed in done for ran in failed]


def main() -> int:
    """Print the table; return 1 if a command failed."""
    with tempfile.TemporaryDirectory() as place:
        wheel = built(Path(place))
        pinned = ["--constraint", ROOT / "constraints.txt"]
        program = environment(Path(place) / "core", wheel, *pinned) / "rigidimeter"
        folders = [Path(place) / "tried", Path(place) / "studies"]
        shutil.copytree(ROOT / "examples", folders[0] / "examples")
        every = [*commands()]
        helps = [[*words, "--help"] for words, _ in every]
        lines: list[list[list[str]]] = [[], []]
        for words, command in every:
            lines[words[0] == "study"].extend(examples(command))
        print("status  s      command: first line", flush=True)
        failed = beside(program, [[["demo"]], helps], [folders[0], folders[0]])
        failed += tried(program, [["run", "--console", "--out", "led"]], folders[0])
        shutil.copytree(*folders)
        failed += beside(program, lines, folders)
    for each in failed:
        print(
            f"\nfailed, with status {each.status}: {shlex.join(each.words)}\n{each.out}{each.err}"
        )
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
