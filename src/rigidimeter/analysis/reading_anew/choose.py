"""Which column is which quantity, and in what unit: by what the user and the file say.

What the user says comes first, then a column with our own name, then the one column whose name says
the quantity. Its unit is the user's, or the file's, or that of the name. Where two columns could be
one quantity, or a unit is stated nowhere, nothing is taken. No number is looked at, but to leave
columns that never change out of a question.
"""

from __future__ import annotations

import itertools
import re
import shlex
from collections.abc import Collection, Iterable
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rigidimeter.analysis.reading_anew.clock import stated_rates
from rigidimeter.analysis.reading_anew.columns import Columns, alike, nearest
from rigidimeter.analysis.reading_anew.headers import Header, fits, read_header
from rigidimeter.analysis.reading_anew.mapping import Fault, Mapping, of_every_muscle
from rigidimeter.analysis.reading_anew.quantities import EMG, LABELS, MOTION, QUANTITIES, words_of
from rigidimeter.analysis.reading_anew.units import (
    Conversion,
    conversion,
    divided_by,
    factor,
    measures,
    unit_of,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.words import series

# Of the columns of our own exports: of those without a quantity none is guessed by its name.
_OWN_NAMES = frozenset(
    {*(one.stored for one in QUANTITIES.values()), *LABELS}
    | {"drive_torque_nm", "drive_torque_time_s"}
)
MOST_OFFERED = 6
# Of a column that is named as the nearest, where its unit does not tell.
_LEAST_LIKE = 0.4
_PROCESSED = {"rms", "envelope", "env", "rectified", "smooth", "smoothed", "integrated", "iemg",
              "mvc", "normalised", "normalized", "filtered", "filt"}  # fmt: skip
_LENGTH = r"(mm|cm|m|inch|in)(?![a-z])"
_LEVER_ARM = re.compile(
    r"(?i)(?<![a-z])(?:(?:lever|moment)[\s_-]*arm|hebel(?:arm|länge)?|bras de levier"
    r"|braccio(?: di leva)?|brazo(?: de palanca)?|hefboom(?:sarm)?)(?![a-z])"
    rf"(?:[\s_]*[\[(_]\s*{_LENGTH}\s*[\])]?)?[^\w\n]*(\d+(?:[.,]\d+)?)\s*(?:{_LENGTH})?"
)
_CALIBRATION = re.compile(
    r"([-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)\s*([^\s\d,;=:]+/(?:\([^()\s]+\)|[^\s,;()]+))"
)


@dataclass
class Chosen:
    """The columns that are used, as far as names say.

    Parameters
    ----------
    mapping : Mapping
        What was said, completed by what the file states: every quantity that is used has its
        column, and its unit where one is known.
    to_si : mapping of str to Conversion
        By quantity; those without a unit are not in it.
    of_user : set of str
        The quantities whose unit the user stated, which is believed.
    several : mapping of str to list of str
        The columns of a quantity that could be more than one.
    faults : list of Fault
        Of what an estimate needs.
    unused : list of Fault
        Of what it does not need.
    """

    mapping: Mapping
    to_si: dict[str, Conversion] = field(default_factory=dict)
    of_user: set[str] = field(default_factory=set)
    several: dict[str, list[str]] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)
    unused: list[Fault] = field(default_factory=list)

    @property
    def columns(self) -> dict[str, str]:
        """The column of each quantity that is used."""
        return {
            name: pick.column
            for name, pick in self.mapping.said_of.items()
            if pick.column and not pick.leaves_out
        }

    @property
    def unstated(self) -> list[str]:
        """The quantities with a column whose unit is not known."""
        return [name for name in self.columns if name not in self.to_si]

    @property
    def labels(self) -> dict[str, str]:
        """The column of each label that is used."""
        return {name: column for name in LABELS if (column := self.mapping.label(name))}


def choose(file: Columns, said: Mapping) -> Chosen:
    """Decide which columns of a file are used, and as what."""
    said = of_every_muscle(said)
    headers = {name: read_header(name, one.unit) for name, one in file.columns.items()}
    chosen = Chosen(Mapping(**_without_columns(said)))
    _label_columns(file, said, chosen)
    used = {pick.column for pick in said.said_of.values() if pick.column}
    used |= {said.label(label) for label in LABELS}
    for name in QUANTITIES:
        column = said.pick(name).column
        if column and column not in file.columns and not said.pick(name).leaves_out:
            chosen.faults.append(_no_such_column(file, said, name, column))
    emg, unused = _emg_columns(file, headers, said, used)
    chosen.unused += unused
    by_name = {q: _candidates(file, q, headers, said, used) for q in QUANTITIES if q not in EMG}
    for name, candidates in (by_name | emg).items():
        if len(candidates) > 1:
            chosen.several[name] = candidates
        elif candidates:
            _take(file, chosen, said, name, candidates[0], headers[candidates[0]])
    _settle(file, chosen, said, headers)
    return chosen


