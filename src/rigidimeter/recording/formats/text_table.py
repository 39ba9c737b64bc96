"""Text tables: recordings, and the small tables of labels that a study keeps.

Columns are separated by comma, semicolon or tab and named in the first line. Comment lines start
with ``#``. Where the separator is not the comma, numbers may have a decimal comma. The text is
UTF-8, UTF-16 with its byte order mark, or what Windows writes in western Europe.
"""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.documents import as_read, open_regular
from rigidimeter.documents.bounds import (
    COLUMNS,
    RECORDING_BYTES,
    TABLE_BYTES,
    TABLE_CELLS,
    TABLE_ROWS,
)
from rigidimeter.documents.escaping import NUMBER
from rigidimeter.errors import UserError
from rigidimeter.recording.formats.table import Table, printable

_DELIMITERS = ("\t", ";", ",")
_DECIMAL_COMMA = re.compile(r"^(\s*[+-]?\d*),(\d+(?:[eE][+-]?\d+)?\s*)$")
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f]")
_HEAD_BYTES = 2**16
_MISSING = {"", "na", "n/a", "#n/a", "nan", "null", "none", "-", "–", "."}


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
        return cell_number(self.columns[name][row], name, f"{self.source}, line {self.lines[row]}")


def is_missing(text: str) -> bool:
    """Return whether a cell says that nothing is there."""
    return text.lower() in _MISSING


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
    text = _open(path, "rows", "condition,examiner,score", TABLE_BYTES)
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
    return TextTable(text.source, columns, tuple(text.lines[kept].tolist()))


def read_text_recording(path: Path) -> Table:
    """Read a recording.

    Returns
    -------
    Table
        Columns that hold nothing but numbers as float64, all others as text.

    Raises
    ------
    UserError
        If it is not such a file; the sentence names the line where there is one.
    """
    text = _open(path, "samples", "time_s,torque_nm,angle_rad", RECORDING_BYTES)
    if len(text.names) < 2:
        raise UserError(
            f"{text.source}: its first line, {text.names[0][:40]!r}, names fewer than two columns; "
            "it must name all columns, separated by commas, semicolons or tabs"
        )
    if not text.lines.size:
        raise text.without_rows()
    comma = text.delimiter != "," and re.search(rb"\d,\d", text.body) is not None
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
    return Table(text.source, columns, lines=text.lines)


@dataclass(frozen=True)
class _Text:
    """A text table before its cells are read: comments, blank lines and the header are off."""

    source: str
    delimiter: str
    names: list[str]
    head_line: int
    body: bytes
    lines: NDArray[np.int64]
    rows_are: str

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


def _open(path: Path, rows_are: str, example: str, most_bytes: int) -> _Text:
    """Find the columns and rows of a text table, and check that every row has every column."""
    source = str(path)
    with open_regular(path, most_bytes) as file:
        try:
            data = file.read(_HEAD_BYTES)
            if len(data) == _HEAD_BYTES:
                _refuse_zeros(source, data)  # before the rest of a large file
                data += file.read(os.fstat(file.fileno()).st_size)
        except OSError as error:
            raise UserError(f"{source}: cannot be read ({error.strerror or error})") from None
    data, lines = _content(_utf8(source, data))
    head, _, body = data.partition(b"\n")
    if not head.strip():
        raise UserError(f"{source} is empty; its first line must name the columns")
    delimiter, names = _header(source, head.decode("utf-8"), example)
    if not body.strip():
        body = b""
    try:
        starts, counts = _records(body, delimiter)
    except csv.Error as error:  # such as a quote that is never closed
        raise UserError(f"{source} is not a readable table: {error}") from None
    wrong = np.flatnonzero(counts != len(names))
    if wrong.size:
        count, line = int(counts[wrong[0]]), int(lines[1:][starts[wrong[0]]])
        hint = ""
        if delimiter == "," and count > len(names):
            hint = "; where numbers have a decimal comma, separate the columns by semicolons"
        raise UserError(
            f"{source}, line {line} has {count} value{'' if count == 1 else 's'}, but the first "
            f"line names {len(names)} columns{hint}"
        )
    return _Text(source, delimiter, names, int(lines[0]), body, lines[1:][starts], rows_are)


