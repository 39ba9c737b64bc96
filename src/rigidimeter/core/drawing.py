"""What `plot` of a result calls: the drawings of the page, imported when one is asked for.

The one import from below to above: whoever has a result can draw it, and nothing else loads
matplotlib.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rigidimeter.analysis.report import plots

__all__ = ["Axes", "plots"]


def __getattr__(name: str) -> Any:
    if name != "plots":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from rigidimeter.analysis.report import plots

    return plots
