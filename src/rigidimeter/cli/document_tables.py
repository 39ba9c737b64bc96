"""What a command writes as JSON, as tables for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rigidimeter.cli.terminal_tables import Block, Heading, Table
from rigidimeter.core.units import deg_from_rad, named_unit
from rigidimeter.core.words import axis_unit, number

MOST_ENTRIES, ABREAST = 8, 4
"""How many entries of a list are shown, and how many of them side by side."""


def document_tables(document: Mapping[str, Any], *above: str) -> Iterator[Block]:
    """Yield a heading and a table for each part of a document, however deep.

    Entries of one kind, such as conditions, stand side by side; of a list the first ones.

    Parameters
    ----------
    document : mapping
        Of plain values, units in the names.
    *above : str
        The keys that lead to it.
    """
    if alone := {key: value for key, value in document.items() if not _entries(value)}:
        yield from (Heading(_title(above)), _table({"": alone}, above))
    for key, value in document.items():
        entries, within = _entries(value), (*above, key)
        if any(not isinstance(each, Mapping) for each in entries.values()):
            yield from document_tables(entries, *within)
        elif entries:
            shown = [*entries.items()][:MOST_ENTRIES]
            more = f", the first {len(shown)} of {len(entries)}"
            yield Heading(_title(within) + more * (len(shown) < len(entries)))
            for start in range(0, len(shown), ABREAST):
                yield _table(dict(shown[start : start + ABREAST]), within)


def _entries(value: Any) -> Mapping[str, Any]:
    """Return what a value consists of, if that is more than numbers and words."""
    if isinstance(value, list) and value and isinstance(value[0], Mapping):
        return {f"{place}": each for place, each in enumerate(value, start=1)}
    return value if isinstance(value, Mapping) else {}


def _title(keys: Sequence[str]) -> str:
    title = ": ".join(keys).replace("_", " ")
    return title[:1].upper() + title[1:]


def _table(columns: Mapping[str, Mapping[str, Any]], above: Sequence[str]) -> Table:
    """Return a row for each value within, named by the keys that lead to it."""
    leaves = {name: dict(_leaves(each)) for name, each in columns.items()}
    rows: list[Sequence[str] | str] = []
    for keys in dict.fromkeys(keys for each in leaves.values() for keys in each):
        values = [each.get(keys) for each in leaves.values()]
        named = [_named(key) for key in (*above, *keys)]
        factor, unit = next((each for _, each in named if each[1]), (1.0, ""))
        numbers = [value for value in values if isinstance(value, float)]
        scale, unit = axis_unit((factor * value for value in numbers), unit)
        name = ", ".join(filter(None, (" ".join(words for words, _ in named[len(above) :]), unit)))
        cells = [_shown(value, factor * scale) for value in values]
        if len(cells) == 1 and " " in cells[0]:
            rows += [name, f"  {cells[0]}"]
        else:
            rows.append((name, *cells))
    headings = ("", *columns) if any(columns) else ()
    return Table(headings, rows, "<" + ">" * len(columns))


def _named(key: str) -> tuple[str, tuple[float, str]]:
    """Return the words of a key, and the factor and the unit that it ends with."""
    words, unit = named_unit(key)
    turned = deg_from_rad(1.0) if unit.startswith("rad") else 1.0  # people read degrees
    return words.replace("_", " "), (turned, unit.replace("rad", "deg", turned > 1.0))


def _leaves(part: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], Any]]:
    for key, value in part.items():
        if isinstance(value, Mapping):
            yield from (((key, *keys), each) for keys, each in _leaves(value))
        else:
            yield (key,), value


def _shown(value: Any, factor: float) -> str:
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ", ".join(_shown(each, factor) for each in value)
    return number(factor * value) if isinstance(value, float) else str(value)
