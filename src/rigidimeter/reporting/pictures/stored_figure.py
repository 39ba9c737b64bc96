"""A figure as it is stored, and the epochs that stand for their condition."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar

from matplotlib.figure import Figure

from rigidimeter.estimation import aligned
from rigidimeter.records import Epoch, Fit, Score
from rigidimeter.reporting.figures import svg_text
from rigidimeter.reporting.measures import short_names
from rigidimeter.study import StudyResult

__all__ = [
    "Picture",
    "analysed_epoch",
    "drawn",
    "origin_s",
    "place",
    "representative_fits",
    "representatives",
    "slug",
]


@dataclass(frozen=True)
class Picture:
    """A figure as it is stored: file name without suffix, SVG, alternative text, caption."""

    name: str
    svg: str
    alt: str
    caption: str


def drawn(study: StudyResult, figure: Figure) -> str:
    """Return the figure as SVG, marked where what it shows was simulated."""
    cohort = study.sessions and study.virtual
    some = sum(epoch.virtual for epoch in study.epochs)
    if cohort or (some and some == len(study.epochs)):
        return svg_text(figure, "virtual data")
    return svg_text(figure, "some of the data are virtual" if some else "")


_Result = TypeVar("_Result", Fit, Score)


def representatives(
    study: StudyResult, results: Iterable[_Result], key: Callable[[_Result], float]
) -> list[_Result]:
    """Return for each condition the included result with the median (lower middle) key."""
    results = list(results)
    chosen = []
    for condition in study.condition_names:
        ranked = sorted(
            (r for r in results if r.condition == condition and r.outcome.included), key=key
        )
        if ranked:
            chosen.append(ranked[(len(ranked) - 1) // 2])
    return chosen


def representative_fits(study: StudyResult) -> list[Fit]:
    """Return for each condition the included fit with the median VAF.

    From the fits at fixed inertia, whose damping and stiffness the report compares; from the free
    fits if there are none.
    """
    analysis = study.analysis
    fixed = representatives(study, analysis.fixed_inertia, lambda fit: fit.vaf_percent)
    return fixed or representatives(study, analysis.fits, lambda fit: fit.vaf_percent)


def analysed_epoch(study: StudyResult, result: Fit | Score) -> Epoch | None:
    """Return the epoch of a result as it was analysed: on one clock where it was not."""
    for epoch in study.epochs:
        if (epoch.source, epoch.label) == (result.source, result.epoch):
            return aligned(epoch, study.analysis.delays)
    return None


def place(study: StudyResult, result: Fit | Score) -> str:
    """Return epoch and source: labels repeat from one session to the next."""
    names = short_names(epoch.source for epoch in study.epochs)
    return f"epoch {result.epoch} of {names.get(result.source, result.source)}"


def origin_s(epoch: Epoch) -> float:
    """Return when the first channel begins."""
    return min(float(channel.time_s[0]) for channel in epoch.channels.values() if len(channel))


def slug(condition: str) -> str:
    """Return a name that every file system takes; the position beside it keeps names apart."""
    return re.sub(r"[^A-Za-z0-9]+", "-", condition).strip("-").lower()[:40] or "unnamed"
