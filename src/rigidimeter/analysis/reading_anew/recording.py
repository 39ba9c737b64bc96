"""A file as a recording: its epochs, what to say of them, and the mapping that reads it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rigidimeter.analysis.reading_anew.columns import Columns
from rigidimeter.analysis.reading_anew.epochs import epochs_of
from rigidimeter.analysis.reading_anew.judge import Verdict, verdict
from rigidimeter.analysis.reading_anew.mapping import Mapping
from rigidimeter.analysis.reading_anew.readers import columns_of
from rigidimeter.analysis.reading_anew.search import propose
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Epoch, Notice


@dataclass(frozen=True)
class Recording:
    """What was read of one file.

    Parameters
    ----------
    epochs : tuple of Epoch
        In the order of the file; at least one.
    notices : tuple of Notice
        What was wrong or looked wrong.
    mapping : Mapping
        What reads the file like this once more: what was said, completed by what the file states.
    reasons : tuple of str
        What the numbers decided, where they were asked.
    """

    epochs: tuple[Epoch, ...]
    notices: tuple[Notice, ...]
    mapping: Mapping
    reasons: tuple[str, ...] = ()


def read_file(
    path: Path, said: Mapping | None = None, *, condition: str = "", by_numbers: bool = False
) -> Recording:
    """Read a file.

    Parameters
    ----------
    path : Path
    said : Mapping, optional
        What the file does not say of itself.
    condition : str
        Of a file without a column of conditions.
    by_numbers : bool
        Also use what follows only from the numbers, each with its reason; else it is offered.

    Raises
    ------
    UserError
        If it cannot be read as a recording: every question in a line of its own.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(3000) / 100
    >>> rows = np.column_stack([t, np.sin(2 * t) + 0.1, 3 * np.sin(2 * t) + 2 * np.sin(9 * t)])
    >>> np.savetxt("mine.csv", rows, delimiter=",", header="time_s,Fz,angle", comments="")
    >>> from rigidimeter.analysis.reading_anew import mapping_of
    >>> said = mapping_of(column={"torque_nm": "Fz"}, unit={"angle": "deg"})
    >>> [sorted(epoch.channels) for epoch in read_file(Path("mine.csv"), said).epochs]
    [['angle_rad', 'torque_nm']]
    """
    said = said or Mapping()
    file = columns_of(path, said)
    if not by_numbers:
        return recording_of(file, verdict(file, said), condition)
    proposal = propose(file, said)
    return recording_of(file, proposal.verdict, condition, proposal.reasons)


def recording_of(
    file: Columns, result: Verdict, condition: str = "", reasons: Sequence[str] = ()
) -> Recording:
    """Return columns under a mapping as a recording.

    Raises
    ------
    UserError
        If the verdict has faults, or nothing is left to read.
    """
    if result.faults:
        raise UserError(*result.sentences)
    epochs, notices = epochs_of(file, result.found, condition)
    said = result.found.said
    texts = [one.sentence(said) for one in result.warnings] + result.found.notices
    warnings = [Notice("warning", text) for text in texts]
    mapping = result.found.chosen.mapping
    return Recording(tuple(epochs), (*warnings, *notices), mapping, tuple(reasons))
