"""What is compared: measures, two conditions, and for which tests together p is adjusted.

Primary measures, which a study declares, are one family, by Holm's method or in a fixed sequence.
All others are secondary, by Holm's method among themselves, but the inertia: no treatment changes
it, so that it checks the instrument and is in no family. In a sequence

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
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Notice
from rigidimeter.core.study_files import PrimaryTable
from rigidimeter.core.words import series

Origin = Literal["fits", "scores", "ratings", "column"]
Role = Literal["primary", "secondary", "check"]

LEVEL = 0.05
"""Below it p shows a difference."""

_SHOWN = 8


MEASURE_NAMES = ("measure", "title", "unit")
"""How tables and documents call what names a measure."""


class Measure(NamedTuple):
    """A quantity that rows hold.

    Attributes
    ----------
    name : str
        Stored name with unit, for example ``damping_nm_s_rad``.
    title, unit : str
        For people, for example ``Viscous damping B`` and ``N·m·s/rad``.
    origin : str
        Where its values come from: fits, scores of sinusoids, examiners' ratings, or the column of
        a table.
    """

    name: str
    title: str
    unit: str
    origin: Origin

    @property
    def label(self) -> str:
        """Title and unit, for axes and headings."""
        return f"{self.title} ({self.unit})" if self.unit else self.title

    @property
    def short(self) -> str:
        """A word for tables and lists: ``K``, ``impulse``, ``rating``."""
        if self.origin == "column":
            return self.title
        word = self.title.split()[-1]
        return word if len(word) == 1 else word.lower()

    @property
    def place(self) -> int:
        """Where summaries name it: stiffness first, for rigidity is a stiffness before all."""
        first = ("stiffness_nm_rad", "damping_nm_s_rad", "inertia_kg_m2")
        return first.index(self.name) if self.name in first else len(first)

    @property
    def counted(self) -> str:
        """What one value is, in the plural."""
        return {"ratings": "ratings", "column": "values"}.get(self.origin, "epochs")

    @property
    def names(self) -> dict[str, str]:
        """How tables and documents name it."""
        return dict(zip(MEASURE_NAMES, self, strict=False))


MEASURES = (
    Measure("inertia_kg_m2", "Inertia J", "kg·m²", "fits"),
    Measure("damping_nm_s_rad", "Viscous damping B", "N·m·s/rad", "fits"),
    Measure("stiffness_nm_rad", "Stiffness K", "N·m/rad", "fits"),
    Measure("impulse_nm_s", "Angular impulse", "N·m·s", "scores"),
    Measure("work_j", "Work", "J", "scores"),
)
"""J, B and K are those of one fit; with J held they are rows of their own (`inertia`)."""

RATING = Measure("rating", "Examiners' rating", "points", "ratings")
"""Scores less the offsets of their examiners."""

SCORE = "score"
"""What an examiner wrote down: rows from which those of `RATING` are made."""

CHECK = "inertia_kg_m2"
"""No treatment changes it, so it checks the instrument."""

_KNOWN = {one.name: one for one in (*MEASURES, RATING)}


def measure_of(name: str, *, column: bool = False) -> Measure:
    """Return the measure of a stored name; a column of a table is one, whatever its name."""
    return Measure(name, name, "", "column") if column else _KNOWN[name]


def off_first(names: Iterable[str]) -> tuple[str, ...]:
    """Return each name once in order of appearance, ``OFF`` first; empty ones are left out.

    Examples
    --------
    >>> off_first(["DBS", "", "OFF", "DBS"])
    ('OFF', 'DBS')
    """
    return tuple(sorted(dict.fromkeys(filter(None, names)), key=lambda name: name != "OFF"))


def chosen_pair(
    known: Sequence[str],
    wanted: tuple[str | None, str | None],
    *,
    holder: str = "recorded are:",
    remedy: str = "name them in a condition column, or give --condition once for each file in "
    "their order",
) -> tuple[str, str]:
    """Return the two conditions to compare: what is wanted, else the first of those known.

    Parameters
    ----------
    known : sequence of str
    wanted : (str or None, str or None)
        Reference and other, None where not given.
    holder, remedy : str
        For messages: what comes before the list of conditions, and what to do if there are not two.

    Raises
    ------
    UserError
        If a name is unknown, both are one, or there are not two.
    """
    listed = ", ".join(known[:_SHOWN]) + (", ..." if len(known) > _SHOWN else "") or "none"
    first, second = wanted
    for option, name in (("--reference", first), ("--other", second)):
        if name is not None and name not in known:
            raise UserError(f"{option} {name}: there is no such condition; {holder} {listed}")
    if first is not None and first == second:
        raise UserError(f"--reference and --other are both {first}; name two conditions")
    if len(known) < 2:
        raise UserError(f"a comparison needs two conditions; {holder} {listed}; {remedy}")
    first = first or next(name for name in known if name != second)
    return first, second or next(name for name in known if name != first)


class Family(NamedTuple):
    """The tests that p of one of them is adjusted for.

    `tests` is their number; `first` is that by which the level of the first of them is divided;
    `order` names the measures of a sequence.
    """

    role: Role = "primary"
    rule: Literal["holm", "sequence", "none"] = "none"
    tests: int = 1
    first: int = 1
    order: tuple[str, ...] = ()

    @property
    def level(self) -> float:
        """The level of the first test of the family."""
        return LEVEL / self.first


class PValue(NamedTuple):
    """A test by its measure, the condition that is compared with the reference, and p; or NaN."""

    measure: Measure
    other: str
    p: float


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
        return series([measure_of(name).short for name in names])

    @property
    def late(self) -> bool:
        """Whether the measures were declared after the first recording, as far as is known."""
        declared, first = self.table.declared, self.first_recording
        return declared is not None and first is not None and declared > first

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What is odd about the declaration."""
        text = ""
        if self.source == "earlier comparison":
            text = (
                "study.toml has no [primary], and analysis/ holds an earlier comparison, so all "
                "measures stay one family by Holm's method, J among them; declare [primary] to "
                "conclude from K and B"
            )
        elif self.late:
            text = (
                f"study.toml: the primary measures were declared on {self.table.declared}, after "
                f"the first recording, of {self.first_recording}"
            )
        return (Notice("warning", text),) if text else ()

    def row(self, measures: Iterable[Measure]) -> dict[str, Any]:
        """Return the declaration as documents have it, of the measures that were compared."""
        names = [each.name for each in measures if self.role(each) == "primary"]
        declared_alone = self.source != "earlier comparison" and {*names} <= {*self.table.measures}
        declared, first = self.table.declared, self.first_recording
        return {
            "measures": list(self.table.measures) if declared_alone else names,
            "rule": self.table.rule,
            "difference_percent": self.table.difference_percent,
            "declared": None if declared is None else declared.isoformat(),
            "first_recording": None if first is None else first.isoformat(),
            "declared_after_first_recording": self.late,
            "source": self.source,
        }


