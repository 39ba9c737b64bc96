"""What the columns of a table hold, before they mean anything."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.channels.headers import read_header
from rigidimeter.analysis.reading.formats.columns import numbers
from rigidimeter.analysis.reading.formats.gaps import longest_s
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError


@dataclass(frozen=True)
class ColumnFacts:
    """One column.

    Parameters
    ----------
    name, unit, kind : str
        As the file has them; `kind` is the quantity that the name says.
    n_missing : int
    lowest, highest : float
        NaN of text.
    rate_hz, jitter_percent : float
        Of the rows that have a number; NaN where there is no time.
    n_gaps : int
        Intervals too long to bridge.
    text : str
        The first entries of a column of text.
    """

    name: str
    unit: str
    kind: str
    n_missing: int
    lowest: float
    highest: float
    rate_hz: float
    jitter_percent: float
    n_gaps: int
    text: str = ""


def column_facts(table: Table, time_s: NDArray[np.float64] | None) -> list[ColumnFacts]:
    """Return the facts of each column; `time_s` is the time of the rows, where it is known."""
    return [_facts(table, name, time_s) for name in table.columns]


def _facts(table: Table, name: str, time_s: NDArray[np.float64] | None) -> ColumnFacts:
    header = read_header(name, table.units.get(name, ""))
    nothing = math.nan
    try:
        values = numbers(table, name, name, [])
    except UserError:
        shown = ", ".join(str(entry)[:20] for entry in table.columns[name][:3])
        return ColumnFacts(
            name, header.unit, header.kind, 0, nothing, nothing, nothing, nothing, 0, shown
        )
    finite = np.isfinite(values)
    here = values[finite]
    rate_hz = jitter = nothing
    gaps = 0
    if time_s is not None and time_s.size == values.size and here.size > 2:
        steps = np.diff(time_s[finite])
        typical = float(np.median(steps))
        if typical > 0:
            rate_hz = 1.0 / typical
            gaps = int(np.count_nonzero(steps > longest_s(typical)))
            # A step back is no jitter, and may be too large to be squared.
            jitter = 100.0 * float(np.std(steps[np.abs(steps) < 1.9 * typical] / typical))
    lowest, highest = (float(here.min()), float(here.max())) if here.size else (nothing, nothing)
    n_missing = int(values.size - here.size)
    return ColumnFacts(
        name, header.unit, header.kind, n_missing, lowest, highest, rate_hz, jitter, gaps
    )
