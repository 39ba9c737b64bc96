"""Arrays of an archive: what they are is known from their headers, and only those used are read.

A compressed archive of a few megabytes may hold gigabytes of zeros. So the size of an array counts
against an `Expansion` before it is read.
"""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import EXPANDED_BYTES, EXPANSION, MAX_COLUMNS, size_text


@dataclass(frozen=True)
class Stored:
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
        size = 1
        for length in self.shape:  # not of NumPy, whose integers overflow
            size *= length
        return size


class Columns(Mapping[str, NDArray[Any]]):
    """Columns by name, each read when it is first asked for.

    Parameters
    ----------
    unread : mapping of str to callable
        Each returns a column.
    refusal : callable, optional
        Turns an exception of theirs, which means a damaged file, into the one that is raised.
    """

    def __init__(
        self,
        unread: Mapping[str, Callable[[], NDArray[Any]]],
        refusal: Callable[[Exception], Exception] = lambda error: error,
    ) -> None:
        self._unread = dict(unread)
        self._refusal = refusal
        self._read: dict[str, NDArray[Any]] = {}

    def refusing(self, refusal: Callable[[Exception], Exception]) -> Columns:
        """Return the same columns with another `refusal`."""
        return Columns(self._unread, refusal)

    def __getitem__(self, name: str) -> NDArray[Any]:
        read = self._unread[name]
        if name not in self._read:
            try:
                self._read[name] = read()
            except UserError:
                raise
            except Exception as error:
                raise self._refusal(error) from error
        return self._read[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._unread)

    def __contains__(self, name: object) -> bool:  # Mapping's would read the column
        return name in self._unread

    def __len__(self) -> int:
        return len(self._unread)


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
