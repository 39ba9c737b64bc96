"""The plan of a study: what is to be recorded on which day, in which order, after which wait.

    plan.toml     how it was drawn: subjects, waits, examiners, seed, codes, digest of the table
    plan.csv      a row for each session: subject, day, order in the day, condition, wait before it
    protocols/    a settings file for each kind of session

`plan.csv` may be edited by hand. It is checked whenever it is read, and its digest goes into the
manifest of every session that is run from it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from rigidimeter.core.errors import UserError, refused
from rigidimeter.core.files import (
    DOCUMENT_BYTES,
    cell_number,
    csv_text,
    noted_digests,
    read_bytes,
    read_text_table,
    text_bytes,
    toml_text,
    write_text,
)
from rigidimeter.core.session import in_codes
from rigidimeter.core.settings import Section, read_section
from rigidimeter.core.study_files.study_toml import is_outside

PLAN_FILE, PLAN_TABLE = "plan.toml", "plan.csv"
PLAN_SCHEMA = "rigidimeter.plan/1"
TASKS = ("prbs", "sinusoid")
LONGEST_WAIT_MIN = 24 * 60.0
PLAN_BOUNDS: Mapping[str, tuple[float, float]] = {
    "days": (1, 1000),
    "seed": (0, 2**31),
    "wait_after_on": (0.0, LONGEST_WAIT_MIN),
    "wait_after_off": (0.0, LONGEST_WAIT_MIN),
}
"""The least and the largest value of numbers of a plan."""

_LONGEST_DAY, _MOST_ORDER = 40, 1000

COLUMNS = ("subject", "day", "order", "condition", "task", "protocol", "wait_min", "raters")
_MAY_BE_EMPTY = ("raters",)


@dataclass(frozen=True)
class PlannedBlock:
    """One session of a plan.

    Attributes
    ----------
    subject : str
    day : str
        A label, not a date.
    order : int
        Place in the day, from 1.
    condition : str
    task : str
        ``prbs``, ``sinusoid`` or both.
    protocol : str
        The settings file, below the study folder.
    wait_min : float
        From the change of the stimulation to the first epoch.
    raters : str
        Who rates in it, separated by blanks.
    """

    subject: str
    day: str
    order: int
    condition: str
    task: str
    protocol: str
    wait_min: float
    raters: str = ""

    @property
    def key(self) -> tuple[str, str, int]:
        """What names it: subject, day and place in the day."""
        return self.subject, self.day, self.order


def _number(key: str, unit: str = "min", default: Any = ...) -> Any:
    low, high = PLAN_BOUNDS[key]
    return Field(default, ge=low, le=high, json_schema_extra={"unit": unit})


class PlanToml(Section):
    """All of `plan.toml` but its schema.

    Parameters
    ----------
    stimulated : list of str
        The conditions with the stimulation on.
    order : str
        How the order of a day came about.
    codes : mapping of str to str
        What stands for each condition wherever a blinded examiner may see it; empty if nobody is
        blinded.
    sha256 : str
        Of `plan.csv` as it was drawn.
    """

    subjects: list[str] = Field(min_length=1, max_length=1000)
    days: int = _number("days", "1")
    conditions: list[str] = Field(min_length=1, max_length=20)
    stimulated: list[str] = Field(default_factory=list)
    order: Literal["balanced", "drawn", "given"] = "balanced"
    seed: int = _number("seed", "1", 1)
    wait_after_on_min: float = _number("wait_after_on", default=15.0)
    wait_after_off_min: float = _number("wait_after_off", default=60.0)
    raters: list[str] = Field(default_factory=list)
    codes: dict[str, str] = Field(default_factory=dict)
    sha256: str = Field("", max_length=64)

    @model_validator(mode="after")
    def _known_conditions(self) -> Self:
        for name in (*self.stimulated, *self.codes):
            if name not in self.conditions:
                raise ValueError(
                    f"{name!r} is not one of the conditions {', '.join(self.conditions)}"
                )
        return self

    @model_validator(mode="after")
    def _codes_hide(self) -> Self:
        codes = self.codes.values()
        whole = (
            len(self.codes)
            == len(self.conditions)
            == len({*codes, *self.conditions} - {*self.conditions})
        )
        if self.codes and not (whole and all(codes)):
            raise ValueError(
                "codes must hold another code for each condition, none of them a name of one"
            )
        return self

    def stimulation_of(self, condition: str) -> str:
        """Return whether the stimulation is ``on`` or ``off`` in a condition."""
        return "on" if condition in self.stimulated else "off"


@dataclass(frozen=True)
class StudyPlan:
    """A plan as it is in its files.

    Attributes
    ----------
    folder : Path
        The study folder.
    about : PlanToml
    blocks : tuple of PlannedBlock
        In the order in which they are to be recorded.
    sha256 : str
        Of `plan.csv` as it is now.
    """

    folder: Path
    about: PlanToml
    blocks: tuple[PlannedBlock, ...]
    sha256: str

    @property
    def edited(self) -> bool:
        """Whether the table was changed after it was drawn."""
        return self.sha256 != self.about.sha256

    @property
    def blinded(self) -> bool:
        """Whether examiners must not know the conditions."""
        return bool(self.about.codes)

    def shown(self, condition: str) -> str:
        """Return the code of a condition, or its name where nobody is blinded."""
        return self.about.codes.get(condition, condition)


def read_plan(study: Path) -> StudyPlan | None:
    """Read and check the plan of a study folder; None if none was written to its end.

    Raises
    ------
    UserError
        Naming the file, the line, the value and what would be right.
    """
    if not (study / PLAN_FILE).exists():
        return None
    about = read_section(study / PLAN_FILE, PLAN_SCHEMA, PlanToml)
    try:
        return _read_table(study, about)
    except UserError as error:
        raise UserError(*(in_codes(line, about.codes) for line in error.lines)) from None


def _read_table(study: Path, about: PlanToml) -> StudyPlan:
    """Return the plan with its table, checked."""
    table = study / PLAN_TABLE
    with noted_digests() as noted:
        found = read_text_table(table, may_be_empty=True)
    missing = [column for column in COLUMNS if column not in found.columns]
    if missing:
        raise UserError(
            f"{table}: there is no column {missing[0]}; it must have {', '.join(COLUMNS)}"
        )
    blocks: dict[tuple[str, str, int], PlannedBlock] = {}
    for k, line in enumerate(found.lines):
        cells = {column: found.columns[column][k] for column in COLUMNS}
        block = _block(cells, f"{table}, line {line}", about)
        _check_protocol(study, block, f"{table}, line {line}")
        if block.key in blocks:
            raise UserError(
                f"{table}, line {line}: subject {block.subject}, day {block.day}, order "
                f"{block.order} is planned twice; give each session of a day its own order"
            )
        blocks[block.key] = block
    if not blocks:
        raise UserError(f"{table}: plans no session; write a row for each, or draw the plan again")
    return StudyPlan(study, about, _in_order(blocks.values()), noted[table])


def write_plan(
    study: Path,
    about: PlanToml,
    blocks: Sequence[PlannedBlock],
    protocols: Mapping[str, str],
) -> StudyPlan:
    """Write the files of a plan and return it.

    Parameters
    ----------
    study : Path
        Made if there is none.
    about : PlanToml
    blocks : sequence of PlannedBlock
    protocols : mapping of str to str
        The text of each settings file by its path below the study folder.

    Raises
    ------
    UserError
        If a file is there already, since sessions may have been recorded by it, or cannot be
        written. Files of a plan that was not written to its end are no hindrance to the same plan.
    """
    table = csv_text(COLUMNS, [asdict(block) for block in blocks])
    texts = {PLAN_TABLE: table, **protocols}
    names = (PLAN_FILE, *texts)  # the first is written last, and nothing is recorded without it
    there = [
        name
        for name in names
        if (study / name).exists() and not _holds(study / name, texts.get(name))
    ]
    if there:
        raise UserError(
            f"{study / there[0]}: is there already; a plan is never written over, so name another "
            "folder or remove the old plan"
        )
    with refused(study, "cannot be made"):
        for name in names:
            (study / name).parent.mkdir(parents=True, exist_ok=True)
    for name in (*protocols, PLAN_TABLE):
        write_text(study / name, texts[name])
    digest = hashlib.sha256(read_bytes(study / PLAN_TABLE, DOCUMENT_BYTES)).hexdigest()
    values = about.model_dump() | {"sha256": digest}
    write_text(study / PLAN_FILE, toml_text({"schema": PLAN_SCHEMA, **values}))
    written = read_plan(study)
    assert written is not None
    return written


def _holds(path: Path, text: str | None) -> bool:
    """Whether a file holds just this text."""
    return (
        text is not None and path.is_file() and read_bytes(path, DOCUMENT_BYTES) == text_bytes(text)
    )


def _in_order(blocks: Iterable[PlannedBlock]) -> tuple[PlannedBlock, ...]:
    """Return the days of each subject as they come in the table, each in its order."""
    days: dict[tuple[str, str], list[PlannedBlock]] = {}
    for block in blocks:
        days.setdefault((block.subject, block.day), []).append(block)
    return tuple(one for own in days.values() for one in sorted(own, key=lambda b: b.order))


def _block(cells: Mapping[str, str], where: str, about: PlanToml) -> PlannedBlock:
    """Return a row of the table, checked."""
    for column in COLUMNS:
        if not cells[column] and column not in _MAY_BE_EMPTY:
            raise UserError(f"{where}: {column} is empty")
    if cells["subject"] not in about.subjects:
        raise UserError(
            f"{where}: subject {cells['subject']} is not one of those in {PLAN_FILE}: "
            f"{', '.join(about.subjects)}"
        )
    if cells["condition"] not in about.conditions:
        raise UserError(
            f"{where}: condition {cells['condition']} is not one of those in {PLAN_FILE}: "
            f"{', '.join(sorted(about.conditions, key=lambda name: about.codes.get(name, '')))}"
        )
    tasks = cells["task"].split()
    if not set(tasks) <= set(TASKS):
        raise UserError(f"{where}: task {cells['task']!r} must be prbs, sinusoid or both")
    if len(cells["day"]) > _LONGEST_DAY:
        raise UserError(f"{where}: day has {len(cells['day'])} letters; at most {_LONGEST_DAY}")
    order = cell_number(cells["order"], "order", where)
    if order is None or order != int(order) or not 1 <= order <= _MOST_ORDER:
        raise UserError(
            f"{where}: order {cells['order']} must be a whole number from 1 to {_MOST_ORDER}"
        )
    wait = cell_number(cells["wait_min"], "wait_min", where)
    if wait is None or not 0.0 <= wait <= LONGEST_WAIT_MIN:
        raise UserError(
            f"{where}: wait_min {cells['wait_min']} must be from 0 to {LONGEST_WAIT_MIN:g} min"
        )
    return PlannedBlock(
        cells["subject"],
        cells["day"],
        int(order),
        cells["condition"],
        " ".join(tasks),
        cells["protocol"],
        wait,
        cells["raters"],
    )


def _check_protocol(study: Path, block: PlannedBlock, where: str) -> None:
    """Refuse a settings file that is not there, or not in the study folder."""
    if is_outside(block.protocol):
        raise UserError(
            f"{where}: protocol {block.protocol} is outside the study folder; copy the file into it"
        )
    if not (study / block.protocol).is_file():
        raise UserError(f"{where}: protocol {block.protocol}: there is no such file in {study}")
