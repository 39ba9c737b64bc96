"""The epochs that represent their condition in a figure."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import TypeVar

from rigidimeter.estimation import aligned
from rigidimeter.estimation.prepared import PreparedEpoch, prepare
from rigidimeter.estimation.stretches import longest_part
from rigidimeter.records import Epoch, Fit, Score
from rigidimeter.reporting.numbers import short_names
from rigidimeter.study import StudyResult

_Result = TypeVar("_Result", Fit, Score)


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
    """Return for each condition the included fit with the median stiffness, what is compared first.

    From the fits at fixed inertia, whose damping and stiffness the report compares; from the free
    fits if there are none.
    """
    analysis = result.analysis
    fixed = representatives(result, analysis.fixed_inertia, lambda fit: fit.stiffness_nm_rad)
    return fixed or representatives(result, analysis.fits, lambda fit: fit.stiffness_nm_rad)


def analysed_epoch(result: StudyResult, one: Fit | Score) -> Epoch | None:
    """Return the epoch of a fit or score as it was analysed.

    Its delay is corrected, and what is left out is left out.
    """
    if isinstance(one, Fit) and result.prepared:
        return prepared_epochs(result)[one.source, one.epoch].epoch
    for epoch in result.epochs:
        if (epoch.source, epoch.label) == (one.source, one.epoch):
            return aligned(longest_part(epoch), result.analysis.delays)
    return None


def prepared_epochs(result: StudyResult) -> dict[tuple[str, str], PreparedEpoch]:
    """Return the perturbation epochs as they were analysed, by source and label."""
    prepared = result.prepared or prepare(
        (aligned(epoch, result.analysis.delays) for epoch in result.epochs), result.settings
    )
    return {(one.epoch.source, one.epoch.label): one for one in prepared}


def place(result: StudyResult, one: Fit | Score) -> str:
    """Return epoch and source, since sessions use the same labels."""
    names = short_names(epoch.source for epoch in result.epochs)
    return f"epoch {one.epoch} of {names.get(one.source, one.source)}"


def origin_s(epoch: Epoch) -> float:
    """Return when the first channel begins."""
    return min(float(channel.time_s[0]) for channel in epoch.channels.values() if len(channel))


def slug(condition: str) -> str:
    """Return a name that every file system takes; two conditions may get the same one."""
    return re.sub(r"[^A-Za-z0-9]+", "-", condition).strip("-").lower()[:40] or "unnamed"
