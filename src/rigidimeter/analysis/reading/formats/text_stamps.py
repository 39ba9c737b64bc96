"""Dates and times of day in a column of text."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

_TIME = r"\d{1,2}:\d\d:\d\d(?:[.,]\d+)?"
_STAMP = re.compile(rf"{_TIME}|\d{{4}}-\d\d-\d\d[ T]{_TIME}(?: ?(?:Z|[+-]\d\d:?\d\d))?")


def stamps_s(column: NDArray[Any]) -> NDArray[np.float64] | None:
    """Return dates and times of day as seconds since the first; None where they are none.

    A time of day that goes back by more than half a day is of the next day. Dates may state
    how far their clock is from UTC.
    """
    if column.dtype != object or not column.size or not _STAMP.fullmatch(str(column[0]).strip()):
        return None
    import pandas as pd

    texts = pd.Series(column).str.strip().str.replace(",", ".")
    try:
        if re.match(r"\d{1,2}:", texts[0]):
            since = pd.to_timedelta(texts)
            midnights = (since.diff() < -pd.Timedelta(hours=12)).cumsum()
            since = since + pd.to_timedelta(midnights, unit="D")
        else:
            when = pd.to_datetime(texts, format="ISO8601", utc=True)
            since = when - when[0]
    except (ValueError, TypeError, OverflowError):
        return None
    return np.asarray(since.dt.total_seconds(), dtype=np.float64)
