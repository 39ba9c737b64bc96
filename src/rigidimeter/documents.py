"""Files of text, JSON, CSV and TOML: the one place where they are written, and read as values."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rigidimeter.errors import UserError


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, all of it or nothing.

    Raises
    ------
    UserError
        If the file cannot be written; an older file of that name is still there then.
    """
    content = text_bytes(text)
    try:
        if path.is_dir():
            raise IsADirectoryError(21, "Is a directory", str(path))
        if path.exists() and not path.is_file():  # such as /dev/stdout
            path.write_bytes(content)
        else:
            replace_file(path, content)
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error.strerror or error})") from None


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
        Cells by name, or in the order of the columns; None, NaN and absent cells stay empty.
    """
    import pandas as pd

    frame = pd.DataFrame(list(rows), columns=list(columns), dtype=object)
    return str(frame.to_csv(index=False, lineterminator="\n"))


def read_json(path: Path) -> Any:
    """Return what a JSON file holds.

    Raises
    ------
    UserError
        If the file cannot be read or is not JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror or error})") from None
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path}: is not valid JSON ({error})") from None


def read_toml(path: Path) -> dict[str, Any]:
    """Return what a TOML file holds.

    Raises
    ------
    UserError
        If the file cannot be read or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror or error})") from None
    except UnicodeDecodeError:
        raise UserError(f"{path}: is not a text file in UTF-8") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise UserError(f"{path}: is not valid TOML: {error}") from None


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
    beside = path.with_name(f".{path.name}.part")
    try:
        beside.write_bytes(content)
        beside.replace(path)
    except OSError:
        beside.unlink(missing_ok=True)
        raise
