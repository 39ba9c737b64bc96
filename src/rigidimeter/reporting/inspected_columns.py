"""A figure of the columns of a file, each in a pane of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from rigidimeter.documents import visible
from rigidimeter.errors import UserError
from rigidimeter.recording.channels.inspection import Inspection
from rigidimeter.recording.formats.columns import numbers

_MOST_PANES = 16


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
    figure = Figure(figsize=(8, 1.2 + 1.3 * len(drawn)), layout="constrained")
    panes = figure.subplots(max(len(drawn), 1), 1, sharex=True, squeeze=False)[:, 0]
    for pane, one in zip(panes, drawn, strict=False):
        values = numbers(found.table, one.name, one.name, [])
        known = found.time_s is not None and found.time_s.size == values.size
        time = found.time_s if known and found.time_s is not None else np.arange(values.size)
        there = np.isfinite(values)  # rows of other clocks are empty
        pane.plot(time[there], values[there], linewidth=0.7, rasterized=True)
        unit = (taken[one.name].unit if one.name in taken else "") or one.unit
        pane.set_ylabel(_label(one.name, unit), parse_math=False)
    panes[-1].set_xlabel("time (s)" if found.time_s is not None else "row")
    return figure


def _label(name: str, unit: str) -> str:
    """Return name and unit, the unit once where the name ends with it."""
    stated = bool(unit) and name.endswith((f"[{unit}]", f"({unit})"))
    return visible(name[:32] if stated else f"{name[:24]}\n({unit or 'unit unknown'})", lines=True)
