"""What looks wrong with an analysis, and what keeps its measures from being tested."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.core.records import Analysis, Notice

DIFFERENT_INERTIA = 0.15
"""Sources whose median J differ by more than this hardly are one joint."""


def analysis_warnings(analysis: Analysis) -> tuple[Notice, ...]:
    """Return what looks wrong with an analysis in general, and what to do about it."""
    return (*_misfit(analysis), *_different_inertia(analysis), *_wrong_sign(analysis))


def _misfit(analysis: Analysis) -> tuple[Notice, ...]:
    return tuple(
        Notice("warning", f"{fit.condition or 'all epochs'}: {finding.headline}. {finding.remedy}")
        for fit in analysis.pooled
        for finding in fit.findings
        if finding.level != "note"
    )


def _different_inertia(analysis: Analysis) -> tuple[Notice, ...]:
    """Say so when sources differ in J: one median for all would put the difference into K."""
    by_source: dict[str, list[float]] = {}
    for fit in analysis.fits:
        if fit.outcome.included:
            by_source.setdefault(fit.source, []).append(fit.inertia_kg_m2)
    medians = {source: float(np.median(values)) for source, values in by_source.items()}
    if len(medians) < 2 or min(medians.values()) <= 0:
        return ()
    low, high = min(medians, key=lambda s: medians[s]), max(medians, key=lambda s: medians[s])
    if medians[high] / medians[low] - 1 < DIFFERENT_INERTIA:
        return ()
    text = (
        f"the median J of {high} ({medians[high]:.4g} kg·m²) is "
        f"{100 * (medians[high] / medians[low] - 1):.0f} % above that of {low} "
        f"({medians[low]:.4g} kg·m²); B and K at one median J are then wrong for both. Analyse "
        "different joints or subjects separately"
    )
    return (Notice("warning", text),)


def _wrong_sign(analysis: Analysis) -> tuple[Notice, ...]:
    included = [fit for fit in analysis.fits if fit.outcome.included]
    of_all = f"of {len(included)} included epochs"
    turned = [fit for fit in included if np.all(fit.value < 0) and not np.any(fit.high > 0)]
    if turned:
        text = (
            f"J, B and K are all below zero in {len(turned)} {of_all}: the torque has the wrong "
            "sign; a sensor that reports the joint's reaction needs --reaction"
        )
        return (Notice("warning", text),)
    massless = [fit for fit in included if fit.inertia_kg_m2 <= 0]
    if massless:
        text = (
            f"J is not greater than zero in {len(massless)} {of_all}, which is impossible: the "
            "channels are too slow, too noisy or delayed relative to each other for an inertia "
            "this small"
        )
        return (Notice("warning", text),)
    negative = [fit for fit in included if min(fit.damping_nm_s_rad, fit.stiffness_nm_rad) < 0]
    if negative:
        text = (
            f"B or K is negative in {len(negative)} {of_all}: something but the robot may have "
            "pushed, or the channels are delayed relative to each other; check R² "
            "before using them"
        )
        return (Notice("warning", text),)
    return ()


def lacking(comparisons: Sequence[Comparison], pair: tuple[str, str]) -> list[Notice]:
    """Say once what keeps the measures of recordings from being tested."""
    if not comparisons:
        return [Notice("error", "no epoch could be fitted or scored, so nothing is compared")]
    recorded = {
        name: sum(c.summaries[name].n + c.excluded[name] for c in comparisons if name in c.pair)
        for name in pair
    }
    absent = [name or "a second condition" for name, count in recorded.items() if not count]
    if absent:
        present = [name for name, count in recorded.items() if count]
        text = (
            f"there is no session in {' or '.join(absent)}, only in "
            f"{present[0] if present else 'other conditions'}, so nothing is compared"
        )
        return [Notice("error", text)]
    why: dict[str, list[str]] = {}
    for c in comparisons:
        if c.paired and c.test is None:
            why.setdefault(c.remark, []).append(c.measure.title)
    return [
        Notice("error", f"no test of {', '.join(titles)}: {remark}")
        for remark, titles in why.items()
    ]
