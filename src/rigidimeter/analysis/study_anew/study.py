"""A study: its rows, and what is known beside them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import pandas as pd

from rigidimeter.analysis.statistics import Mixed
from rigidimeter.analysis.study_anew.measures import Primary
from rigidimeter.core.records import Notice
from rigidimeter.core.settings import Settings

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
    """One epoch that does not count, who said so, and why.

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
    """

    source: str
    rows: pd.DataFrame
    random: tuple[str, ...]
    fit: Mixed
    by_day: Mixed | None = None
    notices: tuple[str, ...] = ()

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

    @property
    def others(self) -> tuple[str, ...]:
        """Every condition that is compared with the reference."""
        return tuple(name for name in (self.other, *self.further) if name)
