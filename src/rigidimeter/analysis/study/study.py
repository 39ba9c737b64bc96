"""A study: its rows, what is known beside them, and how its conditions are called.

With a blinding key, a code becomes the condition that the key gives it; a condition may also be
given by its name. Without a key, names that `study.toml` does not know are codes: the analysis runs
on them as they are, blinded.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import pandas as pd

from rigidimeter.analysis.statistics import Mixed
from rigidimeter.analysis.study.measures import Primary
from rigidimeter.core.records import Analysis, Notice
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import ConditionTable, StudyFolder

if TYPE_CHECKING:
    from rigidimeter.analysis.study.from_folder import Loaded

NO_ESTIMATES = Analysis("", (), (), math.nan, ())

GROUP = "group"
"""The column that says of which group, such as patients, a subject is."""


def no_such_group(source: str, group: str, labels: Iterable[str]) -> str:
    """Return that a table has no such group of subjects, and which it has."""
    known = ", ".join(filter(None, dict.fromkeys(labels)))
    return f"{source}: there is no group {group}; there are: {known or 'none'}"


@dataclass(frozen=True)
class Condition:
    """One condition of a study: its name, and the stimulation if there is one.

    What was not written down is None or empty. `simulated` are the medians of a virtual condition,
    by the names of the measures.
    """

    name: str
    title: str = ""
    frequency_hz: float | None = None
    amplitude: float | None = None
    amplitude_unit: str = ""
    pulse_width_us: float | None = None
    electrodes: str = ""
    wash_in_min: float | None = None
    simulated: Mapping[str, float] = field(default_factory=dict)

    @property
    def dose(self) -> dict[str, Any]:
        """The stimulation as rows hold it, without what is not known."""
        names = ("frequency_hz", "amplitude", "amplitude_unit", "pulse_width_us")
        cells = {name: getattr(self, name) for name in names}
        return {name: cell for name, cell in cells.items() if cell is not None}


class SessionEntry(NamedTuple):
    """One recording of a study: whose, when, in what condition, and where it lies.

    `source` is the name by which its epochs go in rows; `code` is the blinded name of its condition
    as the table of sessions has it, `condition` what the key says, or the code without a key.
    """

    subject: str
    day: str
    condition: str
    code: str
    path: str
    source: str
    group: str = ""


class LeftOut(NamedTuple):
    """One recording of a study's table that does not count at all, and why.

    `condition` is as the table has it, a code or a name.
    """

    path: str
    subject: str
    day: str
    condition: str
    reason: str


class Exclusion(NamedTuple):
    """One epoch that does not count, who excluded it, and why.

    `by` is ``protocol`` (ended early or was repeated), ``check`` (a diagnostic), ``estimate`` (no
    fit) or ``operator`` (the study's table of exclusions; `who` is whom it names).
    """

    subject: str
    day: str
    condition: str
    source: str
    epoch: str
    task: str
    by: Literal["protocol", "check", "estimate", "operator"]
    reason: str
    who: str = ""


class Deviation(NamedTuple):
    """One way in which a session was not as planned.

    Attributes
    ----------
    subject, day : str
    order : int
        Place in the day that was planned; 0 where none was.
    condition : str
    path : str
        Of the session; empty where none was recorded.
    kind : str
        ``not done``, ``not planned``, ``out of order``, ``short wait``, ``unknown wait``, ``other
        protocol``, ``cut short``, ``plan edited``.
    detail : str
    """

    subject: str
    day: str
    order: int
    condition: str
    path: str
    kind: str
    detail: str


class Ratings(NamedTuple):
    """The mixed models of the ratings of a study.

    Attributes
    ----------
    source : str
        The table that they are from.
    rows : pandas.DataFrame
        The scores, as their examiners gave them.
    random : tuple of str
        What has an offset: ``examiner``, and ``subject`` where there are several.
    fit : Mixed
        With a mean for each condition; its corrected scores go with `rows`.
    by_day : Mixed or None
        With an offset for every day too; None where the ratings cannot separate days.
    notices : tuple of str
        What is odd about the ratings.
    left_out_lines : tuple of int
        Of rows without a score or a label.
    """

    source: str
    rows: pd.DataFrame
    random: tuple[str, ...]
    fit: Mixed
    by_day: Mixed | None = None
    notices: tuple[str, ...] = ()
    left_out_lines: tuple[int, ...] = ()

    @property
    def model_notices(self) -> tuple[str, ...]:
        """Where a variance is at its boundary or cannot be estimated, in sentences."""
        at_zero = [
            f"the variance of {name} is estimated as zero, its boundary: they differ no more than "
            "the residual explains, so all their offsets are zero and no score is corrected for "
            "them"
            for name in self.fit.at_zero
        ]
        left_out = [
            f"{name} was left out of the model: {reason}; its offsets are zero"
            for name, reason in self.fit.inseparable.items()
        ]
        return (*at_zero, *left_out)


@dataclass(frozen=True)
class Study:
    """The rows of a study and what is to be known to compare them.

    Attributes
    ----------
    rows : pandas.DataFrame
        As `as_rows`.
    reference, other : str
        The conditions that are compared; `other` is empty where there is only one.
    further : tuple of str
        Conditions that are compared with the reference, too.
    title : str
    source, by : str
        The table and its column of conditions, where columns of a table are compared.
    primary : Primary
    settings : Settings
    conditions, sessions, left_out, exclusions, deviations, notices
        Of a study folder; empty if there is none.
    ratings : Ratings or None
    blinded : bool
        Whether the conditions are codes, for no key was given.
    virtual, partly_virtual : bool
        Whether all epochs come from the virtual rig, and whether any does.
    digests : mapping of str to str
        SHA-256 of every file that was read, by its path below the study.
    analysis : Analysis
        The estimates that are concluded from, with everything that is known of each fit; empty for
        columns of a table.
    folder_read : callable or None
        Reads the study folder once more, with its recordings, which are not kept; None without one.
    """

    rows: pd.DataFrame = field(repr=False)
    reference: str
    other: str = ""
    further: tuple[str, ...] = ()
    title: str = ""
    source: str = ""
    by: str = ""
    primary: Primary = field(default_factory=Primary)
    settings: Settings = field(default_factory=Settings)
    conditions: tuple[Condition, ...] = ()
    sessions: tuple[SessionEntry, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    exclusions: tuple[Exclusion, ...] = ()
    deviations: tuple[Deviation, ...] = ()
    notices: tuple[Notice, ...] = ()
    ratings: Ratings | None = field(default=None, repr=False)
    blinded: bool = False
    virtual: bool = False
    partly_virtual: bool = False
    digests: Mapping[str, str] = field(default_factory=dict, repr=False)
    analysis: Analysis = field(default=NO_ESTIMATES, repr=False)
    folder_read: Callable[[], Loaded] | None = field(default=None, repr=False, compare=False)

    @property
    def pair(self) -> tuple[str, str]:
        """The two conditions that are compared first."""
        return self.reference, self.other

    @property
    def others(self) -> tuple[str, ...]:
        """Every condition that is compared with the reference."""
        return tuple(name for name in (self.other, *self.further) if name)


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
