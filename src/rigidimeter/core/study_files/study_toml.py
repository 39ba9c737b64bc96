"""`study.toml`: what a study is, which two conditions it compares, and how they differ.

Strict as the settings are: an unknown key is refused with the nearest known one, a number out of
its range with the range and the unit.

What the program wrote without being asked carries a checksum. Once a person has changed the file,
it is theirs, and nothing is written into it any more.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from rigidimeter.core.files import (
    FIELD,
    ZEROS,
    checksum_holds,
    text_bytes,
    toml_text,
    with_checksum,
)
from rigidimeter.core.records import Axis
from rigidimeter.core.settings import Section, quantity, read_section

STUDY_FILE = "study.toml"
STUDY_SCHEMA = "rigidimeter.study/1"

OFF, DBS = "OFF", "DBS"
_TITLES = {OFF: "stimulation off", DBS: "stimulation on"}

_REFERENCE = """\
# Differences shown are other - reference; the columns shift and estimate of the tables are
# reference - other.
"""
_TABLES = """\
# The tables, below this folder. Only that of the sessions must exist.
sessions = "sessions.csv"       # path,subject,day,condition,part,note
ratings = "ratings.csv"         # subject,day,condition,examiner,score
exclusions = "exclusions.csv"   # path,epoch,reason,by
# A blinding key (code,condition) is key.csv in this folder, or given with --key FILE. Without one,
# codes stay codes.
"""
_NOT_WRITTEN = """\
# What was not written down may be left out; the amplitude is amplitude_v or amplitude_ma.
# frequency_hz = 130.0
# amplitude_ma = 2.5
# pulse_width_us = 60.0
# electrodes = "1-2+"
# wash_in_min = 15.0
"""
_PRIMARY = """\
[primary]
# What the study concludes from; declare it before the data.
measures = [{measures}]
rule = "{rule}"   # or "sequence": each is claimed only if those before it are shown
difference_percent = {difference}   # the smallest difference worth finding, of the reference
{declared}   # the day on which it was declared
"""
_TAIL = """\
[rating]
scale = [0.0, 3.0]   # lowest and highest score
step = 0.5           # 0 for none

[analysis]
method = "auto"      # as --method takes it
axis = "unknown"     # of the joint: vertical or horizontal; unknown: as the sessions state it
"""
_OWN = (
    "# Written by rigidimeter, which adds conditions and stimulation as sessions are recorded,"
    f'\n# until you change a line.\n# {FIELD.decode()}{ZEROS}"\n'
)


def _optional(unit: str, low: float, high: float) -> Any:
    return Field(None, ge=low, le=high, json_schema_extra={"unit": unit})


def _text(default: Any, shortest: int = 1, longest: int = 200) -> Any:
    return Field(default, min_length=shortest, max_length=longest)


class SimulatedTable(Section):
    """``[simulated.NAME]``: medians of a virtual condition, by the measures' names."""

    inertia_kg_m2: float | None = _optional("kg·m²", 0.0, 1e3)
    damping_nm_s_rad: float | None = _optional("N·m·s/rad", 0.0, 1e4)
    stiffness_nm_rad: float | None = _optional("N·m/rad", 0.0, 1e5)
    impulse_nm_s: float | None = _optional("N·m·s", 0.0, 1e5)
    work_j: float | None = _optional("J", 0.0, 1e5)
    rating: float | None = _optional("points", -1e3, 1e3)


class ConditionTable(Section):
    """``[conditions.NAME]``: how people call it, and the stimulation if there is one."""

    title: str = _text("", 0)
    frequency_hz: float | None = _optional("Hz", 0.0, 1000.0)
    amplitude_v: float | None = _optional("V", 0.0, 50.0)
    amplitude_ma: float | None = _optional("mA", 0.0, 50.0)
    pulse_width_us: float | None = _optional("µs", 0.0, 10000.0)
    electrodes: str = _text("", 0)
    wash_in_min: float | None = _optional("min", 0.0, 100000.0)

    @model_validator(mode="after")
    def _one_amplitude(self) -> Self:
        if self.amplitude_v is not None and self.amplitude_ma is not None:
            raise ValueError(
                "amplitude_v and amplitude_ma are both given; a stimulator holds one of them, so "
                "give the one that it holds"
            )
        return self


class RatingTable(Section):
    """``[rating]``: lowest and highest score, and the step of the scale (0 for none)."""

    scale: list[float] = Field(default_factory=lambda: [0.0, 3.0], min_length=2, max_length=2)
    step: float = Field(0.5, ge=0.0, le=100.0, json_schema_extra={"unit": "1"})

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.scale[0] < self.scale[1]:
            raise ValueError(
                f"scale = [{self.scale[0]:g}, {self.scale[1]:g}] must be the lowest score and then "
                "the highest"
            )
        return self


