"""Records of checks as sealed files: JSON with the SHA-256 of their own content.

The seal tells of accidents, of a file that was edited or cut short. It is no signature and keeps
nobody from forging one.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import plain_values, read_json, write_json


class RecordKind(NamedTuple):
    """What a record is: its schema, its name, the command that makes it, and how to say so."""

    schema: str
    name: str
    command: str
    again: str


class Dated(Protocol):
    """A record that says when it was made."""

    @property
    def made_utc(self) -> str:
        """ISO 8601, with a time zone."""


Record = TypeVar("Record", bound=Dated)

AHEAD = timedelta(minutes=10)
"""So much may the clock have been set back since a record was made."""


def digest(values: Mapping[str, Any]) -> str:
    """Return the seal of values as JSON has them."""
    text = json.dumps(values, sort_keys=True, ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()


def write_sealed(path: Path, values: Mapping[str, Any]) -> None:
    """Write values with their seal; a failed write leaves the old file."""
    plain = plain_values(values)
    write_json(path, {**plain, "digest": digest(plain)})


def read_sealed(path: Path, kind: RecordKind, build: Callable[[dict[str, Any]], Record]) -> Record:
    """Read a sealed record and build it of its values.

    Raises
    ------
    UserError
        If there is none, it is something else, or it was changed since it was written.
    """
    if not path.exists():
        raise UserError(f"{path}: there is no such record; make it with `{kind.command}`")
    try:
        values = read_json(path)
    except UserError as error:
        raise UserError(f"{error}; a {kind.name} was expected") from None
    if not isinstance(values, dict) or values.get("schema") != kind.schema:
        raise UserError(f"{path}: is no {kind.name} of the schema {kind.schema}")
    if values.pop("digest", None) != digest(values):
        raise UserError(
            f"{path}: was changed since it was written (its digest differs); {kind.again}"
        )
    try:
        record = build(values)
        made = datetime.fromisoformat(record.made_utc)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UserError(
            f"{path}: was written by another version of rigidimeter, "
            f"{values.get('software', 'which it does not say')} ({error}); {kind.again}"
        ) from None
    if made.tzinfo is None:
        raise UserError(f"{path}: made_utc = {record.made_utc!r} names no time zone; {kind.again}")
    return record
