"""Measured against modelled torque, and the terms of the model (Fig. 4)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from numpy.typing import NDArray

from rigidimeter.estimation import Signals, epoch_signals
from rigidimeter.records import Channel, Fit
from rigidimeter.reporting.contents import Block, Figure, Section, paragraph
from rigidimeter.reporting.method_words import is_least_squares
from rigidimeter.reporting.numbers import condition_name, number
from rigidimeter.reporting.representative import (
    analysed_epoch,
    origin_s,
    place,
    representative_fits,
    slug,
)
from rigidimeter.reporting.sections.perturbation_figure import changes, drawable_perturbation
from rigidimeter.reporting.style import GREY, condition_colours, note, styled
from rigidimeter.study import StudyResult

Array = NDArray[np.float64]

WINDOW_S = 7.0
"""How much of an epoch the figures show: more would be too dense to read."""


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
            "leaves here is the subject’s own torque and noise, so a low VAF does not mean a poor "
            "fit."
        )
    yield paragraph(text)
    limit_nm = max(torque_limit_nm(signals, fit, WINDOW_S) for fit, _, signals in found)
    for position, (fit, epoch, signals) in enumerate(found, start=1):
        name = condition_name(fit.condition)
        vaf = f"{number(fit.vaf_percent)} %"
        yield Figure(
            f"torque_{position}_{slug(fit.condition)}",
            f"{name}: {place(result, fit)}, the included epoch with the median VAF ({vaf}); its "
            f"first {WINDOW_S:g} s in the band {_hz(signals.band_hz)}"
            f"{_fitted_elsewhere(signals, fit)}.",
            f"{name}: measured and modelled torque of epoch {fit.epoch}, and the terms of inertia, "
            f"damping and stiffness. VAF {vaf}.",
            partial(
                torque_parts,
                signals,
                fit,
                colours[fit.condition],
                origin_s=origin_s(epoch),
                window_s=WINDOW_S,
                limit_nm=limit_nm,
                perturbation=drawable_perturbation(epoch),
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
    """Return the largest size of any torque that `torque_parts` would draw."""
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
    perturbation: Channel | None = None,
) -> Drawing:
    """Draw the torque of an epoch and what inertia, damping and stiffness contribute.

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
    perturbation : Channel or None
        Drawn in a panel of its own where it was recorded.
    """
    shown = _window(signals, window_s)
    time_s = signals.time_s[shown] - origin_s
    parts = _parts(signals, fit)
    model = parts[0] + parts[1] + parts[2]
    residual = signals.torque_nm - model
    titles = (
        f"Inertia term J θ″, J = {fit.inertia_kg_m2:.4g} kg·m²",
        f"Damping term B θ′, B = {fit.damping_nm_s_rad:.4g} N·m·s/rad",
        f"Stiffness term K θ, K = {fit.stiffness_nm_rad:.4g} N·m/rad",
    )
    with styled():
        rows = 4 if perturbation is None else 5
        figure = Drawing(figsize=(7.4, 1.5 * rows + 0.3))
        panels = list(figure.subplots(rows, 1, sharex=True))
        if perturbation is not None:
            _draw_perturbation(panels.pop(0), perturbation, origin_s)
        top, *below = panels
        _pair(top, time_s, signals.torque_nm[shown], model[shown], colour, ("measured", "model"))
        top.set_title("Torque")
        note(top, f"VAF {fit.vaf_percent:.4g} %, R² {fit.r_squared:.4g}")
        for axes, title, part in zip(below, titles, parts, strict=True):
            labels = ("measured less the other terms", "this term of the model")
            _pair(axes, time_s, (residual + part)[shown], part[shown], colour, labels)
            axes.set_title(title)
        for axes in panels:
            axes.set_ylim(-1.35 * limit_nm, 1.35 * limit_nm)
            axes.set_ylabel("Torque (N·m)")
        below[-1].set_xlabel("Time since the start of the epoch (s)")
        below[-1].set_xlim(time_s[0], time_s[-1])
    return figure


def _pair(
    axes: Axes,
    time_s: Array,
    measured: Array,
    model: Array,
    colour: str,
    labels: tuple[str, str],
) -> None:
    axes.plot(time_s, measured, color=GREY, linewidth=1.0, alpha=0.75, label=labels[0])
    axes.plot(time_s, model, color=colour, linewidth=1.2, dashes=(4, 1), label=labels[1])
    axes.legend(loc="upper right", ncols=2, borderaxespad=0.1)


def _draw_perturbation(axes: Axes, channel: Channel, origin_s: float) -> None:
    time_s, values = changes(channel)
    axes.step(time_s - origin_s, values, where="post", color="#222222", linewidth=0.9)
    axes.set_title("Perturbation")
    axes.set_ylabel("Torque (N·m)")


SECTION = Section("torque", "Measured and modelled torque", _blocks)
