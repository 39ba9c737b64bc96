"""How every figure looks, and how it becomes text.

Colours are Okabe and Ito's (Color Universal Design, 2008), which people with any of the common
colour deficiencies can tell apart; those of OFF and DBS also differ in lightness in grey print.
A condition keeps its colour through the report. Only matplotlib's object API is used, so nothing is
left behind in its global state.
"""

from __future__ import annotations

import io
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib import font_manager
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import Formatter, LogFormatter, NullFormatter, ScalarFormatter
from numpy.typing import ArrayLike, NDArray

from rigidimeter.core.files import visible
from rigidimeter.core.words import tick_labels

Look = dict[str, Any]
"""Arguments of a line or of points, by name."""

GREY = "#555555"
INK = "#1C1C1C"
WARN = "#8A3B00"
_BY_NAME = {"OFF": "#D55E00", "DBS": "#0072B2"}
OTHERS = ("#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = "osD^vP*X"
_GOLDEN = 0.6180339887498949

_FONT = "DejaVu Sans"  # comes with matplotlib, so the report looks the same everywhere
_INSTEAD = "Verdana, sans-serif"
"""Where that font is not installed: Verdana has its widths."""
_STYLE: dict[Any, Any] = {
    "axes.edgecolor": GREY,
    "axes.grid": True,
    "axes.labelsize": 9,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 9,
    "figure.constrained_layout.use": True,
    "figure.facecolor": "white",
    "font.family": [_FONT],
    "font.size": 9,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "path.simplify": True,
    "svg.fonttype": "none",  # text stays text: found, copied, and a tenth of the bytes
    "svg.hashsalt": "rigidimeter",
    "text.parse_math": False,  # a condition may be called "$5"
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
}


@contextmanager
def styled() -> Iterator[None]:
    """Apply the style to what is drawn inside, and nothing else."""
    with mpl.rc_context():
        mpl.rcdefaults()  # a matplotlibrc of the user must not change the report
        mpl.rcParams.update(_STYLE)
        yield


def drawn(
    size: tuple[float, float],
    draw: Callable[..., None],
    *arguments: Any,
    rows: int = 1,
    columns: int = 1,
    **options: Any,
) -> Figure:
    """Return a figure of its own of what a function draws on panels.

    Parameters
    ----------
    size : (float, float)
        In inches.
    draw : callable
        Takes the list of panels, then `arguments`.
    rows, columns : int
    **options
        Of the panels, as `matplotlib.figure.Figure.subplots` takes them.
    """
    with styled():
        figure = Figure(figsize=size)
        panels = figure.subplots(rows, columns, squeeze=False, **options)
        draw(list(panels.ravel()), *arguments)
        figure.align_ylabels()
    return figure


def svg_text(figure: Figure, mark: str = "") -> str:
    """Return the figure as an SVG document: the same figure gives the same text.

    `mark` is written above everything, for what must never be taken for a measurement.
    """
    file = io.StringIO()
    with styled():
        if mark:
            figure.suptitle(mark, x=0.995, ha="right", fontsize=8, style="italic", color=WARN)
        plain_ticks(figure.axes)
        for text in figure.findobj(Text):  # fonts have no control characters, XML forbids them
            if (shown := visible(text.get_text(), lines=True)) != text.get_text():
                text.set_text(shown)
        # `savefig` would draw all of it a second time, for a layout that is made here too.
        metadata = {"Date": None, "Creator": "rigidimeter"}
        FigureCanvasSVG(figure).print_svg(file, metadata=metadata)  # type: ignore[no-untyped-call]
    # A clipping path is named after its place in memory; it is named by its order instead.
    document = file.getvalue()
    names = dict.fromkeys(re.findall(r'<clipPath id="(\w+)"', document))
    numbers = {name: f"clip-{number}" for number, name in enumerate(names)}
    document = re.sub(
        r'(?<=[#"])p[0-9a-f]{10}(?=[")])', lambda found: numbers.get(found[0], found[0]), document
    )
    return document.replace(f"'{_FONT}'", f"'{_FONT}', {_INSTEAD}")


def condition_colours(conditions: Iterable[str]) -> dict[str, str]:
    """Return a colour for each condition: OFF and DBS their own, others in order."""
    names = list(dict.fromkeys(conditions))
    others = [name for name in names if name not in _BY_NAME]
    free = {name: OTHERS[i % len(OTHERS)] for i, name in enumerate(others)}
    return {name: _BY_NAME.get(name) or free[name] for name in names}


def condition_markers(conditions: Iterable[str]) -> dict[str, str]:
    """Return a marker for each condition, so that grey print tells them apart too."""
    names = dict.fromkeys(conditions)
    return {name: MARKERS[place % len(MARKERS)] for place, name in enumerate(names)}


def drawable(text: str) -> str:
    """Return the text with a box for every character that the font cannot draw."""
    font = font_manager.get_font(font_manager.findfont(_FONT))
    return "".join(
        c if c.isprintable() and font.get_char_index(ord(c)) else "\N{WHITE SQUARE}" for c in text
    )


def listed(text: str) -> str:
    """Return the text for a legend, which leaves out whatever begins with an underscore."""
    return drawable(f" {text}" if text.startswith("_") else text)


def labelled(title: str, unit: str) -> str:
    """Return title and unit, for axes and headings.

    Examples
    --------
    >>> labelled("Stiffness K", "N·m/rad")
    'Stiffness K (N·m/rad)'
    """
    return f"{title} ({unit})" if unit else title


def wrapped(text: str, width: int, lines: int = 3) -> str:
    """Return the text on a few short lines, shortened where it does not fit."""
    return "\n".join(
        textwrap.wrap(drawable(text), width, max_lines=lines, placeholder="…") or ["–"]
    )


def spread(count: int, reach: float) -> NDArray[np.float64]:
    """Return offsets within ±reach that never cluster: multiples of the golden ratio."""
    share = np.mod(0.5 + _GOLDEN * np.arange(count), 1.0)
    return np.asarray(reach * (2 * share - 1), dtype=np.float64)


def with_intervals(
    axes: Axes,
    places: ArrayLike,
    rows: ArrayLike,
    colour: str,
    marker: str,
    *,
    across: bool = False,
    width: float = 1.2,
    faint: float = 1.0,
    **style: Any,
) -> None:
    """Draw values as points with their intervals.

    Parameters
    ----------
    places : float or array, shape (n,)
        Where they stand along the other axis.
    rows : array, shape (3,) or (n, 3)
        Each value and the ends of its interval, which is drawn where both are finite.
    across : bool
        The values are those of the horizontal axis.
    width, faint : float
        Width and opacity of the intervals.
    **style
        Of the points.
    """
    values, low, high = np.reshape(np.asarray(rows, dtype=np.float64), (-1, 3)).T
    at = np.broadcast_to(places, values.shape)
    known = np.isfinite(low) & np.isfinite(high)
    if np.any(known):
        lines = axes.hlines if across else axes.vlines
        lines(at[known], low[known], high[known], color=colour, linewidth=width, alpha=faint)
    x, y = (values, at) if across else (at, values)
    axes.plot(x, y, marker, color=colour, **style)


def write_at(
    axes: Axes, x: float, y: float, text: str, *, share: Literal["x", "y"], **style: Any
) -> None:
    """Write a few words where one of the coordinates is a share of the axes, from 0 to 1."""
    place = axes.get_yaxis_transform() if share == "x" else axes.get_xaxis_transform()
    axes.text(x, y, drawable(text), transform=place, fontsize=8, **style)


class _Numbers(Formatter):
    """Labels the ticks of an axis as every number of the page is written."""

    def __call__(self, value: float, pos: int | None = None) -> str:
        """Return one number."""
        return self.format_ticks([value])[0]

    def format_ticks(self, values: list[float]) -> list[str]:
        """Return the numbers of all ticks."""
        scale = self.axis.get_scale() if isinstance(self.axis, Axis) else ""
        return tick_labels(values, logarithmic=scale == "log")


def plain_ticks(panels: Iterable[Axes]) -> None:
    """Label the ticks that have no names with numbers, without a factor at the end of the axis."""
    for axes in panels:
        for axis in (axes.xaxis, axes.yaxis):
            if isinstance(axis.get_major_formatter(), ScalarFormatter | LogFormatter):
                axis.set_major_formatter(_Numbers())
                axis.set_minor_formatter(NullFormatter())


def legend_above(axes: Axes) -> None:
    """Write the legend above the axes, on lines of four."""
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, handletextpad=0.4, borderpad=0.1,
        fontsize=8, frameon=False,
    )  # fmt: skip


def legend_outside(axes: Axes) -> None:
    """Write the legend of axes above all panels of their figure."""
    axes.figure.legend(
        *axes.get_legend_handles_labels(), loc="outside upper left", ncols=4, handletextpad=0.4
    )


def named_places(axes: Axes, names: Iterable[str]) -> None:
    """Name the places 0, 1, … of the horizontal axis, without lines at them."""
    labels = list(names)
    axes.set_xticks(range(len(labels)), labels)
    axes.set_xlim(-0.55, len(labels) - 0.45)
    axes.tick_params(axis="x", length=0)
    axes.grid(visible=False, axis="x")


def note(axes: Axes, text: str) -> None:
    """Write a short remark above the axes, at the right."""
    axes.set_title(text, loc="right", fontsize=8, color=GREY)
