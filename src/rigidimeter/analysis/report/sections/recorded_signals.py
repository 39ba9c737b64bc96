"""Perturbation, torque and angle of one epoch as they were recorded, without any filter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from rigidimeter.analysis.report.contents import Block, Figure, Section
from rigidimeter.analysis.report.representative import origin_s, place
from rigidimeter.analysis.report.style import INK, styled
from rigidimeter.analysis.study import StudyResult
from rigidimeter.analysis.study.examples import analysed_epoch, representative_fits
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.words import condition_name, series

WINDOW_S = 7.0
_PANELS = {
    "perturbation_nm": ("Perturbation", "Perturbation\n(N·m)"),
    "torque_nm": ("torque", "Torque\n(N·m)"),
    "angle_rad": ("angle", "Angle\n(deg)"),
    "velocity_rad_s": ("velocity", "Velocity\n(deg/s)"),
}


def _blocks(result: StudyResult) -> Iterator[Block]:
    for fit in representative_fits(result):
        epoch = analysed_epoch(result, fit)
        if epoch is None:
            continue
        shown = shown_channels(epoch)
        names = series([_PANELS[name][0] for name in shown])
        names = names[:1].upper() + names[1:]
        which = f"{condition_name(fit.condition)}, {place(result, fit)}"
        yield Figure(
            "recorded",
            f"{names} as recorded, not filtered; the first {WINDOW_S:g} s of {which}.",
            f"{names} over the first {WINDOW_S:g} s of {which}.",
            partial(recorded, shown, origin_s(epoch)),
        )
        return


def shown_channels(epoch: Epoch) -> dict[str, Channel]:
    """Return the channels that are drawn: the velocity only where there is no angle."""
    shown = {name: epoch.channels[name] for name in _PANELS if name in epoch.channels}
    if "angle_rad" in shown:
        shown.pop("velocity_rad_s", None)
    return shown


def recorded(channels: Mapping[str, Channel], start_s: float, span_s: float = WINDOW_S) -> Drawing:
    """Draw a panel for each channel, from the start of the epoch on; the perturbation is held."""
    with styled():
        figure = Drawing(figsize=recorded_size(len(channels)))
        panels = np.atleast_1d(figure.subplots(len(channels), 1, sharex=True))
        draw_recorded(list(panels), channels, start_s, span_s)
        figure.align_ylabels()
    return figure


def recorded_size(panels: int) -> tuple[float, float]:
    """Return the size of the figure in inches."""
    return 7.4, 0.4 + 1.15 * panels


def draw_recorded(
    panels: Sequence[Axes], channels: Mapping[str, Channel], start_s: float, span_s: float
) -> None:
    """Draw each channel on axes of its own."""
    for axes, (name, channel) in zip(panels, channels.items(), strict=True):
        # One sample beyond the end: a held or slow channel reaches the edge of the axes.
        stop = int(np.searchsorted(channel.time_s, start_s + span_s)) + 1
        time_s, values = channel.time_s[:stop] - start_s, channel.values[:stop]
        if channel.unit.startswith("rad"):
            values = np.degrees(values)
        held = name == "perturbation_nm"
        axes.plot(
            time_s,
            values,
            drawstyle="steps-post" if held else "default",
            color=INK,
            linewidth=0.9,
        )
        axes.set_ylabel(_PANELS[name][1])
        axes.set_xlim(0.0, span_s)
    panels[-1].set_xlabel("Time since the start of the epoch (s)")


SECTION = Section("recorded", "As recorded", _blocks)
