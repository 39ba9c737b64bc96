"""Text files of columns: separated by comma, semicolon or tab, with the names in the first line.

Comment lines start with ``#``. Where the separator is not the comma, numbers may have a decimal
comma.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
from numpy.typing import NDArray

from rigidimeter.errors import UserError
from rigidimeter.recording.formats.columns import Table, printable

__all__ = ["read_csv"]

_DELIMITERS = ("\t", ";", ",")
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
_DECIMAL_COMMA = re.compile(r"([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)")


def read_csv(path: Path) -> Table:
    """Read a text file of columns.

    Parameters
    ----------
    path : Path
        The file, in UTF-8 or, as spreadsheets write it, in UTF-16.

    Returns
    -------
    Table
        Columns that hold nothing but numbers as float64, all others as text.

    Raises
    ------
    UserError
        If it is not such a file; the sentence names the line where there is one.
    """
    source = str(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise UserError(f"{source} cannot be read ({error.strerror or error})") from None
    data, lines = _content(_utf8(source, data))
    head, _, body = data.partition(b"\n")
    if not head.strip():
        raise UserError(f"{source} is empty; its first line must name the columns")
    delimiter, names = _header(source, head.decode("utf-8"))
    if not body or body.isspace():
        raise UserError(f"{source} names its columns in line {int(lines[0])} but has no samples")
    decimal = "," if delimiter != "," and b"," in body and re.search(rb"\d,\d", body) else "."
    arrow = _parse(source, body, names, delimiter, decimal, lines[1:])
    columns = {name: _column(arrow.column(index), decimal) for index, name in enumerate(names)}
    return Table(source, columns, lines=lines[1:])


def _utf8(source: str, data: bytes) -> bytes:
    """Return the text as UTF-8 without its byte order mark, with line feeds as line ends."""
    try:
        if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            data = data.decode("utf-16").encode()
        data = data.removeprefix(b"\xef\xbb\xbf")
        if not data.isascii():
            data.decode("utf-8")
    except UnicodeError:
        raise UserError(
            f"{source} is not a text file in UTF-8; in a spreadsheet, save it as CSV UTF-8"
        ) from None
    if b"\0" in data:
        raise UserError(
            f"{source} is not a text file: it holds zero bytes; a CSV file was expected"
        )
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    return data


def _content(data: bytes) -> tuple[bytes, NDArray[np.int64]]:
    """Leave out comments and blank lines; also return the number of each line that is kept."""
    unusual = (b"#", b"\n\n", b"\n\r", b"\n ")
    if not data.startswith((b"\n", b"\r", b" ")) and not any(mark in data for mark in unusual):
        count = data.count(b"\n") + (0 if data.endswith(b"\n") else 1)
        return data, np.arange(1, count + 1)
    kept = [
        (number, line)
        for number, line in enumerate(data.split(b"\n"), start=1)
        if (bare := line.strip(b" \r")) and (bare[:1] != b"#" or bare.startswith(b"#N/A"))
    ]
    return b"\n".join(line for _, line in kept), np.array([number for number, _ in kept], np.int64)


def _header(source: str, text: str) -> tuple[str, list[str]]:
    """Return the delimiter and the names of the columns."""
    delimiter = next((mark for mark in _DELIMITERS if mark in text), "")
    if not delimiter:
        raise UserError(
            f"{source}: its first line, {text.strip()[:40]!r}, names fewer than two columns; it "
            "must name all columns, separated by commas, semicolons or tabs"
        )
    fields = _fields(text, delimiter)
    names = [printable(name.strip().strip("\"'").strip()) for name in fields]
    if all(_NUMBER.fullmatch(name) for name in names if name) and any(names):
        raise UserError(
            f"{source}: its first line holds numbers ({', '.join(names[:3])}, ...), but it must "
            "name the columns, as in time_s,torque_nm,angle_rad"
        )
    names = [name or f"column {index}" for index, name in enumerate(names, start=1)]
    twice = next((name for index, name in enumerate(names) if name in names[:index]), None)
    if twice is not None:
        raise UserError(f"{source}: two columns are named {twice}; each must have its own name")
    return delimiter, names


def _fields(line: str, delimiter: str) -> list[str]:
    try:
        return next(csv.reader([line.rstrip("\r\n")], delimiter=delimiter, skipinitialspace=True))
    except csv.Error:
        return line.split(delimiter)


def _parse(
    source: str,
    body: bytes,
    names: list[str],
    delimiter: str,
    decimal: str,
    lines: NDArray[np.int64],
) -> Any:
    try:
        return pyarrow.csv.read_csv(
            pa.BufferReader(body),
            read_options=pyarrow.csv.ReadOptions(column_names=names),
            parse_options=pyarrow.csv.ParseOptions(delimiter=delimiter, ignore_empty_lines=False),
            convert_options=pyarrow.csv.ConvertOptions(decimal_point=decimal, timestamp_parsers=[]),
        )
    except pa.ArrowInvalid as error:
        for number, line in zip(lines, body.decode("utf-8").split("\n"), strict=False):
            count = len(_fields(line, delimiter))
            if count != len(names):
                raise UserError(
                    f"{source}, line {int(number)} has {count} value{'' if count == 1 else 's'}, "
                    f"but the first line names {len(names)} columns"
                ) from None
        raise UserError(f"{source} is not a readable table: {str(error)[:200]}") from None


def _column(values: Any, decimal: str) -> NDArray[Any]:
    """Return float64 where every entry is a number or missing, else objects that are str."""
    kind = values.type
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_null(kind):
        return np.asarray(values.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)
    texts = values.cast(pa.string()).fill_null("").to_numpy(zero_copy_only=False)
    if decimal == ",":
        texts = np.array(
            [
                _DECIMAL_COMMA.sub(r"\1.\2", t) if _DECIMAL_COMMA.fullmatch(t.strip()) else t
                for t in texts
            ],
            dtype=object,
        )
    return np.asarray(texts, dtype=object)
