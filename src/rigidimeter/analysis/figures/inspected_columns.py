"""A figure of the columns of a file, each in a pane of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rigidimeter.analysis.reading.channels.inspection import Inspection
from rigidimeter.analysis.reading.formats.columns import numbers
from rigidimeter.analysis.reading.formats.gaps import longest_s
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import visible

Array = NDArray[np.float64]

_MOST_PANES = 16
_LONGEST = 70


def draw_columns(found: Inspection, path: Path) -> None:
    """Write an image of `columns_figure`.

    Raises
    ------
    UserError
        If the image cannot be written.
    """
    try:
        columns_figure(found).savefig(path, dpi=200)
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: cannot be written ({error})") from None


def columns_figure(found: Inspection) -> Figure:
    """Draw every column of numbers but the time against time, or against its row."""
    taken = {one.column: one for one in found.proposal.choice.taken.values()}
    drawn = [
        one
        for one in found.facts
        if not one.text and (one.name not in taken or taken[one.name].standard != "time_s")
    ][:_MOST_PANES]
    figure = Figure(figsize=(8, 1.0 + 1.5 * len(drawn)), layout="constrained")
    panes = figure.subplots(max(len(drawn), 1), 1, sharex=True, squeeze=False)[:, 0]
    for pane, one in zip(panes, drawn, strict=False):
        values = numbers(found.table, one.name, one.name, [])
        known = found.time_s is not None and found.time_s.size == values.size
        time = found.time_s if known and found.time_s is not None else np.arange(float(values.size))
        there = np.isfinite(values)  # rows of other clocks are empty
        x, y = time[there], values[there]
        if known:
            x, y = _with_gaps(x, y)
        pane.plot(x, y, linewidth=0.7, rasterized=True)
        role = taken.get(one.name)
        unit = (role.unit if role is not None else "") or one.unit
        title = one.name[:_LONGEST] + (f", read as {role.standard}" if role is not None else "")
        pane.set_title(visible(title), loc="left", fontsize="small", parse_math=False)
        pane.set_ylabel(visible(unit or "unit unknown"), parse_math=False)
    panes[-1].set_xlabel("time (s)" if found.time_s is not None else "row")
    return figure


def _with_gaps(time: Array, values: Array) -> tuple[Array, Array]:
    """Return a signal with a point that is not drawn in every gap."""
    steps = np.diff(time)
    if not steps.size or not (typical := float(np.median(steps))) > 0:
        return time, values
    gaps = np.flatnonzero(steps > longest_s(typical)) + 1
    return np.insert(time, gaps, time[gaps - 1]), np.insert(values, gaps, np.nan)
