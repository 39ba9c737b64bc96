"""What is compared: the measures, the values that count, and the choice of two conditions."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis, Fit, Score

_SHOWN = 8


@dataclass(frozen=True)
class Measure:
    """What is compared.

    Attributes
    ----------
    name : str
        Stored name with unit, for example ``damping_nm_s_rad``.
    title, unit : str
        For people, for example ``Viscous damping B`` and ``N·m·s/rad``.
    origin : str
        Where its values come from: a field of an analysis, examiners' ratings, or the column of a
        table.
    """

    name: str
    title: str
    unit: str
    origin: Literal["fits", "scores", "ratings", "column"]

    def results(self, analysis: Analysis) -> Sequence[Fit | Score]:
        """Return the fits or scores that hold this measure."""
        if self.origin in ("ratings", "column"):
            return ()
        found: Sequence[Fit | Score] = getattr(analysis, self.origin)
        return found

    @property
    def label(self) -> str:
        """Title and unit, for axes and headings."""
        return f"{self.title} ({self.unit})" if self.unit else self.title

    @property
    def short(self) -> str:
        """A word for tables and lists: ``K``, ``impulse``, ``rating``."""
        word = self.title.split()[-1] if self.origin != "column" else self.title
        return word if len(word) == 1 or self.origin == "column" else word.lower()

    @property
    def place(self) -> int:
        """Where summaries name it: stiffness first, for rigidity is a stiffness before all."""
        first = ("stiffness_nm_rad", "damping_nm_s_rad", "inertia_kg_m2")
        return first.index(self.name) if self.name in first else len(first)

    @property
    def counted(self) -> str:
        """What one value is, in the plural."""
        return {"ratings": "ratings", "column": "values"}.get(self.origin, "epochs")


MEASURES = (
    Measure("inertia_kg_m2", "Inertia J", "kg·m²", "fits"),
    Measure("damping_nm_s_rad", "Viscous damping B", "N·m·s/rad", "fits"),
    Measure("stiffness_nm_rad", "Stiffness K", "N·m/rad", "fits"),
    Measure("impulse_nm_s", "Angular impulse", "N·m·s", "scores"),
    Measure("work_j", "Work", "J", "scores"),
)
"""J, B and K are those of one fit. The paper's second stage, with J held, is in `sensitivity`."""

RATING = Measure("rating", "Examiners' rating", "points", "ratings")
"""Scores less the offsets of their examiners."""


@dataclass(frozen=True)
class Observation:
    """One value of a measure that counts.

    Attributes
    ----------
    value, low, high : float
        With the ends of its own 95 % interval, NaN where it has none.
    condition, subject, day, source, epoch : str
        Empty where unknown.
    unit : str
        What the bootstrap resamples: a day of a subject, a session, or the value itself.
    group : str
        Of subjects, such as patients.
    """

    value: float
    condition: str
    subject: str = ""
    day: str = ""
    source: str = ""
    epoch: str = ""
    unit: str = ""
    low: float = math.nan
    high: float = math.nan
    group: str = ""


def conditions(analysis: Analysis) -> tuple[str, ...]:
    """Return the named conditions in order of appearance, ``OFF`` first where it occurs."""
    results: list[Fit | Score] = [*analysis.fits, *analysis.scores]
    return off_first(result.condition for result in results)


def off_first(names: Iterable[str]) -> tuple[str, ...]:
    """Return each name once in order of appearance, ``OFF`` first; empty ones are left out."""
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
        For messages: what to say before the list of conditions, and what to do if there are not
        two.

    Raises
    ------
    UserError
        If a name is unknown, both are one, or there are not two.
    """
    listed = ", ".join(known[:_SHOWN]) + (", ..." if len(known) > _SHOWN else "")
    for option, name in zip(("--reference", "--other"), wanted, strict=True):
        if name is not None and name not in known:
            raise UserError(
                f"{option} {name}: there is no such condition; {holder} {listed or 'none'}"
            )
    first, second = wanted
    if first is not None and first == second:
        raise UserError(f"--reference and --other are both {first}; name two conditions")
    if len(known) < 2:
        raise UserError(f"a comparison needs two conditions; {holder} {listed or 'none'}; {remedy}")
    first = first or next(name for name in known if name != second)
    return first, second or next(name for name in known if name != first)
