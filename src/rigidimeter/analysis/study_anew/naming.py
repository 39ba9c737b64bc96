"""Names of conditions: what a table or a recording says, through the blinding key.

With a key, a code becomes the condition that the key gives it; a condition may also be given by its
name. Without a key, names that `study.toml` does not know are codes: the analysis runs on them as
they are, blinded.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from rigidimeter.analysis.study_anew.study import Condition
from rigidimeter.core.records import Notice
from rigidimeter.core.study_files import ConditionTable, StudyFolder


@dataclass(frozen=True)
class Naming:
    """How the conditions of one study are called.

    Attributes
    ----------
    defined : tuple of str
        The conditions of `study.toml`.
    known : tuple of str
        The names that an analysis may hold: the conditions, or the codes while blinded.
    pair : (str, str)
        Reference and other; two codes in the order of the alphabet while blinded.
    conditions : tuple of Condition
    codes : mapping of str to str
        From the key; empty without one.
    blinded : bool
    """

    defined: tuple[str, ...]
    known: tuple[str, ...]
    pair: tuple[str, str]
    conditions: tuple[Condition, ...]
    codes: Mapping[str, str] = field(default_factory=dict)
    blinded: bool = False

    def named(self, name: str) -> str | None:
        """Return the condition behind a name or code; None if it is unknown."""
        if name in self.codes:
            return self.codes[name]
        return name if name in self.known else None

    def unknown(self, name: str) -> str:
        """Return why a name means nothing, and the names that do."""
        listed = [*self.codes, *self.known]
        folded = {each.casefold(): each for each in listed}
        near = difflib.get_close_matches(name.casefold(), list(folded), n=1, cutoff=0.6)
        hint = f"; the nearest is {folded[near[0]]}" if near else ""
        what = "codes and conditions" if self.codes else "codes" if self.blinded else "conditions"
        return f"condition {name} is unknown{hint} ({what}: {', '.join(listed)})"


def naming(read: StudyFolder) -> tuple[Naming, list[Notice]]:
    """Return the names of a study, and what is wrong with its key."""
    about = read.about
    tables: dict[str, ConditionTable | None] = {**about.conditions}
    tables = tables or {about.reference: None, about.other: None}
    defined = tuple(tables)
    codes, notices = _codes(read, defined)
    names = {row["condition"] for row in read.sessions}
    folded = {name.casefold() for name in defined}
    if read.key is None and not any(name.casefold() in folded for name in names):
        blinded = _blinded(defined, tuple(sorted(names)))
        text = (
            f"{read.folder}: blinded, because there is no key: the conditions are the codes "
            f"{', '.join(blinded.known)}, and differences are {blinded.pair[0]} − {blinded.pair[1]}"
        )
        return blinded, [*notices, Notice("warning", text)]
    simulated = {name: one.model_dump(exclude_none=True) for name, one in about.simulated.items()}
    conditions = tuple(
        replace(_condition(name, table), simulated=simulated.get(name, {}))
        for name, table in tables.items()
    )
    notices += _same_stimulation(read, conditions)
    pair = about.reference, about.other
    return Naming(defined, defined, pair, conditions, codes), notices


def _codes(read: StudyFolder, defined: tuple[str, ...]) -> tuple[dict[str, str], list[Notice]]:
    """Return the conditions of the codes of a key, and why others are not used."""
    codes: dict[str, str] = {}
    notices: list[Notice] = []
    for row in read.key or ():
        code, condition = row["code"], row["condition"]
        if condition not in defined:
            wrong = (
                f"stands for {condition}, which study.toml does not know "
                f"(conditions: {', '.join(defined)}); the code is not used"
            )
        elif codes.get(code, condition) != condition:
            wrong = f"stands for {condition} here and for {codes[code]} above; the first counts"
        elif code in defined and code != condition:
            wrong = (
                f"is itself a condition of study.toml, but stands for {condition}; the code is "
                "not used"
            )
        else:
            codes[code] = condition
            continue
        notices.append(Notice("error", f"{row.where}: code {code} {wrong}"))
    return codes, notices


def _blinded(defined: tuple[str, ...], codes: tuple[str, ...]) -> Naming:
    """Return the names of a study whose conditions are codes, without their stimulation."""
    first, second = (*codes, "")[:2]
    return Naming(defined, codes, (first, second), tuple(map(Condition, codes)), blinded=True)


def _condition(name: str, table: ConditionTable | None) -> Condition:
    if table is None:
        return Condition(name)
    unit, amplitude = "V", table.amplitude_v
    if amplitude is None:
        unit, amplitude = "mA", table.amplitude_ma
    return Condition(
        name,
        table.title,
        table.frequency_hz,
        amplitude,
        "" if amplitude is None else unit,
        table.pulse_width_us,
        table.electrodes,
        table.wash_in_min,
    )


def _same_stimulation(read: StudyFolder, conditions: tuple[Condition, ...]) -> list[Notice]:
    seen: dict[tuple[Any, ...], str] = {}
    notices = []
    for one in conditions:
        how = (*one.dose.values(), one.electrodes)
        if not any(value not in (None, "") for value in how):
            continue
        if how in seen:
            text = (
                f"{read.files['study.toml']}: {seen[how]} and {one.name} have the same "
                "stimulation settings; if they differ, one of them is wrong"
            )
            notices.append(Notice("warning", text))
        seen.setdefault(how, one.name)
    return notices
