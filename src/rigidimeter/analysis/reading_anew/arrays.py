"""Arrays of an archive: what they are is known from their headers, and only those used are read.

A compressed archive of a few megabytes may hold gigabytes of zeros. So the size of an array counts
against an `Expansion` before it is read.
"""

from __future__ import annotations

import functools
import logging
import math
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.columns import Column, Columns
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import EXPANDED_BYTES, EXPANSION, MAX_COLUMNS, printable, size_text

MOST_IN_A_MATRIX = 64
"""Columns of a matrix that are columns of the file, as ``q[3]``."""
_LONGEST_TEXT_BYTES = 4096
_SHOWN = 20


class Stored(NamedTuple):
    """An array of a file: its type and shape, and how to read it."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    read: Callable[[], NDArray[Any]]

    @classmethod
    def of(cls, array: NDArray[Any]) -> Stored:
        """Return an array that was read already."""
        return cls(array.dtype, array.shape, lambda: array)

    @property
    def size(self) -> int:
        """The number of its values."""
        return math.prod(self.shape)  # not of NumPy, whose integers overflow


class Expansion:
    """How much the arrays that are read from one file may hold together.

    Parameters
    ----------
    path : Path
    file_bytes : int
        The size of the file.
    """

    def __init__(self, path: Path, file_bytes: int) -> None:
        self._path = path
        self._most = max(EXPANDED_BYTES, EXPANSION * file_bytes)
        self._taken = 0

    def take(self, name: str, n_bytes: int) -> None:
        """Count an array before it is read.

        Raises
        ------
        UserError
            If the arrays hold more, with it, than an honest file of this size.
        """
        self._taken += n_bytes
        if self._taken > self._most:
            raise UserError(
                f"{self._path}: {name[:60]} expands to {size_text(n_bytes)}; the columns that are "
                f"used of a file of this size may hold {size_text(self._most)} together, so split "
                "the recording or save it without compression"
            )


def check_count(path: Path, n_entries: int) -> None:
    """Refuse an archive of more entries than are read.

    Raises
    ------
    UserError
        If there are more than `MAX_COLUMNS`.
    """
    if n_entries > MAX_COLUMNS:
        raise UserError(
            f"{path}: holds {n_entries} entries; at most {MAX_COLUMNS} are read, so save the "
            "columns of the recording alone"
        )


@contextmanager
def silent(library: str) -> Iterator[None]:
    """Keep a library from printing and warning of what a message says, or of no matter."""
    log = logging.getLogger(library)
    level = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        log.setLevel(level)


def columns_of_arrays(
    source: str, entries: Mapping[str, Stored], units: Mapping[str, str] | None = None
) -> Columns:
    """Return named arrays as columns.

    Raises
    ------
    UserError
        If there is no column at all.
    """
    columns, facts, others = sorted_arrays(entries)
    if not columns:
        held = ", ".join([*facts, *others][:_SHOWN]) or "nothing"
        raise UserError(
            f"{source} has no column of samples, that is, no array with one dimension and at least "
            f"2 values, or with two of which one is at most {MOST_IN_A_MATRIX} (it holds {held})"
        )
    stated = units or {}
    columns = {name: one._replace(unit=stated.get(name, "")) for name, one in columns.items()}
    return Columns(source, columns, facts=facts, others=others)


def sorted_arrays(
    entries: Mapping[str, Stored],
) -> tuple[dict[str, Column], dict[str, float | str], dict[str, str]]:
    """Sort named arrays into columns, single values and what is neither, with the reason.

    An array with one value is a single value; one with one dimension longer than 1 is a column, one
    with two is a column for each place in the shorter one, ``q[0]`` and so on. Fields of an array
    of records are columns too.
    """
    columns: dict[str, Column] = {}
    facts: dict[str, float | str] = {}
    others: dict[str, str] = {}
    for key, array in entries.items():
        name = printable(key)
        text = array.dtype.kind in "OU"
        longer = [length for length in array.shape if length != 1]
        if array.dtype.itemsize > _LONGEST_TEXT_BYTES:
            others[name] = f"text of up to {array.dtype.itemsize // 4} letters"
        elif array.dtype.names and len(longer) == 1:
            columns |= {
                f"{name}.{field}": Column(functools.partial(_field, array, field), array.size)
                for field in array.dtype.names
                if array.dtype[field].kind in "fiub"
            }
        elif array.dtype.kind not in "fiubOU":
            kind = "objects" if array.dtype.kind == "V" else str(array.dtype)
            others[name] = f"an array of {kind}"
        elif array.size == 0:
            others[name] = "empty"
        elif array.size == 1:
            value = array.read().item()
            facts[name] = str(value) if text else float(value)
        elif len(longer) == 1:
            kind_of = object if text else np.float64
            columns[name] = Column(functools.partial(_column, array, kind_of), array.size)
        elif len(longer) == 2 and not text and min(longer) <= MOST_IN_A_MATRIX:
            for place in range(min(longer)):
                read = functools.partial(_of_matrix, array, place)
                columns[f"{name}[{place}]"] = Column(read, max(longer))
        else:
            others[name] = f"an array of {' × '.join(map(str, array.shape))}"
    return columns, facts, others


def _column(array: Stored, dtype: type) -> NDArray[Any]:
    return array.read().reshape(-1).astype(dtype, copy=False)


def _field(array: Stored, name: str) -> NDArray[Any]:
    return np.ascontiguousarray(array.read().reshape(-1)[name], dtype=np.float64)


def _of_matrix(array: Stored, place: int) -> NDArray[Any]:
    matrix = array.read().squeeze()
    column = matrix[:, place] if matrix.shape[0] >= matrix.shape[1] else matrix[place]
    return np.ascontiguousarray(column, dtype=np.float64)
