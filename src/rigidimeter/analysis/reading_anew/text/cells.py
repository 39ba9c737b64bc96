"""Cells of a text that are not written as Python writes numbers: thousands, dates, times of day.

1,234.5 and 1.234,5, 1 234,5 and 1'234.5: a comma or a point may be the mark between thousands or
the decimal mark, so the rows decide: it stands between thousands if it does so wherever it stands,
and a number has the other one behind it, or two of it, or the other one where it can only be the
decimal mark. Otherwise the numbers stay as they are.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

_TIME = r"\d{1,2}:\d\d:\d\d(?:[.,]\d+)?"
_STAMP = re.compile(rf"{_TIME}|\d{{4}}-\d\d-\d\d[ T]{_TIME}(?: ?(?:Z|[+-]\d\d:?\d\d))?")
_BLANKS = "[ \u00a0\u202f\u2009'\u2019]"
_LEAD = r"[+-]?[1-9]\d{0,2}"
GROUPED = re.compile(
    rf"{_LEAD}(?:(?:,\d{{3}})+(?:\.\d*)?|(?:\.\d{{3}})+(?:,\d*)?|(?:{_BLANKS}\d{{3}})+(?:[.,]\d*)?)"
)
"""A number that may have marks between thousands."""


def ungrouped(body: bytes, delimiter: str) -> bytes:
    r"""Return the rows of a text without the marks between thousands.

    Parameters
    ----------
    body : bytes
    delimiter : str
        Between cells; where it is the comma, only cells in quotes have one inside.

    Examples
    --------
    >>> ungrouped(b"995;0,5\n1.005;-1.234,5", ";"), ungrouped(b"0.005;0,5", ";")
    (b'995;0,5\n1005;-1234,5', b'0.005;0,5')
    """
    commas = b"," in body if delimiter != "," else b'"' in body
    blanks = any(mark in body for mark in (b" ", b"'", b"\xc2\xa0", b"\xe2\x80"))
    if not (commas and b"." in body) and not (blanks and re.search(rb"\d[ '\xc2\xe2]\S", body)):
        return body
    text = body.decode("utf-8")
    edge = re.escape(delimiter) + '\n"'
    start, end = f"(?<![^{edge}]){_LEAD}", f"(?![^{edge}])"
    text = re.sub(
        rf"{start}(?:{_BLANKS}\d{{3}})+(?:[.,]\d*)?{end}",
        lambda found: re.sub(_BLANKS, "", found[0]),
        text,
    )
    cells = _cells(text, delimiter)
    if delimiter == ",":
        start, end = f'(?<="){_LEAD}', '(?=")'
    marks = [pair for pair in ((",", r"\."), (r"\.", ",")) if _groups(cells, *pair)]
    if not marks:
        return text.encode()
    mark, decimal = marks[0]
    whole = rf"{start}(?:{mark}\d{{3}})+(?:{decimal}\d*)?{end}"
    return re.sub(whole, lambda found: re.sub(mark, "", found[0]), text).encode()


def _cells(text: str, delimiter: str) -> str:
    """Return the cells, one a line."""
    if delimiter != ",":
        return text.replace(delimiter, "\n").replace('"', "\n")
    inside = "\n".join(re.findall(r'"([^"\n]*)"', text))
    outside = re.sub(r'"[^"\n]*"', "", text).replace(",", "\n")
    return f"{inside}\n{outside}"


def _groups(cells: str, mark: str, decimal: str) -> bool:
    """Whether a mark stands between thousands."""

    def any_of(form: str) -> bool:
        return re.search(rf"(?m)^ *{form} *$", cells) is not None

    group = rf"(?:{mark}\d{{3}})"
    grouped = rf"{_LEAD}{group}+(?:{decimal}\d*)?"
    if any_of(rf"(?!{grouped} *$)[+-]?\d*{mark}\d*(?:[eE][+-]?\d+)?"):
        return False  # where it can only be the decimal mark
    if any_of(rf"{_LEAD}(?:{group}+{decimal}\d+|{group}{{2,}})"):
        return True
    other = rf"(?!{_LEAD}{decimal}\d{{3}} *$)[+-]?\d*{decimal}\d+(?:[eE][+-]?\d+)?"
    return any_of(f"{_LEAD}{group}") and any_of(other)


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
