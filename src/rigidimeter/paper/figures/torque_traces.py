"""Torques of one epoch over each other (Fig. 4b to 4d)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rigidimeter.reporting.style import note, styled

__all__ = ["traces"]

_LOOKS = {
    "measured": ("#C4C4C4", 4.0, "-"),
    "estimated": ("#E69F00", 2.2, "-"),
    "simulated": ("#222222", 0.9, (0, (4, 3))),
}
"""Colour, width and dashes: lines that coincide show beside each other, in grey print too."""


def traces(
    time_s: NDArray[np.float64],
    torques_nm: Mapping[str, NDArray[np.float64]],
    limit_nm: float,
    remark: str,
) -> Figure:
    """Draw torques over the time since the start of the epoch.

    Parameters
    ----------
    time_s : array, shape (n,)
    torques_nm : mapping of str to array, shape (n,)
        ``measured``, ``estimated``, ``simulated``, or some of them, the widest line first.
    limit_nm : float
        How far the torque axis reaches either way.
    remark : str
        A few words above the axes.
    """
    with styled():
        figure = Figure(figsize=(7.4, 2.5))
        axes = figure.add_subplot()
        for name, values in torques_nm.items():
            colour, width, dashes = _LOOKS[name]
            axes.plot(time_s, values, color=colour, linewidth=width, linestyle=dashes, label=name)
        axes.set_xlim(time_s[0], time_s[-1])
        axes.set_ylim(-1.1 * limit_nm, 1.3 * limit_nm)
        axes.set_xlabel("Time since the start of the epoch (s)")
        axes.set_ylabel("Torque (N·m)")
        axes.legend(loc="upper right", ncols=len(torques_nm), borderaxespad=0.1)
        note(axes, remark)
    return figure
