"""Files that belong together: torque in one, motion in another, each with its clock.

Their columns become one table over the union of both clocks, as far as all files go. A column is
empty in the rows of the other clock, so every sample keeps its own time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.channels.choice import LABELS, MOTION, choose
from rigidimeter.analysis.reading.channels.clock_offset import Offset, find_offset
from rigidimeter.analysis.reading.channels.readings import options_text
from rigidimeter.analysis.reading.formats.clocked_table import spread
from rigidimeter.analysis.reading.formats.columns import numbers, own_rate, own_rates, time_stamps
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Notice
from rigidimeter.core.words import with_error

Array = NDArray[np.float64]
FOUND = "found"


@dataclass(frozen=True)
class _Part:
    """One table with the time of its rows and the column of it, if there is one."""

    table: Table
    time_s: Array
    time_column: str | None


def join_tables(
    tables: Sequence[Table], options: ReadOptions, clock_offset: float | str | None
) -> tuple[Table, Offset | None]:
    """Return tables as one, and the offset of their clocks where it was found.

    Parameters
    ----------
    tables : sequence of Table
    options : ReadOptions
        Time units and the sampling rate are those of every table.
    clock_offset : float, "found" or None
        What is added to the clocks of the second and later tables, in s; ``"found"``: estimated
        from torque and motion. None: they are one clock.

    Raises
    ------
    UserError
        If a table has no time, or the offset cannot be found.
    """
    if len(tables) < 2:
        raise UserError("--join: name two recordings or more, which then are one")
    parts = [_part(table, options) for table in tables]
    offset_s = 0.0
    found: Offset | None = None
    if clock_offset == FOUND:
        found = _found(parts, options)
        offset_s = found.value_s
    elif isinstance(clock_offset, int | float):
        offset_s = float(clock_offset)
    elif clock_offset is not None:
        raise UserError(f"--clock-offset {clock_offset}: write seconds, or {FOUND}")
    moved = [replace(part, time_s=part.time_s + offset_s) for part in parts[1:]]
    return _union([parts[0], *moved]), found


def offset_notice(found: Offset, source: str) -> Notice:
    """Say what offset was added to the clock of the second source."""
    text = (
        f"{source}: {with_error(found.value_s, found.error_s)} s is added to its clock; the motion "
        f"then explains {100 * found.r_squared:.1f} % of the torque. The intervals of J, B and K "
        "contain the error"
    )
    return Notice("warning", text)


def _part(table: Table, options: ReadOptions) -> _Part:
    has_rate = options.rate_hz is not None or bool(own_rates(table))
    said = options.said
    here = {
        standard: column
        for standard, column in said.columns.items()
        if column in table.columns or column in table.scalars
    }
    taken = choose(table, replace(said, columns=here), has_rate).taken.get("time_s")
    n_rows = max((column.size for column in table.columns.values()), default=0)
    if taken is None:
        rate_hz = own_rate(table) if options.rate_hz is None else options.rate_hz
        return _Part(table, np.arange(n_rows) / rate_hz, None)
    if taken.to_si is None:
        raise UserError(
            f"{table.source}: the unit of {taken.column!r} is stated nowhere; say "
            f"{options_text({'time_s': ()})}"
        )
    raw = numbers(table, "time_s", taken.column)
    return _Part(table, time_stamps(table, taken.column, raw, taken.to_si, None), taken.column)


def joined_options(options: ReadOptions) -> ReadOptions:
    """Return options for the joined table, whose time is in s already."""
    without = {
        name: {key: text for key, text in given.items() if key not in ("time", "time_s")}
        for name, given in (
            ("columns", options.columns), ("units", options.units),
            ("scales", options.scales), ("offsets", options.offsets),
        )
    }  # fmt: skip
    return replace(options, rate_hz=None, **without)  # type: ignore[arg-type]


def _union(parts: Sequence[_Part]) -> Table:
    start_s = max(float(part.time_s[0]) for part in parts)
    stop_s = min(float(part.time_s[-1]) for part in parts)
    inside = [(part.time_s >= start_s) & (part.time_s <= stop_s) for part in parts]
    if any(np.count_nonzero(here) < 2 for here in inside):
        spans = "; ".join(
            f"{part.table.source} from {part.time_s[0]:.6g} to {part.time_s[-1]:.6g} s"
            for part in parts
        )
        raise UserError(f"--join: the clocks have nothing in common ({spans}); say --clock-offset")
    time_s = np.unique(
        np.concatenate([p.time_s[here] for p, here in zip(parts, inside, strict=True)])
    )
    columns: dict[str, NDArray[Any]] = {"time_s": time_s}
    units: dict[str, str] = {}
    scalars: dict[str, float | str] = {}
    for part, here in zip(parts, inside, strict=True):
        at = np.searchsorted(time_s, part.time_s[here])
        for name, column in part.table.columns.items():
            if name == part.time_column or column.size != here.size:
                continue
            free = name if name not in columns else f"{name} ({part.table.source})"
            columns[free] = spread(column[here], at, time_s.size, fill=name in LABELS)
            if name in part.table.units:
                units[free] = part.table.units[name]
        labels = (n for n in part.table.scalars if n in LABELS)
        scalars |= {name: part.table.scalars[name] for name in labels}
    source = " + ".join(part.table.source for part in parts)
    virtual = any(part.table.virtual for part in parts)
    return Table(source, columns, scalars, units=units, virtual=virtual)


def _found(parts: Sequence[_Part], options: ReadOptions) -> Offset:
    others = parts[1:]
    if len(others) > 1:
        raise UserError("--clock-offset found: is for two recordings; join the others first")
    signals: dict[str, tuple[Array, Array]] = {}
    where: dict[str, int] = {}
    columns = {n: c for part in parts[::-1] for n, c in part.table.columns.items()}
    units = {n: u for part in parts[::-1] for n, u in part.table.units.items()}
    choice = choose(Table(others[0].table.source, columns, units=units), options.said)
    for standard in ("torque_nm", *MOTION):
        column = choice.taken[standard].column if standard in choice.taken else ""
        for index, part in enumerate(parts):
            if column in part.table.columns and standard not in where:
                values = numbers(part.table, standard, column, [])
                here = np.isfinite(values)
                signals[standard] = (part.time_s[here], values[here])
                where[standard] = index
    motion = next((name for name in ("angle_rad", "velocity_rad_s") if name in where), None)
    if "torque_nm" not in where or motion is None or where["torque_nm"] == where[motion]:
        raise UserError(
            "--clock-offset found: needs the torque in one recording and the motion in the other; "
            "name the columns with --column, or give the offset in seconds"
        )
    offset = find_offset(signals["torque_nm"], signals[motion], is_angle=motion == "angle_rad")
    return offset if where[motion] == 1 else replace(offset, value_s=-offset.value_s)
