"""What the numbers of a study show, as facts that a sentence can be made of.

A difference is shown where p is below one less the confidence: in a study folder the p by days,
adjusted by Holm's method for the number of measures; else that of the epochs. An effect leads where
the adjusted p of its difference from another is. A conclusion depends on the method where methods
do not agree on whether there is a difference, or on its sign.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from rigidimeter.estimation import method_named
from rigidimeter.records import Analysis
from rigidimeter.study.compared import Comparison
from rigidimeter.study.results import SensitivityRow, StudyResult

LEVEL = 0.05
SAME = 1e-12
Reason = Literal[
    "", "size", "alike", "least squares alone", "imprecise", "not voluntary", "voluntary"
]
_Found = tuple[Reason, SensitivityRow | None, tuple[SensitivityRow, ...]]


@dataclass(frozen=True)
class Verdict:
    """Which measures are lower or higher in the other condition.

    `basis` says what was counted; `untested` are those that could not be tested by days.
    """

    basis: Literal["days", "epochs"]
    lower: tuple[Comparison, ...]
    higher: tuple[Comparison, ...]
    undecided: tuple[Comparison, ...]
    untested: tuple[Comparison, ...] = ()

    @property
    def tested(self) -> int:
        """The number of measures that were tested."""
        return len(self.lower) + len(self.higher) + len(self.undecided)


@dataclass(frozen=True)
class Leader:
    """The largest effect: of whom (several if equal), and over whom its lead is beyond chance.

    `ahead` is beyond chance, `level` is not, and of `unknown` there is no p.
    """

    first: tuple[Comparison, ...]
    size: float
    ahead: tuple[Comparison, ...] = ()
    level: tuple[Comparison, ...] = ()
    unknown: tuple[Comparison, ...] = ()


@dataclass(frozen=True)
class Doubt:
    """A check that casts doubt on `epochs` of the `counting` epochs that count.

    On none of them where it is the fit to all of them together that it casts doubt on.
    """

    check: str
    epochs: int
    counting: int


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


def verdict(result: StudyResult, *, days: bool = True) -> Verdict | None:
    """Return which differences are shown; None where no two conditions were compared.

    Days count where they are known, unless `days` is false.
    """
    by_days = [c for c in result.comparisons if days and c.days is not None]
    sides: dict[str, list[Comparison]] = {"lower": [], "higher": [], "none": [], "untested": []}
    for c in by_days or result.comparisons:
        sides[_side(c, days=bool(by_days))].append(c)
    if not by_days and len(sides["untested"]) == len(result.comparisons):
        return None
    lower, higher, none, untested = (tuple(found) for found in sides.values())
    return Verdict("days" if by_days else "epochs", lower, higher, none, untested)


def _side(c: Comparison, *, days: bool) -> str:
    if days and c.days is not None:
        p, confidence, sign = c.days_p_holm, c.days.confidence, c.days.estimate
    elif not days and c.test is not None:
        p, confidence, sign = c.test.p, c.test.confidence, c.test.z
    else:
        return "untested"
    if math.isnan(p):
        return "untested"
    return "none" if p >= 1 - confidence else "lower" if sign > 0 else "higher"


def leader(result: StudyResult) -> Leader | None:
    """Return the largest effect of a result; None where there are not two to compare."""
    sized = {c.measure.name: c for c in result.comparisons if c.effects is not None}
    if len(sized) < 2:
        return None
    sizes = {name: abs(c.effects.rank_biserial) for name, c in sized.items() if c.effects}
    largest = max(sizes.values())
    first = tuple(sized[name] for name, size in sizes.items() if size > largest - SAME)
    if len(first) > 1 or not result.differences:
        return Leader(first, largest)
    p = {frozenset((pair.first, pair.second)): pair.p_holm for pair in result.differences}
    sides: dict[str, list[Comparison]] = {"ahead": [], "level": [], "unknown": []}
    for name, c in sized.items():
        if c is not first[0]:
            one = p.get(frozenset((name, first[0].measure.name)), math.nan)
            sides["unknown" if math.isnan(one) else "ahead" if one < LEVEL else "level"].append(c)
    return Leader(first, largest, *(tuple(found) for found in sides.values()))


def doubts(analysis: Analysis) -> tuple[Doubt, ...]:
    """Return which checks cast doubt on epochs that count, those of most epochs first."""
    counting = [fit for fit in analysis.fits if fit.outcome.included]
    of_epochs = Counter(
        name for fit in counting for name in {f.name for f in fit.findings if f.level != "note"}
    )
    of_pool = {f.name for fit in analysis.pooled for f in fit.findings if f.level != "note"}
    names = [name for name, _ in of_epochs.most_common()]
    names += sorted(of_pool - of_epochs.keys())
    return tuple(Doubt(name, of_epochs[name], len(counting)) for name in names)


def doubt_sentence(analysis: Analysis) -> list[str]:
    """Return the sentence on doubts that goes with whatever is concluded; nothing without any."""
    parts = [
        f"{doubt.check} in {doubt.epochs} of {doubt.counting} epochs"
        if doubt.epochs
        else f"{doubt.check} in all epochs together"
        for doubt in doubts(analysis)
    ]
    return [f"Checks cast doubt on J, B or K: {', '.join(parts)}."] if parts else []


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
