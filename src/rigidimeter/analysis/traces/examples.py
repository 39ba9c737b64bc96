"""The epochs that represent their condition, as they were analysed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeAlias, TypeVar

from rigidimeter.analysis.estimation import Ready, prepare
from rigidimeter.core.records import Analysis, Channel, Epoch, Fit, Score
from rigidimeter.core.settings import Settings

_Result = TypeVar("_Result", Fit, Score)

Prepared: TypeAlias = Mapping[tuple[str, str], Ready]
"""Epochs as they were analysed, by source and label."""

FEWEST_SAMPLES = 16
"""Of a perturbation that is drawn."""


def prepared_epochs(
    epochs: Sequence[Epoch],
    analysis: Analysis,
    settings: Settings,
    prepared: Iterable[Ready] = (),
) -> dict[tuple[str, str], Ready]:
    """Return epochs as they were analysed, by source and label.

    Parameters
    ----------
    epochs : sequence of Epoch
        As recorded.
    analysis : Analysis
        Of these epochs, with the delays that were corrected.
    settings : Settings
        With which they were analysed.
    prepared : iterable of Ready, optional
        What the analysis itself prepared; without, the epochs are prepared again.
    """
    found = tuple(prepared) or (
        prepare(epochs, settings, clocks=False)
        ._replace(delays=analysis.delays)
        .analysed(as_recorded=False)
    )
    return {(one.epoch.source, one.epoch.label): one for one in found}


def analysed_epoch(prepared: Prepared, one: Fit | Score) -> Epoch | None:
    """Return the epoch of a fit or score as it was analysed.

    Its delay is corrected, and what is left out is left out.
    """
    ready = prepared.get((one.source, one.epoch))
    return None if ready is None else ready.epoch


def representatives(
    names: Iterable[str], results: Iterable[_Result], key: Callable[[_Result], float]
) -> list[_Result]:
    """Return for each condition the included result with the median (lower middle) key.

    Parameters
    ----------
    names : iterable of str
        The conditions; the results come in their order.
    results : iterable of Fit or Score
    key : callable
        What a result is ranked by.
    """
    results = list(results)
    chosen = []
    for condition in names:
        ranked = sorted(
            (r for r in results if r.condition == condition and r.outcome.included), key=key
        )
        if ranked:
            chosen.append(ranked[(len(ranked) - 1) // 2])
    return chosen


def representative_fits(analysis: Analysis, names: Iterable[str]) -> list[Fit]:
    """Return for each condition the included fit with the median stiffness."""
    return representatives(names, analysis.fits, lambda fit: fit.stiffness_nm_rad)


def representative_scores(analysis: Analysis, names: Iterable[str]) -> list[Score]:
    """Return for each condition the included score with the median work."""
    return representatives(names, analysis.scores, lambda score: score.work_j)


def perturbed_epoch(
    analysis: Analysis, names: Iterable[str], prepared: Prepared, epochs: Iterable[Epoch]
) -> Epoch | None:
    """Return the epoch whose perturbation is drawn: an example, or the first that has one."""
    fits = representative_fits(analysis, names)
    shown = [epoch for fit in fits if (epoch := analysed_epoch(prepared, fit))]
    return next((e for e in (*shown, *epochs) if drawable_perturbation(e) is not None), None)


def drawable_perturbation(epoch: Epoch) -> Channel | None:
    """Return the perturbation of an epoch if there is enough of it to draw."""
    channel = epoch.channels.get("perturbation_nm")
    if channel is None or len(channel) < FEWEST_SAMPLES:
        return None
    low, high = float(min(channel.values)), float(max(channel.values))
    return channel if math.isfinite(high - low) and high > low else None
