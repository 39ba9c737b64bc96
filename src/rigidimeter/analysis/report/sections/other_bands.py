"""How J, B and K of all epochs together depend on the band, and on the part of the epochs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure as Drawing
from scipy.stats import norm

from rigidimeter.analysis.report.contents import Block, Figure, Section, paragraph
from rigidimeter.analysis.report.style import (
    GREY,
    condition_colours,
    condition_markers,
    listed,
    styled,
)
from rigidimeter.analysis.study import StudyResult, split_pooled
from rigidimeter.core.records import PARAMETERS, BandEstimate
from rigidimeter.core.words import Table, condition_name, number

_WIDE = float(norm.ppf(0.975))
_BESIDE = 0.5
"""The rows of all conditions of one band fill this share of its height."""


def _blocks(result: StudyResult) -> Iterator[Block]:
    found = result.analysis.sensitivity
    of_conditions, _ = split_pooled(result.analysis)
    half = {
        name: 50 * (fit.high - fit.low) / np.abs(fit.value) for name, fit in of_conditions.items()
    }
    words = "; ".join(
        f"{condition_name(one.condition)}, {_label(one)}: "
        + ", ".join(
            f"{parameter.symbol} {number(change, 2)} ± {number(_WIDE * se, 2)} %"
            for parameter, change, se in zip(PARAMETERS, *_percent(one), strict=True)
        )
        for one in found
        if not one.of_fit
    )
    own = found[0]
    yield paragraph(
        "The estimates change with the band by no more than chance where the joint is inertia, "
        "damping and stiffness alone. Where they change by more, they carry a "
        "finding (band_sensitivity)."
    )
    yield Figure(
        "band_sensitivity",
        f"Change of J, B and K of all epochs together from those of the band of the fit, "
        f"{own.low_hz:.3g} to {own.high_hz:.3g} Hz, if another band or one half of "
        "each epoch is used. Bars: 95 % interval of the change. Bands of colour: 95 % interval of "
        "the estimate.",
        f"How J, B and K depend on the band. {words}.",
        partial(band_sensitivity, found, half),
        "tall",
    )
    yield Table(
        "band_sensitivity",
        "J, B and K of other bands and parts of the epochs",
        (),
        [one.row() for one in found],
    )


def _label(one: BandEstimate) -> str:
    if one.part != "all":
        return f"{one.part} of each epoch"
    return f"{one.low_hz:.2g} to {one.high_hz:.3g} Hz"


def _percent(one: BandEstimate) -> tuple[np.ndarray, np.ndarray]:
    """Return change and standard error in % of the estimate in the band of the fit."""
    change = np.array(one.change)
    scale = 100 / np.abs(np.array(one.value) - change)
    return scale * change, scale * np.array(one.change_se)


def band_sensitivity(found: Sequence[BandEstimate], half: dict[str, np.ndarray]) -> Drawing:
    """Draw a panel for each parameter, with a row for each band.

    Parameters
    ----------
    found : sequence of BandEstimate
        At least one.
    half : dict of str to array, shape (3,)
        By condition, half the interval of the estimate in %; none is drawn where it is missing.
    """
    others = [one for one in found if not one.of_fit]
    labels = list(dict.fromkeys(_label(one) for one in others))
    conditions = list(dict.fromkeys(one.condition for one in found))
    colours = condition_colours(map(condition_name, conditions))
    markers = condition_markers(map(condition_name, conditions))
    with styled():
        figure = Drawing(figsize=(7.4, 1.1 + (0.2 + 0.12 * len(conditions)) * len(labels)))
        panels = figure.subplots(1, len(PARAMETERS), sharey=True)
        for i, (axes, parameter) in enumerate(zip(panels, PARAMETERS, strict=True)):
            axes.axvline(0.0, color=GREY, linewidth=0.9)
            for place, condition in enumerate(conditions):
                name = condition_name(condition)
                if condition in half and np.isfinite(half[condition][i]):
                    wide = float(half[condition][i])
                    axes.axvspan(-wide, wide, color=colours[name], alpha=0.12, linewidth=0)
                own = [one for one in others if one.condition == condition]
                percent = np.array([_percent(one) for one in own])[:, :, i]
                beside = _BESIDE * ((place + 0.5) / len(conditions) - 0.5)
                axes.errorbar(
                    percent[:, 0],
                    [labels.index(_label(one)) + beside for one in own],
                    xerr=_WIDE * percent[:, 1],
                    fmt=markers[name],
                    markersize=4,
                    color=colours[name],
                    elinewidth=1.2,
                    label=listed(name),
                )
            axes.set_title(parameter.symbol)
            axes.set_xlabel("Change (%)")
            axes.grid(visible=False, axis="y")
        panels[0].set_yticks(range(len(labels)), labels)
        panels[0].set_ylim(len(labels) - 0.5, -0.5)
        if len(conditions) > 1:
            figure.legend(
                *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4
            )
    return figure


SECTION = Section(
    "band_sensitivity", "Other bands", _blocks, lambda result: bool(result.analysis.sensitivity)
)
