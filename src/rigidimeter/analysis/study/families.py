"""Which tests p is adjusted for together: what a study declared that it concludes from.

Primary measures are one family, by Holm's method or in a fixed sequence. All others are secondary,
by Holm's method among themselves, but the inertia: no treatment changes it, so that it checks the
instrument and is in no family. In a sequence

    p of a measure = c · the largest p of it and of those before it

with c the number of conditions that are compared with the reference. Columns of a table, and a
study that was compared before anything could be declared, are one family by Holm's method.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from datetime import date
from typing import Any, Literal, NamedTuple

from rigidimeter.analysis.statistics import holm
from rigidimeter.analysis.study.measures import MEASURES, RATING, Measure
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import read_json
from rigidimeter.core.records import Notice
from rigidimeter.core.study_files import PrimaryTable, StudyFolder
from rigidimeter.core.words import series

Role = Literal["primary", "secondary", "check"]

CHECK = "inertia_kg_m2"
ANALYSIS, COMPARISON = "analysis", "comparison.json"


class Family(NamedTuple):
    """The tests that p of one of them is adjusted for.

    `tests` is their number; `first` is that by which the level of the first of them is divided;
    `order` names the measures of a sequence.
    """

    role: Role
    rule: str
    tests: int
    first: int
    order: tuple[str, ...] = ()

    def level(self, alpha: float) -> float:
        """Return the level of the first test of the family."""
        return alpha / self.first


@dataclass(frozen=True)
class Primary:
    """What a study concludes from, and where that is from.

    Attributes
    ----------
    table : PrimaryTable
    source : str
        ``study.toml``, ``default``, or ``earlier comparison``, which had all measures in one
        family.
    first_recording : date or None
        The first day that is named by a date.
    """

    table: PrimaryTable = field(default_factory=PrimaryTable)
    source: Literal["study.toml", "default", "earlier comparison"] = "default"
    first_recording: date | None = None

    def role(self, measure: Measure) -> Role:
        """Return what a measure is to the study."""
        if measure.origin == "column" or self.source == "earlier comparison":
            return "primary"
        if measure.name == CHECK:
            return "check"
        return "primary" if measure.name in self.table.measures else "secondary"

    def before(self, measure: Measure) -> str:
        """Return the words of the measures before one in the declared sequence."""
        declared: list[str] = [*self.table.measures]
        names = declared[: declared.index(measure.name)]
        known = {one.name: one.short for one in (*MEASURES, RATING)}
        return series([known[name] for name in names])

    @property
    def late(self) -> bool:
        """Whether the measures were declared after the first recording, as far as is known."""
        declared, first = self.table.declared, self.first_recording
        return declared is not None and first is not None and declared > first

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What is to be said of the declaration."""
        if self.source == "earlier comparison":
            text = (
                "study.toml has no [primary], and analysis/ holds an earlier comparison, so all "
                "measures stay one family by Holm's method, J among them; declare [primary] to "
                "conclude from K and B"
            )
            return (Notice("warning", text),)
        if self.late:
            text = (
                f"study.toml: the primary measures were declared on {self.table.declared}, after "
                f"the first recording, of {self.first_recording}"
            )
            return (Notice("warning", text),)
        return ()

    def row(self, measures: Iterable[Measure]) -> dict[str, Any]:
        """Return the declaration as documents have it, of the measures that were compared."""
        one_family = [each.name for each in measures if self.role(each) == "primary"]
        declared = self.table.declared
        first = self.first_recording
        return {
            "measures": one_family if self._all_in_one(one_family) else list(self.table.measures),
            "rule": self.table.rule,
            "difference_percent": self.table.difference_percent,
            "declared": None if declared is None else declared.isoformat(),
            "first_recording": None if first is None else first.isoformat(),
            "declared_after_first_recording": self.late,
            "source": self.source,
        }

    def _all_in_one(self, names: Sequence[str]) -> bool:
        return self.source == "earlier comparison" or not {*names} <= {*self.table.measures}


def primary_of(study: StudyFolder, days: Iterable[str]) -> Primary:
    """Return what a study concludes from; `days` are those of its recordings as it names them."""
    first = min((day for day in map(_date, days) if day is not None), default=None)
    if "primary" in study.about.model_fields_set:
        return Primary(study.about.primary, "study.toml", first)
    earlier = study.folder / ANALYSIS / COMPARISON
    try:
        found = read_json(earlier) if earlier.is_file() else None
    except UserError:
        found = None  # damaged: what keeps the analysis says so
    known = found.get("primary") if isinstance(found, dict) else None
    if found is None or (isinstance(known, dict) and known.get("source") == "default"):
        return Primary(first_recording=first)
    return Primary(source="earlier comparison", first_recording=first)


def adjusted(
    tests: Sequence[tuple[Measure, str, float]], primary: Primary
) -> list[tuple[float, Family]]:
    """Return p of each test, adjusted in its family, and the family.

    Parameters
    ----------
    tests : sequence of (Measure, str, float)
        Measure, condition that is compared with the reference, and p; NaN without a test.
    primary : Primary
    """
    found: dict[int, tuple[float, Family]] = {}
    roles = [primary.role(measure) for measure, _, _ in tests]
    for role in dict.fromkeys(roles):
        own = [k for k, one in enumerate(roles) if one == role]
        p = [tests[k][2] for k in own]
        count = sum(not math.isnan(one) for one in p) or len(own)
        family = Family(role, "holm", count, count)
        if role == "check":
            family = Family(role, "none", 1, 1)
        elif role == "primary" and primary.table.rule == "sequence":
            conditions = len({tests[k][1] for k in own})
            order = tuple(primary.table.measures)
            family = Family(role, "sequence", count, conditions, order)
        found |= dict(
            zip(own, ((one, family) for one in _by(family, own, tests, primary)), strict=True)
        )
    return [found[k] for k in range(len(tests))]


def _by(
    family: Family,
    own: Sequence[int],
    tests: Sequence[tuple[Measure, str, float]],
    primary: Primary,
) -> Sequence[float]:
    p = [tests[k][2] for k in own]
    if family.rule == "holm":
        return holm(p)
    if family.rule == "none":
        return p
    order: dict[str, int] = {name: k for k, name in enumerate(primary.table.measures)}
    largest: dict[str, float] = {}
    found: dict[int, float] = {}
    for k in sorted(own, key=lambda k: order[tests[k][0].name]):
        _, other, alone = tests[k]
        # What could not be tested is not shown either.
        largest[other] = max(largest.get(other, 0.0), 1.0 if math.isnan(alone) else alone)
        found[k] = math.nan if math.isnan(alone) else min(1.0, family.first * largest[other])
    return [found[k] for k in own]


def _date(day: str) -> date | None:
    try:
        return date.fromisoformat(day)
    except ValueError:
        return None
