"""A plan of days from what was asked for: drawn, shown, and written into the folder of a study.

The command `study plan` and the operator's page only collect the values; all else is here.
"""

from __future__ import annotations

import random
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import read_json, toml_text
from rigidimeter.core.session import drawn_codes
from rigidimeter.core.settings import Settings, changed_settings, validated
from rigidimeter.core.study_files import (
    PLAN_BOUNDS,
    ConditionTable,
    PlannedBlock,
    PlanToml,
    StudyPlan,
    is_study,
    write_new_study,
    write_plan,
)
from rigidimeter.planning.document import DESIGN_SCHEMA
from rigidimeter.planning.study_days import StudyDays, WrongValue, draw_days

Order = Literal["balanced", "drawn", "given"]

BOUNDS: Mapping[str, tuple[float, float]] = {
    **PLAN_BOUNDS,
    "sessions": (1, 6),
    "prbs_epochs": (0, 500),
    "sinusoid_epochs": (0, 500),
}
"""The least and the largest value of each number."""

_SEED = 2023
_NAME = re.compile(r"\w[\w.+-]*")
_LONGEST_NAME = 40
_COUNT = re.compile(r"\d{1,9}", re.ASCII)


@dataclass(frozen=True)
class PlanValues:
    """What is asked for, by the names of the options of `study plan`.

    Attributes
    ----------
    stimulated : tuple of str, optional
        All conditions but the first by default.
    order : str
        `given` for that of `given`.
    rests_s : tuple of float
        Those of the settings if empty.
    seed : int, optional
        Of orders, codes and sessions; a usual one by default, or one that nobody knows where
        examiners are blinded.
    """

    subjects: tuple[str, ...]
    days: int = 8
    conditions: tuple[str, ...] = ("OFF", "DBS")
    stimulated: tuple[str, ...] | None = None
    days_of: Mapping[str, int] = field(default_factory=dict)
    sessions: int = 1
    order: Order = "balanced"
    given: tuple[str, ...] = ()
    wait_after_on: float = 15.0
    wait_after_off: float = 60.0
    prbs_epochs: int = 5
    sinusoid_epochs: int = 3
    rests_s: tuple[float, ...] = ()
    raters: tuple[str, ...] = ()
    blinded: bool = False
    seed: int | None = None

    def __post_init__(self) -> None:
        for key, (low, high) in BOUNDS.items():
            value = getattr(self, key)
            if value is not None and not low <= value <= high:
                raise WrongValue(key, f"must be from {low:g} to {high:.0f}", f"{value:.10g}")
        for name in self.stimulated or ():
            if name not in self.conditions:
                known = ", ".join(self.conditions)
                raise WrongValue("stimulated", f"is not one of the conditions {known}", name)
        if not self.prbs_epochs and not self.sinusoid_epochs:
            raise WrongValue("prbs_epochs", "a session needs an epoch, PRBS or sinusoidal", "0")

    def days_asked(self, seed: int) -> StudyDays:
        """Return the same as what the days are drawn from."""
        counts = ("prbs", self.prbs_epochs), ("sinusoid", self.sinusoid_epochs)
        codes = drawn_codes(self.conditions, random.Random(f"codes {seed}"))
        return StudyDays(
            subjects=self.subjects,
            conditions=self.conditions,
            days=self.days,
            stimulated=self.conditions[1:] if self.stimulated is None else self.stimulated,
            days_of=self.days_of,
            sessions_a_day=self.sessions,
            order=self.given if self.order == "given" else (),
            balanced=self.order != "drawn",
            wait_after_on_min=self.wait_after_on,
            wait_after_off_min=self.wait_after_off,
            task=" ".join(name for name, count in counts if count),
            raters=self.raters,
            codes=codes if self.blinded else {},
        )


@dataclass(frozen=True)
class DrawnPlan:
    """A plan before it is written."""

    about: PlanToml
    blocks: tuple[PlannedBlock, ...]
    protocols: Mapping[str, str]

    def shown(self, folder: Path) -> StudyPlan:
        """Return the plan as it would be in a folder, in which nothing is written."""
        return StudyPlan(folder, self.about, self.blocks, "")

    def write(self, folder: Path) -> StudyPlan:
        """Write the plan into a study folder, which is made if it is none.

        Raises
        ------
        UserError
            If there is a plan already, or the folder cannot be written.
        """
        about = self.about
        if not is_study(folder) and len(about.conditions) > 1:
            waits = dict.fromkeys(about.stimulated, about.wait_after_on_min)
            tables = {
                name: ConditionTable(wash_in_min=waits.get(name)) for name in about.conditions
            }
            write_new_study(folder, planned=tables)
        return write_plan(folder, about, self.blocks, self.protocols)


