"""The paper's figures that the report does not draw: arrays in, a matplotlib figure out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from rigidimeter.analysis.figures import GREY, note, styled
from rigidimeter.model import JointDynamics

_BODE = (("#222222", "-"), ("#0072B2", (0, (1, 1.5))), ("#D55E00", "--"), ("#009E73", "-."))
"""Colour and dashes of each arm."""

_LEFT = [("#0072B2", "o-", 4.5), ("#D55E00", "s-", 4.5)]
_ENLARGED = [
    ("#D55E00", "s-", 4.5),
    ("#009E73", "^--", 4.5),
    ("#CC79A7", "v--", 7.0),
    ("#222222", "o:", 2.5),
]
"""Colour, marker with line, and size of the marker of each curve."""

_TRACES = {
    "measured": ("#C4C4C4", 4.0, "-"),
    "estimated": ("#E69F00", 2.2, "-"),
    "simulated": ("#222222", 0.9, (0, (4, 3))),
}
"""Colour, width and dashes: lines that coincide show beside each other, in grey print too."""

Curves = Mapping[str, Sequence[float]]


def arm_bode(arms: Mapping[str, JointDynamics]) -> Drawing:
    """Draw magnitude and phase of θ/M for each arm, with its −3 dB frequency as a dot (Fig. 3a).

    Parameters
    ----------
    arms : mapping of str to JointDynamics
        By the name in the legend; at most four.
    """
    frequency_hz = np.geomspace(0.1, 100.0, 600)
    with styled():
        figure = Drawing(figsize=(7.4, 5.0))
        above, below = figure.subplots(2, 1, sharex=True)
        for (name, arm), (colour, line) in zip(arms.items(), _BODE, strict=False):
            corner_hz = arm.bandwidth_hz()
            label = f"{name}: −3 dB at {corner_hz:.2f} Hz"
            response = arm.compliance_rad_nm(frequency_hz)
            at_corner = arm.compliance_rad_nm(corner_hz)
            decibel = 20.0 * np.log10(np.abs(response))
            phase = np.degrees(np.unwrap(np.angle(response)))
            above.semilogx(frequency_hz, decibel, color=colour, linestyle=line, label=label)
            below.semilogx(frequency_hz, phase, color=colour, linestyle=line)
            above.plot(corner_hz, 20.0 * np.log10(np.abs(at_corner)), "o", color=colour, ms=5)
            below.plot(corner_hz, np.degrees(np.angle(at_corner)), "o", color=colour, ms=5)
        above.set_ylabel("|θ/M| (dB re 1 rad/N·m)")
        above.legend(loc="lower left")
        note(above, "dots: 3 dB below the value at rest")
        note(below, "one factor on J, B and K leaves the phase as it is: two curves coincide")
        below.set_ylabel("Phase (deg)")
        below.yaxis.set_major_locator(MultipleLocator(45.0))
        below.set_ylim(-185.0, 5.0)
        below.axhline(-180.0, color=GREY, linewidth=0.8)
        below.set_xlabel("Frequency (Hz)")
        for axes in (above, below):
            axes.grid(visible=False, which="minor")
    return figure


def sensitivity_plot(
    score: str, percents: Sequence[float], changes: Curves, enlarged: Curves | None = None
) -> Drawing:
    """Draw the change of a score against the value of a parameter, both in percent (Fig. 6).

    Parameters
    ----------
    score : str
        What changes, as the axis says it.
    percents : sequence of float
        The parameter, in percent of its nominal value.
    changes : mapping of str to sequence of float
        By the name in the legend, one value for each of `percents`; two at most.
    enlarged : mapping of str to sequence of float, optional
        Changes with the stiffness, in a panel of their own with its own scale; four at most.
    """
    with styled():
        figure = Drawing(figsize=(7.4, 3.4))
        panels = [(changes, _LEFT)] + ([(enlarged, _ENLARGED)] if enlarged else [])
        for axes, (curves, looks) in zip(
            figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True
        ):
            axes.axhline(0.0, color=GREY, linewidth=0.8)
            for (name, values), (colour, line, size) in zip(curves.items(), looks, strict=False):
                axes.plot(percents, values, line, color=colour, markersize=size, label=name)
            axes.set_xticks(percents)
            axes.set_xlabel("Parameter (% of nominal)")
            axes.legend(loc="upper left" if curves is changes else "upper right")
        figure.axes[0].set_ylabel(f"Change in {score} (%)")
        if enlarged:
            largest = max(abs(change) for values in enlarged.values() for change in values)
            figure.axes[1].set_ylim(-1.2 * largest, 2.2 * largest)
            note(figure.axes[1], "stiffness K, enlarged")
    return figure


def torque_traces(
    time_s: NDArray[np.float64],
    torques_nm: Mapping[str, NDArray[np.float64]],
    limit_nm: float,
    remark: str,
) -> Drawing:
    """Draw torques of one epoch over each other (Fig. 4b to 4d).

    Parameters
    ----------
    time_s : array, shape (n,)
        Since the start of the epoch.
    torques_nm : mapping of str to array, shape (n,)
        ``measured``, ``estimated``, ``simulated``, or some of them, the widest line first.
    limit_nm : float
        How far the torque axis reaches either way.
    remark : str
        A few words above the axes.
    """
    with styled():
        figure = Drawing(figsize=(7.4, 2.5))
        axes = figure.add_subplot()
        for name, values in torques_nm.items():
            colour, width, dashes = _TRACES[name]
            axes.plot(time_s, values, color=colour, linewidth=width, linestyle=dashes, label=name)
        axes.set_xlim(time_s[0], time_s[-1])
        axes.set_ylim(-1.1 * limit_nm, 1.3 * limit_nm)
        axes.set_xlabel("Time since the start of the epoch (s)")
        axes.set_ylabel("Torque (N·m)")
        axes.legend(loc="upper right", ncols=len(torques_nm), borderaxespad=0.1)
        note(axes, remark)
    return figure
