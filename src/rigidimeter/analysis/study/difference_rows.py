"""The table of differences as terminal and page show it: a row of cells for each measure."""

from __future__ import annotations

import math
from typing import NamedTuple

from rigidimeter.analysis.study.conclusions import Conclusion, Conclusions, conclude
from rigidimeter.analysis.study.differences import Difference, Signed, signed
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.core.words import condition_name, number, p_value, scaled

VERDICTS = {
    "lower": "lower",
    "higher": "higher",
    "no difference shown": "none shown",
    "not supported": "not supported",
    "cannot be decided": "undecided",
}
"""What a cell says of each verdict, under the heading “difference”."""
UNTESTED = "not tested"


class DifferenceRow(NamedTuple):
    """One measure of two conditions; differences are other − reference."""

    conclusion: Conclusion
    measure: str
    unit: str
    reference: str
    other: str
    difference: str
    simulated: str
    interval: str
    p: str
    verdict: str


def difference_cells(result: StudyResult) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return headings and cells; of a virtual study what was simulated in the place of p."""
    concluded = conclude(result)
    rows = [] if concluded is None else difference_rows(concluded)
    virtual = any(row.simulated for row in rows)
    p_name = "p" if concluded is None else concluded.p_name
    reference, other = condition_name(result.reference), condition_name(result.other)
    headings = ("", reference, other, f"{other} − {reference}", "simulated" if virtual else "",
                "95 % interval", "" if virtual else p_name, "difference")  # fmt: skip
    return headings, [
        (
            ", ".join(filter(None, (row.measure, row.unit))),
            *(row.reference, row.other, row.difference, row.simulated, row.interval),
            "" if virtual else row.p,
            row.verdict,
        )
        for row in rows
    ]


def difference_rows(concluded: Conclusions) -> list[DifferenceRow]:
    """Return a row for each measure that was compared.

    Differences are in % where that has a meaning. p is adjusted in its family, and not given of J
    where it checks the instrument.
    """
    return [_row(one) for one in concluded.each]


def _row(one: Conclusion) -> DifferenceRow:
    d, measure = one.difference, one.comparison.measure
    factor, unit = scaled(max(abs(d.reference), abs(d.other)), measure.unit)
    difference, ends = _cells(d, factor)
    return DifferenceRow(
        one,
        measure.short,
        unit,
        number(factor * d.reference, 3),
        number(factor * d.other, 3),
        difference,
        "" if one.simulated is None else _simulated(one.simulated, factor),
        ends,
        "–" if one.role == "check" else "" if math.isnan(one.p) else p_value(one.p, 2),
        UNTESTED if math.isnan(one.p) else VERDICTS[one.verdict],
    )


def _cells(d: Difference, factor: float) -> Signed:
    estimate, low, high = d.tested
    return signed(d.percent, (factor * estimate, factor * low, factor * high))


def _simulated(d: Difference, factor: float) -> str:
    return _cells(d, factor).value if d.estimate else "0"