def _without_columns(said: Mapping) -> dict[str, Any]:
    """Return the fields of a mapping that are of no column, and what is left out on purpose."""
    return {
        name: getattr(said, name)
        for name in Mapping.model_fields
        if (said.pick(name).leaves_out if name in QUANTITIES else not name.endswith("_column"))
    }


def _label_columns(file: Columns, said: Mapping, chosen: Chosen) -> None:
    changes = {}
    for label in LABELS:
        column = said.label(label) or label
        if column in file.columns or column in file.facts:
            changes[f"{label}_column"] = column
        elif said.label(label):
            chosen.faults.append(_no_such_column(file, said, label, column))
    chosen.mapping = chosen.mapping.saying(**changes)


def _candidates(
    file: Columns, name: str, headers: Dict[str, Header], said: Mapping, used: Collection[str]
) -> list[str]:
    pick = said.pick(name)
    if pick.column:
        return [pick.column] if pick.column in file.columns else []
    if QUANTITIES[name].stored in file.columns:
        return [QUANTITIES[name].stored]
    free = [one for one in file.columns if one not in used and one not in _OWN_NAMES]
    found = [column for column in free if headers[column].kind == name]
    if name == "torque" and not found:
        found = [column for column in free if headers[column].kind == "force"]
    possible = [column for column in found if _may_be(name, headers[column].unit, said)]
    if possible:
        return possible
    units = {column: unit_of(headers[column].unit) for column in found}
    return [column for column, unit in units.items() if unit is not None and unit.is_uncalibrated]


def _may_be(name: str, unit: str, said: Mapping) -> bool:
    """Whether a column of the right name is one of the quantity by its unit: no angle is in mm."""
    stated, pick = unit_of(unit), said.pick(name)
    if pick.scale or pick.unit or stated is None or factor(unit, name) is not None:
        return True
    return name == "torque" and (stated.is_uncalibrated or measures(stated, "force"))


def _take(
    file: Columns, chosen: Chosen, said: Mapping, name: str, column: str, header: Header
) -> None:
    """Take a column for a quantity, with its unit where one is stated."""
    pick, quantity = said.pick(name), QUANTITIES[name]
    unit = pick.unit
    if not unit:
        if header.stated_twice:
            chosen.faults.append(_stated_twice(file, said, name, column, header))
            return
        unit = header.unit if unit_of(header.unit) else ""
        if not unit and column == quantity.stored:
            unit = quantity.usual[0]
    if not unit and not pick.scale:
        chosen.mapping = chosen.mapping.saying(**{name: {"column": column}})
        return
    try:
        to_si = conversion(name, quantity.usual, column, unit, pick.scale, pick.offset)
    except UserError as error:
        chosen.faults.append(_not_converted(file, said, name, unit, str(error)))
        return
    values = {"column": column, "unit": unit, "scale": pick.scale, "offset": pick.offset}
    chosen.mapping = chosen.mapping.saying(**{name: values})
    chosen.to_si[name] = to_si
    if pick.unit or pick.scale:
        chosen.of_user.add(name)


def _stated_twice(file: Columns, said: Mapping, name: str, column: str, header: Header) -> Fault:
    known = [unit for unit in (header.unit, header.stated_twice) if unit_of(unit)]
    text = (
        f"{file.source}: column {column!r} is in {header.stated_twice} by its name and in "
        f"{header.unit} by the file; say which"
    )
    remedies = tuple(said.saying(**{name: {"unit": unit}}) for unit in known)
    return Fault(text, "unit stated twice", name, remedies)


def _not_converted(file: Columns, said: Mapping, name: str, unit: str, text: str) -> Fault:
    """Say that a unit does not make a quantity, with the lever arm or factor that the file has."""
    pick = said.pick(name)
    stated, is_force = "", measures(unit_of(unit), "force")
    if not pick.scale:
        stated = lever_arm(file.facts) if is_force else stated_scale(file.facts, name, unit)
    if not stated:
        return Fault(f"{file.source}: {text}", "unit", name)
    remedy = said.saying(**{name: {"scale": stated}})
    text = f"{file.source}: {text.partition(': say ')[0]}"
    rule = "stated lever arm" if is_force else "stated factor"
    return Fault(text, rule, name, (remedy,), because=" (as the file states)")


