"""Whether what is concluded of a measure depends on the method of estimation, and what explains it.

A conclusion depends on the method where methods do not agree on whether there is a difference, or
on its sign.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from rigidimeter.estimation import method_named
from rigidimeter.study.results import SensitivityRow, StudyResult
from rigidimeter.study.tested import LEVEL

Reason = Literal[
    "", "size", "alike", "least squares alone", "imprecise", "not voluntary", "voluntary"
]
_Found = tuple[Reason, SensitivityRow | None, tuple[SensitivityRow, ...]]


@dataclass(frozen=True)
class Dependence:
    """Whether the conclusion on one measure depends on the method.

    Attributes
    ----------
    rows : tuple of SensitivityRow
    lower, higher, none : tuple of SensitivityRow
        Those that show the other condition lower, higher, or no difference.
    reason : str
        What may explain the disagreement. ``size``: all agree on the sign, `about` gives a shift
        outside the interval of `standard`. ``alike``: all shifts lie in that interval. ``least
        squares alone``: no instrumental estimate without a difference to hold against it.
        ``imprecise``: the interval of `standard` holds the shift of `about` too. ``voluntary``: it
        does not, and torque of the subject would do this. ``not voluntary``: it does not, but such
        torque would also bias `about`, which shows nothing.
    standard : SensitivityRow or None
    about : tuple of SensitivityRow
    """

    rows: tuple[SensitivityRow, ...]
    lower: tuple[SensitivityRow, ...]
    higher: tuple[SensitivityRow, ...]
    none: tuple[SensitivityRow, ...]
    reason: Reason = ""
    standard: SensitivityRow | None = None
    about: tuple[SensitivityRow, ...] = ()


def dependences(result: StudyResult) -> tuple[Dependence, ...]:
    """Return for each measure with several methods whether its conclusion depends on them."""
    by_measure: dict[str, list[SensitivityRow]] = {}
    for row in result.sensitivity:
        by_measure.setdefault(row.measure.name, []).append(row)
    return tuple(_dependence(rows) for rows in by_measure.values() if len(rows) > 1)


def _shown(row: SensitivityRow) -> int:
    """Return 1 or −1 where the row shows a difference of that sign, else 0."""
    p = row.p if math.isnan(row.p_day) else row.p_day
    return int(math.copysign(1, row.shift)) if p < LEVEL and row.shift else 0


def _dependence(rows: Sequence[SensitivityRow]) -> Dependence:
    lower, higher, none = (tuple(r for r in rows if _shown(r) == sign) for sign in (1, -1, 0))
    found: _Found = ("", None, ())
    if not none and not (lower and higher):
        found = _size(rows)
    elif none and bool(lower) != bool(higher):
        found = _reason(rows, lower or higher, none)
    return Dependence(tuple(rows), lower, higher, none, *found)


def _biased(row: SensitivityRow) -> bool:
    """Whether torque of the subject biases the method: it does not use the perturbation."""
    return not method_named(row.method).uses_perturbation


def _within(row: SensitivityRow, standard: SensitivityRow) -> bool:
    return standard.shift_low <= row.shift <= standard.shift_high


def _size(rows: Sequence[SensitivityRow]) -> _Found:
    chosen = next((row for row in rows if row.chosen), None)
    outside = [row for row in rows if chosen and not _within(row, chosen)]
    if chosen is None or not outside:
        return "", None, ()
    return "size", chosen, (max(outside, key=lambda row: abs(row.shift - chosen.shift)),)


def _reason(
    rows: Sequence[SensitivityRow],
    shown: Sequence[SensitivityRow],
    none: Sequence[SensitivityRow],
) -> _Found:
    """Distinguish the subject's own torque from a lack of precision, where the intervals can.

    Such torque biases all of least squares, so what one of its methods shows and another does not
    has another reason.
    """
    instrumental = [row for row in none if not _biased(row)]
    least = [row for row in shown if _biased(row)]
    if not instrumental and not least:
        return "least squares alone", None, ()
    if not instrumental or not least:
        chosen = next((row for row in rows if row.chosen), None)
        if chosen is not None and all(_within(row, chosen) for row in rows):
            return "alike", chosen, ()
        return _size(rows)
    standard = next((row for row in instrumental if row.chosen), instrumental[0])
    inside = tuple(row for row in least if _within(row, standard))
    if inside:
        return "imprecise", standard, inside
    unmoved = tuple(row for row in none if _biased(row))
    if {row.method for row in unmoved} - {row.method for row in least}:
        return "not voluntary", standard, unmoved
    return "voluntary", standard, ()
