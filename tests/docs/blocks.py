"""Runs the blocks of documents in order; compares or rewrites the output that they show.

    python -m tests.docs.blocks            compare
    python -m tests.docs.blocks --write    rewrite what differs

Each document has a folder of its own. In it the blocks ``sh`` are run, and those in a comment,
``<!-- sh``, which a reader does not see (``<!-- sh quiet``: nor what it prints); ``toml NAME`` is
written as a file. Blocks ``python`` are cells of one notebook: of each a last expression is shown;
``<!-- python`` is one that a reader does not see. A block ``text output`` shows what the commands
since the last one printed. A block after ``<!-- not run -->`` needs a rig, or a study of the
reader's.
"""

from __future__ import annotations

import ast
import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from tests.console.opened import Console
from tests.docs.markdown import ROOT

from rigidimeter.cli.main import main

TUTORIALS = ROOT / "docs" / "tutorials"
HOW_TO = ROOT / "docs" / "how-to"
RUN = (
    TUTORIALS / "first-study.md",
    TUTORIALS / "operator-day.md",
    TUTORIALS / "my-first-recording.md",
    TUTORIALS / "from-python.md",
    HOW_TO / "after-a-change.md",
    HOW_TO / "count-the-days.md",
    HOW_TO / "design-an-experiment.md",
    HOW_TO / "optimise-the-perturbation.md",
    HOW_TO / "plan-the-days.md",
    HOW_TO / "recover-a-session.md",
    HOW_TO / "undo.md",
)

NOT_RUN = "<!-- not run -->\n"

_BLOCK = re.compile(r"^(?:```|<!-- (?=sh|python))([^\n]*)\n(.*?)^(?:```|-->)$", re.DOTALL | re.M)
_NUMBER = re.compile(r"(?<![\w-])[+−-]?\d+(?:[.,]\d+)?(?![\w.]\d)")
_TOOK = re.compile(r"(?<=Done in )\d+(?= s)")
_VARIES = (
    (_TOOK, "…"),
    (re.compile(r"(?<= in )[\d.]+ s, \d+ times(?= real time)"), "…"),
    (re.compile(r"\d{4}-\d\d-\d\d|\d\d:\d\d(:\d\d)?"), "…"),
)
_LAST_PLACES = 5.0
_SHARES = (0.6, 0.2)
"""How far apart numbers may be: of two significant digits, as standard errors, and of more."""


class Shown(NamedTuple):
    """A block of output: where its text lies in the document, the text, and what was printed."""

    path: Path
    begin: int
    text: str
    printed: str

    @property
    def where(self) -> str:
        """The document and its first line."""
        return f"{self.path.relative_to(ROOT)}: {self.text.partition(chr(10))[0].strip()}"


def run(path: Path, folder: Path) -> Iterator[Shown]:
    """Run the blocks of a document in a folder; yield each block of output.

    Raises
    ------
    RuntimeError
        If a command ends with another status than 0.
    """
    printed, text = "", path.read_text("utf-8")
    names: dict[str, Any] = {"__name__": path.stem}
    for block in _BLOCK.finditer(text):
        kind, _, more = block[1].partition(" ")
        if text[: block.start()].endswith(NOT_RUN):
            continue
        if kind == "sh":
            said = [_command(line, folder) for line in lines_of(block[2])]
            printed += "" if more == "quiet" else "".join(said)
        elif kind == "python":
            printed += cell(block[2], folder, names)
        elif kind == "toml" and more:
            (folder / more).write_text(block[2], "utf-8")
        elif block[1] == "text output":
            yield Shown(
                path, block.start(2), block[2], printed.replace(f"{folder.resolve()}", "...")
            )
            printed = ""


def cell(text: str, folder: Path, names: dict[str, Any]) -> str:
    """Run a block of Python as a cell of a notebook; return what it shows."""
    tree = ast.parse(text)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    out = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(out):
        exec(compile(tree, "document", "exec"), names)
        if last is not None:
            shown = eval(compile(ast.Expression(last.value), "document", "eval"), names)
            if shown is not None:
                print(repr(shown))
    return out.getvalue()