def lever_arm(facts: Dict[str, float | str]) -> str:
    """Return the one lever arm that single values and lines of a head state, as ``0.25 m``."""
    found = {
        f"{number.replace(',', '.')} {behind or before}"
        for name, value in facts.items()
        for before, number, behind in _LEVER_ARM.findall(f"{name} {value}")
        if (behind or before) and (not behind or not before or behind == before)
    }
    return found.pop() if len(found) == 1 else ""


def stated_scale(facts: Dict[str, float | str], name: str, unit: str) -> str:
    """Return the one factor that makes a quantity of a column's unit, as ``20 deg/V``, or nothing.

    Examples
    --------
    >>> lines = {"calibration": "Torque cell: 1.7 Nm/V; goniometer: 20 deg/V"}
    >>> stated_scale(lines, "angle", "V"), stated_scale(lines, "angle", "mV")
    ('20 deg/V', '20 deg/V')
    """
    found = {
        f"{number} {per}"
        for text in facts.values()
        for number, per in _CALIBRATION.findall(str(text))
        if divided_by(f"{number} {per}") and factor(unit, name, f"{number} {per}") is not None
    }
    return found.pop() if len(found) == 1 else ""


def _not_needed(file: Columns, chosen: Chosen) -> set[str]:
    """Return the quantities that an estimate can do without, given the others."""
    free = {"velocity_command", "perturbation", *EMG}
    if set(chosen.to_si) & set(MOTION):
        free |= set(MOTION)
    has_rate = chosen.mapping.rate_hz is not None or bool(stated_rates(file))
    return free | ({"time"} if has_rate or file.clocks else set())


def _settle(file: Columns, chosen: Chosen, said: Mapping, headers: Dict[str, Header]) -> None:
    """Leave out what is in doubt and not needed; what is in doubt and needed is a fault."""
    free = _not_needed(file, chosen)
    for name, candidates in chosen.several.items():
        fault = _several(file, said, name, candidates)
        if name in free:
            chosen.unused.append(fault)
        else:
            chosen.faults.append(fault)
    for name in chosen.unstated:
        if name in free and not said.pick(name).column:
            column = chosen.columns[name]
            chosen.mapping = chosen.mapping.saying(**{name: {"column": ""}})
            usual = QUANTITIES[name].usual
            text = f"{file.source}: column {column!r} is not used because its unit is not stated"
            remedies = tuple(said.saying(**{name: {"unit": unit}}) for unit in usual)
            chosen.unused.append(Fault(text, "unit", name, remedies))
    if "torque" not in chosen.columns and "torque" not in chosen.several:
        chosen.faults += _missing(file, chosen, said, headers, ("torque",))
    if not any(name in chosen.columns or name in chosen.several for name in MOTION):
        chosen.faults += _missing(file, chosen, said, headers, MOTION)


def _several(file: Columns, said: Mapping, name: str, candidates: list[str]) -> Fault:
    moving = _moving_first(file, candidates) or candidates
    spoken = name.replace("_", " ")
    more = len(moving) - MOST_OFFERED
    text = f"{file.source}: {len(moving)} columns may be the {spoken}"
    if more > 0:
        text += f" ({more} more than are offered here)"
    remedies = tuple(said.saying(**{name: {"column": one}}) for one in moving[:MOST_OFFERED])
    return Fault(text, "several", name, remedies)


def _moving_first(file: Columns, names: Iterable[str]) -> list[str]:
    """Return columns of numbers without those that never change, those that change often first."""
    shares: dict[str, float] = {}
    for name in names:
        values = file.columns[name].read()
        if values.dtype != object:
            finite = values[np.isfinite(values)]
            changed = np.count_nonzero(finite[1:] != finite[:-1])
            shares[name] = changed / max(finite.size, 1)
    moving = (name for name, share in shares.items() if share > 0)
    return sorted(moving, key=lambda name: -round(shares[name], 1))


