"""An analysis as HTML, for a notebook."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

from rigidimeter.records.parameters import PARAMETERS

if TYPE_CHECKING:
    from rigidimeter.records.estimates import Analysis, Fit

__all__ = ["analysis_html"]

MOST_EPOCHS = 20
"""Epochs shown one by one; of more only the first are."""


def analysis_html(analysis: Analysis) -> str:
    """Return J, B and K with their 95 % intervals, what the checks found, and the scores."""
    parts = [f"<p>{escape(_summary(analysis))}</p>"]
    if analysis.fits:
        heading = ["epoch", "condition"]
        heading += [f"{p.symbol} ({p.unit}) [95\xa0% interval]" for p in PARAMETERS]
        shown = [*analysis.fits[:MOST_EPOCHS], *analysis.pooled]
        parts.append(_table([*heading, "R²", "outcome"], [_fit_row(fit) for fit in shown]))
    if len(analysis.fits) > MOST_EPOCHS:
        parts.append(f"<p>The first {MOST_EPOCHS} of {len(analysis.fits)} epochs.</p>")
    if analysis.findings:
        rows = [
            [found.first.level, _where(found.fits), found.first.text, found.first.remedy]
            for found in analysis.findings
        ]
        parts.append("<p>What the checks found:</p>")
        parts.append(_table(["level", "epochs", "finding in the first", "remedy"], rows))
    if analysis.scores:
        rows = [
            [
                f"{s.source}, {s.epoch}",
                s.condition,
                _number(s.impulse_nm_s),
                _number(s.work_j),
                f"{s.outcome.kind} {s.outcome.reason}",
            ]
            for s in analysis.scores[:MOST_EPOCHS]
        ]
        parts.append(_table(["epoch", "condition", "impulse (N·m·s)", "work (J)", "outcome"], rows))
    return "\n".join(parts)


def _summary(analysis: Analysis) -> str:
    reason = f": {analysis.method_reason}" if analysis.method_reason else ""
    return f"Method {analysis.method}{reason}."


def _fit_row(fit: Fit) -> list[str]:
    intervals = [
        f"{_number(value)} [{_number(low)}, {_number(high)}]" if math.isfinite(value) else "–"
        for value, low, high in zip(fit.value, fit.low, fit.high, strict=True)
    ]
    name = "all epochs" if fit.epoch == "pooled" else f"{fit.source}, {fit.epoch}"
    outcome = f"{fit.outcome.kind} {fit.outcome.reason}"
    return [name, fit.condition, *intervals, _number(fit.r_squared), outcome]


def _where(fits: Sequence[Fit]) -> str:
    first = "all together" if fits[0].epoch == "pooled" else f"{fits[0].source}, {fits[0].epoch}"
    return first if len(fits) == 1 else f"{len(fits)}, first {first}"


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "–"


def _table(heading: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heading)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
