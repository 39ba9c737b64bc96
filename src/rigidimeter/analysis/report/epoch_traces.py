"""The traces of every epoch as part of the page, with the words above them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from typing import Any

from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.traces import EpochTrace, epoch_traces
from rigidimeter.core.records import Fit, Score
from rigidimeter.core.words import amount, condition_name, epoch_name, number, short_names

Trace = dict[str, Any]


def page_traces(shown: Shown) -> dict[tuple[str, str], Trace]:
    """Return what the page shows of each epoch that was fitted or scored, by source and label."""
    analysis = shown.analysis
    names = short_names(epoch.source for epoch in shown.epochs)
    results: list[Fit | Score] = [*analysis.scores, *analysis.fits]
    by_name = {(one.source, one.epoch): one for one in results}
    return {
        (trace.source, trace.epoch): _trace(trace, by_name[trace.source, trace.epoch], names)
        for trace in epoch_traces(analysis, shown.as_analysed, shown.study.settings)
    }


def _trace(trace: EpochTrace, one: Fit | Score, names: dict[str, str]) -> Trace:
    if isinstance(one, Fit):
        words = "; ".join(_values(one))
    else:
        words = f"{number(one.work_j)} J and {number(one.impulse_nm_s)} N·m·s per cycle"
    if not one.outcome.included:
        words += f". Does not count: {one.outcome.reason}"
    where = epoch_name(one.epoch, one.source, names)
    return {
        "title": f"{condition_name(one.condition)}, {where}",
        "words": f"{words}. {shown_words(trace)}".strip(),
        "start": trace.start_s,
        "step": trace.step_s,
        **{name: list(series) for name, series in trace.series.items()},
        **({"active": trace.active} if trace.active else {}),
    }


def shown_words(trace: EpochTrace) -> str:
    """Return how much of an epoch its traces show, unless it is all, and what is shaded."""
    active = "Shaded: a muscle was active." if trace.active else ""
    if trace.shown_s >= trace.length_s:
        return active
    first = f"The first {number(trace.shown_s, 3)} s of {number(trace.length_s, 3)} s."
    return f"{first} {active}".strip()


def _values(fit: Fit) -> Iterator[str]:
    for letter, value, unit in zip(
        "JBK", fit.value, ("kg·m²", "N·m·s/rad", "N·m/rad"), strict=True
    ):
        yield f"{letter} {amount(value, unit)}"
    yield f"VAF {number(fit.vaf_percent)} %"


def traces_json(traces: Iterable[Trace]) -> str:
    """Return the traces as JSON that may stand inside an element of the page."""
    text = json.dumps(list(traces), ensure_ascii=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")
