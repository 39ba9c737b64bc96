"""The table of differences as terminal and page show it: a row of cells for each measure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from rigidimeter.analysis.study_anew.compared import Compared, signed
from rigidimeter.core.words import condition_name, number, p_value, scaled

if TYPE_CHECKING:
    from rigidimeter.analysis.study_anew.results import StudyResult

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

    compared: Compared
    measure: str
    unit: str
    reference: str
    other: str
    difference: str
    simulated: str
    interval: str
    p: str
    verdict: str


def difference_cells(
    result: StudyResult, other: str | None = None
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return headings and cells; of a virtual study what was simulated in the place of p.

    Parameters
    ----------
    result : StudyResult
    other : str, optional
        The condition that is compared with the reference; that of the main pair by default.
    """
    other = result.study.other if other is None else other
    each = [one for one in result.comparisons if one.other == other]
    rows = difference_rows(each)
    virtual = any(row.simulated for row in rows)
    names = condition_name(result.study.reference), condition_name(other)
    headings = ("", *names, " − ".join(names[::-1]), "simulated" if virtual else "",
                "95 % interval", "" if virtual else p_name(each), "difference")  # fmt: skip
    return headings, [
        (
            ", ".join(filter(None, (row.measure, row.unit))),
            *(row.reference, row.other, row.difference, row.simulated, row.interval),
            "" if virtual else row.p,
            row.verdict,
        )
        for row in rows
    ]


def p_name(each: Sequence[Compared]) -> str:
    """Return what a column of p is called: Holm's method is not that of a sequence."""
    if any(one.family.rule == "sequence" for one in each):
        return "p, adjusted"
    return "p, Holm" if any(one.family.tests > 1 for one in each) else "p"


def difference_rows(each: Iterable[Compared]) -> list[DifferenceRow]:
    """Return a row for each measure that was compared.

    Differences are in % where that has a meaning. p is adjusted in its family, and not given of J
    where it checks the instrument.
    """
    return [_row(one) for one in each]


def _row(one: Compared) -> DifferenceRow:
    first, second = one.value_reference, one.value_other
    factor, unit = scaled(max(abs(first), abs(second)), one.measure.unit)
    estimate, low, high = one.of_test
    own = factor * estimate, factor * low, factor * high
    difference, ends = signed(one.percent(one.of_test), own)
    p = "" if math.isnan(one.p_adjusted) else p_value(one.p_adjusted, 2)
    return DifferenceRow(
        one,
        one.measure.short,
        unit,
        number(factor * first, 3),
        number(factor * second, 3),
        difference,
        _simulated(one, factor),
        ends,
        "–" if one.role == "check" else p,
        VERDICTS[one.verdict] if one.verdict and one.tested else UNTESTED,
    )


def _simulated(one: Compared, factor: float) -> str:
    """Return the difference that was simulated; nothing where none was, as of no virtual study."""
    if one.simulated is None:
        return ""
    difference, percent = one.simulated_difference
    unknown = math.nan, math.nan
    return signed((percent, *unknown), (factor * difference, *unknown)).value if difference else "0"
