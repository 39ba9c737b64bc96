"""Named arrays, as NumPy and MATLAB files hold them, sorted into columns and scalars."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.errors import UserError
from rigidimeter.recording.formats.columns import Table, printable

__all__ = ["first_line", "table_of_arrays"]


def table_of_arrays(source: str, entries: Mapping[str, NDArray[Any]]) -> Table:
    """Sort named arrays into columns, scalars and others.

    An array with one value is a scalar; one with a single dimension longer than 1 is a column.

    Raises
    ------
    UserError
        If there is no column at all.
    """
    columns: dict[str, NDArray[Any]] = {}
    scalars: dict[str, float | str] = {}
    others: dict[str, str] = {}
    for key, array in entries.items():
        name = printable(key)
        text = array.dtype.kind in "OU"
        if array.dtype.kind not in "fiubOU":
            kind = "objects" if array.dtype.kind == "V" else str(array.dtype)
            others[name] = f"an array of {kind}"
        elif array.size == 0:
            others[name] = "empty"
        elif array.size == 1:
            scalars[name] = str(array.item()) if text else float(array.item())
        elif max(array.shape) == array.size:
            flat = array.reshape(-1)
            columns[name] = flat.astype(object) if text else flat.astype(np.float64, copy=False)
        else:
            others[name] = f"an array of {' × '.join(map(str, array.shape))}"
    if not columns:
        held = ", ".join([*scalars, *others][:20]) or "nothing"
        raise UserError(
            f"{source} has no column of samples, that is, no array with one dimension and at least "
            f"2 values (it holds {held})"
        )
    return Table(source, columns, scalars, others)


def first_line(error: Exception) -> str:
    """Return the beginning of what a library says went wrong, to quote in a sentence."""
    return (str(error).strip().splitlines() or [""])[0][:120] or type(error).__name__
