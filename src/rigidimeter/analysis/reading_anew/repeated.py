"""Samples that are not what they seem: repeats of a slower sensor, and an angle that wraps.

A sensor of 50 samples/s in a table of 1000 rows/s is often repeated for 20 rows. No joint moves in
such steps: fitted as they are, they make J and K far too small. The repeats are taken for blanks,
as is what was interpolated by straight lines.

An angle that begins anew after each turn, as that of an encoder from 0° to 360°, is made to go on.
A step of nearly one turn is such a beginning if the motion across it, taken to be the short way
round, is no faster than between the other samples. A sensor that drops to 0 is none.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.columns import Array

SLOWEST_S = 0.1
"""Between samples of a slower sensor; what lasts longer is a step or a ramp of the motion."""
TURN_RAD = 2.0 * np.pi
_FEWEST_CHANGES = 20
# Of the samples of a slower sensor that differ from the one before; a coarse encoder has fewer.
_LEAST_SHARE = 0.5
_REGULAR = 0.99
# Of a bend between two straight lines over the median, which is rounding.
_BEND = 30.0
# Of the RMS about the straight lines over the median bend: 0.7 for rounding, and above 1.6 for the
# curves between the steps of a simulated perturbation, if they last `_FEWEST_ROWS`.
_STRAIGHT = 1.2
_FEWEST_ROWS = 4
# Samples in the middle that are looked at first: most columns have no repeats there.
_LOOK = 20_000
_FASTER = 1.5
_ROUNDING = 1e-6


def held_rows(values: Array) -> NDArray[np.intp]:
    """Return the rows with samples of a column that repeats each of them; none where it does not.

    Examples
    --------
    >>> held_rows(np.repeat(np.sin(np.arange(50.0)), 4))[:3]
    array([0, 4, 8])
    """
    if not _may_repeat(values):
        return np.empty(0, dtype=np.intp)
    return _evenly(np.flatnonzero(values[1:] != values[:-1]) + 1, values.size)


def _may_repeat(values: Array) -> bool:
    """Whether as many samples in the middle are those before them as where each is held."""
    first = max(0, (values.size - _LOOK) // 2)
    middle = values[first : first + _LOOK]
    changes = np.count_nonzero(middle[1:] != middle[:-1])
    # Of two rows each one at most differs, but for 1 % and what is lost.
    return bool(changes < 0.6 * middle.size)


def knots(values: Array) -> NDArray[np.intp]:
    """Return the rows with samples of a column that has straight lines between them, or none."""
    none = np.empty(0, dtype=np.intp)
    if values.size < 3:
        return none
    first = max(0, (values.size - _LOOK) // 2)
    middle = np.abs(np.diff(values[first : first + _LOOK], 2))
    share = np.mean(middle > 0.5 * _BEND * np.median(middle))
    if not 0.0 < share <= 1.1 / _FEWEST_ROWS or not np.all(np.isfinite(values)):
        return none
    bends = np.abs(np.diff(values, 2))
    usual = float(np.median(bends))
    rows = _evenly(np.flatnonzero(bends > _BEND * usual) + 1, values.size)
    if rows.size < 2 or rows[1] - rows[0] < _FEWEST_ROWS:
        return none
    between = np.arange(rows[0], rows[-1])
    about = values[between] - np.interp(between, rows, values[rows])
    rounding = 8 * np.finfo(np.float64).eps * np.max(np.abs(values))
    return rows if np.sqrt(np.mean(about**2)) <= _STRAIGHT * usual + rounding else none


def only_at(values: Array, rows: NDArray[np.intp]) -> Array:
    """Return a column with NaN in all rows but these."""
    sampled = np.full(values.size, np.nan)
    sampled[rows] = values[rows]
    return sampled


def repeats_text(rows: NDArray[np.intp], *, held: bool, moves: bool) -> str:
    """Return what to know of such a column; a torque, unlike a motion, may come in steps."""
    count = rows[1] - rows[0]
    if not held:
        return f"has straight lines of {count} rows, so it is read as a slower sensor at their ends"
    text = f"holds each value for {count} rows"
    if moves:
        return f"{text}, so it is read as a slower sensor, sampled in the first row of each"
    return f"{text}; if it is a slower sensor, leave the repeats blank: they bias J, B and K"


def _evenly(rows: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    """Return even rows to which nearly all of these belong and most of which they are, or none."""
    count = int(np.median(np.diff(rows))) if rows.size >= _FEWEST_CHANGES else 0
    if count < 2 or rows.size < _LEAST_SHARE * size / count:
        return np.empty(0, dtype=np.intp)
    first = rows[-1] % count
    if np.mean(rows % count == first) < _REGULAR:
        return np.empty(0, dtype=np.intp)
    return np.arange(first, size, count)


def unwrapped(angle_rad: Array) -> tuple[Array, int]:
    """Return an angle that goes on, and how often it began anew; the same array if it did not.

    Parameters
    ----------
    angle_rad : array, shape (n,)
        NaN where there is no sample.

    Examples
    --------
    >>> unwrapped(np.radians([358.0, 359.5, 1.0, 2.5]))[1]
    1
    """
    low, high = np.nanmin(angle_rad, initial=np.inf), np.nanmax(angle_rad, initial=-np.inf)
    if not TURN_RAD / 2 < float(high) - float(low) <= TURN_RAD * (1 + _ROUNDING):
        return angle_rad, 0
    here = np.flatnonzero(np.isfinite(angle_rad))
    inside = angle_rad[here]
    steps = np.diff(inside)
    anew = np.abs(steps) > TURN_RAD / 2
    if not np.any(anew):
        return angle_rad, 0
    turns = np.where(anew, -np.sign(steps), 0.0)
    fastest = float(np.max(np.abs(steps[~anew]), initial=0.0))
    if fastest > TURN_RAD / 4:
        return angle_rad, 0
    if np.max(np.abs(steps + TURN_RAD * turns)[anew]) > _FASTER * fastest:
        return angle_rad, 0
    whole = angle_rad.copy()
    whole[here[1:]] += TURN_RAD * np.cumsum(turns)
    return whole, int(np.count_nonzero(anew))


def turns_text(n_turns: int) -> str:
    """Say of a column what `unwrapped` did."""
    times = "once" if n_turns == 1 else f"{n_turns} times"
    return f"begins anew after a turn ({times}); it is read as an angle that goes on"
