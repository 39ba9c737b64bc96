"""Small tables of labels and numbers, as a spreadsheet writes them: every cell is text.

Separated by comma, semicolon or tab; names in the first line; comment lines start with ``#``.
Numbers may have a decimal comma. Recordings, with millions of rows, are read in `tables`.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rigidimeter.errors import UserError

__all__ = ["Labelled", "read_labelled"]

_DELIMITERS = ("\t", ";", ",")
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
_MISSING = {"", "na", "n/a", "#n/a", "nan", "null", "none", "-", "–", "."}


@dataclass(frozen=True)
class Labelled:
    """A table of text.

    Attributes
    ----------
    source : str
        The file.
    columns : mapping of str to tuple of str
        By name, in the file's order; cells without the blanks around them.
    lines : tuple of int
        The line of the file in which each row begins; the header is line 1.
    """

    source: str
    columns: Mapping[str, tuple[str, ...]]
    lines: tuple[int, ...]

    def column(self, name: str, option: str) -> tuple[str, ...]:
        """Return a column.

        Raises
        ------
        UserError
            If there is no such column; the sentence names the option that chose it.
        """
        if name not in self.columns:
            known = ", ".join(self.columns)
            raise UserError(
                f"{self.source}: there is no column {name}; its columns are {known}. Name the "
                f"right one with {option}"
            )
        return self.columns[name]

    def number(self, name: str, row: int) -> float | None:
        """Return a cell as a number, None where it is missing.

        Raises
        ------
        UserError
            If it is neither.
        """
        text = self.columns[name][row]
        if is_missing(text):
            return None
        if not _NUMBER.fullmatch(text):
            raise UserError(
                f"{self.source}, line {self.lines[row]}: {name} is {text!r}, which is not a "
                "number; write a number, or leave the cell empty where there is none"
            )
        value = float(text.replace(",", "."))
        if value in (float("inf"), float("-inf")):
            raise UserError(
                f"{self.source}, line {self.lines[row]}: {name} is {text}, which is too large"
            )
        return value


def is_missing(text: str) -> bool:
    """Return whether a cell says that nothing is there."""
    return text.lower() in _MISSING


def read_labelled(path: Path) -> Labelled:
    """Read a table.

    Raises
    ------
    UserError
        If the file cannot be read, is empty, is not text, has no rows, names a column twice, or a
        row has another number of cells than the first line.
    """
    source = str(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise UserError(f"{source} cannot be read ({error.strerror or error})") from None
    text = _decoded(source, data)
    lines = text.splitlines()
    head = next((k for k, line in enumerate(lines) if line.strip() and line[:1] != "#"), None)
    if head is None:
        raise UserError(f"{source} is empty; its first line must name the columns")
    delimiter = next((mark for mark in _DELIMITERS if mark in lines[head]), ",")
    rows = _rows(source, lines, head, delimiter)
    names = [name or f"column {k}" for k, name in enumerate(rows[0][1], start=1)]
    if all(_NUMBER.fullmatch(name) for name in rows[0][1] if name):
        raise UserError(
            f"{source}: its first line holds numbers ({', '.join(rows[0][1][:3])}); it must name "
            "the columns, as in condition,examiner,score"
        )
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        raise UserError(f"{source}: two columns are named {twice}; each must have its own name")
    body = [(line, cells) for line, cells in rows[1:] if any(cells)]
    if not body:
        raise UserError(f"{source} names its columns but has no rows")
    for line, cells in body:
        if len(cells) != len(names):
            hint = ""
            if delimiter == "," and len(cells) > len(names):
                hint = "; where numbers have a decimal comma, separate the columns by semicolons"
            raise UserError(
                f"{source}, line {line} has {len(cells)} cell{'' if len(cells) == 1 else 's'}, but "
                f"the first line names {len(names)} columns{hint}"
            )
    columns = {name: tuple(cells[k] for _, cells in body) for k, name in enumerate(names)}
    return Labelled(source, columns, tuple(line for line, _ in body))


def _decoded(source: str, data: bytes) -> str:
    try:
        if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            text = data.decode("utf-16")
        else:
            text = data.decode("utf-8-sig")
    except UnicodeError:
        raise UserError(
            f"{source} is not a text file in UTF-8; in a spreadsheet, save it as CSV UTF-8"
        ) from None
    if "\0" in text:
        raise UserError(f"{source} is not a text file; a table as CSV was expected")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _rows(source: str, lines: list[str], head: int, delimiter: str) -> list[tuple[int, list[str]]]:
    """Return every row with the line in which it begins, comments left out."""
    kept = ["" if line[:1] == "#" and not line.startswith("#N/A") else line for line in lines]
    reader = csv.reader(
        io.StringIO("\n".join(kept[head:])), delimiter=delimiter, skipinitialspace=True
    )
    rows: list[tuple[int, list[str]]] = []
    begins = head + 1
    try:
        for cells in reader:
            if cells:
                rows.append((begins, [cell.strip() for cell in cells]))
            begins = head + reader.line_num + 1
    except csv.Error as error:
        raise UserError(f"{source}, line {begins} is not readable as a table ({error})") from None
    return rows
