"""The compliance of an arm over frequency, −3 dB marked (Fig. 3a)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MultipleLocator

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.reporting.style import GREY, note, styled

__all__ = ["arm_bode"]

_COLOURS = ("#222222", "#0072B2", "#D55E00", "#009E73")
_DASHES = ("-", (0, (1, 1.5)), "--", "-.")


def arm_bode(arms: Mapping[str, JointDynamics]) -> Figure:
    """Draw magnitude and phase of θ/M for each arm, with its −3 dB frequency as a dot.

    Parameters
    ----------
    arms : mapping of str to JointDynamics
        By the name in the legend; at most four.
    """
    frequency_hz = np.geomspace(0.1, 100.0, 600)
    with styled():
        figure = Figure(figsize=(7.4, 5.0))
        above, below = figure.subplots(2, 1, sharex=True)
        for (name, arm), colour, line in zip(arms.items(), _COLOURS, _DASHES, strict=False):
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
        below.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        for axes in (above, below):
            axes.grid(visible=False, which="minor")
    return figure
