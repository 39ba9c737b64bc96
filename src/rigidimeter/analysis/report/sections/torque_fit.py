"""Measured against modelled torque, and the terms of the model (Fig. 4)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from numpy.typing import NDArray

from rigidimeter.analysis.estimation import Signals, epoch_signals
from rigidimeter.analysis.report.contents import Block, Figure, Section, paragraph
from rigidimeter.analysis.report.method_words import is_least_squares
from rigidimeter.analysis.report.representative import origin_s, place, slug
from rigidimeter.analysis.report.style import GREY, INK, condition_colours, note, styled
from rigidimeter.analysis.study import StudyResult
from rigidimeter.analysis.study.examples import analysed_epoch, representative_fits
from rigidimeter.core.records import Fit
from rigidimeter.core.words import amount, condition_name, number

Array = NDArray[np.float64]

WINDOW_S = 7.0
"""How much of an epoch the figures show: more would be too dense to read."""

TORQUE_SIZE = (7.4, 7.4)
TORQUE_HEIGHTS = (1.4, 0.7, 1.0, 1.0, 1.0)
"""Of the figure of torques in inches, and of its panels beside each other."""


def _blocks(result: StudyResult) -> Iterator[Block]:
    colours = condition_colours(result.condition_names)
    found = [
        (fit, epoch, epoch_signals(epoch, fit.method, result.settings.estimation))
        for fit in representative_fits(result)
        if (epoch := analysed_epoch(result, fit)) is not None
    ]
    if not found:
        return
    text = (
        "The model is the fit with the inertia fixed. The panels of inertia, damping and stiffness "
        "show, in grey, what is left for that term to explain: the measured torque less the other "
        "two terms. These panels have the same axis in all conditions."
    )
    if not is_least_squares(result.analysis.method):
        text += (
            " The estimate ignores torque that does not follow the perturbation. What the model "
            "leaves here is noise and torque that something but the robot adds, so a low VAF does "
            "not mean a poor fit."
        )
    yield paragraph(text)
    limit_nm = max(torque_limit_nm(signals, fit, WINDOW_S) for fit, _, signals in found)
    for position, (fit, epoch, signals) in enumerate(found, start=1):
        name = condition_name(fit.condition)
        stiffness = amount(fit.stiffness_nm_rad, "N·m/rad", 3)
        vaf = f"{number(fit.vaf_percent)} %"
        yield Figure(
            f"torque_{position}_{slug(fit.condition)}",
            f"{name}: {place(result, fit)}, the included epoch with the median stiffness "
            f"({stiffness}); its first {WINDOW_S:g} s in the band {_hz(signals.band_hz)}"
            f"{_fitted_elsewhere(signals, fit)}.",
            f"{name}: measured and modelled torque of epoch {fit.epoch}, what the model leaves, "
            f"and the terms of inertia, damping and stiffness. K {stiffness}, VAF {vaf}.",
            partial(
                torque_parts,
                signals,
                fit,
                colours[fit.condition],
                origin_s=origin_s(epoch),
                window_s=WINDOW_S,
                limit_nm=limit_nm,
            ),
            "tall",
        )


def _hz(band_hz: tuple[float, float]) -> str:
    return f"{number(band_hz[0], 3)} to {number(band_hz[1], 3)} Hz"


def _fitted_elsewhere(signals: Signals, fit: Fit) -> str:
    """Return the band of the fit where it is not the one that is drawn."""
    if fit.band_hz == signals.band_hz:
        return ""
    return f"; fit and VAF use the band {_hz(fit.band_hz)}"


def _window(signals: Signals, window_s: float) -> slice:
    return slice(0, int(np.searchsorted(signals.time_s, signals.time_s[0] + window_s)) + 1)


def _parts(signals: Signals, fit: Fit) -> tuple[Array, Array, Array]:
    return (
        fit.inertia_kg_m2 * signals.acceleration_rad_s2,
        fit.damping_nm_s_rad * signals.velocity_rad_s,
        fit.stiffness_nm_rad * signals.angle_rad,
    )


def torque_limit_nm(signals: Signals, fit: Fit, window_s: float) -> float:
    """Return the largest size of any torque that `torque_parts` draws."""
    shown = _window(signals, window_s)
    parts = _parts(signals, fit)
    residual = signals.torque_nm - (parts[0] + parts[1] + parts[2])
    drawn = [signals.torque_nm, signals.torque_nm - residual, *parts]
    drawn += [residual + part for part in parts]
    return max(float(np.max(np.abs(values[shown]))) for values in drawn)


def torque_parts(
    signals: Signals,
    fit: Fit,
    colour: str,
    *,
    origin_s: float,
    window_s: float,
    limit_nm: float,
) -> Drawing:
    """Draw `draw_torque_parts` on a figure of its own."""
    with styled():
        figure = Drawing(figsize=TORQUE_SIZE)
        panels = figure.subplots(5, 1, sharex=True, height_ratios=TORQUE_HEIGHTS)
        draw_torque_parts(
            list(panels), signals, fit, colour, origin_s=origin_s, window_s=window_s,
            limit_nm=limit_nm,
        )  # fmt: skip
    return figure


def draw_torque_parts(
    panels: Sequence[Axes],
    signals: Signals,
    fit: Fit,
    colour: str,
    *,
    origin_s: float,
    window_s: float,
    limit_nm: float,
) -> None:
    """Draw the torque of an epoch, the model, the residual below, and the terms of the model.

    The panel of each term also shows what is left for it to explain: the measured torque less the
    two other terms of the model.

    Parameters
    ----------
    signals : Signals
        As they entered the fit.
    fit : Fit
        Of these signals, with numbers.
    colour : str
        Of the model.
    origin_s : float
        What the time axis counts from, on the epoch's clock.
    window_s : float
        How much is shown, from the first sample of the signals.
    limit_nm : float
        The vertical axes reach from minus to plus this.
    """
    shown = _window(signals, window_s)
    time_s = signals.time_s[shown] - origin_s
    parts = _parts(signals, fit)
    model = parts[0] + parts[1] + parts[2]
    residual = signals.torque_nm - model
    titles = (
        f"Inertia term J θ″, J = {amount(fit.inertia_kg_m2, 'kg·m²')}",
        f"Damping term B θ′, B = {amount(fit.damping_nm_s_rad, 'N·m·s/rad')}",
        f"Stiffness term K θ, K = {amount(fit.stiffness_nm_rad, 'N·m/rad')}",
    )
    top, left, *below = panels
    _pair(top, time_s, signals.torque_nm[shown], model[shown], colour, ("measured", "model"))
    top.set_title("Torque", loc="left")
    note(top, f"VAF {fit.vaf_percent:.4g} %, R² {fit.r_squared:.4g}")
    left.plot(time_s, residual[shown], color=INK, linewidth=0.8)
    left.set_title("Residual: measured less model", loc="left")
    for axes, title, part in zip(below, titles, parts, strict=True):
        labels = ("measured less the other terms", "this term of the model")
        _pair(axes, time_s, (residual + part)[shown], part[shown], colour, labels)
        axes.set_title(title, loc="left")
    for axes in panels:
        reach = 0.7 if axes is left else 1.35
        axes.set_ylim(-reach * limit_nm, reach * limit_nm)
        axes.set_xlim(time_s[0], time_s[-1])
        axes.set_ylabel("Torque (N·m)")
    below[-1].set_xlabel("Time since the start of the epoch (s)")


def _pair(
    axes: Axes,
    time_s: Array,
    measured: Array,
    model: Array,
    colour: str,
    labels: tuple[str, str],
) -> None:
    axes.plot(time_s, measured, color=GREY, linewidth=2.4, alpha=0.45, label=labels[0])
    axes.plot(time_s, model, color=colour, linewidth=0.9, label=labels[1])
    axes.legend(loc="upper right", ncols=2, borderaxespad=0.1)


SECTION = Section("torque", "Measured and modelled torque", _blocks)
