"""The torque that the joint does not explain, over frequency: movement, tremor, noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator
from numpy.typing import NDArray
from scipy import signal

from rigidimeter.reporting.figures.style import listed, styled

__all__ = ["density", "voluntary_spectrum"]

Array = NDArray[np.float64]

SEGMENT_S = 5.0
"""Of Welch's method: lines 0.2 Hz apart, which tells a tremor from the movements below it."""

_DOWN_TO = 1e-6
"""Densities this far below the largest are drawn at the foot of the axes."""
_NOTHING = 1e-30


def density(torque_nm: Array, rate_hz: float) -> tuple[Array, Array]:
    """Return frequencies in Hz and the one-sided power spectral density in (N·m)²/Hz."""
    segment = min(torque_nm.size, max(round(SEGMENT_S * rate_hz), 8))
    frequency_hz, power = signal.welch(torque_nm, rate_hz, nperseg=segment)
    return frequency_hz, power


def voluntary_spectrum(
    epochs: Mapping[str, Sequence[tuple[Array, Array]]],
    colours: Mapping[str, str],
    labels: Mapping[str, str],
    band_hz: tuple[float, float],
) -> Figure:
    """Draw the spectrum of each epoch thin and the mean of each condition thick.

    Parameters
    ----------
    epochs : mapping of str to sequence of (array, array)
        Frequencies and densities of each epoch, by condition, as `density` gives them.
    colours, labels : mapping of str to str
        By condition.
    band_hz : (float, float)
        What is shown: outside of it the signals were filtered away.
    """
    low, high = band_hz
    inside = {
        condition: [_within(spectrum, low, high) for spectrum in spectra]
        for condition, spectra in epochs.items()
    }
    heights = np.concatenate([power for spectra in inside.values() for _, power in spectra])
    # Without any torque left there is still a figure: a line at its foot.
    floor = max(float(np.max(heights, initial=0.0)) * _DOWN_TO, _NOTHING)
    with styled():
        figure = Figure(figsize=(7.4, 3.0))
        axes = figure.add_subplot()
        for condition, spectra in inside.items():
            colour = colours[condition]
            for frequency_hz, power in spectra:
                drawn = np.maximum(power, floor)
                axes.loglog(frequency_hz, drawn, color=colour, linewidth=0.5, alpha=0.35)
            grid, _ = spectra[0]
            mean = np.mean([np.interp(grid, f, power) for f, power in spectra], axis=0)
            axes.loglog(
                grid,
                np.maximum(mean, floor),
                color=colour,
                linewidth=1.8,
                label=listed(labels[condition]),
            )
        axes.set_xlim(max(low, 1 / SEGMENT_S), high)
        axes.set_xlabel("Frequency (Hz)")
        axes.set_ylabel("Power spectral density\n((N·m)²/Hz)")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.grid(visible=False, which="minor")
        axes.legend(loc="lower left")
    return figure


def _within(spectrum: tuple[Array, Array], low: float, high: float) -> tuple[Array, Array]:
    frequency_hz, power = spectrum
    shown = (frequency_hz >= low) & (frequency_hz <= high)
    return frequency_hz[shown], power[shown]