class SubjectTable(Section):
    """``[subjects.NAME]``: what archives and readers ask about a subject, but not who it is.

    Parameters
    ----------
    group : str
        Such as ``patients``.
    body_mass_kg, forearm_length_m : float or None
        With both, `design --from` computes the bandwidth of this arm (App. A).
    side : str
        The side that is measured, ``L`` or ``R``.
    handedness : str
        ``L``, ``R`` or ``A`` (both).
    diagnosis, severity : str
        Severity with its scale, such as ``Hoehn and Yahr 2.5``.
    medication : str
    medication_since_h : float or None
        Since the last dose.
    implant_target : str
        Such as ``STN``.
    implant_side : str
        ``L``, ``R`` or ``B`` (both).
    """

    age_years: float | None = _optional("years", 0.0, 130.0)
    sex: Literal["F", "M", "O", "U"] = "U"
    species: str = _text("Homo sapiens")
    group: str = _text("", 0, 40)
    body_mass_kg: float | None = _optional("kg", 0.01, 500.0)
    forearm_length_m: float | None = _optional("m", 0.005, 1.0)
    side: Literal["L", "R", ""] = ""
    handedness: Literal["L", "R", "A", ""] = ""
    diagnosis: str = _text("", 0)
    severity: str = _text("", 0)
    medication: str = _text("", 0)
    medication_since_h: float | None = _optional("h", 0.0, 10000.0)
    implant_target: str = _text("", 0, 40)
    implant_side: Literal["L", "R", "B", ""] = ""

    @model_validator(mode="before")
    @classmethod
    def _nobody_is_named(cls, values: Any) -> Any:
        for key in ("name", "date_of_birth", "birth_date", "birthday", "initials"):
            if isinstance(values, Mapping) and key in values:
                raise ValueError(
                    f"{key} would say who the subject is; remove it, and give age_years instead of "
                    "a date of birth"
                )
        return values


class ArchiveTable(Section):
    """``[archive]``: what archives ask about a data set; nothing is computed from it."""

    joint: str = _text("elbow", 1, 40)
    authors: list[str] = Field(default_factory=list, max_length=200)
    institution: str = _text("", 0)
    lab: str = _text("", 0)
    license: str = _text("", 0)
    keywords: list[str] = Field(default_factory=list, max_length=50)


PrimaryMeasure = Literal["stiffness_nm_rad", "damping_nm_s_rad", "impulse_nm_s", "work_j", "rating"]
"""What a study may conclude from. Inertia is not among them: it checks the instrument."""

_MEASURES: list[PrimaryMeasure] = ["stiffness_nm_rad", "damping_nm_s_rad"]


class PrimaryTable(Section):
    """``[primary]``: what the study concludes from, declared before the data.

    Parameters
    ----------
    measures : list of str
        Names as in the tables.
    rule : str
        ``holm``, or ``sequence``: tested in this order, each at the full level, and claimed only if
        all before it are shown.
    difference_percent : float
        The smallest difference worth finding, of the reference.
    declared : date or None
        The day on which it was declared.
    """

    measures: list[PrimaryMeasure] = Field(
        default_factory=_MEASURES.copy, min_length=1, max_length=5
    )
    rule: Literal["holm", "sequence"] = "holm"
    difference_percent: float = quantity(20.0, "%", 1.0, 100.0)
    declared: date | None = None

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        for name in self.measures:
            if self.measures.count(name) > 1:
                raise ValueError(f"measures names {name} twice; name each measure once")
        return self

    def first_level(self, alpha: float) -> float:
        """Return the level of the first test of the family.

        Parameters
        ----------
        alpha : float
            Of the family, between 0 and 1.

        Examples
        --------
        >>> PrimaryTable().first_level(0.05), PrimaryTable(rule="sequence").first_level(0.05)
        (0.025, 0.05)
        """
        return alpha / (len(self.measures) if self.rule == "holm" else 1)


class AnalysisTable(Section):
    """``[analysis]``: how the study is analysed.

    Parameters
    ----------
    method : str
        Of estimation, as ``--method`` takes it.
    axis : {"unknown", "vertical", "horizontal"}
        How the joint's axis stands, instead of `diagnostics.axis` of the settings; ``"unknown"``
        leaves that.
    one_offset_a_day : bool
        Read and without effect: the test by days is chosen by which days have which conditions.
    """

    method: str = _text("auto", 1, 40)
    axis: Axis = "unknown"
    one_offset_a_day: bool = False


