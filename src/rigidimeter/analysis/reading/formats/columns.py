"""Columns of a file as numbers, and the time of each row; every refusal names what helps."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.table import MISSING, Table, nearest
from rigidimeter.core.errors import UserError

RATE_NAMES = ("rate_hz", "fs_hz", "fs", "sampling_rate_hz")
"""Single values of a file that are taken as its sampling rate."""
STRAY_SHARE = 0.01
"""Up to this share of entries may be text in a column of numbers and still be left out singly."""
_AGREEMENT = 0.01
APART_S = 1.0
"""Between epochs that each have a time of their own."""


def numbers(
    table: Table, standard: str, name: str, strays: list[str] | None = None
) -> NDArray[np.float64]:
    """Return a column as float64, shape (n,), with NaN where a number is missing.

    Parameters
    ----------
    table : Table
    standard, name : str
        What we and what the file call the column.
    strays : list of str, optional
        Where given, a few entries that are not numbers are missing too, and a sentence about them
        is added here.

    Raises
    ------
    UserError
        If the column holds a text that is not a number; it names the row and the text.
    """
    column = table.columns[name]
    if column.dtype != object:
        return column.astype(np.float64, copy=False)
    values = np.empty(column.size)
    found: list[str] = []
    for row, entry in enumerate(column):
        text = str(entry).strip()
        try:
            values[row] = math.nan if text.lower() in MISSING else float(text)
        except ValueError:
            label = standard if standard == name else f"{standard} (column {name!r})"
            found.append(f"{table.where(row)}: {label} holds {text[:60]!r}, which is not a number")
            values[row] = math.nan
            # The first row is more often a row of units than a slip.
            if strays is None or row == 0 or len(found) > STRAY_SHARE * column.size:
                raise UserError(found[0]) from None
    if strays is not None and found:
        more = f", nor are {len(found) - 1} other entries of the column" if found[1:] else ""
        left = "they were" if more else "the entry was"
        strays.append(f"{found[0]}{more}; {left} left out")
    return values


def time_stamps(
    table: Table,
    name: str,
    values: NDArray[np.float64],
    to_si: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    rate_hz: float | None,
    labels: NDArray[Any] | None = None,
) -> NDArray[np.float64]:
    """Return the time of each row in s, shape (n_rows,), strictly increasing.

    Parameters
    ----------
    table : Table
        The file.
    name : str
        The file's name of its time column.
    values : array, shape (n_rows,)
        The column as it is.
    to_si : callable
        Turns it into seconds.
    rate_hz : float or None
        The sampling rate, if the user gave one.
    labels : array, shape (n_rows,), optional
        Of the epochs. Where the time starts anew with each of them, they are put `APART_S` apart.

    Raises
    ------
    UserError
        If time and rate disagree, or if the time does not increase.
    """
    time_s = to_si(values)
    starts = restarts(values)
    if labels is not None and starts.size and np.all(labels[starts] != labels[starts - 1]):
        values = time_s = one_after_another(time_s)
    _increasing(table, name, values)
    if rate_hz is not None:
        _agreeing(table, name, time_s, rate_hz)
    return time_s


def restarts(values: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the rows in which a time goes back."""
    return np.flatnonzero(values[1:] < values[:-1]) + 1


