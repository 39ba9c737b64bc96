"""Files are opened and read here: regular ones only, and none that is larger than its bound."""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
import re
import stat
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError, refused
from rigidimeter.core.files.size_limits import (
    DOCUMENT_BYTES,
    MAX_DIGITS,
    NESTING,
    SETTINGS_BYTES,
    size_text,
)

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


_noted: ContextVar[dict[Path, str] | None] = ContextVar("noted", default=None)


def open_regular(path: Path, max_bytes: int) -> io.BufferedReader:
    """Open a regular file for reading, or what a link to one leads to.

    Parameters
    ----------
    path : Path
    max_bytes : int
        The largest file that is opened, one of `core.files.size_limits`.

    Raises
    ------
    UserError
        If there is none, it is not a regular file (a pipe or a device may never end), it is larger
        than its bound, or it cannot be opened.
    """
    with ExitStack() as on_failure:
        file = on_failure.enter_context(_opened(path, max_bytes))
        if _noted.get() is not None:
            with refused(path, "cannot be read"):
                _note(path, hashlib.file_digest(file, "sha256").hexdigest())
                file.seek(0)
        on_failure.pop_all()
    return file


def _opened(path: Path, max_bytes: int) -> io.BufferedReader:
    try:
        _check(path, os.stat(path), max_bytes)
        # Another file may have this name by now; without O_NONBLOCK a pipe waits for its writer.
        with ExitStack() as on_failure:
            file = on_failure.enter_context(
                open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK))
            )
            _check(path, os.fstat(file.fileno()), max_bytes)
            on_failure.pop_all()
        return file
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        reason = getattr(error, "strerror", None) or error
        raise UserError(f"{path}: cannot be read ({reason})") from None


@contextmanager
def noted_digests() -> Iterator[dict[Path, str]]:
    """Note the SHA-256 of every file that is opened for reading meanwhile, as it is then.

    A digest that is computed later may be that of another file of the same name. A file that is
    opened again and is no longer the same is refused: parts of two would make one result.
    """
    found: dict[Path, str] = {}
    token = _noted.set(found)
    try:
        yield found
    finally:
        _noted.reset(token)


def _note(path: Path, digest: str) -> None:
    noted = _noted.get()
    if noted is not None and noted.setdefault(path, digest) != digest:
        raise UserError(f"{path}: was changed while it was read; run the command again")


def _check(path: Path, status: os.stat_result, max_bytes: int) -> None:
    if not stat.S_ISREG(status.st_mode):
        kind = next((what for test, what in _KINDS if test(status.st_mode)), "something else")
        raise UserError(f"{path}: cannot be read (it is {kind}); name a regular file")
    if status.st_size > max_bytes:
        raise UserError(
            f"{path}: has {size_text(status.st_size)}, and at most {size_text(max_bytes)} are "
            "read of such a file; split it, or name the right file"
        )


def read_bytes(path: Path, max_bytes: int) -> bytes:
    """Return what a regular file holds.

    Raises
    ------
    UserError
        As `open_regular`.
    """
    with _opened(path, max_bytes) as file, refused(path, "cannot be read"):
        # Not read(max_bytes), which would make room for as much.
        content = file.read(os.fstat(file.fileno()).st_size)
    if _noted.get() is not None:
        _note(path, hashlib.sha256(content).hexdigest())
    return content


def read_json(path: Path, largest: int = DOCUMENT_BYTES) -> Any:
    """Return what a JSON file holds.

    Raises
    ------
    UserError
        If the file cannot be read, is not JSON, or goes beyond `core.files.size_limits`.
    """
    return parse_json(read_bytes(path, largest), str(path))


def parse_json(data: bytes, source: str) -> Any:
    """Return what JSON says, of a file or of one line of it, which `source` names.

    Raises
    ------
    UserError
        If it is not JSON, or goes beyond `core.files.size_limits`.
    """
    try:
        values = json.loads(data.decode("utf-8"))
    except json.JSONDecodeError as error:
        raise UserError(f"{source}: is not valid JSON ({error})") from None
    except UnicodeDecodeError:
        raise UserError(f"{source}: is not valid JSON: it is not text in UTF-8") from None
    except RecursionError:
        raise UserError(_too_deep(source)) from None
    except ValueError:  # of int(), for which Python has a bound of its own
        raise UserError(_too_long(source, "a whole number")) from None
    _check_values(values, source)
    for name, value in _leaves(values):
        if isinstance(value, float) and not math.isfinite(value):
            raise UserError(
                f"{source}: {name or 'the value'} is {value}, which is not a number of JSON; "
                "write null where there is none"
            )
    return values


def read_toml(path: Path) -> dict[str, Any]:
    """Return what a TOML file holds.

    Raises
    ------
    UserError
        If the file cannot be read, is not TOML, or goes beyond `core.files.size_limits`.
    """
    return parse_toml(read_bytes(path, SETTINGS_BYTES), str(path))


def parse_toml(data: bytes, source: str) -> dict[str, Any]:
    """Return what TOML says, of a file that `source` names.

    Raises
    ------
    UserError
        If it is not TOML, or goes beyond `core.files.size_limits`.
    """
    try:
        text = data.decode("utf-8-sig")
        if _DEEP_KEY.search(text):  # tomllib would take a minute for 50,000 parts
            raise UserError(_too_deep(source))
        values = tomllib.loads(text)
    except UnicodeDecodeError:
        raise UserError(f"{source}: is not a text file in UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        raise UserError(f"{source}: is not valid TOML: {error}") from None
    except RecursionError:
        raise UserError(_too_deep(source)) from None
    except ValueError as error:  # of int(), or of a date that does not exist
        if "digits" in str(error):
            raise UserError(_too_long(source, "a whole number")) from None
        raise UserError(f"{source}: is not valid TOML: {error}") from None
    _check_values(values, source)
    return values


def _check_values(values: Any, source: str) -> None:
    """Refuse nested values that are deeper, or hold a longer whole number, than is read."""
    for name, value in _leaves(values):
        if value is _DEEPER:
            raise UserError(_too_deep(source))
        if isinstance(value, int) and abs(value) >= 10**MAX_DIGITS:
            raise UserError(_too_long(source, name or "a whole number"))


_DEEPER = object()
_KEY = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*"""
_DEEP_KEY = re.compile(rf"(?:^[ \t\[]*|[{{,][ \t]*)(?:{_KEY}\.[ \t]*){{{NESTING}}}", re.MULTILINE)


def _leaves(values: Any) -> Iterator[tuple[str, Any]]:
    """Yield every value that is no table or list with its name, and `_DEEPER` below the bound."""
    waiting: list[tuple[str, Any, int]] = [("", values, 0)]
    while waiting:
        name, value, depth = waiting.pop()
        if not isinstance(value, dict | list):
            yield name, value
        elif depth == NESTING:
            yield name, _DEEPER
        elif isinstance(value, dict):
            waiting += [(f"{name}.{key}".lstrip("."), v, depth + 1) for key, v in value.items()]
        else:
            waiting += [(f"{name}[{index}]", v, depth + 1) for index, v in enumerate(value)]


def _too_deep(source: str) -> str:
    return (
        f"{source}: tables or lists are nested more than {NESTING} deep; a file of this program "
        "never is, so name the right file"
    )


def _too_long(source: str, name: str) -> str:
    return (
        f"{source}: {name} has more than {MAX_DIGITS} digits; write a whole number of at most that"
    )
