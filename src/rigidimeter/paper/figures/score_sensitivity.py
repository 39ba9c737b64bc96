"""How a score changes with damping and stiffness (Fig. 6)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidimeter.reporting.style import GREY, note, styled

__all__ = ["sensitivity"]

_LOOKS = (
    {"color": "#0072B2", "marker": "o", "linestyle": "-"},
    {"color": "#D55E00", "marker": "s", "linestyle": "-"},
)
_ENLARGED = (
    {"color": "#D55E00", "marker": "s", "linestyle": "-"},
    {"color": "#009E73", "marker": "^", "linestyle": "--"},
    {"color": "#CC79A7", "marker": "v", "linestyle": "--", "markersize": 7.0},
    {"color": "#222222", "marker": "o", "linestyle": ":", "markersize": 2.5},
)

_Curves = Mapping[str, Sequence[float]]


def sensitivity(
    score: str,
    percents: Sequence[float],
    changes_percent: _Curves,
    enlarged_percent: _Curves | None = None,
    remark: str = "",
) -> Figure:
    """Draw the change of a score against the value of a parameter, both in percent.

    Parameters
    ----------
    score : str
        What changes, as the axis says it.
    percents : sequence of float
        The parameter, in percent of its nominal value.
    changes_percent : mapping of str to sequence of float
        By the name in the legend, one value for each of `percents`; two at most.
    enlarged_percent : mapping of str to sequence of float, optional
        More of them, in a panel of their own with its own scale; four at most.
    remark : str
        A few words above that panel.
    """
    with styled():
        figure = Figure(figsize=(7.4, 3.4))
        panels = list(figure.subplots(1, 2 if enlarged_percent else 1, squeeze=False)[0])
        _draw(panels[0], percents, changes_percent, _LOOKS)
        panels[0].set_ylabel(f"Change in {score} (%)")
        panels[0].legend(loc="upper left")
        if enlarged_percent:
            _draw(panels[1], percents, enlarged_percent, _ENLARGED)
            largest = max(abs(change) for values in enlarged_percent.values() for change in values)
            panels[1].set_ylim(-1.2 * largest, 2.2 * largest)
            panels[1].legend(loc="upper right")
            note(panels[1], remark)
    return figure


def _draw(
    axes: Axes, percents: Sequence[float], curves: _Curves, looks: Sequence[Mapping[str, object]]
) -> None:
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    for (name, changes), look in zip(curves.items(), looks, strict=False):
        axes.plot(percents, changes, label=name, **{"markersize": 4.5, **look})  # type: ignore[arg-type]
    axes.set_xticks(percents)
    axes.set_xlabel("Parameter (% of nominal)")
