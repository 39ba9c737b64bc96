"""What is compared: the measures, and which two conditions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal, NamedTuple

from rigidimeter.core.errors import UserError

Origin = Literal["fits", "scores", "ratings", "column"]

_SHOWN = 8


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
        return {"measure": self.name, "title": self.title, "unit": self.unit}


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
