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
_MOST_POINTS = 20_000


def draw_columns(found: Inspection, path: Path) -> None:
    """Draw every column of numbers against time, or against its row.

    Raises
    ------
    UserError
        If the image cannot be written.
    """
    drawn = [one for one in found.facts if not one.text][:_MOST_PANES]
    figure = Figure(figsize=(8, 1.2 + 1.3 * len(drawn)), layout="constrained")
    panes = figure.subplots(max(len(drawn), 1), 1, sharex=True, squeeze=False)[:, 0]
    for pane, one in zip(panes, drawn, strict=False):
        values = numbers(found.table, one.name, one.name, [])
        known = found.time_s is not None and found.time_s.size == values.size
        time = found.time_s if known and found.time_s is not None else np.arange(values.size)
        every = max(1, values.size // _MOST_POINTS)
        pane.plot(time[::every], values[::every], linewidth=0.7)
        pane.set_ylabel(
            visible(f"{one.name[:24]}\n{one.unit or '?'}", lines=True), parse_math=False
        )
    panes[-1].set_xlabel("time (s)" if found.time_s is not None else "row")
    try:
        figure.savefig(path)
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: cannot be written ({error})") from None
