"""Conclusions as plain values: the rows of documents and tables, every number unrounded."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from rigidimeter.analysis.study_anew.compared import Compared
from rigidimeter.analysis.study_anew.comparisons import OfMethod, method_caveats
from rigidimeter.core.words import within


def conclusion_rows(
    concluded: Iterable[Compared], methods: Sequence[OfMethod] = ()
) -> list[dict[str, Any]]:
    """Return what is concluded as rows of a document."""
    caveats = method_caveats(methods)
    return [
        {
            **one.measure.names,
            "reference": one.reference,
            "other": one.other,
            "verdict": one.verdict,
            **one.numbers(),
            "p_holm": one.p_adjusted,
            "role": one.role,
            "adjusted_for": one.family.tests,
            "level": one.family.level,
            "half_width": one.half_width,
            "wanted_percent": one.wanted_percent,
            "tested_by": one.by,
            "test": one.test,
            "reason": one.reason,
            "finding": "" if one.finding is None else one.finding.name,
            "caution": "" if one.caution is None else within(one.caution.headline),
            **_needed(one),
            "caveat": caveats.get(one.measure.name, ""),
            **_simulated(one),
        }
        for one in concluded
    ]


def _needed(one: Compared) -> dict[str, Any]:
    number, unit = one.needed or (None, "")
    of_days = number if unit == "day" else None
    return {"days_to_decide": of_days, "units_to_decide": number, "unit_to_decide": unit}


def _simulated(one: Compared) -> dict[str, float]:
    if one.simulated is None:
        return {}
    first, second = one.simulated
    difference = second - first
    percent = 100 / first * difference if first > 0 and one.measure.origin != "ratings" else None
    return {
        "simulated_reference": first,
        "simulated_other": second,
        "simulated_difference": difference,
        "simulated_difference_percent": float("nan") if percent is None else percent,
    }
