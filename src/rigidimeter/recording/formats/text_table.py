"""Text tables: recordings, and the small tables of labels that a study keeps.

Columns are separated by comma, semicolon or tab and named in the first line; those of a recording
also by bars or blanks, below a head of several lines. Comment lines start with ``#``. Where the
separator is not the comma, numbers may have a decimal comma.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.documents import as_read
from rigidimeter.documents.bounds import RECORDING_BYTES, TABLE_BYTES, TABLE_CELLS, TABLE_ROWS
from rigidimeter.documents.escaping import NUMBER
from rigidimeter.errors import UserError
from rigidimeter.recording.channels.headers import read_header
from rigidimeter.recording.channels.lever_arm import states_lever_arm
from rigidimeter.recording.formats.clocked_table import table_of_pairs
from rigidimeter.recording.formats.grouped_numbers import THOUSANDS, ungrouped
from rigidimeter.recording.formats.spike2_text import FIRST as SPIKE2
from rigidimeter.recording.formats.spike2_text import spike2_table
from rigidimeter.recording.formats.table import CALIBRATION, Table, printable
from rigidimeter.recording.formats.text_head import (
    HEAD_LINES,
    Head,
    Layout,
    first_line_head,
    found_head,
    stated_rate,
)
from rigidimeter.recording.formats.text_lines import (
    content,
    is_missing,
    read_utf8,
    records,
    trimmed,
    whole_names,
)
from rigidimeter.recording.formats.text_preambles import known_head, without_later_heads
from rigidimeter.recording.formats.text_stamps import stamps_s
from rigidimeter.recording.formats.vicon_text import is_vicon, vicon_table

_DECIMAL_COMMA = re.compile(r"^(\s*[+-]?\d*),(\d+(?:[eE][+-]?\d+)?\s*)$")
_CALIBRATION = re.compile(
    r"(?i)\d\s*[\w·.*°]+\s*(?:/|per)\s*(?:m?V|counts?|digits?|LSB|bits?)\b"
    r"|\d\s*(?:m?V|counts?|digits?|LSB|bits?)\s*(?:/|per)\s*[\w·.*°]+"
)
_SECONDS = re.compile(r"(?i)[^\[(]*[\[(]\s*s(?:ec)?\s*[\])](?: \(\d+\))?")
_LABCHART = b"Interval="


@dataclass(frozen=True)
class TextTable:
    """A small table in which every cell is text.

    Attributes
    ----------
    source : str
        The file.
    columns : mapping of str to tuple of str
        By name, in the file's order; cells without the blanks around them.
    lines : tuple of int
        The line of the file in which each row begins; the header is line 1.
    delimiter : str
        What separates the columns.
    """

    source: str
    columns: Mapping[str, tuple[str, ...]]
    lines: tuple[int, ...]
    delimiter: str = ","

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
        return cell_number(self.columns[name][row], name, f"{self.source}, line {self.lines[row]}")


def cell_number(text: str, name: str, where: str) -> float | None:
    """Return a cell of the column `name` as a number, None where it is missing.

    Raises
    ------
    UserError
        If it is neither.
    """
    if is_missing(text):
        return None
    if not NUMBER.fullmatch(text):
        raise UserError(
            f"{where}: {name} is {text!r}, which is not a number; write a number, or leave the "
            "cell empty where there is none"
        )
    value = float(text.replace(",", "."))
    if abs(value) == float("inf"):
        raise UserError(f"{where}: {name} is {text}, which is too large")
    return value


def read_text_table(path: Path, *, may_be_empty: bool = False) -> TextTable:
    """Read a small table of labels and numbers; every cell stays text.

    Raises
    ------
    UserError
        If it is not such a file, or has no rows and may not be empty.
    """
    text = _open(str(path), read_utf8(path, TABLE_BYTES), "rows", "condition,examiner,score")
    n_rows, n_columns = text.lines.size, len(text.names)
    if not n_rows and not may_be_empty:
        raise text.without_rows()
    if n_rows > TABLE_ROWS or n_rows * n_columns > TABLE_CELLS:
        raise UserError(
            f"{text.source}: has {n_rows} rows of {n_columns} columns; a table of labels and "
            f"numbers may have {TABLE_ROWS} rows and {TABLE_CELLS} cells, so leave out what is not "
            "needed"
        )
    frame = text.parsed(dtype=str, na_filter=False)
    cells = [frame[name].str.strip() for name in text.names]
    kept = np.flatnonzero(np.any([column != "" for column in cells], axis=0))
    if not kept.size and not may_be_empty:
        raise text.without_rows()
    columns = {
        name: tuple(map(as_read, column.iloc[kept]))
        for name, column in zip(text.names, cells, strict=True)
    }
    return TextTable(text.source, columns, tuple(text.lines[kept].tolist()), text.delimiter)


def read_text_recording(path: Path, layout: Layout | None = None) -> Table:
    """Read a recording, whose rows may have a head of several lines before them.

    Returns
    -------
    Table
        Columns that hold nothing but numbers as float64, all others as text.

    Raises
    ------
    UserError
        If it is not such a file; the sentence names the line where there is one.
    """
    example = "time_s,torque_nm,angle_rad"
    whole = whole_names(without_later_heads(read_utf8(path, RECORDING_BYTES)))
    if whole.startswith(_LABCHART) and b"\n" + _LABCHART in whole:
        raise UserError(
            f"{path}: holds {whole.count(_LABCHART)} blocks of LabChart, each with a head and a "
            "time of its own; export each block to a file of its own"
        )
    if whole.startswith(SPIKE2):
        return spike2_table(str(path), whole)
    if is_vicon(whole):
        return vicon_table(str(path), whole)
    text = _open(str(path), whole, "samples", example, layout or Layout())
    if len(text.names) < 2:
        raise UserError(
            f"{text.source}: its first line, {text.names[0][:40]!r}, names fewer than two columns; "
            "it must name all columns, separated by commas, semicolons or tabs"
        )
    if not text.lines.size:
        raise text.without_rows()
    text = replace(text, body=ungrouped(text.body, text.delimiter))
    comma = _has_decimal_comma(text.delimiter, text.body)
    frame = text.parsed(decimal="," if comma else ".", low_memory=False)
    columns: dict[str, NDArray[Any]] = {}
    for name in text.names:
        values = frame[name]
        if values.dtype.kind in "iuf":
            columns[name] = values.to_numpy(np.float64)
            continue
        if values.dtype.kind == "b":  # labels such as "true" stay as they are written
            values = text.parsed(dtype=str, usecols=[name])[name]
        texts = values.astype(str).where(values.notna(), "")
        if comma:
            texts = texts.str.replace(_DECIMAL_COMMA, r"\1.\2", regex=True)
        if texts.str.startswith("'").any():
            texts = texts.map(as_read)
        columns[name] = texts.to_numpy(object)
    units = dict(text.head.units)
    if text.head.in_pairs or _is_pairs(text.names):
        return table_of_pairs(Table(text.source, columns, lines=text.lines, units=units))
    for name in text.names:
        if read_header(name).kind == "time" and (stamps := stamps_s(columns[name])) is not None:
            columns[name], units[name] = stamps, "s"
    return Table(text.source, columns, text.head.scalars, lines=text.lines, units=units)


def _has_decimal_comma(delimiter: str, body: bytes) -> bool:
    """Whether numbers have one: between commas, in quotes and not with three digits after it."""
    if delimiter != ",":
        return re.search(rb"\d,\d", body) is not None
    return re.search(rb'"[+-]?\d*,(?:\d{1,2}|\d{4,})(?:[eE][+-]?\d+)?"', body) is not None


def _is_pairs(names: Sequence[str]) -> bool:
    """Whether every second column is a channel, and the one before it a time in s by its name."""
    in_s = [_SECONDS.fullmatch(name) is not None for name in names]
    return len(names) > 2 and in_s == [True, False] * (len(names) // 2)


@dataclass(frozen=True)
class _Text:
    """A text table before its cells are read: comments, blank lines and the header are off."""

    source: str
    delimiter: str
    head: Head
    head_line: int
    body: bytes
    lines: NDArray[np.int64]
    rows_are: str

    @property
    def names(self) -> list[str]:
        return self.head.names

    def without_rows(self) -> UserError:
        return UserError(
            f"{self.source} names its columns in line {self.head_line} but has no {self.rows_are}"
        )

    def parsed(self, **options: Any) -> Any:
        """Return the rows as a pandas frame."""
        import pandas as pd

        try:
            return pd.read_csv(
                io.BytesIO(self.body),
                sep=self.delimiter,
                names=self.names,
                header=None,
                index_col=False,
                skipinitialspace=True,
                skip_blank_lines=False,
                lineterminator="\n",
                **options,
            )
        except ValueError as error:  # of which pandas' ParserError is one
            raise UserError(
                f"{self.source} is not a readable table: {printable(str(error)[:200])}"
            ) from None


def _open(
    source: str, whole: bytes, rows_are: str, example: str, layout: Layout | None = None
) -> _Text:
    """Find the columns and rows of a text table, and check that every row has every column.

    Without a layout its first line names its columns.
    """
    if layout is not None and layout.skip_rows:
        parts = whole.split(b"\n", layout.skip_rows)
        if len(parts) <= layout.skip_rows:
            raise UserError(f"{source}: has fewer lines than --skip-rows {layout.skip_rows}")
        whole = b"\n" * layout.skip_rows + parts[-1]  # so that lines keep their numbers
    data, lines = content(whole)
    if not data.strip():
        raise UserError(f"{source} is empty; its first line must name the columns")
    head = _head(source, whole, data, example, layout)
    body = data.split(b"\n", head.n_before)[head.n_before] if lines.size > head.n_before else b""
    if not body.strip():
        body = b""
    if not head.delimiter:
        body = re.sub(rb"(?m)^[ \t]+|[ \t]+$", b"", body)
        body = re.sub(rb"[ \t]+", b"\t", body)
    delimiter = head.delimiter or "\t"
    try:
        starts, counts = records(body, delimiter)
        if layout is not None:
            body, starts, counts = trimmed(body, starts, counts, len(head.names), delimiter)
    except csv.Error as error:  # such as a quote that is never closed
        raise UserError(f"{source} is not a readable table: {error}") from None
    rest = lines[head.n_before :]
    wrong = np.flatnonzero(counts != len(head.names))
    if wrong.size:
        count, line = int(counts[wrong[0]]), int(rest[starts[wrong[0]]])
        hint = ""
        if delimiter == "," and count > len(head.names):
            hint = "; where numbers have a decimal comma, separate the columns by semicolons"
            if THOUSANDS.search(body.split(b"\n", starts[wrong[0]] + 1)[starts[wrong[0]]]):
                hint = "; write numbers without a comma between thousands, or in quotes"
        named = "first line names" if head.n_before == 1 else "head of the file names"
        raise UserError(
            f"{source}, line {line} has {count} value{'' if count == 1 else 's'}, but the {named} "
            f"{len(head.names)} columns{hint}"
        )
    return _Text(source, delimiter, head, int(lines[0]), body, rest[starts], rows_are)


def _head(source: str, whole: bytes, data: bytes, example: str, layout: Layout | None) -> Head:
    if layout is None:
        return first_line_head(source, data.partition(b"\n")[0].decode("utf-8"), example, once=True)
    first = [line.decode("utf-8") for line in data.split(b"\n", HEAD_LINES)[:HEAD_LINES]]
    known = None if layout.names else known_head(source, first)
    if known is not None:
        return known
    before, _, _ = whole.partition(data[: data.find(b"\n")] if b"\n" in data else data)
    comments = [line[1:].strip() for line in before.decode("utf-8").splitlines() if line[:1] == "#"]
    head = found_head(source, first, comments[-1] if comments else "", layout.names, example)
    head = replace(head, scalars={**stated_rate(comments), **head.scalars})
    above = (*comments, *first[: head.n_before - 1])
    stated = [line for line in above if _CALIBRATION.search(line) or states_lever_arm(line)]
    if not stated:
        return head
    return replace(head, scalars={**head.scalars, CALIBRATION: "; ".join(stated)})
