"""The table of differences as terminal and page show it: a row of cells for each measure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rigidimeter.analysis.study.compared import Compared, signed
from rigidimeter.core.words import condition_name, number, p_value, scaled

if TYPE_CHECKING:
    from rigidimeter.analysis.study.results import StudyResult

VERDICTS = {
    "lower": "lower",
    "higher": "higher",
    "no difference shown": "none shown",
    "not supported": "not supported",
    "cannot be decided": "undecided",
}
"""What a cell says of each verdict, under the heading “difference”."""
UNTESTED = "not tested"


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
    rows = [shown_cells(one) for one in each]
    virtual = any(row["simulated"] for row in rows)
    names = condition_name(result.study.reference), condition_name(other)
    headings = ("", *names, " − ".join(names[::-1]), "simulated" if virtual else "",
                "95 % interval", "" if virtual else p_name(each), "difference")  # fmt: skip
    return headings, [
        (
            ", ".join(filter(None, (row["measure"], row["unit"]))),
            *(row[name] for name in ("reference", "other", "difference", "simulated", "interval")),
            "" if virtual else row["p"],
            row["verdict"],
        )
        for row in rows
    ]


def p_name(each: Sequence[Compared]) -> str:
    """Return what a column of p is called: Holm's method is not that of a sequence."""
    if any(one.family.rule == "sequence" for one in each):
        return "p, adjusted"
    return "p, Holm" if any(one.family.tests > 1 for one in each) else "p"


def shown_cells(one: Compared) -> dict[str, str]:
    """Return the cells of one measure in two conditions, by what they say.

    Differences are other − reference, in % where that has a meaning. p is adjusted in its family,
    and not given of J where it checks the instrument.
    """
    first, second = one.value_reference, one.value_other
    factor, unit = scaled(max(abs(first), abs(second)), one.measure.unit)
    estimate, low, high = one.of_test
    own = factor * estimate, factor * low, factor * high
    difference, ends = signed(one.percent(one.of_test), own)
    p = "" if math.isnan(one.p_adjusted) else p_value(one.p_adjusted, 2)
    return {
        "measure": one.measure.short,
        "unit": unit,
        "reference": number(factor * first, 3),
        "other": number(factor * second, 3),
        "difference": difference,
        "simulated": _simulated(one, factor),
        "interval": ends,
        "p": "–" if one.role == "check" else p,
        "verdict": VERDICTS[one.verdict] if one.verdict and one.tested else UNTESTED,
    }


def _simulated(one: Compared, factor: float) -> str:
    """Return the difference that was simulated; nothing where none was, as of no virtual study."""
    if one.simulated is None:
        return ""
    difference, percent = one.simulated_difference
    unknown = math.nan, math.nan
    return signed((percent, *unknown), (factor * difference, *unknown)).value if difference else "0"
