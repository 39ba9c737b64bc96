"""The epochs that represent their condition, as they were analysed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TypeVar

from rigidimeter.analysis.estimation import Ready, prepare
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.core.records import Channel, Epoch, Fit, Score

_Result = TypeVar("_Result", Fit, Score)

FEWEST_SAMPLES = 16
"""Of a perturbation that is drawn."""


def representatives(
    result: StudyResult, results: Iterable[_Result], key: Callable[[_Result], float]
) -> list[_Result]:
    """Return for each condition the included result with the median (lower middle) key."""
    results = list(results)
    chosen = []
    for condition in result.condition_names:
        ranked = sorted(
            (r for r in results if r.condition == condition and r.outcome.included), key=key
        )
        if ranked:
            chosen.append(ranked[(len(ranked) - 1) // 2])
    return chosen


def representative_fits(result: StudyResult) -> list[Fit]:
    """Return for each condition the included fit with the median stiffness."""
    return representatives(result, result.analysis.fits, lambda fit: fit.stiffness_nm_rad)


def representative_scores(result: StudyResult) -> list[Score]:
    """Return for each condition the included score with the median work."""
    return representatives(result, result.analysis.scores, lambda score: score.work_j)


def analysed_epoch(result: StudyResult, one: Fit | Score) -> Epoch | None:
    """Return the epoch of a fit or score as it was analysed.

    Its delay is corrected, and what is left out is left out.
    """
    ready = prepared_epochs(result).get((one.source, one.epoch))
    return None if ready is None else ready.epoch


def prepared_epochs(result: StudyResult) -> dict[tuple[str, str], Ready]:
    """Return the epochs as they were analysed, by source and label."""
    prepared = result.prepared or (
        prepare(result.epochs, result.settings, clocks=False)
        ._replace(delays=result.analysis.delays)
        .analysed(as_recorded=False)
    )
    return {(one.epoch.source, one.epoch.label): one for one in prepared}


def perturbed_epoch(result: StudyResult) -> Epoch | None:
    """Return the epoch whose perturbation is drawn: an example, or the first that has one."""
    shown = [e for fit in representative_fits(result) if (e := analysed_epoch(result, fit))]
    found = (each for each in (*shown, *result.epochs) if drawable_perturbation(each) is not None)
    return next(found, None)


def drawable_perturbation(epoch: Epoch) -> Channel | None:
    """Return the perturbation of an epoch if there is enough of it to draw."""
    channel = epoch.channels.get("perturbation_nm")
    if channel is None or len(channel) < FEWEST_SAMPLES:
        return None
    low, high = float(min(channel.values)), float(max(channel.values))
    return channel if math.isfinite(high - low) and high > low else None
