"""A study folder is made, empty or of a folder of sessions, and grows with each that is recorded.

Nothing that a person wrote is changed: rows are added behind theirs, and a `study.toml` that was
edited stays as it is.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path

from rigidimeter.core.errors import UserError, refused
from rigidimeter.core.files import DOCUMENT_BYTES, read_bytes, toml_text, write_text
from rigidimeter.core.session import EVENTS, is_session, read_events, read_manifest
from rigidimeter.core.settings import validated
from rigidimeter.core.study_files.folder import is_study
from rigidimeter.core.study_files.recorded_sessions import (
    RecordedSession,
    recorded_rating_rows,
    recorded_session,
    session_rows,
    stimulated,
)
from rigidimeter.core.study_files.session_scan import scan_session, session_folders
from rigidimeter.core.study_files.study_toml import (
    DBS,
    OFF,
    STUDY_FILE,
    ConditionTable,
    PrimaryTable,
    is_own,
    own_text,
    pair_of,
    read_study_toml,
    study_text,
)
from rigidimeter.core.study_files.tables import (
    add_rows,
    commented_cells,
    empty_table,
    table_path,
    table_rows,
    write_study_dictionary,
)

_TABLES = ("sessions", "ratings", "exclusions")


def write_new_study(
    folder: Path, title: str = "", planned: Mapping[str, ConditionTable] | None = None
) -> None:
    """Make a study folder; without a title it has the folder's name.

    Parameters
    ----------
    folder : Path
    title : str
    planned : mapping of str to ConditionTable, optional
        The conditions of a plan, the reference first; then `study.toml` is marked as the program's
        own, and grows with the sessions.

    Raises
    ------
    UserError
        If one of its files is there already, or the folder cannot be written.
    """
    names = (STUDY_FILE, *(f"{name}.csv" for name in _TABLES))
    there = [name for name in names if (folder / name).exists()]
    if there:
        raise UserError(
            f"{folder / there[0]}: is there already; a study is never written over, so name "
            "another folder"
        )
    with refused(folder, "cannot be made"):
        folder.mkdir(parents=True, exist_ok=True)
    for name in _TABLES:
        write_text(folder / f"{name}.csv", empty_table(name))
    write_study_dictionary(folder)
    shown = title.strip() or folder.resolve().name
    conditions = dict(planned or {OFF: ConditionTable(), DBS: ConditionTable()})
    primary = PrimaryTable(declared=date.today())
    reference, other = list(conditions)[:2]
    text = study_text(shown, reference, other, conditions, primary)
    write_text(folder / STUDY_FILE, text if planned is None else own_text(text))


def extend_study(
    study: Path,
    folders: Iterable[Path] | None = None,
    *,
    subject: str = "",
    known: Sequence[str] | None = None,
    refused: list[str] | None = None,
) -> list[str]:
    """Add recorded sessions to a study folder, which is made if it is none yet.

    A session is added once. One whose row was made a comment stays out of the study.

    Parameters
    ----------
    study : Path
    folders : iterable of Path, optional
        Session folders; those in the study folder and in its folder `sessions` by default.
    subject : str
        Of sessions that do not say theirs.
    known : sequence of str, optional
        Names of conditions; any other may be a code. Those of the session's settings by default.
    refused : list of str, optional
        Takes the sentences about sessions without a subject, or of a condition that an edited
        `study.toml` does not know; by default they are among those that are returned.

    Returns
    -------
    list of str
        What was done and what was not, a sentence each.

    Raises
    ------
    UserError
        If a table or `study.toml` cannot be read or written.
    """
    table = table_path(study, "sessions")
    there = {os.path.normpath(row["path"]) for row in table_rows(table, "sessions")}
    there |= {os.path.normpath(cell) for cell in commented_cells(table) if cell}
    asked = folders is not None
    said = []
    if not asked and not study.is_dir():
        raise UserError(f"{study}: there is no such folder")
    for folder in session_folders(study) if folders is None else folders:
        path = os.path.relpath(os.path.realpath(folder), os.path.realpath(study))
        if path in there:
            said += [f"{path}: is in {table.name} already"] if asked else []
            continue
        if path.split(os.sep)[0] == os.pardir:
            said.append(
                f"{folder}: lies outside the study folder {study}; copy or link it there to add it"
            )
            continue
        kept_out, told = (said, asked) if refused is None else (refused, True)
        said += _added(study, table, Path(path), subject, known, kept_out, asked=told)
    return said


def raters_of(study: Path, path: str) -> dict[str, str]:
    """Return the score that each examiner gave a session or its epochs; several with blanks.

    Raises
    ------
    UserError
        If the table of ratings cannot be read.
    """
    scores: dict[str, list[str]] = {}
    for row in table_rows(table_path(study, "ratings"), "ratings"):
        if row.get("note", "").partition(", epoch ")[0] == path:
            scores.setdefault(row["examiner"], []).append(row["score"])
    return {examiner: " ".join(given) for examiner, given in scores.items()}


def rate_session(study: Path, path: str, examiner: str, score: float) -> None:
    """Write the score that an examiner gave a recorded session into the ratings of its study.

    Parameters
    ----------
    study : Path
    path : str
        Of the session folder, below that of the study.
    examiner : str
    score : float

    Raises
    ------
    UserError
        If this examiner rated it before, it has epochs of several conditions or none, or the table
        cannot be written.
    """
    events, _ = read_events(study / path / EVENTS)
    session = recorded_session(path, read_manifest(study / path), events)
    if len(session.conditions) != 1:
        raise UserError(f"{path}: has not one condition, so its epochs are rated one by one")
    if examiner in raters_of(study, path):
        table = table_path(study, "ratings")
        raise UserError(f"{path}: {examiner} rated it before; correct {table} if that is wrong")
    row = {
        "subject": session.subject,
        "day": session.day,
        "condition": session.conditions[0],
        "examiner": examiner,
        "score": f"{score:g}",
        "note": path,
    }
    add_rows(table_path(study, "ratings"), "ratings", [row])


def _added(
    study: Path,
    table: Path,
    path: Path,
    subject: str,
    known: Sequence[str] | None,
    refused: list[str],
    *,
    asked: bool,
) -> list[str]:
    """Add one session; return what is to be said of it."""
    one = scan_session(study, study / path)
    manifest = one.manifest
    if not one.of("session_ended"):
        return [f"{path}: was not closed, so it is not in the study yet"] if asked else []
    session = recorded_session(path.as_posix(), manifest, one.events)
    session = replace(session, subject=session.subject or subject)
    if not session.subject:
        if asked:
            refused.append(f"{path}: does not say its subject; name it with --subject")
        return []
    if not session.conditions:
        return [f"{path}: no epoch was begun in it, so it is not in the study"] if asked else []
    before = table_rows(table, "sessions")
    kinds = (_is_virtual(study / row["path"]) for row in before)
    if next((kind for kind in kinds if kind is not None), session.virtual) != session.virtual:
        kind, other = ("virtual", "real") if session.virtual else ("real", "virtual")
        return [
            f"{path}: was recorded on a {kind} rig, the sessions of the study on a {other} one; "
            "it is not in the study, so use another folder for it"
        ]
    recorded = [*(row["condition"] for row in before), *session.conditions]
    names = list(manifest["settings"]["subject"]) if known is None else list(known)
    if is_study(study) and not is_own(read_bytes(study / STUDY_FILE, DOCUMENT_BYTES)):
        about = read_study_toml(study / STUDY_FILE)
        defined = about.conditions or (about.reference, about.other)
        new = [name for name in _new(study, recorded, defined) if name in session.conditions]
        if new:
            refused.append(
                f"{path}: is not in the study, for {study / STUDY_FILE} lacks its condition "
                f"{new[0]}: write {toml_text({'conditions': {new[0]: {}}}).strip()} there and "
                "add the session again"
            )
            return []
    said = _described(study, session, recorded, names)
    ratings = table_path(study, "ratings")
    # The row of the session comes last: what was interrupted before is done again.
    add_rows(ratings, "ratings", recorded_rating_rows(session, table_rows(ratings, "ratings")))
    add_rows(table, "sessions", session_rows(session, before))
    # Not in which condition: the operator may be blinded.
    return [f"{path}: added to {table.name}, subject {session.subject}, day {session.day}.", *said]


def _is_virtual(folder: Path) -> bool | None:
    """Whether a row's recording was made on the virtual rig; None where that is not known."""
    try:
        return bool(read_manifest(folder)["virtual"]) if is_session(folder) else None
    except UserError:
        return None


