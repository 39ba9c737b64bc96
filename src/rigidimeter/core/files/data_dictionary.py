"""The data dictionary beside the tables that are written: unit and meaning of each column.

What the columns hold is data, `columns.toml`; the reference of files is made from it too.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

from rigidimeter.core.files.reading import parse_toml, read_bytes
from rigidimeter.core.files.size_limits import DOCUMENT_BYTES
from rigidimeter.core.files.writing import csv_text, write_text
from rigidimeter.core.units import named_unit

DICTIONARY = "data-dictionary.csv"
"""Its name in a folder; beside a single table the name of the table comes first."""

HEADER = ("file", "column", "unit", "meaning", "row")

_ENDS = ("_se", "_low", "_high")
"""What may follow the unit in a name."""

_OTHER_COLUMNS = ("unit", "amplitude_unit")
"""Columns that hold the unit of other columns, row by row."""


class Meaning(NamedTuple):
    """What a column holds: its unit, empty for words, and in words."""

    unit: str
    meaning: str


@cache
def _records() -> Mapping[str, Mapping[str, Any]]:
    data = (resources.files("rigidimeter.core.files") / "columns.toml").read_bytes()
    return parse_toml(data, "columns.toml")


def rows_of(table: str) -> str:
    """Return what each row of a table stands for; empty if that is not known."""
    records = _records()
    return str(records["rows"].get(table) or records["rows elsewhere"].get(table, ""))


def described(section: str) -> dict[str, Meaning]:
    """Return what one section describes, in order: the columns of a table, keys of a document."""
    return {name: _meaning(said, name) for name, said in _records()[section].items()}


def meaning_of(table: str, column: str) -> Meaning:
    """Return what a column of a table holds.

    A name that is not described itself may be made of one that is: by a suffix, a prefix, or the
    condition of a comparison.

    Raises
    ------
    KeyError
        If nobody has described it.

    Examples
    --------
    >>> meaning_of("estimates", "stiffness_nm_rad_se")
    Meaning(unit='N·m/rad', meaning='stiffness K: standard error')
    """
    records = _records()
    for section in (table, "any"):
        if (said := records.get(section, {}).get(column)) is not None:
            return _meaning(said, column)
    for start, words in records["prefixes"].items():
        if column.startswith(start):
            unit, base = meaning_of(table, column.removeprefix(start))
            return Meaning(unit, f"{base}; {words}")
    if table == "comparisons" and column.startswith("days_"):
        by_days = records["test by days"]
        name = column if column in by_days else column.removeprefix("days_")
        unit, base = _meaning(by_days[name], name)
        return Meaning(unit, f"test by days: {base}")
    for ending, said in sorted(records["suffixes"].items(), key=lambda one: -len(one[0])):
        if column.endswith(ending):
            unit, base = meaning_of(table, column.removesuffix(ending))
            own = _meaning(said, "")
            return Meaning(own.unit or unit, f"{base}: {own.meaning}")
    raise KeyError(f"{table}: {column}")


def _meaning(said: str | list[str], column: str) -> Meaning:
    """Return unit and words; a unit that is not stated is that of the name."""
    if not isinstance(said, str):
        unit, words = said
        return Meaning(f"(column {unit})" if unit in _OTHER_COLUMNS else unit, words)
    base = next((column.removesuffix(e) for e in _ENDS if column.endswith(e)), column)
    return Meaning(named_unit(base)[1], said)


def dictionary_text(
    tables: Mapping[str, Iterable[str]],
    names: Mapping[str, str] | None = None,
    known: Mapping[str, Meaning] | None = None,
) -> str:
    """Return the data dictionary of tables as CSV.

    Parameters
    ----------
    tables : mapping of str to iterable of str
        The columns of each file.
    names : mapping of str to str, optional
        By file the table that it holds; otherwise its name without the ending.
    known : mapping of str to Meaning, optional
        What columns hold that nobody can have described before, such as those of a sensor.
    """
    names, known = names or {}, known or {}
    rows = []
    for file, columns in tables.items():
        table = names.get(file, Path(file).stem)
        for column in columns:
            unit, words = known.get(column) or _meaning_if_known(table, column)
            rows.append((file, column, unit, words.replace("`", ""), rows_of(table)))
    return csv_text(HEADER, rows)


def _meaning_if_known(table: str, column: str) -> Meaning:
    try:
        return meaning_of(table, column)
    except KeyError:  # tests find it; nobody's results are lost for it
        return Meaning("", "")


def write_dictionary_beside(path: Path, table: str, columns: Iterable[str]) -> None:
    """Write the data dictionary of one table beside it, as ``NAME.data-dictionary.csv``.

    Nothing is written beside what is no file, such as ``/dev/stdout``.

    Raises
    ------
    UserError
        If it cannot be written.
    """
    if path.is_file():
        text = dictionary_text({path.name: columns}, {path.name: table})
        write_dictionary(path.with_name(f"{path.stem}.{DICTIONARY}"), text)


def write_dictionary(path: Path, text: str) -> None:
    """Write a data dictionary, but never over one that is not of this program.

    Raises
    ------
    UserError
        If it cannot be written.
    """
    head = text[: text.index("\n")].encode()
    if not path.exists() or read_bytes(path, DOCUMENT_BYTES).startswith(head):
        write_text(path, text)


def is_dictionary(path: Path) -> bool:
    """Return whether a file is, by its name, a data dictionary, and so no recording."""
    return path.name == DICTIONARY or path.name.endswith(f".{DICTIONARY}")
