"""A golden input: what is written to a folder, the commands that are run there, and its answers."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.golden.answers import rows_of, table_rows
from tests.golden.table import Row

from rigidimeter.cli.main import main

ANSWER = "answer.json"
"""What the last command writes; a table may take its place."""


@dataclass(frozen=True)
class Case:
    """An input and its commands.

    `shows` is the capability of the program that it is an example of; `write` makes the files;
    each of `commands` is run in their folder, and the exit status of each is an answer. The last
    one writes `answer`.
    """

    name: str
    shows: str
    write: Callable[[Path], object]
    commands: Sequence[Sequence[object]]
    answer: str = ANSWER
    left_out: Sequence[str] = ("sensitivity",)
    needs: Path | None = None

    def answers(self, folder: Path) -> dict[str, Row]:
        """Write the input, run the commands, and return what came of them."""
        self.write(folder)
        statuses = {}
        with contextlib.chdir(folder):
            for number, command in enumerate(self.commands, 1):
                statuses[f"{number} {command[0]}"] = _run([str(word) for word in command])
        found: dict[str, Row] = {"exit": statuses}
        path = folder / self.answer
        if not path.exists():
            return found
        if path.suffix == ".csv":
            with path.open(encoding="utf-8", newline="") as file:
                return found | table_rows(list(csv.DictReader(file)))
        return found | rows_of(json.loads(path.read_text(encoding="utf-8")), self.left_out)


def _run(words: Sequence[str]) -> int:
    """Run a command in this process and return its exit status."""
    before = sys.argv
    sys.argv = ["rigidimeter", *words]
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            main()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    finally:
        sys.argv = before
    return 0


def estimated(*inputs: object, **options: object) -> list[object]:
    """Return the words of `estimate`; an option of several words is a mapping or a list."""
    return ["estimate", *inputs, *option_words(options), "--json", ANSWER]


def option_words(options: dict[str, object]) -> list[object]:
    """Return options of Python's front as those of the command line."""
    words: list[object] = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is True:
            words.append(option)
        elif isinstance(value, dict):
            words += [word for key, one in value.items() for word in (option, f"{key}={one}")]
        elif name == "names" and isinstance(value, tuple):
            words += [option, ",".join(value)]
        elif isinstance(value, (list, tuple)):
            words += [option, *value]
        else:
            words += [option, value]
    return words