def _new(study: Path, recorded: Sequence[str], defined: Collection[str]) -> list[str]:
    """Return the recorded conditions that a study does not know; not its codes.

    Where it knows none of them, all are codes, and the study is analysed blinded.
    """
    codes = {row["code"] for row in table_rows(table_path(study, "key"), "key")}
    if not codes and set(recorded).isdisjoint(defined):
        return []
    return [name for name in dict.fromkeys(recorded) if name not in defined and name not in codes]


def _described(
    study: Path, session: RecordedSession, recorded: Sequence[str], known: list[str]
) -> list[str]:
    """Write `study.toml`, or add to one that is the program's own; return what could not be."""
    path = study / STUDY_FILE
    names = [name for name in known if name in recorded]
    title, pair = study.resolve().name, pair_of(names, known)
    conditions: dict[str, ConditionTable] = {}
    own = True
    primary: PrimaryTable | None = PrimaryTable()
    if is_study(study):
        content, about = read_bytes(path, DOCUMENT_BYTES), read_study_toml(path)
        own, title, conditions = is_own(content), about.title, dict(about.conditions)
        pair = pair if own else (about.reference, about.other)
        # What was made before anything was declared may have been compared.
        primary = about.primary if "primary" in about.model_fields_set else None
    for name in (*pair, *names):
        conditions.setdefault(name, ConditionTable())
    conditions |= {name: ConditionTable() for name in _new(study, recorded, conditions)}
    said = []
    for name in stimulated(session, pair[0]):
        if name not in conditions:  # a code; whose stimulation it was would tell
            continue
        given = validated(ConditionTable, dict(session.stimulation), "stimulation")
        there = conditions[name].model_dump(exclude={"title"}, exclude_defaults=True)
        new = given.model_dump(exclude={"title"}, exclude_defaults=True)
        if there == new:
            continue
        if there or not own:
            told = ", ".join(f"{key} = {value}" for key, value in new.items())
            said.append(
                f"{session.path}: its stimulation was {told}; {path.name} says otherwise and "
                "stays as it is"
            )
        else:
            conditions[name] = ConditionTable(**new)
    if own:
        for table in ("ratings", "exclusions"):
            if not table_path(study, table).exists():
                write_text(table_path(study, table), empty_table(table))
        text = own_text(study_text(title, *pair, conditions, primary))
        if not path.exists() or read_bytes(path, DOCUMENT_BYTES) != text.encode():
            write_text(path, text)
    return said