def one_after_another(time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return times that go back nowhere: each stretch begins `APART_S` after the one before it."""
    starts = restarts(time_s)
    ends_s = time_s[starts - 1] + APART_S - time_s[starts]
    later_s: NDArray[np.float64] = np.concatenate([[0.0], np.cumsum(ends_s)])
    lengths = np.diff(starts, prepend=0, append=time_s.size)
    return np.add(time_s, np.repeat(later_s, lengths), dtype=np.float64)


def counts_samples(values: NDArray[np.float64]) -> bool:
    """Whether a column only numbers the rows, as 0, 1, 2: no clock, or one in ms at 1000 Hz."""
    return values.size > 1 and bool(np.all(np.diff(values) == 1.0))


def seconds(value: float) -> str:
    """Return a time or duration as sentences show it, with at most four decimals."""
    return f"{value:.4f}".rstrip("0").rstrip(".") + " s"


def same_length(table: Table, found: Mapping[str, str]) -> None:
    """Refuse columns, by standard name, of different lengths or of fewer than two samples."""
    first = found["torque_nm"]
    length = table.columns[first].size
    for name in found.values():
        if name in table.columns and table.columns[name].size != length:
            raise UserError(
                f"{table.source}: column {name} has {table.columns[name].size} values and column "
                f"{first} has {length}; all columns must have the same length"
            )
    if length < 2:
        raise UserError(
            f"{table.source} holds {length} sample{'' if length == 1 else 's'}; a recording needs "
            "at least 2, and an estimate some seconds"
        )


def own_rates(table: Table) -> dict[str, float]:
    """Return the sampling rates that a file states, by its names of them."""
    return {
        name: float(value)
        for name, value in table.scalars.items()
        if _names_rate(name) and not isinstance(value, str)
    }


def _names_rate(name: str) -> bool:
    return name.rsplit(".", 1)[-1] in RATE_NAMES


def own_rate(table: Table) -> float:
    """Return the sampling rate of a file without a column of the time.

    Raises
    ------
    UserError
        If it states none, several, or one that cannot be.
    """
    found = own_rates(table)
    if not found:
        told = [str(value) for name, value in table.scalars.items() if _names_rate(name)]
        if told:
            raise UserError(
                f"{table.source} states its sampling rate as {told[0][:120]!r}, which does not say "
                "how many rows there are in a second; say --rate-hz"
            )
        near = nearest("time_s", table.columns, least=0.7) or "NAME"
        option = shlex.quote(f"time={near}")
        raise UserError(
            f"{table.source} has neither a column of the time nor a sampling rate; say "
            f"--rate-hz, or name the column of the time, as in --column {option} (its columns are "
            f"{table.listed})"
        )
    if len(set(found.values())) > 1:
        shown = ", ".join(f"{name} = {value:g}" for name, value in found.items())
        raise UserError(f"{table.source} states several sampling rates ({shown}); say --rate-hz")
    name, rate_hz = next(iter(found.items()))
    if not (math.isfinite(rate_hz) and rate_hz > 0):
        raise UserError(
            f"{table.source}: {name} = {rate_hz:g}, but a sampling rate must be greater than 0 Hz; "
            "say --rate-hz"
        )
    return rate_hz


def _increasing(table: Table, name: str, time_s: NDArray[np.float64]) -> None:
    bad = np.flatnonzero(~np.isfinite(time_s))
    if bad.size:
        row = int(bad[0])
        raise UserError(
            f"{table.where(row)}: {name} is {'missing' if np.isnan(time_s[row]) else 'infinite'}; "
            "every row must have a time"
        )
    back = np.flatnonzero(np.diff(time_s) <= 0)
    if back.size:
        row = int(back[0]) + 1
        before, now = float(time_s[row - 1]), float(time_s[row])
        what = f"repeats {now!r}" if now == before else f"goes back from {before!r} to {now!r}"
        text = f"{table.where(row)}: {name} {what}; time must increase from row to row"
        if now <= float(time_s[0]):
            text += "; if it starts anew with each trial, say --column epoch=NAME of their numbers"
        raise UserError(text)


def _agreeing(table: Table, name: str, time_s: NDArray[np.float64], rate_hz: float) -> None:
    """Refuse a stated rate that is not the one of the stamps; gaps do not count."""
    steps = np.diff(time_s)
    own_hz = 1.0 / float(np.mean(steps[steps <= 3 * np.median(steps)]))
    if abs(own_hz / rate_hz - 1) > _AGREEMENT:
        raise UserError(
            f"{table.source}: --rate-hz {rate_hz:g} disagrees with column {name}, whose stamps are "
            f"{own_hz:.6g} Hz; leave out --rate-hz to use the column"
        )
