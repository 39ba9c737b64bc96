"""Names of exported files: `sub-S1_ses-day1_acq-OFF`, after the rules of BIDS."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from rigidimeter.analysis.export.exported_sessions import ExportedSession
from rigidimeter.core.errors import UserError
from rigidimeter.core.study_files import SubjectTable

ABOUT_SUBJECT = tuple(
    name for name in SubjectTable.model_fields if name not in ("age_years", "sex", "species")
)
"""What a study says of a subject for which archives have no field of their own."""


def label(text: str, otherwise: str) -> str:
    """Return a text as a label of BIDS: letters and digits alone.

    Examples
    --------
    >>> label("day 1", "unknown")
    'day1'
    """
    return re.sub(r"[^a-zA-Z0-9]", "", text) or otherwise


def subject_label(about: Mapping[str, Any]) -> str:
    """Return the subject of a document as a label."""
    return label(str(about.get("subject", "")), "unknown")


def entities(sessions: Sequence[ExportedSession]) -> list[dict[str, str]]:
    """Return subject, day and acquisition of each session as labels; no two are the same.

    The acquisition is condition and part. Sessions that still have the same names, as of two
    recordings of an unknown subject, are numbered.

    Raises
    ------
    UserError
        If two subjects would be one.
    """
    _check_subjects(sessions)
    found: list[dict[str, str]] = []
    seen: set[tuple[str, ...]] = set()
    for session in sessions:
        about = session.about
        own = {"sub": subject_label(about), "ses": label(str(about.get("day", "")), "1")}
        acquisition = label(f"{about.get('condition', '')}{about.get('part', '')}", "")
        number, tried = 1, acquisition
        while (*own.values(), tried.casefold()) in seen:
            number += 1
            tried = f"{acquisition}{number}"
        seen.add((*own.values(), tried.casefold()))
        found.append(own | ({"acq": tried} if tried else {}))
    return found


def stems(sessions: Sequence[ExportedSession]) -> list[str]:
    """Return a file name without a suffix for each session."""
    return [joined(own) for own in entities(sessions)]


def joined(own: Mapping[str, str]) -> str:
    """Return entities as BIDS writes them into a name."""
    return "_".join(f"{key}-{value}" for key, value in own.items())


def _check_subjects(sessions: Sequence[ExportedSession]) -> None:
    names: dict[str, str] = {}
    for session in sessions:
        name = str(session.about.get("subject", ""))
        other = names.setdefault(subject_label(session.about).casefold(), name)
        if other != name:
            raise UserError(
                f"subjects {other} and {name} would both be sub-{subject_label(session.about)} in "
                "the names of files, which have letters and digits alone; rename one of them"
            )
