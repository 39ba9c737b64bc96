"""The lines of a text file: decoded, without comments and blank lines, and their cells counted.

The text is UTF-8, UTF-16 with its byte order mark, or what Windows writes in western Europe; gzip
may have compressed it.
"""

from __future__ import annotations

import csv
import gzip
import io
import os
import re
import zlib
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.files.escaping import NUMBER_TEXT
from rigidimeter.core.files.reading import open_regular
from rigidimeter.core.files.size_limits import EXPANDED_BYTES, EXPANSION, size_text

_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f]")
_HEAD_BYTES = 2**16
_GZIP = b"\x1f\x8b"
_FOOTER = 50
_NAME_LINES = 16
"""What opens a quotation and does not close it within so many lines is no list of names."""
_MISSING = {"", "na", "n/a", "#n/a", "nan", "null", "none", "-", "–", "."}


def read_utf8(path: Path, max_bytes: int) -> bytes:
    """Return the text of a file as UTF-8, with line feeds as line ends.

    Raises
    ------
    UserError
        If it cannot be read, is too large, or is not a text.
    """
    source = str(path)
    with open_regular(path, max_bytes) as file:
        try:
            data = file.read(_HEAD_BYTES)
            if data.startswith(_GZIP):
                file.seek(0)
                data = _expanded(path, file, max_bytes)
            elif len(data) == _HEAD_BYTES:
                _refuse_zeros(source, data)  # before the rest of a large file
                data += file.read(os.fstat(file.fileno()).st_size)
        except OSError as error:
            raise UserError(f"{source}: cannot be read ({error.strerror or error})") from None
    return _utf8(source, data)


def _expanded(path: Path, file: BinaryIO, max_bytes: int) -> bytes:
    """Return what a file that gzip compressed holds."""
    most = min(max_bytes, max(EXPANDED_BYTES, EXPANSION * os.fstat(file.fileno()).st_size))
    try:
        data = gzip.GzipFile(fileobj=file).read(most + 1)
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise UserError(
            f"{path} is not a complete gzip file ({error}); compress the text once more"
        ) from None
    if len(data) > most:
        raise UserError(
            f"{path}: expands to more than {size_text(most)}; split the recording, or expand it"
        )
    return data


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


def joined_names(data: bytes) -> bytes:
    """Return the text with names that go over several lines, in quotes, on the first.

    Empty lines stand in for those that it had, so that all lines keep their numbers.
    """
    first, n_lines = b"", 0
    for line in data.split(b"\n", _NAME_LINES)[:_NAME_LINES]:
        first = first + b" " + line if n_lines else line
        n_lines += 1
        if first.count(b'"') % 2 == 0:
            break
    if n_lines == 1 or first.count(b'"') % 2:
        return data
    return first + b"\n" * n_lines + data.split(b"\n", n_lines)[n_lines]


def content(data: bytes) -> tuple[bytes, NDArray[np.int64]]:
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


def records(body: bytes, delimiter: str) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
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


def is_missing(text: str) -> bool:
    """Return whether a cell says that nothing is there."""
    return text.lower() in _MISSING


def _is_text(line: bytes, is_row: bool, first: bytes, mark: bytes) -> bool:
    """Whether a line is no row: it begins with no number, though the first row does."""
    start = line.decode("utf-8").strip()
    if not is_row:
        return not NUMBER_TEXT.match(start)
    cells = [row.split(mark)[0].strip().decode("utf-8") for row in (first, line)]
    if is_missing(cells[1]) or cells[1].lower() in ("inf", "infinity"):
        return False
    return bool(NUMBER_TEXT.fullmatch(cells[0])) and cells[1][:1].isalpha()


def trimmed(
    body: bytes,
    starts: NDArray[np.intp],
    counts: NDArray[np.intp],
    n_columns: int,
    delimiter: str,
) -> tuple[bytes, NDArray[np.intp], NDArray[np.intp]]:
    """Leave out an empty last column that has no name, and lines of text after the last row."""
    mark = delimiter.encode()
    if counts.size and b'"' not in body:
        lines = body.split(b"\n")
        kept = len(lines)
        while (
            kept > 1
            and len(lines) - kept < _FOOTER
            and _is_text(
                lines[kept - 1], counts[kept - 1] in (n_columns, n_columns + 1), lines[0], mark
            )
        ):
            kept -= 1
        if kept < len(lines):
            body = b"\n".join(lines[:kept])
            starts, counts = starts[:kept], counts[:kept]
    if counts.size and np.all(counts == n_columns + 1):
        bare = re.sub(rb"(?m)" + re.escape(mark) + rb"[ ]*$", b"", body)
        starts, new_counts = records(bare, delimiter)
        if np.all(new_counts == n_columns):
            return bare, starts, new_counts
    return body, starts, counts
