"""The table and its summary as Markdown."""

from __future__ import annotations

import math
from collections.abc import Mapping

from tests.docs.measured import folded

from benchmarks.scenarios.measure import EPOCHS
from benchmarks.scenarios.rule import Answer, Array, Row

HEADER = (
    "method", "scenario", "bias (%)", "scatter (%)", "coverage (%)", "pooled: bias (%)",
    "coverage (%)", "flagged: epochs, recordings (%)", "findings (% of recordings)", "rule",
)  # fmt: skip

Rows = Mapping[tuple[str, str], Row]
"""By scenario and method."""


def summary(rows: Rows) -> list[str]:
    """Return how many rows keep the rule, by method."""
    lines = []
    for method in dict.fromkeys(method for _, method in rows):
        own = [row for (_, name), row in rows.items() if name == method]
        breaks = [row.breaks for row in own]
        lines.append(
            f"- `{method}`: {breaks.count('')} of {len(own)} rows keep the rule; "
            f"{breaks.count('silent, off')} are off by more than 10 % and silent, "
            f"{breaks.count('silent, overconfident')} overconfident and silent, "
            f"{breaks.count('misnamed')} flagged by another finding, "
            f"{breaks.count('false alarm')} flagged in vain."
        )
    return lines


def table(rows: Rows) -> list[str]:
    """Return the table, the methods one after the other."""
    lines = [
        "| " + " | ".join(HEADER) + " |",
        "| --- | --- |" + " ---: |" * (len(HEADER) - 4) + " --- | --- |",
    ]
    for method in dict.fromkeys(method for _, method in rows):
        lines += [
            "| " + " | ".join(cells(scenario, method, row)) + " |"
            for (scenario, name), row in rows.items()
            if name == method
        ]
    return lines


def measured(rows: Rows) -> str:
    """Return what stands between the marks of the page."""
    counts: dict[str, list[int]] = {}
    for (_, method), row in rows.items():
        counts.setdefault(method, []).append(row.recordings)
    lines = []
    for method, said in zip(counts, summary(rows), strict=True):
        least, most = min(counts[method]), max(counts[method])
        many = f"{least}" if least == most else f"{least} to {most}"
        lines.append(
            f"{said} {many} recordings of {EPOCHS} epochs a row: the standard error of a share is "
            f"up to {50 / math.sqrt(least):.0f} %."
        )
    return "\n".join([*lines, "", *folded(table(rows))])


def cells(scenario: str, method: str, row: Row) -> tuple[str, ...]:
    """Return a row as cells of the table."""
    shares = ", ".join(f"{name} {100 * share:.0f}" for name, share in row.shares.items())
    return (
        method,
        scenario,
        _three(row.epochs.bias, sign=True),
        _three(row.epochs.scatter),
        _whole(row.epochs),
        _three(row.pooled.bias, sign=True),
        _whole(row.pooled),
        f"{100 * row.doubted_epochs:.0f}, {100 * row.doubted:.0f}",
        shares or "–",
        f"**{row.breaks}**" if row.breaks else ("wrong, reported" if row.wrong else "right"),
    )


def _three(values: Array, sign: bool = False) -> str:
    return " ".join(_short(100 * value, sign) for value in values)


def _short(value: float, sign: bool) -> str:
    if value != value:
        return "–"
    digits = 1 if abs(value) < 9.95 else 0
    return f"{value:{'+' if sign else ''}.{digits}f}"


def _whole(answer: Answer) -> str:
    return " ".join("–" if x != x else f"{100 * x:.0f}" for x in answer.coverage)