def lines_of(text: str) -> list[str]:
    """Return the commands of a block."""
    return [line for line in text.replace("\\\n", " ").splitlines() if line.strip()]


def _command(line: str, folder: Path) -> str:
    words = shlex.split(line, comments=True)
    if words[:2] == ["rigidimeter", "console"]:  # it runs until it is stopped
        Console(folder, words=words[2:]).close()
        return ""
    if words[0] == "rigidimeter":
        return _main(words, folder)
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join((f"{ROOT / 'src'}", f"{ROOT}")),
        "PATH": os.pathsep.join((f"{Path(sys.executable).parent}", os.environ["PATH"])),
    }
    ran = subprocess.run(
        line, shell=True, cwd=folder, capture_output=True, text=True, check=False, timeout=120,
        env=environment,
    )  # fmt: skip
    if ran.returncode:
        raise RuntimeError(f"{line}: {ran.stderr}")
    return ran.stdout


def _main(words: list[str], folder: Path) -> str:
    """Run a command in this process and return what it printed."""
    out, said, status = io.StringIO(), io.StringIO(), 0
    before, sys.argv = sys.argv, words
    try:
        with (
            contextlib.chdir(folder),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(said),
        ):
            main()
    except SystemExit as stop:
        status = int(stop.code or 0)
    finally:
        sys.argv = before
    if status:
        raise RuntimeError(f"{shlex.join(words)}: {said.getvalue()}")
    return out.getvalue()


def differs(shown: str, printed: str) -> str:
    """Return in what the words differ, or a number by more than another machine explains."""
    one, other = _words(shown), _words(printed)
    for a, b in zip(one, other, strict=False):
        if not _alike(a, b):
            at = one.index(a)
            return f"{' '.join(one[max(at - 5, 0) : at + 5])!r}: {a} is printed as {b}"
    return "" if len(one) == len(other) else f"{len(other)} words are printed, {len(one)} shown"


def _words(text: str) -> list[str]:
    for pattern, name in _VARIES:
        text = pattern.sub(name, text)
    return text.split()


def _alike(one: str, other: str) -> bool:
    if _NUMBER.sub("#", one) != _NUMBER.sub("#", other):
        return False
    return all(map(_close, _NUMBER.findall(one), _NUMBER.findall(other)))


def _close(one: str, other: str) -> bool:
    a, b = (float(text.replace("−", "-").replace(",", ".")) for text in (one, other))
    whole, _, decimals = one.lstrip("+−-").replace(",", ".").partition(".")
    share = _SHARES[len((whole + decimals).lstrip("0")) > 2]
    return abs(a - b) <= max(_LAST_PLACES * 10.0 ** -len(decimals), share * max(abs(a), abs(b)))


def write(shown: list[Shown]) -> int:
    """Write what was printed into one document; return how many blocks differed."""
    path, changed = shown[0].path, 0
    text = path.read_text("utf-8")
    for one in reversed(shown):
        if _words(one.text) != _words(one.printed):
            changed += 1
            new = one.printed.strip("\n") + "\n"
            if took := _TOOK.search(one.text):  # on a machine that did nothing else
                new = _TOOK.sub(took[0], new)
            text = text[: one.begin] + new + text[one.begin + len(one.text) :]
    path.write_text(text, "utf-8")
    return changed


def _all(*, rewrite: bool) -> int:
    status = 0
    for path in RUN:
        with tempfile.TemporaryDirectory(prefix="blocks-") as name:
            shown = list(run(path, Path(name)))
        if rewrite and shown:
            print(f"{path.relative_to(ROOT)}: {write(shown)} of {len(shown)} blocks rewritten")
        for one in () if rewrite else shown:
            if why := differs(one.text, one.printed):
                print(f"{one.where}: {why}")
                status = 1
    return status


if __name__ == "__main__":
    raise SystemExit(_all(rewrite="--write" in sys.argv[1:]))
