"""The standard columns of a file: found by name, converted to numbers, with a time for each row.

Files use names of their own. A column gets its standard name here, either because it has it
already or because the user says so; every refusal names the option that helps.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rigidimeter.errors import UserError
from rigidimeter.recording.formats.table import MISSING, Table, alike, nearest
from rigidimeter.records import CHANNEL_UNITS

LABELS = ("epoch", "condition", "task")
MOTION = ("velocity_rad_s", "angle_rad")
STANDARD = ("time_s", *CHANNEL_UNITS, *LABELS)
RATE_NAMES = ("rate_hz", "fs_hz", "fs", "sampling_rate_hz")
"""Single values of a file that are taken as its sampling rate."""
STRAY_SHARE = 0.01
"""Up to this share of entries may be text in a column of numbers and still be left out singly."""
_AGREEMENT = 0.01


def find_columns(table: Table, wanted: Mapping[str, str]) -> dict[str, str]:
    """Return the file's name of each standard column that is there.

    Parameters
    ----------
    table : Table
        The file.
    wanted : mapping of str to str
        Standard name to the file's name, as the user gave them; other columns go by their own
        name.

    Raises
    ------
    UserError
        If a name is unknown on either side, or if the torque or the motion is missing.
    """
    for standard, name in wanted.items():
        if standard not in STANDARD:
            raise UserError(
                f"--column {shlex.quote(f'{standard}={name}')}: {standard} is not a name that is "
                f"read; the nearest is {nearest(standard, STANDARD)} (known are "
                f"{', '.join(STANDARD)})"
            )
        if name not in table.columns and not (standard in LABELS and name in table.scalars):
            raise UserError(_no_such_column(table, standard, name))
    found = {
        name: wanted.get(name, name)
        for name in STANDARD
        if name in wanted or name in table.columns or (name in LABELS and name in table.scalars)
    }
    if "torque_nm" not in found:
        raise UserError(_missing(table, found, "has no column torque_nm", ("torque_nm",)))
    if not any(name in found for name in MOTION):
        raise UserError(
            _missing(table, found, f"has neither column {MOTION[0]} nor {MOTION[1]}", MOTION)
        )
    _same_length(table, found)
    return found


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
        Where given, a few entries that are not numbers are missing too, and a sentence about each
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
    if strays is not None:
        strays += found
    return values


def time_stamps(
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
    if time_name is not None:
        time_s = numbers(table, "time_s", time_name)
        _increasing(table, time_name, time_s)
        if rate_hz is not None:
            _agreeing(table, time_name, time_s, rate_hz)
        return time_s
    if rate_hz is None:
        rate_hz = _own_rate(table)
    return np.arange(n_rows) / rate_hz


def seconds(value: float) -> str:
    """Return a time or duration as sentences show it, with at most four decimals."""
    return f"{value:.4f}".rstrip("0").rstrip(".") + " s"


def _no_such_column(table: Table, standard: str, name: str) -> str:
    option = f"--column {shlex.quote(f'{standard}={name}')}"
    if name in table.others:
        return (
            f"{table.source}: {option}: {name} is {table.others[name]}; a column has one "
            "dimension and a real number or text for each sample"
        )
    if name in table.scalars:
        return f"{table.source}: {option}: {name} is a single value, not a column of samples"
    near = nearest(name, table.columns)
    right = f"--column {shlex.quote(f'{standard}={near}')}"
    return (
        f"{table.source}: {option}: there is no column {name}; the nearest is {near}, so perhaps "
        f"{right} (its columns are {table.listed})"
    )


def _missing(table: Table, found: Mapping[str, str], what: str, standards: tuple[str, ...]) -> str:
    taken = set(found.values())
    free = [name for name in table.columns if name not in taken]
    text = f"{table.source} {what}; its columns are {table.listed}"
    if not free:
        return f"{text}, and none is left to be it"
    ranked = [(alike(standard, name), standard, name) for standard in standards for name in free]
    _, standard, name = max(ranked, key=lambda entry: entry[0])
    option = shlex.quote(f"{standard}={name}")
    return f"{text}; the nearest is {name}: if it is the one, say --column {option}"


def _same_length(table: Table, found: Mapping[str, str]) -> None:
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