def _missing(
    file: Columns, chosen: Chosen, said: Mapping, headers: Dict[str, Header], names: Iterable[str]
) -> list[Fault]:
    """Say that a quantity is not there, and which column is the nearest to be it."""
    names = tuple(names)
    if any(fault.quantity in names for fault in chosen.faults):  # what was named, and does not fit
        return []
    stored = [QUANTITIES[name].stored for name in reversed(names)]
    what = f"neither column {stored[0]} nor {stored[1]}" if stored[1:] else f"no column {stored[0]}"
    taken = {*chosen.columns.values(), *chosen.labels.values()}
    free = _moving_first(file, (one for one in file.columns if one not in taken))
    text = f"{file.source} has {what}; its columns are {', '.join(free[:20]) or file.listed}"
    if file.others:
        name, why = next(iter(file.others.items()))
        text += f" ({name} is no column but {why})"
    if not free:
        return [Fault(f"{text}, and none is left to be it", "missing", names[0])]
    pairs = itertools.product(names, free)
    ranked = [(fits(q, headers[one].unit), alike(q, one), q, one) for q, one in pairs]
    of_unit, likeness, name, column = max(ranked, key=lambda entry: entry[:2])
    if not of_unit and likeness < _LEAST_LIKE:
        unit = QUANTITIES[name].usual[-1]
        blank = f"which it is, as in --column {name}=NAME --unit {name}={unit}"
        return [Fault(f"{text}, and no name of them is known", "missing", name, blank=blank)]
    remedy = said.saying(**{name: {"column": column}})
    return [Fault(f"{text}; the nearest is {column}: if it is", "missing", name, (remedy,))]


def _no_such_column(file: Columns, said: Mapping, name: str, column: str) -> Fault:
    source = f"{file.source}: --column {shlex.quote(f'{name}={column}')}"
    what = "a single value" if column in file.facts else file.others.get(column, "")
    if what:
        text = f"{column} is {what}; a column has one real number or text for each sample"
        return Fault(f"{source}: {text}", "no column", name)
    near = nearest(column, file.columns)
    text = f"{source}: there is no column {column}; its columns are {file.listed}; the nearest is"
    change = {f"{name}_column": near} if name in LABELS else {name: {"column": near}}
    return Fault(f"{text} {near}: if it is", "no column", name, (said.saying(**change),))


def _emg_columns(
    file: Columns, headers: Dict[str, Header], said: Mapping, used: Collection[str]
) -> tuple[dict[str, list[str]], list[Fault]]:
    """Return the column of each muscle, and why others are not used.

    Active stretches are left out of the fit, so that a column that only looks like EMG is named and
    not used. Where the user says a unit or a scale of EMG, each column that looks like it is one
    muscle, in the order of the file. An envelope or a share of the largest contraction is no EMG.
    """
    named = {name: said.pick(name).column for name in EMG if said.pick(name).column}
    found = {name: named.get(name, QUANTITIES[name].stored) for name in EMG}
    found = {name: column for name, column in found.items() if column in file.columns}
    if named:
        return {name: [column] for name, column in found.items()}, []
    stated = {name for name in EMG if said.pick(name).unit or said.pick(name).scale}
    unused: list[Fault] = []
    looking: list[str] = []
    slots = [name for name in EMG if name not in found]
    for column, header in headers.items():
        if header.kind != "emg" or column in used or column in _OWN_NAMES:
            continue
        why = ""
        if _PROCESSED.intersection(words_of(column)):
            why = "it is not the raw EMG"
        elif not slots:
            why = f"{len(EMG)} muscles are read at most"
        elif slots[0] not in stated and unit_of(header.unit) and not fits("emg", header.unit):
            why = f"it is in {header.unit}, and EMG is needed in V or mV"
        if why:
            text = f"{file.source}: column {column!r} is not used: {why}"
            unused.append(Fault(text, "EMG", "emg"))
        elif stated:
            found[slots.pop(0)] = column
        else:
            looking.append(f"--column {shlex.quote(f'{slots.pop(0)}={column}')}")
    if looking:
        text = f"{file.source}: what looks like EMG is not used; to leave out active stretches"
        unused.append(Fault(text, "EMG", "emg", blank=" ".join(looking)))
    return {name: [column] for name, column in found.items()}, unused


def unstated_fault(file: Columns, chosen: Chosen, said: Mapping) -> Fault:
    """Ask for the units that are stated nowhere, all in one question."""
    names = chosen.unstated
    columns = ", ".join(repr(chosen.columns[name]) for name in names)
    text = f"{file.source}: the unit of {columns} is stated nowhere, so nothing is estimated"
    for name in names:
        column = chosen.columns[name]
        if unknown := read_header(column, file.columns[column].unit).unknown:
            text += f" ({unknown!r} in {column!r} is no unit that is known)"
    asked = [
        " or ".join(f"--unit {shlex.quote(f'{name}={u}')}" for u in QUANTITIES[name].usual)
        for name in names
    ]
    return Fault(text, "unit", names[0], blank=series(asked))
