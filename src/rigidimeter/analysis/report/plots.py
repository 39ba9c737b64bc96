"""The drawings of the page on Axes of matplotlib, for the `plot` of each result.

Without Axes of the caller a figure of pyplot is made, so that a notebook shows it, in the style of
the page. Nothing else of matplotlib's global state changes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from rigidimeter.analysis.estimation import aligned, epoch_signals
from rigidimeter.analysis.estimation.stretches import longest_part
from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.report.curves import (
    TORQUE_HEIGHTS,
    TORQUE_SIZE,
    draw_perturbation,
    draw_recorded,
    draw_spectrum,
    draw_torque,
    origin_s,
    recorded_size,
    shown_channels,
    torque_limit_nm,
)
from rigidimeter.analysis.report.estimate_points import draw_epochs, draw_pairs, quantities
from rigidimeter.analysis.report.interval_rows import draw_effects, effects_label, effects_size
from rigidimeter.analysis.report.points import draw_comparison, draw_days
from rigidimeter.analysis.report.style import condition_colours, drawable, styled
from rigidimeter.analysis.study import Comparison, StudyResult
from rigidimeter.core.records import Analysis, Channel, Epoch, Fit
from rigidimeter.core.words import condition_name, short_names
from rigidimeter.planning import Design, tick_times_s

Panels = NDArray[Any]
_One = TypeVar("_One", Epoch, Fit)


@contextmanager
def _panels(
    given: Any, count: int, size: tuple[float, float], columns: int = 1, **options: Any
) -> Iterator[list[Axes]]:
    """Yield the Axes of the caller, or those of a new figure."""
    if given is not None:
        panels = list(np.ravel(np.asarray(given, dtype=object)))
        if len(panels) != count:
            raise ValueError(f"this draws {count} panels; got {len(panels)} Axes")
        with mpl.rc_context({"text.parse_math": False}):  # a condition may be called "$5"
            yield panels
        return
    import matplotlib.pyplot as plt

    with styled():
        rows, columns = -(-count // columns), min(columns, count)
        figure, made = plt.subplots(rows, columns, figsize=size, squeeze=False, **options)
        try:
            panels = list(made.ravel())
            for unused in panels[count:]:
                unused.remove()
            yield panels[:count]
            figure.align_ylabels()
            figure.draw_without_rendering()  # ticks that are made later have the user's style
        except BaseException:
            plt.close(figure)
            raise


def plot_recording(recording: Recording, epoch: int, span_s: float | None, axes: Any) -> Panels:
    """Draw the channels of an epoch as they were recorded."""
    one = _at(recording.epochs, epoch)
    shown = {name: channel for name, channel in shown_channels(one).items() if len(channel)}
    if not shown:
        raise ValueError(f"{one.name} has no torque, angle, velocity or perturbation")
    begins_s = origin_s(one)
    length_s = max(float(channel.time_s[-1]) for channel in shown.values()) - begins_s
    span_s = length_s if span_s is None else min(span_s, length_s)
    with _panels(axes, len(shown), recorded_size(len(shown)), sharex=True) as panels:
        draw_recorded(panels, shown, begins_s, span_s)
        sources = short_names(each.source for each in recording.epochs)
        panels[0].set_title(_title(one.label, sources[one.source], one.condition), loc="left")
    return np.array(panels)


def plot_fit(fit: Fit, axes: Any) -> Panels:
    """Draw J, B and K in pairs."""
    _need_numbers(fit)
    with _panels(axes, 3, (7.4, 2.7), columns=3) as panels:
        draw_pairs(panels, fit)
    return np.array(panels)


def plot_estimates(analysis: Analysis, axes: Any) -> Panels:
    """Draw each quantity of every epoch."""
    results = analysis.fits or analysis.scores
    if not results:
        raise ValueError("no epoch was estimated, so there is nothing to plot")
    shown = quantities(analysis)
    with _panels(axes, len(shown), (7.4, 0.7 + 1.6 * len(shown)), sharex=True) as panels:
        draw_epochs(panels, results, shown)
    return np.array(panels)


def plot_torque(
    analysis: Analysis, recording: Recording, epoch: int, span_s: float | None, axes: Any
) -> Panels:
    """Draw the measured and the modelled torque of an epoch, and the terms of the model."""
    if not isinstance(recording, Recording):
        raise ValueError(f"recording must be what rigidimeter.read returned, not {recording!r}")
    fit = _at(analysis.fits, epoch)
    _need_numbers(fit)
    key = fit.source, fit.epoch
    own = next((each for each in recording.epochs if (each.source, each.label) == key), None)
    if own is None:
        raise ValueError(
            f"the recording has no epoch {fit.epoch} of {fit.source}; give the one that was "
            "estimated"
        )
    own = aligned(longest_part(own), analysis.delays)
    signals = epoch_signals(own, fit.method, recording.settings.estimation)
    window_s = float(signals.time_s[-1] - signals.time_s[0]) if span_s is None else span_s
    name = condition_name(fit.condition)
    with _panels(axes, 5, TORQUE_SIZE, sharex=True, height_ratios=TORQUE_HEIGHTS) as panels:
        limit_nm = torque_limit_nm(signals, fit, window_s)
        colour = condition_colours([name])[name]
        draw_torque(panels, signals, fit, colour, origin_s(own), limit_nm, window_s)
        sources = short_names(each.source for each in recording.epochs)
        which = _title(fit.epoch, sources[fit.source], fit.condition)
        panels[0].set_title(f"Torque of {which}", loc="left")
    return np.array(panels)


def plot_result(result: StudyResult, measures: Sequence[str] | None, axes: Any) -> Panels:
    """Draw every value of each measure by condition."""
    compared = [_compared(result, name) for name in measures or ()] or [
        c for c in result.comparisons if c.measure.origin != "ratings" and c.observations
    ]
    if not compared:
        raise ValueError("the comparison has no values to plot")
    colours = condition_colours(result.condition_names)
    rows = -(-len(compared) // 3)
    with _panels(axes, len(compared), (7.4, 0.2 + 2.6 * rows), columns=3) as panels:
        for one, c in zip(panels, compared, strict=True):
            draw_comparison([one], c, colours)
    return np.array(panels)


def plot_days(result: StudyResult, measure: str, ax: Any) -> Axes:
    """Draw a measure day by day."""
    c = _compared(result, measure)
    if not c.day_medians:
        raise ValueError(f"{measure} has no days: they are known of a study folder alone")
    order = [condition_name(name) for name in result.condition_names]
    with _panels(ax, 1, (7.4, 2.9)) as panels:
        draw_days(panels, c, order)
    return panels[0]


def plot_effects(result: StudyResult, ax: Any) -> Axes:
    """Draw the effect size of each measure with its interval."""
    found = [(c, c.effects) for c in result.comparisons if c.effects is not None]
    if not found:
        why = next((c.remark for c in result.comparisons if c.remark), "nothing was compared")
        raise ValueError(f"no measure has an effect size: {why}")
    with _panels(ax, 1, effects_size(len(found))) as panels:
        draw_effects(panels, found, effects_label(result))
    return panels[0]


def plot_design(design: Design, axes: Any) -> Panels:
    """Draw the perturbation, its beginning and complete, and its spectrum."""
    prbs, rate_hz = design.settings.prbs, design.settings.rig.tick_rate_hz
    values = design.perturbation_nm
    channel = Channel("perturbation_nm", tick_times_s(values.size, rate_hz), values)
    with _panels(axes, 3, (7.4, 5.8), height_ratios=(1.0, 1.0, 1.8)) as panels:
        draw_perturbation(panels[:2], channel, 0.0)
        draw_spectrum(panels[2:], channel, (prbs.wanted_low_hz, prbs.wanted_high_hz))
    return np.array(panels)


def _at(each: Sequence[_One], place: int) -> _One:
    if not isinstance(place, int) or not 0 <= place < len(each):
        raise IndexError(f"epoch {place!r}: give its place, from 0 to {len(each) - 1}")
    return each[place]


def _need_numbers(fit: Fit) -> None:
    if not np.all(np.isfinite(fit.value)):
        reason = fit.outcome.reason or fit.outcome.kind
        raise ValueError(f"epoch {fit.epoch} of {fit.source} has no J, B and K: {reason}")


def _compared(result: StudyResult, measure: str) -> Comparison:
    found = result.comparison(measure)
    if found is None or not found.observations:
        known = ", ".join(c.measure.name for c in result.comparisons if c.observations)
        raise ValueError(f"{measure!r} was not compared; compared were {known}")
    return found


def _title(epoch: str, source: str, condition: str) -> str:
    return drawable(f"epoch {epoch} of {source}" + (f", {condition}" if condition else ""))
