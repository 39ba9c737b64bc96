"""Torque against angle under an imposed sinusoid (Fig. 7)."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.figure import Figure

from rigidimeter.estimation import Cycles
from rigidimeter.reporting.figures.style import note, styled

__all__ = ["loop", "loop_limits"]

_POINTS = 2000
"""Enough for any number of cycles at the size of the figure."""


def loop_limits(epochs: Iterable[Cycles]) -> tuple[float, float]:
    """Return how far the axes must reach to hold these loops: angle in deg, torque in N·m."""
    sizes = [
        (float(np.max(np.abs(np.degrees(c.angle_rad)))), float(np.max(np.abs(c.torque_nm))))
        for c in epochs
    ]
    return 1.08 * max(angle for angle, _ in sizes), 1.08 * max(torque for _, torque in sizes)


def loop(cycles: Cycles, colour: str, limits: tuple[float, float], remark: str = "") -> Figure:
    """Draw the loops of an epoch; their mean area is the work per cycle.

    Parameters
    ----------
    cycles : Cycles
        The cycles that were scored.
    colour : str
        Of the condition.
    limits : (float, float)
        How far the axes reach either way, in deg and N·m; alike for all conditions.
    remark : str
        A few words above the axes.
    """
    every = slice(None, None, max(1, cycles.time_s.size // _POINTS))
    with styled():
        figure = Figure(figsize=(3.4, 3.0))
        axes = figure.add_subplot()
        axes.plot(
            np.degrees(cycles.angle_rad[every]),
            cycles.torque_nm[every],
            color=colour,
            linewidth=0.8,
        )
        axes.set_xlim(-limits[0], limits[0])
        axes.set_ylim(-limits[1], limits[1])
        axes.set_xlabel("Angle (deg)")
        axes.set_ylabel("Torque (N·m)")
        note(axes, remark)
    return figure
