"""Fields of MATLAB structures: names, units, rates and columns, wherever a program puts them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.clocked_table import even_clock
from rigidimeter.analysis.reading.formats.columns import RATE_NAMES
from rigidimeter.analysis.reading.formats.stored_arrays import Stored

Array = NDArray[np.float64]
Fields = Mapping[str, Stored]
"""The fields of a structure by name in lower case."""
NAMES = ("title", "label", "name", "channel")
UNITS = ("unit", "units")
_RATES = (*RATE_NAMES, "samplerate", "sample_rate", "srate")


def fields_by_place(entries: Mapping[str, Stored]) -> dict[str, dict[str, Stored]]:
    """Return the fields of each structure by its place, such as ``rec.Y(1)``.

    Parameters
    ----------
    entries : mapping of str to Stored
        By dotted name; those without a dot have the place ``""``.
    """
    groups: dict[str, dict[str, Stored]] = {}
    for name, entry in entries.items():
        place, _, field = name.rpartition(".")
        groups.setdefault(place, {}).setdefault(field.lower(), entry)
    return groups


def stepped_clock(start_s: float, step_s: float, count: int) -> Array:
    """Return the stamps of even samples.

    Raises
    ------
    ValueError
        If the step cannot be one.
    """
    return even_clock(start_s, 1.0 / step_s if step_s else 0.0, count)


def fields_above(groups: Mapping[str, Fields], place: str) -> list[Fields]:
    """Return the fields of a structure and of those in which it lies, the innermost first."""
    found = [groups[place]]
    while place:
        place = place.rpartition(".")[0]
        found.append(groups.get(place, {}))
    return found


def stated_rate(fields: Fields) -> float:
    """Return the sampling rate that a structure states, 0 where it states none."""
    found = (fields[key] for key in _RATES if key in fields)
    return next((number(each) for each in found if each.size == 1), 0.0)


def stated_name(fields: Fields, place: str) -> str:
    """Return the name that a structure states, or its own."""
    stated = (texts(fields[key]) for key in NAMES if key in fields)
    return next((each[0] for each in stated if each and each[0]), "") or place.rpartition(".")[2]


def stated_unit(fields: Fields) -> str:
    """Return the unit that a structure states, nothing where it states none."""
    stated = (texts(fields[key]) for key in UNITS if key in fields)
    return next((each[0] for each in stated if each and each[0] not in ("", "-")), "")


def texts(entry: Stored) -> list[str]:
    """Return one text, a cell of texts or the rows of a matrix of letters."""
    if entry.dtype.kind not in "OU":
        return []
    return [str(one).replace("\0", "").strip() for one in entry.read().reshape(-1)]


def text(entry: Stored) -> str:
    """Return the first text of a field.

    Raises
    ------
    ValueError
        If it has none.
    """
    found = texts(entry)
    if not found:
        raise ValueError("a field that must hold text does not")
    return found[0]


def number(entry: Stored) -> float:
    """Return the first number of a field.

    Raises
    ------
    ValueError
        If it has none.
    """
    found = numbers(entry).reshape(-1)
    if not found.size:
        raise ValueError("a field that must hold a number is empty")
    return float(found[0])


def numbers(entry: Stored) -> Array:
    """Return a field of numbers as it is shaped.

    Raises
    ------
    ValueError
        If it holds anything else.
    """
    if entry.dtype.kind not in "fiub":
        raise ValueError("a field that must hold numbers does not")
    return np.asarray(entry.read(), dtype=np.float64)


def matrix_columns(entry: Stored, count: int) -> list[Array] | None:
    """Return a matrix as columns, where it has so many; None where it is no such matrix."""
    long = [length for length in entry.shape if length != 1]
    if entry.dtype.kind not in "fiub" or entry.size < 2 or len(long) > 2 or count < 1:
        return None
    if count == 1:
        return [numbers(entry).reshape(-1)] if len(long) == 1 else None
    values = numbers(entry).reshape(long)
    if count not in values.shape or values.ndim != 2:
        return None
    return list(np.ascontiguousarray(values.T if values.shape[1] == count else values))
