"""When the rows of a table were sampled: its time column, or its sampling rate."""

from __future__ import annotations

import math
import shlex

import numpy as np
from numpy.typing import NDArray

from rigidimeter.errors import UserError
from rigidimeter.recording.formats.columns import Table, listed, nearest, numbers

__all__ = ["RATE_NAMES", "seconds", "stamps", "typical_step_s"]

RATE_NAMES = ("rate_hz", "fs_hz", "fs", "sampling_rate_hz")
"""Single values of a file that are taken as its sampling rate."""

_AGREEMENT = 0.01


def stamps(
    table: Table, time_name: str | None, rate_hz: float | None, n_rows: int
) -> NDArray[np.float64]:
    """Return the time of each row in s, shape (n_rows,), strictly increasing.

    Parameters
    ----------
    table : Table
        The file.
    time_name : str or None
        The file's name of its time column, if it has one.
    rate_hz : float or None
        The sampling rate, if the user gave one.
    n_rows : int
        The length of the columns.

    Raises
    ------
    UserError
        If there is neither time nor rate, if they disagree, or if the time does not increase.
    """
    if rate_hz is not None and not (math.isfinite(rate_hz) and rate_hz > 0):
        raise UserError(f"--rate-hz {rate_hz:g}: the sampling rate must be greater than 0 Hz")
    if time_name is not None:
        time_s = numbers(table, "time_s", time_name)
        _increasing(table, time_name, time_s)
        if rate_hz is not None:
            _agreeing(table, time_name, time_s, rate_hz)
        return time_s
    if rate_hz is None:
        rate_hz = _own_rate(table)
    return np.arange(n_rows) / rate_hz


def typical_step_s(time_s: NDArray[np.float64]) -> float:
    """Return the median interval of two or more stamps, in s."""
    return float(np.median(np.diff(time_s)))


def seconds(value: float) -> str:
    """Return a time or duration as sentences show it, with at most four decimals."""
    return f"{value:.4f}".rstrip("0").rstrip(".") + " s"


def _own_rate(table: Table) -> float:
    found = {
        name: float(value)
        for name, value in table.scalars.items()
        if name.rsplit(".", 1)[-1] in RATE_NAMES and not isinstance(value, str)
    }
    if not found:
        near = nearest("time_s", table.columns, least=0.7) or "NAME"
        option = shlex.quote(f"time_s={near}")
        raise UserError(
            f"{table.source} has neither a column time_s nor a sampling rate; say --rate-hz, or "
            f"name the column of the time in seconds, as in --column {option} (its columns are "
            f"{listed(table)})"
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
            "every row must have a time in seconds"
        )
    back = np.flatnonzero(np.diff(time_s) <= 0)
    if back.size:
        row = int(back[0]) + 1
        before, now = float(time_s[row - 1]), float(time_s[row])
        what = f"repeats {now!r}" if now == before else f"goes back from {before!r} to {now!r}"
        raise UserError(f"{table.where(row)}: {name} {what}; time must increase from row to row")


def _agreeing(table: Table, name: str, time_s: NDArray[np.float64], rate_hz: float) -> None:
    """Refuse a stated rate that is not the one of the stamps; gaps do not count."""
    steps = np.diff(time_s)
    own_hz = 1.0 / float(np.mean(steps[steps <= 3 * np.median(steps)]))
    if abs(own_hz / rate_hz - 1) > _AGREEMENT:
        raise UserError(
            f"{table.source}: --rate-hz {rate_hz:g} disagrees with column {name}, whose stamps are "
            f"{own_hz:.6g} Hz; leave out --rate-hz to use the column"
        )
