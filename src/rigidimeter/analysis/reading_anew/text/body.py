"""The rows of a text as columns.

Parse first, ask later: the head is found in the first lines, and pandas gets the open file at the
byte of the first row. Only where a look at the bytes or a column finds what pandas alone would read
wrongly (comments, blank lines, quotes, a footer, marks between thousands, a wrong number of cells)
are the lines taken apart.
"""

from __future__ import annotations

import csv
import io
import re
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.columns import Column, Columns, numbers
from rigidimeter.analysis.reading_anew.headers import read_header
from rigidimeter.analysis.reading_anew.mapping import Mapping
from rigidimeter.analysis.reading_anew.streams import Stream, columns_of_streams
from rigidimeter.analysis.reading_anew.text.cells import GROUPED, stamps_s, ungrouped
from rigidimeter.analysis.reading_anew.text.dialects import LABCHART_BEGINS, LABVIEW_END, known_head
from rigidimeter.analysis.reading_anew.text.heads import HEAD_LINES, Head, found_head, stated_rate
from rigidimeter.analysis.reading_anew.text.sections import (
    SPIKE2_BEGINS,
    is_vicon,
    spike2_columns,
    vicon_columns,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import (
    NUMBER_TEXT,
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

EXAMPLE = "time_s,torque_nm,angle_rad"
STATED = "calibration"
"""The fact that holds lines of a head such as ``gain 0.5 Nm/V``: shown, and not used."""
_HEAD_BYTES = 2**18
# How gzip and UTF-16 begin.
_OTHER_CODES = (b"\x1f\x8b", b"\xff\xfe", b"\xfe\xff")
_BLOCK = 2**20
_LOOKED_AT = 50
_DECIMAL_COMMA = re.compile(r"^(\s*[+-]?\d*),(\d+(?:[eE][+-]?\d+)?\s*)$")
_CALIBRATION = re.compile(
    r"(?i)\d\s*[\w·.*°]+\s*(?:/|per)\s*(?:\(?m?V/V|m?[VA]|counts?|digits?|LSB|bits?)\b"
    r"|\d\s*(?:m?[VA]|counts?|digits?|LSB|bits?)\s*(?:/|per)\s*[\w·.*°]+"
    r"|(?:lever|moment)[\s_-]*arm|hebel|bras de levier|braccio|brazo|hefboom"
)
_IN_SECONDS = re.compile(r"(?i)[^\[(]*[\[(]\s*s(?:ec)?\s*[\])](?: \(\d+\))?")


class Rows(NamedTuple):
    """The rows of a text, where pandas can read them.

    Attributes
    ----------
    head : Head
    file : binary file
        At the first row.
    delimiter : str
    decimal : str
    lines : array of int, shape (n,), or int
        The line of the file of each row, or of the first.
    """

    head: Head
    file: IO[bytes]
    delimiter: str
    decimal: str
    lines: NDArray[np.int64] | int


def read_text(path: Path, said: Mapping) -> Columns:
    """Read a text, whose rows may have a head of several lines before them.

    Separated by comma, semicolon, tab, bar or blanks; decimal comma; UTF-8, UTF-16,
    Windows-1252; `#` begins a comment; names below a block of other lines, and a row of units;
    units and rates in the headers of LabVIEW, LabChart, Spike2, OpenSim, AcqKnowledge, Vicon
    Nexus, Qualisys and Biodex.

    Raises
    ------
    UserError
        If it is not such a file; the sentence names the line where there is one.
    """
    with path.open("rb") as file:
        plain = _plain(path, file, said)
        frame = None if plain is None else _parsed(str(path), plain)
        if plain is not None and frame is not None and _is_as_meant(plain, file, frame):
            return _columns(str(path), plain, frame)
    text = joined_names(_without_later_heads(read_utf8(path, RECORDING_BYTES)))
    if text.startswith(LABCHART_BEGINS.encode()) and b"\n" + LABCHART_BEGINS.encode() in text:
        raise UserError(
            f"{path}: holds {text.count(LABCHART_BEGINS.encode())} blocks of LabChart, each with a "
            "head and a time of its own; export each block to a file of its own"
        )
    if text.startswith(SPIKE2_BEGINS):
        return spike2_columns(str(path), text)
    if is_vicon(text):
        return vicon_columns(str(path), text)
    taken_apart = _taken_apart(str(path), text, said)
    frame = _parsed(str(path), taken_apart, strict=True)
    return _columns(str(path), taken_apart, frame)


def _plain(path: Path, file: io.BufferedReader, said: Mapping) -> Rows | None:
    """Return the rows of a file that pandas can read as they are; None if it needs a closer look.

    Nothing is refused here: what is wrong is said after the closer look.
    """
    start = file.read(_HEAD_BYTES).removeprefix(b"\xef\xbb\xbf")
    n_mark = file.tell() - len(start)
    if b"\n" not in start or b'"' in start.split(b"\n", 1)[0]:
        return None
    if start[:2] in _OTHER_CODES:
        return None
    if start.startswith((SPIKE2_BEGINS, b"LabVIEW")) or said.skip_rows or is_vicon(start):
        return None
    whole = len(start) < _HEAD_BYTES
    text = start if whole else start[: start.rindex(b"\n") + 1]
    try:
        text.decode("utf-8")
        data, lines = content(text.replace(b"\r\n", b"\n"))
        head = _head_of(str(path), text, data, said)
    except (UserError, UnicodeError):
        return None
    few = len(head.names) < 2 or lines.size < head.n_before + 2
    if head.in_pairs or not head.delimiter or few:
        return None
    first = int(lines[head.n_before])
    offset = n_mark + sum(len(line) + 1 for line in text.split(b"\n", first - 1)[: first - 1])
    file.seek(offset)
    decimal = _plain_decimal(file, head.delimiter)
    if decimal is None:
        return None
    file.seek(offset)
    return Rows(head, file, head.delimiter, decimal, first)


def _plain_decimal(file: IO[bytes], delimiter: str) -> str | None:
    """Return the decimal mark of rows that are plain; None if they are not."""
    commas = points = False
    while block := file.read(_BLOCK):
        if not block.isascii() or any(mark in block for mark in (b'"', b"'", b"\0")):
            return None
        commas = commas or (delimiter != "," and b"," in block)
        points = points or (delimiter != "," and b"." in block)
        if commas and points:
            return None
    return "," if commas else "."


def _is_as_meant(rows: Rows, file: io.BufferedReader, frame: Any) -> bool:
    """Whether pandas found a cell for each name in each row, and no text among numbers."""
    import pandas as pd

    if not isinstance(frame.index, pd.RangeIndex) or not len(frame):
        return False
    for name in rows.head.names:
        values = frame[name]
        if values.dtype.kind == "b":
            return False
        if values.dtype.kind not in "iuf":
            some = values.dropna().astype(str).str.strip()[:_LOOKED_AT]
            if any(NUMBER_TEXT.fullmatch(t) or GROUPED.fullmatch(t) for t in some):
                return False
    if frame[rows.head.names[-1]].notna().all():
        return True
    return _has_every_cell(rows, file, len(frame))


def _has_every_cell(rows: Rows, file: io.BufferedReader, n_rows: int) -> bool:
    """Whether there are as many separators as rows of these names have."""
    file.seek(0)
    skipped = 0
    for _ in range(int(np.min(rows.lines)) - 1):
        skipped += len(file.readline())
    file.seek(skipped)
    mark, count = ord(rows.delimiter), 0
    while block := file.read(_BLOCK):
        count += int(np.count_nonzero(np.frombuffer(block, np.uint8) == mark))
    return count == n_rows * (len(rows.head.names) - 1)


def _parsed(source: str, rows: Rows, *, strict: bool = False, **options: Any) -> Any:
    """Return the rows as a pandas frame; None, or a refusal, where they are no table."""
    import pandas as pd

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)
            return pd.read_csv(
                rows.file,
                sep=rows.delimiter,
                names=rows.head.names,
                header=None,
                index_col=False if strict else None,
                skipinitialspace=True,
                skip_blank_lines=False,
                decimal=rows.decimal,
                low_memory=False,
                encoding="utf-8",
                **options,
            )
    except (ValueError, Warning) as error:  # of which pandas' ParserError is one
        if not strict:
            return None
        raise UserError(
            f"{source} is not a readable table: {printable(str(error)[:200])}"
        ) from None


def _columns(source: str, rows: Rows, frame: Any) -> Columns:
    head = rows.head
    found: dict[str, NDArray[Any]] = {}
    for name in head.names:
        values = frame[name]
        if values.dtype.kind in "iuf":
            found[name] = values.to_numpy(np.float64)
            continue
        if values.dtype.kind == "b":  # labels such as "true" stay as they are written
            rows.file.seek(0)  # of rows in memory: plain ones have no such column
            values = _parsed(source, rows, strict=True, dtype=str, usecols=[name])[name]
        texts = values.astype(str).where(values.notna(), "")
        if rows.decimal == ",":
            texts = texts.str.replace(_DECIMAL_COMMA, r"\1.\2", regex=True)
        if texts.str.startswith("'").any():
            texts = texts.map(as_read)
        found[name] = texts.to_numpy(object)
    units = dict(head.units)
    if head.in_pairs or _are_pairs(head.names):
        return _of_pairs(source, found, units, rows.lines)
    for name in head.names:
        if read_header(name).kind == "time" and (stamps := stamps_s(found[name])) is not None:
            found[name], units[name] = stamps, "s"
    columns = {name: Column.of(values, units.get(name, "")) for name, values in found.items()}
    return Columns(source, columns, facts=head.facts, lines=rows.lines)


def _are_pairs(names: Sequence[str]) -> bool:
    """Whether every second column is a channel, and the one before it a time in s by its name."""
    in_s = [_IN_SECONDS.fullmatch(name) is not None for name in names]
    return len(names) > 2 and in_s == [True, False] * (len(names) // 2)


def _of_pairs(
    source: str,
    found: dict[str, NDArray[Any]],
    units: dict[str, str],
    lines: NDArray[np.int64] | int,
) -> Columns:
    """Return channels, each with the clock in the column before it.

    Raises
    ------
    UserError
        If a time is not a number, or does not increase.
    """
    names = list(found)
    table = Columns(source, {name: Column.of(v) for name, v in found.items()}, lines=lines)
    streams = []
    for time, name in zip(names[::2], names[1::2], strict=True):
        stamps, values = numbers(table, time, "time_s"), numbers(table, name, name, [])
        here = np.isfinite(stamps)  # a shorter channel ends in empty cells
        unit = {name: units.get(name, "")}
        streams.append(Stream(name, stamps[here], {name: values[here]}, unit))
    return columns_of_streams(source, streams)


def _taken_apart(source: str, whole: bytes, said: Mapping) -> Rows:
    """Find the columns and rows line by line, and check that every row has every column."""
    if said.skip_rows:
        parts = whole.split(b"\n", said.skip_rows)
        if len(parts) <= said.skip_rows:
            raise UserError(f"{source}: has fewer lines than --skip-rows {said.skip_rows}")
        whole = b"\n" * said.skip_rows + parts[-1]  # so that lines have their numbers
    data, lines = content(whole)
    if not data.strip():
        raise UserError(f"{source} is empty; its first line must name the columns")
    head = _head_of(source, whole, data, said)
    if len(head.names) < 2:
        raise UserError(
            f"{source}: its first line, {head.names[0][:40]!r}, names fewer than two columns; it "
            "must name all columns, separated by commas, semicolons or tabs"
        )
    body = data.split(b"\n", head.n_before)[head.n_before] if lines.size > head.n_before else b""
    if not body.strip():
        raise UserError(f"{source} names its columns in line {lines[0]} but has no samples")
    delimiter = head.delimiter or "\t"
    if not head.delimiter:
        body = re.sub(rb"(?m)^[ \t]+|[ \t]+$", b"", body)
        body = re.sub(rb"[ \t]+", b"\t", body)
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
        namer = "first line" if head.n_before == 1 else "head of the file"
        count = int(counts[wrong[0]])
        where = f"{source}, line {rest[start]}"
        raise wrong_count(where, row, count, len(head.names), delimiter, namer)
    body = ungrouped(body, delimiter)
    decimal = "," if _has_decimal_comma(delimiter, body) else "."
    return Rows(head, io.BytesIO(body), delimiter, decimal, rest[starts])


def _has_decimal_comma(delimiter: str, body: bytes) -> bool:
    """Whether numbers have one: between commas, in quotes and not with three digits after it."""
    if delimiter != ",":
        return re.search(rb"\d,\d", body) is not None
    return re.search(rb'"[+-]?\d*,(?:\d{1,2}|\d{4,})(?:[eE][+-]?\d+)?"', body) is not None


def _head_of(source: str, whole: bytes, data: bytes, said: Mapping) -> Head:
    """Return the head of a text, with the lines of it that state a rate or a calibration."""
    first = [line.decode("utf-8") for line in data.split(b"\n", HEAD_LINES)[:HEAD_LINES]]
    known = None if said.names else known_head(source, first)
    if known is not None:
        return known
    before, _, _ = whole.partition(data[: data.find(b"\n")] if b"\n" in data else data)
    comments = [line[1:].strip() for line in before.decode("utf-8").splitlines() if line[:1] == "#"]
    head = found_head(source, first, comments[-1] if comments else "", said.names, EXAMPLE)
    head = replace(head, facts={**stated_rate(comments), **head.facts})
    above = (*comments, *first[: head.n_before - 1])
    stated = [line for line in above if _CALIBRATION.search(line)]
    return replace(head, facts={**head.facts, STATED: "; ".join(stated)}) if stated else head


def _without_later_heads(text: bytes) -> bytes:
    """Return an .lvm file with one head: blank lines for those of later blocks of its columns."""
    if not text.startswith(b"LabVIEW Measurement"):
        return text
    end = re.escape(LABVIEW_END.encode())
    found = re.search(rb"\A(?s:.*?)" + end + rb"(?s:.*?)" + end + rb"[^\n]*\n([^\n]*)\n", text)
    if found is None:
        return text
    later = rb"\n\s*\nChannels\t(?s:.*?)" + end + rb"[^\n]*\n" + re.escape(found[1]) + rb"\n"
    body = re.sub(later, lambda head: b"\n" * head[0].count(b"\n"), text[found.end() :])
    return text[: found.end()] + body