def adjusted(tests: Sequence[PValue], primary: Primary) -> list[tuple[float, Family]]:
    """Return p of each test, adjusted in its family, and the family."""
    found: dict[int, tuple[float, Family]] = {}
    roles = [primary.role(one.measure) for one in tests]
    for role in dict.fromkeys(roles):
        places = [k for k, one in enumerate(roles) if one == role]
        own = [tests[k] for k in places]
        family = _family(role, own, primary.table)
        found |= {k: (p, family) for k, p in zip(places, _adjusted(own, family), strict=True)}
    return [found[k] for k in range(len(tests))]


def _family(role: Role, own: Sequence[PValue], table: PrimaryTable) -> Family:
    if role == "check":
        return Family("check")
    count = sum(not math.isnan(one.p) for one in own) or len(own)
    if role == "primary" and table.rule == "sequence":
        conditions = len({one.other for one in own})
        return Family(role, "sequence", count, conditions, tuple(table.measures))
    return Family(role, "holm", count, count)


def _adjusted(own: Sequence[PValue], family: Family) -> Sequence[float]:
    alone = [one.p for one in own]
    if family.rule == "none":
        return alone
    if family.rule == "holm":
        return holm(alone)
    largest: dict[str, float] = {}
    found = [math.nan] * len(own)
    for k in sorted(range(len(own)), key=lambda k: family.order.index(own[k].measure.name)):
        _, other, p = own[k]
        # What could not be tested is not shown either.
        largest[other] = max(largest.get(other, 0.0), 1.0 if math.isnan(p) else p)
        found[k] = math.nan if math.isnan(p) else min(1.0, family.first * largest[other])
    return found
