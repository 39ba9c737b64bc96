"""What a figure shows, as numbers: every line, interval and point in the order of drawing."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure

from rigidimeter.documents import csv_text

COLUMNS = ("panel", "title", "x_axis", "y_axis", "series", "label", "x", "y")


def drawn_csv(figure: Figure) -> str:
    """Return a row for each point that is drawn in the units of the axes.

    `series` counts the lines of a panel; an interval is a series of its two ends. What only marks a
    place across the whole of an axis is left out.
    """
    return csv_text(COLUMNS, []) + "".join(_lines(figure))


def _lines(figure: Figure) -> Iterator[str]:
    """Yield a line for each point; what all points of a series share is made once."""
    for panel, axes in enumerate(figure.axes, start=1):
        title = axes.get_title("left") or axes.get_title()
        texts = (title, axes.get_xlabel(), axes.get_ylabel())
        about = (panel, *(" ".join(str(text).split()) for text in texts))
        for series, (label, points) in enumerate(_series(axes), start=1):
            _, _, shared = csv_text(COLUMNS[:-2], [(*about, series, label)]).partition("\n")
            start = shared.removesuffix("\n")
            for x, y in points.tolist():
                yield f"{start},{_cell(x)},{_cell(y)}\n"


def _cell(number: float) -> str:
    return "" if math.isnan(number) else repr(number)


def _series(axes: Axes) -> Iterator[tuple[str, np.ndarray]]:
    for line in axes.lines:
        if line.get_transform() == axes.transData and np.size(line.get_xdata()):
            yield _label(line.get_label()), np.asarray(line.get_xydata(), dtype=np.float64)
    for collection in axes.collections:
        label = _label(collection.get_label())
        if isinstance(collection, LineCollection):
            for segment in collection.get_segments():
                yield label, np.asarray(segment, dtype=np.float64)
        elif isinstance(collection, PathCollection):
            yield label, np.asarray(collection.get_offsets(), dtype=np.float64)


def _label(label: object) -> str:
    """Return a label of the legend; what has none is called ``_child0`` and the like."""
    text = str(label)
    return "" if text.startswith("_") else text.strip()
