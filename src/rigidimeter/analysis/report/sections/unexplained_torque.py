"""The torque that the joint does not explain, over frequency: movement, tremor, noise."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import LogLocator
from numpy.typing import NDArray

from rigidimeter.analysis.report.contents import Block, Figure, Section, paragraph
from rigidimeter.analysis.report.method_words import is_least_squares
from rigidimeter.analysis.report.style import condition_colours, listed, plain_ticks, styled
from rigidimeter.analysis.study import StudyResult
from rigidimeter.analysis.study.over_frequency import unexplained_spectra
from rigidimeter.core.spectrum import SEGMENT_S
from rigidimeter.core.words import condition_name, number

Array = NDArray[np.float64]

_DOWN_TO = 1e-6
"""Densities this far below the largest are drawn at the foot of the axes."""
_NOTHING = 1e-30


def _blocks(result: StudyResult) -> Iterator[Block]:
    spectra: dict[str, list[tuple[Array, Array]]] = {}
    sizes_nm: dict[str, list[float]] = {}
    found = unexplained_spectra(result)
    for one in found:
        spectra.setdefault(one.condition, []).append((one.frequency_hz, one.density))
        sizes_nm.setdefault(one.condition, []).append(one.sd_nm)
    if not spectra:
        return
    text = Markup(
        "The torque of each epoch that J, B and K do not explain, "
        '<span class="formula">J θ″ + B θ′ + K θ − M</span>: what something but the robot adds, '
        "sensor noise, and whatever the model lacks. Voluntary movement is below 4 Hz; a tremor is "
        "a peak."
    )
    if is_least_squares(result.analysis.method):
        text += " Least squares makes this torque as small as it can, and so hides part of it."
    yield paragraph(text)
    order = [condition for condition in result.condition_names if condition in spectra]
    labels = {
        key: f"{condition_name(key)}: SD {number(float(np.median(sizes_nm[key])), 3)} N·m "
        f"(median of {len(sizes_nm[key])})"
        for key in order
    }
    band_hz = max(one.band_hz[0] for one in found), min(one.band_hz[1] for one in found)
    ranges = "; ".join(
        f"{condition_name(key)} {number(min(sizes_nm[key]), 3)} to {number(max(sizes_nm[key]), 3)}"
        for key in order
    )
    yield Figure(
        "voluntary_spectrum",
        "Thin: every included epoch. Thick: the mean of each condition. SD of the epochs, in N·m: "
        f"{ranges}.",
        f"Power spectral density of the torque that J, B and K do not explain, "
        f"{number(band_hz[0], 3)} to {number(band_hz[1], 3)} Hz. {'; '.join(labels.values())}.",
        partial(
            voluntary_spectrum,
            {key: spectra[key] for key in order},
            condition_colours(result.condition_names),
            labels,
            band_hz,
        ),
    )


def voluntary_spectrum(
    epochs: Mapping[str, Sequence[tuple[Array, Array]]],
    colours: Mapping[str, str],
    labels: Mapping[str, str],
    band_hz: tuple[float, float],
) -> Drawing:
    """Draw the spectrum of each epoch thin and the mean of each condition thick.

    Parameters
    ----------
    epochs : mapping of str to sequence of (array, array)
        Frequencies and densities of each epoch, by condition.
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
        figure = Drawing(figsize=(7.4, 3.0))
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
        plain_ticks(axes.xaxis, axes.yaxis)
        axes.grid(visible=False, which="minor")
        axes.legend(loc="lower left")
    return figure


def _within(spectrum: tuple[Array, Array], low: float, high: float) -> tuple[Array, Array]:
    frequency_hz, power = spectrum
    shown = (frequency_hz >= low) & (frequency_hz <= high)
    return frequency_hz[shown], power[shown]


SECTION = Section("voluntary", "Unexplained torque", _blocks)
