"""The drawings of the page on Axes of matplotlib, for the `plot` of each result.

Without Axes of the caller a figure of pyplot is made, so that a notebook shows it, in the style of
the page. Nothing else of matplotlib's global state changes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeVar, overload

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from rigidimeter.analysis.estimation import aligned, epoch_signals, longest_part
from rigidimeter.analysis.figures.curves import (
    EXCITATION_HEIGHTS,
    EXCITATION_SIZE,
    TORQUE_HEIGHTS,
    TORQUE_SIZE,
    draw_excitation,
    draw_recorded,
    draw_torque,
    origin_s,
    recorded_size,
    shown_channels,
    torque_limit_nm,
)
from rigidimeter.analysis.figures.estimate_points import draw_epochs, draw_pairs, quantities
from rigidimeter.analysis.figures.interval_rows import (
    draw_effects,
    effect_rows,
    effects_label,
    effects_size,
)
from rigidimeter.analysis.figures.points import (
    Values,
    draw_days,
    draw_measures,
    drawn_values,
    values_of,
)
from rigidimeter.analysis.figures.style import condition_colours, drawable, plain_ticks, styled
from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.study import StudyResult, measures_of
from rigidimeter.core.records import Analysis, Channel, Epoch, Fit
from rigidimeter.core.words import condition_name, epoch_name, short_names
from rigidimeter.planning import Design, tick_times_s

Panels = NDArray[Any]
_One = TypeVar("_One", Epoch, Fit)


def _plotted(
    given: Any,
    count: int,
    size: tuple[float, float],
    draw: Callable[..., None],
    *arguments: Any,
    columns: int = 1,
    title: str = "",
    **options: Any,
) -> Panels:
    """Draw on the Axes of the caller, or on those of a new figure, and return them."""
    if given is not None:
        panels = list(np.ravel(np.asarray(given, dtype=object)))
        if len(panels) != count:
            raise ValueError(f"this draws {count} panels; got {len(panels)} Axes")
        with mpl.rc_context({"text.parse_math": False}):  # a condition may be called "$5"
            _draw(panels, draw, arguments, title)
        return np.array(panels)
    import matplotlib.pyplot as plt

    # A backend sets global state as it is loaded (a notebook's: interactive, and what shows the
    # figures of a cell), which `styled` would undo for good. It is loaded before.
    plt.switch_backend(mpl.get_backend())
    with styled():
        rows, columns = -(-count // columns), min(columns, count)
        figure, made = plt.subplots(rows, columns, figsize=size, squeeze=False, **options)
        try:
            panels, unused = made.ravel()[:count], made.ravel()[count:]
            for each in unused:
                each.remove()
            _draw(list(panels), draw, arguments, title)
            figure.align_ylabels()
            figure.draw_without_rendering()  # ticks that are made later have the user's style
        except BaseException:
            plt.close(figure)
            raise
    return np.array(panels)


def _draw(
    panels: list[Axes], draw: Callable[..., None], arguments: Sequence[Any], title: str
) -> None:
    draw(panels, *arguments)
    plain_ticks(panels)
    if title:
        panels[0].set_title(drawable(title), loc="left")


def plot_recording(
    recording: Recording, epoch: int = 0, span_s: float | None = None, axes: Any = None
) -> Panels:
    """Draw the channels of an epoch as they were recorded."""
    one = _at(recording.epochs, epoch)
    shown = {name: channel for name, channel in shown_channels(one).items() if len(channel)}
    if not shown:
        raise ValueError(f"{one.name} has no torque, angle, velocity or perturbation")
    begins_s = origin_s(one)
    length_s = max(float(channel.time_s[-1]) for channel in shown.values()) - begins_s
    span_s = length_s if span_s is None else min(span_s, length_s)
    title = _title(recording, one.source, one.label, one.condition)
    size = recorded_size(len(shown))
    drawing = draw_recorded, shown, begins_s, span_s
    return _plotted(axes, len(shown), size, *drawing, title=title, sharex=True)


def plot_fit(fit: Fit, axes: Any = None) -> Panels:
    """Draw J, B and K in pairs."""
    _need_numbers(fit)
    return _plotted(axes, 3, (7.4, 2.7), draw_pairs, fit, columns=3)


def plot_estimates(analysis: Analysis, axes: Any = None) -> Panels:
    """Draw each quantity of every epoch."""
    results = analysis.fits or analysis.scores
    if not results:
        raise ValueError("no epoch was estimated, so there is nothing to plot")
    shown = quantities(analysis)
    size = 7.4, 0.7 + 1.6 * len(shown)
    return _plotted(axes, len(shown), size, draw_epochs, results, shown, sharex=True)


def plot_torque(
    analysis: Analysis,
    recording: Recording,
    epoch: int = 0,
    span_s: float | None = 7.0,
    axes: Any = None,
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
    signals = epoch_signals(own, recording.settings, fit.method)
    window_s = float(signals.time_s[-1] - signals.time_s[0]) if span_s is None else span_s
    name = condition_name(fit.condition)
    limit_nm = torque_limit_nm(signals, fit, window_s)
    shown = signals, fit, condition_colours([name])[name], origin_s(own), limit_nm, window_s
    title = f"Torque of {_title(recording, fit.source, fit.epoch, fit.condition)}"
    drawing = draw_torque, *shown
    heights = TORQUE_HEIGHTS
    return _plotted(axes, 5, TORQUE_SIZE, *drawing, title=title, sharex=True, height_ratios=heights)


def plot_result(
    result: StudyResult, measures: Sequence[str] | None = None, axes: Any = None
) -> Panels:
    """Draw every value of each measure by condition."""
    found = [_values(result, name) for name in measures or ()] or drawn_values(result)
    if not found:
        raise ValueError("the comparison has no values to plot")
    size = 7.4, 0.2 + 2.6 * -(-len(found) // 3)
    shown = found, condition_colours(result.condition_names)
    return _plotted(axes, len(found), size, draw_measures, *shown, columns=3)


def plot_days(result: StudyResult, measure: str = "stiffness_nm_rad", axes: Any = None) -> Axes:
    """Draw a measure day by day."""
    v = _values(result, measure)
    if v.measure.origin == "ratings" or not any(v.rows["day"]):
        raise ValueError(f"{measure} has no days: they are known of a study folder alone")
    order = [condition_name(name) for name in result.condition_names]
    drawn: Axes = _plotted(axes, 1, (7.4, 2.9), draw_days, v, order)[0]
    return drawn


def plot_effects(result: StudyResult, axes: Any = None) -> Axes:
    """Draw the effect size of each measure with its interval."""
    found = effect_rows(result)
    if not found:
        why = next((one.remark for one in result.values if one.remark), "nothing was compared")
        raise ValueError(f"no measure has an effect size: {why}")
    drawing = draw_effects, found, effects_label(result)
    drawn: Axes = _plotted(axes, 1, effects_size(len(found)), *drawing)[0]
    return drawn


def plot_design(design: Design, axes: Any = None) -> Panels:
    """Draw the perturbation, its beginning and complete, and its spectrum."""
    prbs, rate_hz = design.settings.prbs, design.settings.rig.tick_rate_hz
    values = design.perturbation_nm
    channel = Channel("perturbation_nm", tick_times_s(values.size, rate_hz), values)
    shown = channel, 0.0, (prbs.wanted_low_hz, prbs.wanted_high_hz)
    heights = EXCITATION_HEIGHTS
    return _plotted(axes, 3, EXCITATION_SIZE, draw_excitation, *shown, height_ratios=heights)


DRAWINGS: Mapping[type, Mapping[str, Callable[..., Any]]] = {
    Recording: {"": plot_recording},
    Fit: {"": plot_fit},
    Analysis: {"": plot_estimates, "torque": plot_torque},
    StudyResult: {"": plot_result, "days": plot_days, "effects": plot_effects},
    Design: {"": plot_design},
}
"""What can be drawn of what: the first of each is drawn where none is named."""


@overload
def plot(x: Any, what: Literal["days", "effects"], **options: Any) -> Axes: ...
@overload
def plot(x: Any, what: Literal["", "torque"] = "", **options: Any) -> Panels: ...
def plot(x: Any, what: str = "", **options: Any) -> Panels | Axes:
    """Draw a recording, a fit, estimates, a comparison or a design.

    Parameters
    ----------
    x : Recording, Fit, Analysis, StudyResult or Design
    what : str
        Of estimates ``"torque"``, of a comparison ``"days"`` or ``"effects"``; by default what the
        method `plot` of `x` draws.
    **options
        Those of the method of `x` that draws the same, such as `plot_days`, and `axes`.

    Returns
    -------
    array of matplotlib Axes, or Axes
        Drawn on those of `axes`, or on those of a new figure.

    Raises
    ------
    TypeError
        If there is no drawing of such an object.
    ValueError
        If there is none of this name, or nothing to draw.

    Examples
    --------
    >>> import rigidimeter as rm
    >>> panels = rm.plot(rm.data("elbow"), epoch=1, span_s=2.0)
    >>> [panel.get_ylabel().split() for panel in panels][:2]
    [['Perturbation', '(N·m)'], ['Torque', '(N·m)']]
    """
    drawings = next((one for kind, one in DRAWINGS.items() if isinstance(x, kind)), None)
    if drawings is None:
        known = ", ".join(kind.__name__ for kind in DRAWINGS)
        raise TypeError(f"plot draws {known}; got {type(x).__name__}")
    if what not in drawings:
        known = ", ".join(map(repr, drawings))
        raise ValueError(f"what = {what!r}: of {type(x).__name__} there are {known}")
    drawn: Panels | Axes = drawings[what](x, **options)
    return drawn


def _at(each: Sequence[_One], place: int) -> _One:
    if not isinstance(place, int) or not 0 <= place < len(each):
        raise IndexError(f"epoch {place!r}: give its place, from 0 to {len(each) - 1}")
    return each[place]


def _need_numbers(fit: Fit) -> None:
    if not np.all(np.isfinite(fit.value)):
        reason = fit.outcome.reason or fit.outcome.kind
        raise ValueError(f"epoch {fit.epoch} of {fit.source} has no J, B and K: {reason}")


def _values(result: StudyResult, measure: str) -> Values:
    found = {one.name: values_of(result, one) for one in measures_of(result.study.rows)}
    known = [name for name, one in found.items() if len(one.rows)]
    if measure not in known:
        raise ValueError(f"{measure!r} was not compared; compared were {', '.join(known)}")
    return found[measure]


def _title(recording: Recording, source: str, epoch: str, condition: str) -> str:
    name = epoch_name(epoch, source, short_names(each.source for each in recording.epochs))
    return f"{name}, {condition}" if condition else name
