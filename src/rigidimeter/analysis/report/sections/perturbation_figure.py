"""The torque perturbation: over time (Fig. 4a) and its power spectrum (Fig. 3b)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from numpy.typing import NDArray
from scipy import signal

from rigidimeter.analysis.report.contents import Block, Figure, Section
from rigidimeter.analysis.report.representative import origin_s
from rigidimeter.analysis.report.style import GREY, INK, note, plain_ticks, styled
from rigidimeter.analysis.study import StudyResult
from rigidimeter.analysis.study.examples import perturbed_epoch
from rigidimeter.core.records import Channel
from rigidimeter.core.words import condition_name, number, short_names

_BAND = "#009E73"


def _blocks(result: StudyResult) -> Iterator[Block]:
    epoch = perturbed_epoch(result)
    if epoch is None:
        return
    channel = epoch.channels["perturbation_nm"]
    prbs = result.settings.prbs
    low, high = epoch.excitation_hz or (prbs.wanted_low_hz, prbs.wanted_high_hz)
    where = short_names(one.source for one in result.epochs)[epoch.source]
    whose = f"of epoch {epoch.label} of {where} ({condition_name(epoch.condition)})"
    size_nm = float(np.max(np.abs(channel.values)))
    yield Figure(
        "perturbation",
        f"The commanded torque perturbation {whose}.",
        f"Torque perturbation {whose}: it switches between levels up to {number(size_nm)} N·m "
        f"for {number(channel.time_s[-1] - channel.time_s[0])} s.",
        partial(perturbation, channel, origin_s(epoch)),
    )
    yield Figure(
        "perturbation_spectrum",
        f"Its power spectral density (Hann-windowed periodogram of the complete perturbation), "
        f"with the intended band of {low:g} to {high:g} Hz.",
        f"Power spectral density of the perturbation, with the intended band, {low:g} to "
        f"{high:g} Hz, marked.",
        partial(spectrum, channel, (low, high)),
    )


def changes(channel: Channel) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the stamps and values at which a held signal changes, and its first and last."""
    values = channel.values
    keep = np.ones(values.size, dtype=bool)
    keep[1:-1] = values[1:-1] != values[:-2]
    return channel.time_s[keep], values[keep]


def perturbation(channel: Channel, origin_s: float, first_s: float = 7.0) -> Drawing:
    """Draw the perturbation, its first seconds above and all of it below.

    Parameters
    ----------
    channel : Channel
        `perturbation_nm`, at least two samples.
    origin_s : float
        What the time axis counts from, on the channel's clock.
    first_s : float
        How much of it the upper panel shows.
    """
    with styled():
        figure = Drawing(figsize=(7.4, 3.1))
        draw_perturbation(figure.subplots(2, 1), channel, origin_s, first_s)
    return figure


def draw_perturbation(
    panels: Sequence[Axes], channel: Channel, origin_s: float, first_s: float = 7.0
) -> None:
    """Draw `perturbation` on two axes."""
    time_s, values = changes(channel)
    time_s = time_s - origin_s
    above, below = panels
    for axes in (above, below):
        axes.step(time_s, values, where="post", color=INK, linewidth=0.9)
        axes.set_ylabel("Perturbation\n(N·m)")
    above.set_xlim(time_s[0], min(time_s[0] + first_s, time_s[-1]))
    below.set_xlim(time_s[0], time_s[-1])
    below.set_xlabel("Time since the start of the epoch (s)")
    note(above, f"first {min(first_s, time_s[-1] - time_s[0]):.3g} s")
    note(below, "complete")


def spectrum(channel: Channel, wanted_hz: tuple[float, float]) -> Drawing:
    """Draw the one-sided power spectral density with the wanted band marked.

    From a Hann-windowed periodogram; the perturbation is held between its samples.

    Parameters
    ----------
    channel : Channel
        `perturbation_nm`, at least 16 samples, not constant.
    wanted_hz : (float, float)
        The band that the perturbation is meant to excite.
    """
    with styled():
        figure = Drawing(figsize=(7.4, 2.7))
        draw_spectrum(figure.add_subplot(), channel, wanted_hz)
    return figure


def draw_spectrum(axes: Axes, channel: Channel, wanted_hz: tuple[float, float]) -> None:
    """Draw `spectrum` on axes."""
    rate_hz = channel.rate_hz
    count = int((channel.time_s[-1] - channel.time_s[0]) * rate_hz) + 1
    grid = channel.time_s[0] + np.arange(count) / rate_hz
    # A hundredth of a sample of rounding must not hold the value before.
    index = np.searchsorted(channel.time_s, grid + 0.01 / rate_hz, side="right") - 1
    frequency_hz, density = signal.periodogram(channel.values[index], rate_hz, window="hann")
    low, high = wanted_hz
    shown = (frequency_hz > 0) & (frequency_hz <= max(4 * high, 5 * frequency_hz[1]))
    frequency_hz, density = frequency_hz[shown], density[shown]
    axes.axvspan(low, high, color=_BAND, alpha=0.12, linewidth=0)
    floor = density.max() * 1e-5
    axes.loglog(frequency_hz, np.maximum(density, floor), color=INK, linewidth=0.8)
    axes.set_ylim(floor, density.max() * 6)
    axes.set_xlim(min(frequency_hz[0], low / 2), max(frequency_hz[-1], 2 * high))
    axes.set_xlabel("Frequency (Hz)")
    axes.set_ylabel("Power spectral density\n((N·m)²/Hz)")
    plain_ticks(axes.xaxis, axes.yaxis)
    axes.grid(visible=False, which="minor")
    _label_band(axes, low, high)


def _label_band(axes: Axes, low: float, high: float) -> None:
    axes.text(
        float(np.sqrt(low * high)),
        0.97,
        f"intended: {low:g} to {high:g} Hz",
        transform=axes.get_xaxis_transform(),
        ha="center",
        va="top",
        fontsize=8,
        color=GREY,
    )


SECTION = Section("perturbation", "Perturbation", _blocks)
