"""The table as Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

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
            "| " + " | ".join(_cells(scenario, method, row)) + " |"
            for (scenario, name), row in rows.items()
            if name == method
        ]
    return lines


def page(rows: Rows) -> str:
    """Return the whole page."""
    counts = sorted({row.recordings for row in rows.values()})
    many = " to ".join(str(count) for count in dict.fromkeys((counts[0], counts[-1])))
    how_many = (
        f"Each row: {many} recordings of {EPOCHS} epochs of 20 s. The standard error of a share of "
        f"{counts[0]} recordings is up to {50 / math.sqrt(counts[0]):.0f} %."
    )
    return _INTRODUCTION + "\n".join([how_many, "", *summary(rows), "", *table(rows), ""])


def _cells(scenario: str, method: str, row: Row) -> Iterable[str]:
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


_INTRODUCTION = """\
# Scenarios

How far estimates and findings can be trusted when the joint, the subject or the rig is not as the
model has it. The recordings come from a simulator of its own (`tests/scenarios`): joint, cuff,
drive and sensors in continuous time by Runge–Kutta at 10 kHz, the controller at its ticks. It
shares no equation with the estimation. Written by

```sh
python -m benchmarks.scenarios --keep scenarios.json --jobs 2
python -m benchmarks.scenarios --keep scenarios.json --only relaxed tremor --recordings 10
```

The second form measures the rows again whose names hold one of the words.

Three numbers in a cell are J, B and K. Bias and scatter (SD) of the single epochs are in % of the
truth: the intrinsic J, B and K that were simulated, their mean where they changed. Coverage is the
share of 95 % intervals that hold it. A finding of level caution or exclude flags an epoch. `blind`
is `bandlimited` on a file of torque and motion alone, without perturbation and command.

The rule: an answer is wrong if the mean error of J, B or K exceeds 10 % or an interval covers less
than 80 %, in single epochs or pooled. It must then come with the right finding in at least 90 % of
the recordings; if not, the row is **silent, off** or, within 10 %, **silent, overconfident**, and
**misnamed** where other findings flag it that often. A right answer may be flagged in at most 5 %
of the recordings, or it is a **false alarm**. Where the joint is not one J, B and K (it changes, or
has another term), to say so is never false. A share breaks a limit where chance alone, from a true
share at the limit, would do so in less than 1 of 20 cases. Which findings are right for a scenario
is in `tests/scenarios/catalogue.py`.

"""
