"""Recordings as text.

Columns are separated by comma, semicolon, tab, bars or blanks, and named in the first line or below
a head of several lines. Comment lines start with ``#``. Where the separator is not the comma,
numbers may have a decimal comma.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.channels.headers import read_header
from rigidimeter.analysis.reading.channels.lever_arm import states_lever_arm
from rigidimeter.analysis.reading.formats.clocked_table import table_of_pairs
from rigidimeter.analysis.reading.formats.grouped_numbers import ungrouped
from rigidimeter.analysis.reading.formats.spike2_text import FIRST as SPIKE2
from rigidimeter.analysis.reading.formats.spike2_text import spike2_table
from rigidimeter.analysis.reading.formats.table import CALIBRATION, Table
from rigidimeter.analysis.reading.formats.text_head import (
    HEAD_LINES,
    Head,
    Layout,
    found_head,
    stated_rate,
)
from rigidimeter.analysis.reading.formats.text_preambles import known_head, without_later_heads
from rigidimeter.analysis.reading.formats.text_stamps import stamps_s
from rigidimeter.analysis.reading.formats.vicon_text import is_vicon, vicon_table
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import (
    RECORDING_BYTES,
    as_read,
    content,
    joined_names,
    printable,
    read_utf8,
    records,
    trimmed,
    wrong_count,
)

_DECIMAL_COMMA = re.compile(r"^(\s*[+-]?\d*),(\d+(?:[eE][+-]?\d+)?\s*)$")
_CALIBRATION = re.compile(
    r"(?i)\d\s*[\w·.*°]+\s*(?:/|per)\s*(?:\(?m?V/V|m?[VA]|counts?|digits?|LSB|bits?)\b"
    r"|\d\s*(?:m?[VA]|counts?|digits?|LSB|bits?)\s*(?:/|per)\s*[\w·.*°]+"
)
_SECONDS = re.compile(r"(?i)[^\[(]*[\[(]\s*s(?:ec)?\s*[\])](?: \(\d+\))?")
_LABCHART = b"Interval="


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
    whole = joined_names(without_later_heads(read_utf8(path, RECORDING_BYTES)))
    if whole.startswith(_LABCHART) and b"\n" + _LABCHART in whole:
        raise UserError(
            f"{path}: holds {whole.count(_LABCHART)} blocks of LabChart, each with a head and a "
            "time of its own; export each block to a file of its own"
        )
    if whole.startswith(SPIKE2):
        return spike2_table(str(path), whole)
    if is_vicon(whole):
        return vicon_table(str(path), whole)
    text = _open(str(path), whole, example, layout or Layout())
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

    @property
    def names(self) -> list[str]:
        return self.head.names

    def without_rows(self) -> UserError:
        return UserError(
            f"{self.source} names its columns in line {self.head_line} but has no samples"
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


def _open(source: str, whole: bytes, example: str, layout: Layout) -> _Text:
    """Find the columns and rows of a recording, and check that every row has every column."""
    if layout.skip_rows:
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
        body, starts, counts = trimmed(body, starts, counts, len(head.names), delimiter)
    except csv.Error as error:  # such as a quote that is never closed
        raise UserError(f"{source} is not a readable table: {error}") from None
    rest = lines[head.n_before :]
    wrong = np.flatnonzero(counts != len(head.names))
    if wrong.size:
        start = starts[wrong[0]]
        row = body.split(b"\n", start + 1)[start].decode("utf-8")
        where = f"{source}, line {rest[start]}"
        namer = "first line" if head.n_before == 1 else "head of the file"
        raise wrong_count(where, row, int(counts[wrong[0]]), len(head.names), delimiter, namer)
    return _Text(source, delimiter, head, int(lines[0]), body, rest[starts])


def _head(source: str, whole: bytes, data: bytes, example: str, layout: Layout) -> Head:
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
