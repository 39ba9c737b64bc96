"""Files of text, JSON, TOML and CSV: the one place where they are written."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import tomli_w

from rigidimeter.core.errors import refused
from rigidimeter.core.files.escaping import as_written


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, all of it or nothing.

    Raises
    ------
    UserError
        If the file cannot be written; an older file of that name is still there then.
    """
    content = text_bytes(text)
    with refused(path, "cannot be written"):
        if path.is_dir():
            raise IsADirectoryError(21, "Is a directory", str(path))
        if path.exists() and not path.is_file():  # such as /dev/stdout
            path.write_bytes(content)
        else:
            replace_file(path, content)


def write_json(path: Path, document: Any) -> None:
    """Write a document as JSON; numbers that are not finite become null.

    Raises
    ------
    UserError
        If the file cannot be written.
    """
    write_text(path, json_text(document))


def json_text(document: Any) -> str:
    """Return a document as JSON with a line feed at its end, floats in full precision."""
    values = plain_values(document)
    return json.dumps(values, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def json_line(event: Mapping[str, Any]) -> bytes:
    """Return an event as one line of JSON.

    Raises
    ------
    ValueError
        If it holds a number that is not finite.
    """
    return json.dumps(event, ensure_ascii=False, allow_nan=False).encode() + b"\n"


def toml_text(values: Mapping[str, Any]) -> str:
    """Return nested plain values as TOML; None is left out.

    Examples
    --------
    >>> print(toml_text({"seed": 1, "prbs": {"clock_hz": 20.0}, "task": None}), end="")
    seed = 1
    <BLANKLINE>
    [prbs]
    clock_hz = 20.0
    """
    return tomli_w.dumps(_without_none(values))


def _without_none(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _without_none(each) for key, each in value.items() if each is not None}
    return [_without_none(each) for each in value] if isinstance(value, list | tuple) else value


def plain_values(value: Any) -> Any:
    """Return a value as JSON has it: no NaN, no tuples, no numbers of NumPy."""
    if isinstance(value, Mapping):
        return {str(name): plain_values(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain_values(each) for each in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def csv_text(
    columns: Sequence[str], rows: Iterable[Mapping[str, Any]] | Iterable[Sequence[Any]]
) -> str:
    """Return a table as CSV: names in the first line, floats in full precision.

    Parameters
    ----------
    columns : sequence of str
        The names, in order.
    rows : iterable of mappings or of sequences
        Cells by name, or in the order of the columns; None, NaN and absent cells stay empty. Text
        is written by `as_written`, so that no cell is a formula or holds a control character.
    """
    written: dict[str, str] = {}  # most texts of a column are those of the row before

    def cell(value: Any) -> Any:
        if isinstance(value, str):
            if value not in written:
                written[value] = as_written(value)
            return written[value]
        return None if isinstance(value, float | np.floating) and math.isnan(value) else value

    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(map(cell, columns))
    for row in rows:
        values = map(row.get, columns) if isinstance(row, Mapping) else row
        writer.writerow(map(cell, values))
    return file.getvalue()


def text_bytes(text: str) -> bytes:
    """Return text as files hold it; what UTF-8 cannot say is escaped."""
    return text.encode("utf-8", errors="backslashreplace")


def replace_file(path: Path, content: bytes) -> None:
    """Put a file in its place at once, so that no reader ever finds half of it.

    Raises
    ------
    OSError
        If that cannot be done; the older file is still there then.
    """
    with in_place(path) as beside:
        beside.write_bytes(content)


@contextmanager
def in_place(path: Path) -> Iterator[Path]:
    """Give the name of a file to write, which gets the name `path` once it is complete.

    Whatever is raised meanwhile, the older file of that name is still there.
    """
    beside = path.with_name(f".{path.name}.part")
    try:
        yield beside
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def lock(file: BinaryIO) -> bool:
    """Lock a file until it is closed; return False if another process holds the lock.

    The lock ends with the process, also when it is killed. Where there are no locks, as on some
    network file systems, it is True.
    """
    try:
        import fcntl
    except ImportError:  # not of POSIX
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


def append_line(file: BinaryIO, line: bytes) -> None:
    """Write bytes at the end of an unbuffered file, all of them or none.

    Raises
    ------
    OSError
        If the disk does not take them; what it took is cut off again.
    """
    start = os.fstat(file.fileno()).st_size
    rest = memoryview(line)
    try:
        while rest:
            rest = rest[file.write(rest) :]
        file.flush()
    except OSError as error:
        file.seek(start)
        file.truncate()
        error.filename = file.name  # of a descriptor the system does not say it
        raise
