"""Which column is torque, angle, velocity, perturbation and time, and in what unit: decided here.

What the user says comes first, then a column with our own name, then the one column whose name says
the quantity. Its unit is the user's, or the file's, or that of the name. Where two columns could be
one quantity, or a unit is stated nowhere, nothing is taken.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from rigidimeter.analysis.reading.channels.conversion import EXAMPLE_ARM, Conversion, conversion
from rigidimeter.analysis.reading.channels.emg_columns import emg_columns, of_every_muscle
from rigidimeter.analysis.reading.channels.headers import Header, fits, read_header
from rigidimeter.analysis.reading.channels.lever_arm import lever_arm
from rigidimeter.analysis.reading.channels.quantities import BY_STANDARD, QUANTITIES
from rigidimeter.analysis.reading.channels.stated_scale import stated_scale
from rigidimeter.analysis.reading.channels.unit_text import expression, ratio
from rigidimeter.analysis.reading.formats.table import Table, alike, nearest
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import EMG_CHANNELS

LABELS = ("epoch", "condition", "task")
MOTION = ("velocity_rad_s", "angle_rad")
STANDARD = (*BY_STANDARD, *LABELS)
OF_THE_DRIVE = ("drive_torque_nm", "drive_torque_time_s")
"""Columns of an exported session that are neither the joint's torque nor a time of samples."""
_LEAST_LIKE = 0.4
"""Of a column that is named as the nearest, where its unit does not tell."""
_UNCALIBRATED = (
    *("volt", "millivolt", "microvolt", "millivolt/(volt)", "ampere", "milliampere", "count"),
    *("percent", "permille", "bar", "pascal", "kilopascal", "hertz"),
)
"""What sensors and drives give before a calibration."""


