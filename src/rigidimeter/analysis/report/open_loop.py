"""The open loop of the admittance on the arm: magnitude and phase, with the margins marked."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MultipleLocator
from numpy.typing import NDArray

from rigidimeter.analysis.report.style import GREY, condition_colours, drawable, note, styled
from rigidimeter.core.settings import Settings
from rigidimeter.model import Loop, Margins

_LOWEST_HZ = 0.01
_FLOOR_DB = -80.0


def bode(settings: Settings, margins: dict[str, Margins], worst: dict[str, Margins]) -> Figure:
    """Draw L(jω) for each condition, and dashed for the worst joint around each.

    Parameters
    ----------
    settings : Settings
        For the loop.
    margins, worst : dict of str to Margins
        By condition, as `rigidimeter.model.loop_stability` finds them.
    """
    colours = condition_colours(margins)
    frequency_hz = np.geomspace(_LOWEST_HZ, settings.rig.tick_rate_hz / 2.0, 1200)
    loop = Loop(settings.controller, settings.rig).at_frequency(frequency_hz)
    with styled():
        figure = Figure(figsize=(7.4, 5.4))
        above, below = figure.subplots(2, 1, sharex=True)
        _lines_of_reference(above, below)
        for name, colour in colours.items():
            for found, line, label in (
                (margins[name], "-", drawable(name)),
                (worst[name], "--", f"{drawable(name)}, worst joint"),
            ):
                label = f"{label}: {_in_numbers(found)}"
                curve = loop.gain(found.joint.parameters)
                decibel = 20.0 * np.log10(np.maximum(np.abs(curve), 1e-12))
                phase_deg = np.degrees(np.unwrap(np.angle(curve)))
                above.semilogx(frequency_hz, decibel, line, color=colour, label=label)
                seen = decibel > _FLOOR_DB  # the phase of next to nothing says nothing
                below.semilogx(frequency_hz[seen], phase_deg[seen], line, color=colour)
                _mark(above, below, found, colour, frequency_hz, phase_deg)
        above.set_ylabel("|L| (dB)")
        above.set_ylim(bottom=_FLOOR_DB)
        below.set_ylabel("Phase of L (deg)")
        above.yaxis.set_major_locator(MultipleLocator(20.0))
        below.set_ylim(-360.0, 90.0)
        below.yaxis.set_major_locator(MultipleLocator(90.0))
        below.set_xlabel("Frequency (Hz)")
        below.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        for axes in (above, below):
            axes.grid(visible=False, which="minor")
        above.legend(loc="lower left")
        note(above, "bars: gain margins, where the phase is −180 deg")
        note(below, "bars: phase margins, where |L| is 0 dB")
    return figure


def _lines_of_reference(above: Axes, below: Axes) -> None:
    above.axhline(0.0, color=GREY, linewidth=0.8)
    below.axhline(-180.0, color=GREY, linewidth=0.8)


def _in_numbers(found: Margins) -> str:
    if not found.stable:
        return "unstable"
    gain, phase = found.gain_margin_db, found.phase_margin_deg
    return ", ".join(
        f"{value:.{digits}f} {unit}" if np.isfinite(value) else f"no crossing of {where}"
        for value, digits, unit, where in ((gain, 1, "dB", "−180 deg"), (phase, 0, "deg", "0 dB"))
    )


def _mark(
    above: Axes,
    below: Axes,
    found: Margins,
    colour: str,
    frequency_hz: NDArray[np.float64],
    phase_deg: NDArray[np.float64],
) -> None:
    """Draw the gain margin as a bar up to 0 dB, the phase margin as one from ±180 deg."""
    if np.isfinite(found.gain_margin_db) and abs(found.gain_margin_db) <= -_FLOOR_DB:
        above.plot(
            [found.gain_margin_hz] * 2,
            [0.0, -found.gain_margin_db],
            color=colour,
            marker="_",
            linewidth=2.0,
            alpha=0.7,
        )
    if np.isfinite(found.phase_margin_deg):
        there = float(np.interp(found.phase_margin_hz, frequency_hz, phase_deg))
        below.plot(
            [found.phase_margin_hz] * 2,
            [there - found.phase_margin_deg, there],
            color=colour,
            marker="_",
            linewidth=2.0,
            alpha=0.7,
        )
