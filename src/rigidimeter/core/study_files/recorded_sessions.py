"""What a recorded session adds to the tables of a study; pure functions of its manifest and events.

A session that was continued or of which an epoch was repeated gives several folders of one day.
Each has its rows, told apart by `part`, and the study pools their epochs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, tzinfo
from typing import Any


@dataclass(frozen=True)
class RecordedRating:
    """A score that an examiner gave an epoch."""

    epoch: str
    condition: str
    examiner: str
    score: float


@dataclass(frozen=True)
class RecordedSession:
    """What a study keeps of a session.

    Attributes
    ----------
    path : str
        Of its folder, below that of the study.
    subject : str
        Empty where it was not said.
    day : str
        Its label, or else the date on which it began, where it was recorded.
    virtual : bool
        Whether it was recorded on the virtual rig.
    conditions : tuple of str
        Of the epochs that were begun, in their order.
    ratings : tuple of RecordedRating
        The last one of an examiner for an epoch.
    stimulation : mapping
        As the operator said it, with the keys of `study.toml`.
    note : str
    """

    path: str
    subject: str
    day: str
    virtual: bool
    conditions: tuple[str, ...]
    ratings: tuple[RecordedRating, ...]
    stimulation: Mapping[str, Any]
    note: str


def recorded_session(
    path: str,
    manifest: Mapping[str, Any],
    events: Sequence[Mapping[str, Any]],
    zone: tzinfo | None = None,
) -> RecordedSession:
    """Return what a study keeps of a session.

    Parameters
    ----------
    path : str
    manifest : mapping
    events : sequence of mappings
    zone : tzinfo or None
        Of the laboratory, for the date; None for that of this computer.
    """
    about = manifest.get("about", {})
    created = datetime.fromisoformat(manifest["created_utc"])
    begun = {event["epoch"]: event for event in events if event["event"] == "epoch_started"}
    ratings: dict[tuple[int, str], RecordedRating] = {}
    for event in events:
        if event["event"] == "note" and event.get("what") == "rating" and event["epoch"] in begun:
            epoch = begun[event["epoch"]]
            key = event["epoch"], str(event["by"])
            ratings[key] = RecordedRating(
                str(epoch["label"]), str(epoch["condition"]), key[1], float(event["score"])
            )
    return RecordedSession(
        path,
        str(about.get("subject", "")),
        str(about.get("day") or created.astimezone(zone).date().isoformat()),
        bool(manifest["virtual"]),
        tuple(dict.fromkeys(str(event["condition"]) for event in begun.values())),
        tuple(ratings.values()),
        about.get("stimulation", {}),
        str(about.get("note", "")),
    )


def session_rows(
    session: RecordedSession, before: Sequence[Mapping[str, str]]
) -> list[dict[str, str]]:
    """Return the rows of `sessions.csv` for a session, one for each condition of its epochs.

    Parameters
    ----------
    session : RecordedSession
    before : sequence of mappings
        The rows that are there; a further session of a day in a condition gets another `part`.
    """
    rows = []
    for condition in session.conditions:
        who = {"subject": session.subject, "day": session.day, "condition": condition}
        taken = {row.get("part", "") for row in before if all(row[key] == who[key] for key in who)}
        number = len(taken) + 1
        while str(number) in taken:
            number += 1
        part = str(number) if taken else ""
        rows.append({"path": session.path, **who, "part": part, "note": session.note})
    return rows


def recorded_rating_rows(
    session: RecordedSession, before: Sequence[Mapping[str, str]]
) -> list[dict[str, str]]:
    """Return the rows of `ratings.csv` for a session; `note` says which epoch was rated.

    Rows whose note is in `before` are there already.
    """
    notes = {(row.get("note", ""), row["examiner"]) for row in before}
    rows = []
    for rating in session.ratings:
        note = f"{session.path}, epoch {rating.epoch}"
        if (note, rating.examiner) not in notes:
            rows.append(
                {
                    "subject": session.subject,
                    "day": session.day,
                    "condition": rating.condition,
                    "examiner": rating.examiner,
                    "score": f"{rating.score:g}",
                    "note": note,
                }
            )
    return rows


def stimulated(session: RecordedSession, reference: str) -> tuple[str, ...]:
    """Return the conditions that the stimulation of a session belongs to.

    A session of several conditions has it in all but the reference.
    """
    if not session.stimulation:
        return ()
    others = tuple(name for name in session.conditions if name != reference)
    return others if len(session.conditions) > 1 else session.conditions