@dataclass(frozen=True)
class Said:
    """What the user says of the columns; each mapping is by standard name.

    Parameters
    ----------
    columns : mapping of str to str
        The file's names.
    asserted : set of str
        Those whose unit the user gave with the name, as in ``angle_rad=theta``.
    units, scales, offsets : mapping of str to str
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    asserted: frozenset[str] = frozenset()
    units: Mapping[str, str] = field(default_factory=dict)
    scales: Mapping[str, str] = field(default_factory=dict)
    offsets: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Taken:
    """A column that is taken for a quantity.

    Parameters
    ----------
    standard, column : str
        What we and what the file call it.
    unit : str
        As stated; nothing where it is not, and for labels.
    to_si : Conversion or None
        None where no unit is stated.
    of_user : bool
        Whether the user stated the unit.
    """

    standard: str
    column: str
    unit: str = ""
    to_si: Conversion | None = None
    of_user: bool = False


@dataclass
class Choice:
    """The columns that are taken, and what is wrong with the others.

    `faults` are of what an estimate needs, `unused` of what it does not; `several` has the columns
    of a quantity that could be more than one.
    """

    taken: dict[str, Taken] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    unused: list[str] = field(default_factory=list)
    several: dict[str, list[str]] = field(default_factory=dict)

    @property
    def unstated(self) -> list[Taken]:
        """What is taken but for its unit."""
        return [one for one in self.taken.values() if one.standard in BY_STANDARD and not one.to_si]


def choose(table: Table, said: Said, has_rate: bool = False) -> Choice:
    """Decide which columns of a table are used, and as what.

    Parameters
    ----------
    table : Table
    said : Said
    has_rate : bool
        Whether the sampling rate is known without a column of the time.
    """
    choice = Choice()
    headers = {name: read_header(name, table.units.get(name, "")) for name in table.columns}
    for standard, name in said.columns.items():
        if name not in table.columns and not (standard in LABELS and name in table.scalars):
            choice.faults.append(_no_such_column(table, standard, name))
    for label in LABELS:
        name = said.columns.get(label, label)
        if name in table.columns or name in table.scalars:
            choice.taken[label] = Taken(label, name)
    used = set(said.columns.values())
    for quantity in QUANTITIES:
        if quantity.standard in EMG_CHANNELS:
            continue
        candidates = _candidates(table, quantity.standard, headers, said, used)
        if len(candidates) > 1:
            choice.several[quantity.standard] = candidates
        elif candidates:
            _take(table, choice, quantity.standard, candidates[0], headers[candidates[0]], said)
    _take_emg(table, choice, headers, said, used)
    _settle(table, choice, said, has_rate)
    return choice


def _take_emg(
    table: Table, choice: Choice, headers: Mapping[str, Header], said: Said, used: set[str]
) -> None:
    said = replace(
        said,
        units=of_every_muscle(said.units),
        scales=of_every_muscle(said.scales),
        offsets=of_every_muscle(said.offsets),
    )
    known = frozenset({*used, *STANDARD, *OF_THE_DRIVE})
    stated = frozenset({*said.units, *said.scales})
    columns, unused = emg_columns(table, headers, said.columns, known, stated)
    choice.unused += unused
    for standard, column in columns.items():
        _take(table, choice, standard, column, headers[column], said)


def _candidates(
    table: Table, standard: str, headers: Mapping[str, Header], said: Said, used: set[str]
) -> list[str]:
    if standard in said.columns:
        name = said.columns[standard]
        return [name] if name in table.columns else []
    if standard in table.columns:
        return [standard]
    name = BY_STANDARD[standard].name
    known = {*used, *STANDARD, *OF_THE_DRIVE}
    free = [column for column in table.columns if column not in known]
    found = [column for column in free if headers[column].kind == name]
    if standard == "torque_nm" and not found:
        found = [column for column in free if headers[column].kind == "force"]
    possible = [column for column in found if _may_be(standard, headers[column], said)]
    return possible or [one for one in found if expression(headers[one].unit) in _UNCALIBRATED]


def _may_be(standard: str, header: Header, said: Said) -> bool:
    """Whether a column of the right name is one of the quantity by its unit: no angle is in mm."""
    if standard in said.scales or standard in said.units or not expression(header.unit):
        return True
    try:
        conversion(standard, "", header.unit, "", "")
    except UserError:
        unit = expression(header.unit)
        may_be_scaled = unit in _UNCALIBRATED or ratio(unit, "newton") is not None
        return standard == "torque_nm" and may_be_scaled  # a scale is what lacks
    return True


def _take(
    table: Table, choice: Choice, standard: str, column: str, header: Header, said: Said
) -> None:
    unit = said.units.get(standard, "")
    of_user = bool(unit) or standard in said.scales
    if not unit:
        if header.stated_twice:
            name = BY_STANDARD[standard].name
            known = header.unit if expression(header.unit) else header.stated_twice
            choice.faults.append(
                f"{table.source}: column {column!r} is in {header.stated_twice} by its name and in "
                f"{header.unit} by the file; say which, as in --unit {name}={known}"
            )
            return
        unit = header.unit if expression(header.unit) else ""
        if not unit and column in BY_STANDARD:
            unit = BY_STANDARD[column].usual[0]
        if not unit and standard in said.asserted and standard not in said.scales:
            unit, of_user = BY_STANDARD[standard].usual[0], True
    scale = said.scales.get(standard, "")
    if not unit and not scale:
        choice.taken[standard] = Taken(standard, column)
        return
    try:
        to_si = conversion(standard, column, unit, scale, said.offsets.get(standard, ""))
    except UserError as error:
        text = f"{table.source}: {error}"
        if not scale and (arm := lever_arm(table.scalars)):
            text = text.replace(EXAMPLE_ARM, arm) + " (as the file states)"
        elif not scale and (stated := stated_scale(table.scalars, standard, unit)):
            text = re.sub(r"NUMBER [^']*", stated, text) + " (as the file states)"
        choice.faults.append(text)
        return
    choice.taken[standard] = Taken(standard, column, unit, to_si, of_user)


def _several(table: Table, standard: str, candidates: list[str]) -> str:
    name = BY_STANDARD[standard].name
    shown = " or ".join(f"--column {shlex.quote(f'{name}={column}')}" for column in candidates[:6])
    more = f", or one of {len(candidates) - 6} more" if len(candidates) > 6 else ""
    return (
        f"{table.source}: {len(candidates)} columns may be the {name.replace('_', ' ')}; say "
        f"{shown}{more}"
    )


def _not_needed(choice: Choice, has_rate: bool) -> set[str]:
    """Return the quantities that an estimate can do without, given the others."""
    stated = {name for name, taken in choice.taken.items() if taken.to_si is not None}
    free = {"velocity_command_rad_s", "perturbation_nm", *EMG_CHANNELS}
    if stated & set(MOTION):
        free |= set(MOTION)
    return free | ({"time_s"} if has_rate else set())


def _settle(table: Table, choice: Choice, said: Said, has_rate: bool) -> None:
    """Leave out what is in doubt and not needed; what is in doubt and needed is a fault."""
    free = _not_needed(choice, has_rate)
    several = choice.several
    for standard, candidates in several.items():
        text = _several(table, standard, candidates)
        if standard in free:
            choice.unused.append(f"{text}; none is used")
        else:
            choice.faults.append(text)
    for taken in choice.unstated:
        if taken.standard in free and taken.standard not in said.columns:
            del choice.taken[taken.standard]
            quantity = BY_STANDARD[taken.standard]
            choice.unused.append(
                f"{table.source}: column {taken.column!r} is not used because its unit is stated "
                f"nowhere; say its unit, as in --unit {quantity.name}={quantity.usual[-1]}"
            )
    if "torque_nm" not in choice.taken and "torque_nm" not in several:
        choice.faults += _missing(table, choice, "has no column torque_nm", ("torque_nm",))
    if not any(name in choice.taken or name in several for name in MOTION):
        choice.faults += _missing(
            table, choice, f"has neither column {MOTION[0]} nor {MOTION[1]}", MOTION
        )


def _missing(table: Table, choice: Choice, what: str, standards: tuple[str, ...]) -> list[str]:
    if choice.faults:  # what was named and is not there, or does not fit
        return []
    taken = {one.column for one in choice.taken.values()}
    free = [
        name for name, values in table.columns.items()
        if name not in taken and any(letter.isdigit() for letter in str(values[:1]))
    ]  # fmt: skip
    text = f"{table.source} {what}; its columns are {table.listed}"
    if table.others:
        name, why = next(iter(table.others.items()))
        text += f" ({name} is no column but {why})"
    if not free:
        parts = [
            f"; save each {'column' if '×' in why else 'part'} of {name} under a name of its own"
            for name, why in table.others.items()
            if "×" in why or why.endswith("objects")
        ]
        remedy = parts[0] if parts else ""
        return [f"{text}, and none is left to be it{remedy}"]
    ranked = [
        (fits(BY_STANDARD[standard].name, read_header(name, table.units.get(name, "")).unit),
         alike(standard, name), standard, name)
        for standard in standards for name in free
    ]  # fmt: skip
    of_unit, likeness, standard, name = max(ranked, key=lambda entry: entry[:2])
    short = BY_STANDARD[standard].name
    if not of_unit and likeness < _LEAST_LIKE:
        unit = BY_STANDARD[standard].usual[-1]
        return [
            f"{text}, and no name of them is known; say which it is, as in --column {short}=NAME "
            f"--unit {short}={unit}, and likewise of the time and the other quantities"
        ]
    option = shlex.quote(f"{short}={name}")
    return [f"{text}; the nearest is {name}: if it is the one, say --column {option}"]


def _no_such_column(table: Table, standard: str, name: str) -> str:
    option = f"--column {shlex.quote(f'{standard}={name}')}"
    if name in table.others:
        return (
            f"{table.source}: {option}: {name} is {table.others[name]}; a column has one "
            "dimension and a real number or text for each sample"
        )
    if name in table.scalars:
        return f"{table.source}: {option}: {name} is a single value, not a column of samples"
    near = nearest(name, table.columns)
    right = f"--column {shlex.quote(f'{standard}={near}')}"
    return (
        f"{table.source}: {option}: there is no column {name}; the nearest is {near}, so perhaps "
        f"{right} (its columns are {table.listed})"
    )