def _utf8(source: str, data: bytes) -> bytes:
    """Return the text as UTF-8 without its byte order mark, with line feeds as line ends."""
    try:
        if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            data = data.decode("utf-16").encode()
        data = data.removeprefix(b"\xef\xbb\xbf")
        if not data.isascii():
            data = _decoded(data).encode()
    except UnicodeError:
        raise UserError(
            f"{source} is not a text file in UTF-8; in a spreadsheet, save it as CSV UTF-8"
        ) from None
    _refuse_zeros(source, data)
    return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def _refuse_zeros(source: str, data: bytes) -> None:
    if data[:2] not in (b"\xff\xfe", b"\xfe\xff") and b"\0" in data:
        raise UserError(
            f"{source} is not a text file: it holds zero bytes; a CSV file was expected"
        )


def _decoded(data: bytes) -> str:
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("cp1252")
        if _CONTROL.search(text):  # no text at all
            raise
        return text


def _content(data: bytes) -> tuple[bytes, NDArray[np.int64]]:
    """Leave out comments and blank lines; also return the number of each line that is kept."""
    data = data.rstrip(b"\n")
    if not data.startswith((b"\n", b" ", b"#")) and not any(
        mark in data for mark in (b"\n#", b"\n\n", b"\n ")
    ):
        return data, np.arange(1, data.count(b"\n") + 2)
    kept = [
        (number, line)
        for number, line in enumerate(data.split(b"\n"), start=1)
        if (bare := line.strip(b" ")) and (bare[:1] != b"#" or bare.startswith(b"#N/A"))
    ]
    return b"\n".join(line for _, line in kept), np.array([n for n, _ in kept], np.int64)


def _header(source: str, text: str, example: str) -> tuple[str, list[str]]:
    """Return the delimiter and the names of the columns."""
    delimiter = next((mark for mark in _DELIMITERS if mark in text), ",")
    try:
        fields = next(csv.reader([text], delimiter=delimiter, skipinitialspace=True))
    except csv.Error:
        fields = text.split(delimiter)
    if len(fields) > COLUMNS:
        raise UserError(
            f"{source}: its first line names {len(fields)} columns; at most {COLUMNS} are read, so "
            "leave out those that are not needed"
        )
    names = [printable(name.strip().strip("\"'").strip()) for name in fields]
    if any(names) and all(NUMBER.fullmatch(name) for name in names if name):
        raise UserError(
            f"{source}: its first line holds numbers ({', '.join(names[:3])}"
            f"{', ...' if len(names) > 3 else ''}), but it must name the columns, as in {example}"
        )
    names = [name or f"column {index}" for index, name in enumerate(names, start=1)]
    twice = next((name for index, name in enumerate(names) if name in names[:index]), None)
    if twice is not None:
        raise UserError(f"{source}: two columns are named {twice}; each must have its own name")
    return delimiter, names


def _records(body: bytes, delimiter: str) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the line in which each row begins, counted from 0, and its number of cells."""
    if not body:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    if b'"' not in body:
        codes = np.frombuffer(body, np.uint8)
        ends = np.append(np.flatnonzero(codes == ord("\n")), codes.size)
        before = np.searchsorted(np.flatnonzero(codes == ord(delimiter)), ends)
        return np.arange(ends.size), np.diff(before, prepend=0) + 1
    reader = csv.reader(
        io.StringIO(body.decode("utf-8"), newline="\n"), delimiter=delimiter, skipinitialspace=True
    )
    starts, counts = [], []
    begins = 0
    for cells in reader:
        starts.append(begins)
        counts.append(len(cells))
        begins = reader.line_num
    return np.array(starts), np.array(counts)
