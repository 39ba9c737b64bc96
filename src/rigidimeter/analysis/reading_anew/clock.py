"""When each sample was taken: by a column of the time, a clock of the file, or a rate."""

from __future__ import annotations

import math
import shlex

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.columns import Array, Columns, nearest
from rigidimeter.analysis.reading_anew.mapping import Fault
from rigidimeter.analysis.reading_anew.quantities import words_of

RATE_NAMES = ("rate_hz", "fs_hz", "fs", "sampling_rate_hz")
"""Single values of a file that are taken as its sampling rate."""
APART_S = 1.0
"""Between epochs that each have a time of their own."""
_AGREEMENT = 0.01
_WHOLE = 1e-6
# Milliseconds since 1970, in September 2001.
_MS_IN_2001 = 1e12
# Where the counters of devices begin anew.
_BEGIN_ANEW = (2**8, 2**16)
_COUNTERS = {"sample", "samples", "frame", "frames", "index", "counter"}


class Refused(Exception):
    """A clock that cannot be one; it carries the fault."""

    def __init__(self, fault: Fault) -> None:
        super().__init__(fault.text)
        self.fault = fault


def seconds(value: float) -> str:
    """Return a time or duration as sentences show it, with at most four decimals."""
    return f"{value:.4f}".rstrip("0").rstrip(".") + " s"


def restarts(values: Array) -> NDArray[np.intp]:
    """Return the rows in which a time goes back."""
    return np.flatnonzero(values[1:] < values[:-1]) + 1


def one_after_another(time_s: Array) -> Array:
    """Return times that go back nowhere: each stretch begins `APART_S` after the one before it."""
    starts = restarts(time_s)
    if not starts.size:
        return time_s
    ends_s = time_s[starts - 1] + APART_S - time_s[starts]
    later_s: Array = np.concatenate([[0.0], np.cumsum(ends_s)])
    lengths = np.diff(starts, prepend=0, append=time_s.size)
    return np.add(time_s, np.repeat(later_s, lengths), dtype=np.float64)


def counts_samples(values: Array) -> bool:
    """Whether a column only numbers the rows, as 0, 1, 2: no clock, or one in ms at 1000 Hz."""
    if values.size < 2 or values[1] - values[0] != 1.0:
        return False
    return bool(np.all(np.diff(values) == 1.0))


def may_be_ticks(time: Array) -> bool:
    """Whether the times are whole numbers, as those of a clock of any rate are.

    Milliseconds since 1970 are told from them: a clock with some ticks a millisecond, which could
    be taken for them, would have run for years.
    """
    time = time[np.isfinite(time)]
    whole = bool(np.all(np.abs(time - np.round(time)) < _WHOLE))
    return bool(time.size) and whole and float(np.min(time)) < _MS_IN_2001


def stated_rates(file: Columns) -> dict[str, float]:
    """Return the sampling rates that a file states, by its names of them."""
    return {
        name: float(value)
        for name, value in file.facts.items()
        if _names_rate(name) and not isinstance(value, str)
    }


def _names_rate(name: str) -> bool:
    return name.rsplit(".", 1)[-1] in RATE_NAMES


def stated_rate(file: Columns) -> float:
    """Return the sampling rate of a file without a column of the time.

    Raises
    ------
    Refused
        If it states none, several, or one that cannot be.
    """
    found = stated_rates(file)
    rates = set(found.values())
    if len(rates) == 1 and 0 < min(rates) < math.inf:
        return rates.pop()
    told = [str(value) for name, value in file.facts.items() if _names_rate(name)]
    if len(rates) > 1:
        shown = ", ".join(f"{name} = {value:g}" for name, value in found.items())
        text = f"{file.source} states several sampling rates ({shown}); say --rate-hz"
    elif rates:
        text = f"{file.source}: the sampling rate is {rates.pop():g} Hz; say --rate-hz"
    elif told:
        text = (
            f"{file.source} states its sampling rate as {told[0][:120]!r}, which does not say how "
            "many rows there are in a second; say --rate-hz"
        )
    else:
        near = nearest("time", file.columns, least=0.7) or "NAME"
        option = shlex.quote(f"time={near}")
        text = (
            f"{file.source} has neither a column of the time nor a sampling rate; say --rate-hz, "
            f"or name the column of the time, as in --column {option} (its columns are "
            f"{file.listed})"
        )
    raise Refused(Fault(text, "clock", "time"))


def by_number(file: Columns, size: int, rate_hz: float, *, of_rows: bool) -> Array:
    """Return the time of rows at a rate, with samples left out that a column of numbers skips.

    Parameters
    ----------
    file : Columns
    size : int
    rate_hz : float
    of_rows : bool
        Whether the rate is that of the rows, as the user gives it.

    Raises
    ------
    Refused
        If the numbers skip evenly, and the rate may be that of what they count.
    """
    for name, column in file.columns.items():
        if column.size != size or not _COUNTERS.intersection(words_of(name)):
            continue
        numbers = column.read()
        if numbers.dtype == object:
            continue
        steps = np.diff(numbers)
        if numbers.max() + 1 in _BEGIN_ANEW:
            steps %= numbers.max() + 1
        usual = np.median(steps)
        if not (usual >= 1 and np.all(steps > 0) and np.all(steps % usual == 0)):
            continue
        if usual > 1 and not of_rows:
            text = (
                f"{file.source}: column {name!r} goes up by {usual:g} from row to row, so the "
                "sampling rate that the file states may not be that of the rows; say --rate-hz"
            )
            raise Refused(Fault(text, "counter", "time"))
        return np.asarray(np.concatenate([[0.0], np.cumsum(steps / usual)])) / rate_hz
    return np.arange(size, dtype=np.float64) / rate_hz


def check_increasing(file: Columns, name: str, time: Array) -> None:
    """Refuse stamps, as the file has them, that are missing, repeat or go back.

    Raises
    ------
    Refused
    """
    steps = np.diff(time)
    if time.size and np.isfinite(time[0]) and np.all(steps > 0) and np.isfinite(time[-1]):
        return
    bad = np.flatnonzero(~np.isfinite(time))
    if bad.size:
        row = int(bad[0])
        what = "missing" if np.isnan(time[row]) else "infinite"
        text = f"{file.where(row)}: {name} is {what}; every row must have a time"
        raise Refused(Fault(text, "clock", "time"))
    row = int(np.flatnonzero(steps <= 0)[0]) + 1
    before, now = float(time[row - 1]), float(time[row])
    what = f"repeats {now!r}" if now == before else f"goes back from {before!r} to {now!r}"
    text = f"{file.where(row)}: {name} {what}; time must increase from row to row"
    if now <= float(time[0]):
        text += "; if it starts anew with each trial, say --column epoch=NAME of their numbers"
    raise Refused(Fault(text, "clock", "time"))


def check_agreeing(file: Columns, name: str, time_s: Array, rate_hz: float) -> None:
    """Refuse a rate that the user states and the stamps do not have; gaps do not count.

    Raises
    ------
    Refused
    """
    steps = np.diff(time_s)
    own_hz = 1.0 / float(np.mean(steps[steps <= 3 * np.median(steps)]))
    if abs(own_hz / rate_hz - 1) > _AGREEMENT:
        text = (
            f"{file.source}: --rate-hz {rate_hz:g} disagrees with column {name}, whose stamps are "
            f"{own_hz:.6g} Hz; leave out --rate-hz to use the column"
        )
        raise Refused(Fault(text, "clock", "time"))