class StudyToml(Section):
    """All of `study.toml` but its schema."""

    title: str = _text(...)
    reference: str = _text(..., 1, 40)
    other: str = _text(..., 1, 40)
    sessions: str = _text("sessions.csv")
    ratings: str = _text("ratings.csv")
    exclusions: str = _text("exclusions.csv")
    key: str = _text("key.csv")
    mapping: str | None = Field(None, min_length=1, max_length=200)
    conditions: dict[str, ConditionTable] = Field(default_factory=dict)
    simulated: dict[str, SimulatedTable] = Field(default_factory=dict)
    rating: RatingTable = RatingTable()
    subjects: dict[str, SubjectTable] = Field(default_factory=dict)
    archive: ArchiveTable = ArchiveTable()
    primary: PrimaryTable = PrimaryTable()
    analysis: AnalysisTable = AnalysisTable()

    @model_validator(mode="after")
    def _tables_below(self) -> Self:
        for name in ("sessions", "ratings", "exclusions"):  # a key may be kept elsewhere
            if is_outside(getattr(self, name)):
                raise ValueError(
                    f"{name} = {getattr(self, name)!r} is outside the study folder; name a file "
                    f'in it, as in {name} = "{name}.csv"'
                )
        return self

    @model_validator(mode="after")
    def _mapping_below(self) -> Self:
        if self.mapping is not None and is_outside(self.mapping):
            raise ValueError(
                f"mapping = {self.mapping!r} is outside the study folder; copy the file into it"
            )
        return self

    @model_validator(mode="after")
    def _two_conditions(self) -> Self:
        if self.reference == self.other:
            raise ValueError(f"reference and other are both {self.reference!r}; name two")
        for key in ("reference", "other"):
            name = getattr(self, key)
            if self.conditions and name not in self.conditions:
                raise ValueError(
                    f"{key} = {name!r}, but there is no [conditions.{name}]; there are: "
                    f"{', '.join(self.conditions)}"
                )
        return self


def is_outside(path: str) -> bool:
    """Whether a path that a study names leads out of its folder."""
    return os.path.isabs(path) or os.path.normpath(path).split(os.sep)[0] == os.pardir


def read_study_toml(path: Path) -> StudyToml:
    """Read and check a `study.toml`.

    Raises
    ------
    UserError
        Naming each offending key, its value, and what would be right.
    """
    return read_section(path, STUDY_SCHEMA, StudyToml)


def study_text(
    title: str,
    reference: str,
    other: str,
    conditions: Mapping[str, ConditionTable],
    primary: PrimaryTable | None = None,
) -> str:
    """Return a `study.toml`, with comments on what may be filled in.

    Parameters
    ----------
    title, reference, other : str
    conditions : mapping of str to ConditionTable
        What is known of the stimulation in each; reference and other at least.
    primary : PrimaryTable, optional
        What the study concludes from; without it nothing is declared.
    """
    about = toml_text({"schema": STUDY_SCHEMA, "title": title})
    pair = _REFERENCE + toml_text({"reference": reference, "other": other})
    described = (_condition(*one, reference) for one in conditions.items())
    declared = [] if primary is None else [primary_text(primary)]
    return "\n".join([about, pair, _TABLES, *described, *declared, _TAIL])


def primary_text(primary: PrimaryTable) -> str:
    """Return the table ``[primary]`` of a `study.toml`."""
    day = primary.declared
    return _PRIMARY.format(
        measures=", ".join(f'"{name}"' for name in primary.measures),
        rule=primary.rule,
        difference=primary.difference_percent,
        declared="# declared = 2026-01-31" if day is None else f"declared = {day}",
    )


def own_text(text: str) -> str:
    """Return a `study.toml` marked as the program's own."""
    return with_checksum(text_bytes(_OWN + text)).decode("utf-8")


def is_own(content: bytes) -> bool:
    """Whether a `study.toml` is as the program wrote it."""
    return checksum_holds(content)


def pair_of(recorded: list[str], known: list[str]) -> tuple[str, str]:
    """Return reference and other: conditions that were recorded, filled up with known ones.

    A name that is not known may be a code.

    Examples
    --------
    >>> pair_of(["DBS", "OFF"], ["OFF", "DBS"]), pair_of(["code A"], ["OFF", "DBS"])
    (('OFF', 'DBS'), ('OFF', 'DBS'))
    """
    named = [name for name in recorded if name in known]
    first, second = list(dict.fromkeys([*named, *known, OFF, DBS]))[:2]
    return (second, first) if second == OFF else (first, second)


def _condition(name: str, table: ConditionTable, reference: str) -> str:
    given = table.model_dump(exclude_unset=True, exclude={"title"})
    title = table.title or _TITLES.get(name, "")
    written = toml_text({"conditions": {name: {"title": title, **given}}})
    return written + (_NOT_WRITTEN if not given and name != reference else "")