def draw_plan(values: PlanValues, base: Settings) -> DrawnPlan:
    """Draw a plan.

    Parameters
    ----------
    values : PlanValues
    base : Settings
        What the settings files of all conditions share.

    Raises
    ------
    WrongValue
        If the values do not go together.
    UserError
        If the plan or the settings do not hold with them.
    """
    seed = values.seed
    if seed is None:
        seed = random.SystemRandom().randrange(2**31) if values.blinded else _SEED
    spec = values.days_asked(seed)
    stated = {
        "subjects": list(spec.subjects),
        "days": spec.days,
        "conditions": list(spec.conditions),
        "stimulated": list(spec.stimulated),
        "order": values.order,
        "seed": seed,
        "wait_after_on_min": spec.wait_after_on_min,
        "wait_after_off_min": spec.wait_after_off_min,
        "raters": list(spec.raters),
        "codes": dict(spec.codes),
    }
    about = validated(PlanToml, stated, "the plan")
    protocols = {spec.protocol_of(name): _protocol(base, name, values) for name in spec.conditions}
    return DrawnPlan(about, draw_days(spec, seed), protocols)


def plan_names(text: str, key: str) -> tuple[str, ...]:
    """Return names with commas between them.

    Raises
    ------
    WrongValue
        If there is none, or one is given twice or is not to be a name.

    Examples
    --------
    >>> plan_names("OFF, DBS", "conditions")
    ('OFF', 'DBS')
    """
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    if not names or len(set(names)) < len(names):
        raise WrongValue(
            key, "write different names with commas between, such as A,B", text.strip()
        )
    for name in names:
        if _NAME.fullmatch(name) is None or len(name) > _LONGEST_NAME:
            raise WrongValue(
                key,
                f"{name[:60]!r} is not allowed; use 1 to {_LONGEST_NAME} letters, digits, -, + and "
                "_, the first a letter or digit",
            )
    return names


def plan_days_of(texts: Sequence[str]) -> dict[str, int]:
    """Return on how many days conditions are recorded, from texts such as ``DBS=4``.

    Raises
    ------
    WrongValue
    """
    found = {}
    for text in texts:
        name, _, count = (part.strip() for part in text.partition("="))
        if _COUNT.fullmatch(count) is None or name in found:
            raise WrongValue(
                "days_of", "write each condition once with its days, such as DBS=4", text[:60]
            )
        found[name] = int(count)
    return found


def days_of_design(path: Path) -> tuple[int, int]:
    """Return the days and PRBS epochs a day that a design asks for.

    Raises
    ------
    UserError
        If the file is no design with a difference to detect.
    """
    document = read_json(path)
    if not isinstance(document, dict) or document.get("schema") != DESIGN_SCHEMA:
        raise UserError(f"{path}: is not the JSON of rigidimeter design --json")
    found = [one.get("planned") or {} for one in document.get("detection", [])]
    days = [one["days_needed"] for one in found if one.get("days_needed")]
    if not days:
        raise UserError(
            f"{path}: names no days; run design with --detect and a protocol that has epochs of "
            "two conditions"
        )
    return max(days), max(max(one["epochs_a_day"]) for one in found if one)


def day_settings(values: PlanValues, base: Settings) -> Settings:
    """Return the settings of a day with one session of each condition, for `design`.

    Raises
    ------
    UserError
        If the settings do not hold with the values.
    """
    return _settings(base, values.conditions, values)


def _protocol(base: Settings, condition: str, values: PlanValues) -> str:
    """Return the settings file of the sessions of a condition."""
    made = _settings(base, (condition,), values)
    return toml_text(made.model_dump(mode="json", exclude_unset=True))


def _settings(base: Settings, conditions: Sequence[str], values: PlanValues) -> Settings:
    counts = {"prbs": values.prbs_epochs, "sinusoid": values.sinusoid_epochs}
    blocks = [
        {"task": task, "condition": condition, "epochs": count}
        for condition in conditions
        for task, count in counts.items()
        if count
    ]
    rests = {"rests_s": list(values.rests_s)} if values.rests_s else {}
    first = next(iter(base.subject.values())).model_dump(mode="json", exclude_unset=True)
    joints = {name: first for name in conditions if name not in base.subject}
    what = f"condition {', '.join(conditions)}"
    return changed_settings(
        base, {"subject": joints, "protocol": {"blocks": blocks, **rests}}, what
    )
