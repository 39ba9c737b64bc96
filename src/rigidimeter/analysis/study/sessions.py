"""From the table of sessions to epochs: what can be read is, what cannot is said.

A session is left out, with a sentence, if it is missing or unreadable, was interrupted, is there
twice, disagrees with the table about its condition, or was commanded otherwise than most.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePath

from rigidimeter.analysis.estimation import task_of
from rigidimeter.analysis.reading import ReadOptions, read_recording
from rigidimeter.analysis.reading.channels.joining import FOUND
from rigidimeter.analysis.reading.channels.mapping_file import read_mapping
from rigidimeter.analysis.reading.formats import reader_of, settings_in_file
from rigidimeter.analysis.reading.recording import read_joined
from rigidimeter.analysis.study.blinding import Naming
from rigidimeter.analysis.study.results import LeftOut, SessionEntry
from rigidimeter.analysis.study.session_checks import (
    Session,
    commanded_otherwise,
    other_settings,
    twice,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import RECORDING_BYTES, noted_digests, open_regular
from rigidimeter.core.records import Epoch, Notice
from rigidimeter.core.session import EMG, EVENTS, MANIFEST, SAMPLES, is_session, read_events
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import StudyFolder, TableRow, is_outside


@dataclass(frozen=True)
class Gathered:
    """Every recording of a study that counts, and what became of the others.

    Attributes
    ----------
    sessions : tuple of Session
        In the order of the table.
    left_out : tuple of LeftOut
    digests : mapping of str to str
        SHA-256 of every file of every recording in the table, as it was read, by its path below the
        study.
    notices : tuple of Notice
    """

    sessions: tuple[Session, ...]
    left_out: tuple[LeftOut, ...]
    digests: dict[str, str]
    notices: tuple[Notice, ...]

    @property
    def epochs(self) -> tuple[Epoch, ...]:
        """The epochs of all sessions in order."""
        return tuple(epoch for session in self.sessions for epoch in session.epochs)

    @property
    def entries(self) -> dict[str, SessionEntry]:
        """An entry of each source, for its subject and day, which all rows of a source share."""
        return {session.entry.source: session.entry for session in self.sessions}

    @property
    def settings(self) -> Settings | None:
        """The settings of the first session that has any."""
        return next((s.settings for s in self.sessions if s.settings is not None), None)


class _Refused(Exception):
    """One session does not count, for the reason given."""


def source_of(path: str) -> str:
    """Return a path of the table as epochs carry it."""
    return PurePath(path).as_posix()


def place_of(path: Path) -> Path:
    """Return where a path leads; itself where its links lead nowhere.

    `Path.resolve` raises RuntimeError for links in a circle up to Python 3.12.
    """
    return Path(os.path.realpath(path))


def gather(
    read: StudyFolder, names: Naming, *, progress: Callable[[float], None] = lambda _: None
) -> Gathered:
    """Read every session of the table.

    Raises
    ------
    UserError
        If not one can be read.
    """
    sessions: list[Session] = []
    left_out: list[LeftOut] = []
    notices: list[Notice] = []
    digests: dict[str, str] = {}
    at: dict[Path, list[TableRow]] = {}
    samples: dict[str, TableRow] = {}
    rows_at: dict[Path, list[TableRow]] = {}
    for row in read.sessions:
        rows_at.setdefault(place_of(read.folder / row["path"]), []).append(row)

    def leave_out(row: TableRow, reason: str) -> None:
        text = reason if reason.startswith(row.where) else f"{row.where}: {reason}"
        notices.append(Notice("error", f"{text}; the session is left out"))
        bare = text.replace(f"{read.folder}/", "")
        left_out.append(
            LeftOut(source_of(row["path"]), row["subject"], row["day"], row["condition"], bare)
        )

    for row in read.sessions:
        try:
            # One that is changed while it is read is refused, so digest and result belong together.
            with noted_digests() as noted:
                beside = rows_at[place_of(read.folder / row["path"])]
                try:
                    session, said = _read(read, row, names, beside, at, samples, digests, noted)
                finally:
                    _note_others(read.folder, noted, digests)
        except (_Refused, UserError) as error:
            leave_out(row, " / ".join(str(error).splitlines()))
        except OSError as error:  # such as a path too long for the file system
            leave_out(row, f"{row['path']}: cannot be read ({error.strerror or error})")
        else:
            sessions.append(session)
            notices += said
        progress(1.0 / len(read.sessions))
    for find in (twice, commanded_otherwise):
        for row, reason in find(sessions):
            leave_out(row, reason)
            sessions = [session for session in sessions if session.row is not row]
    notices += other_settings(sessions)
    if not sessions:
        raise UserError(
            f"{read.folder}: no session is left to analyse: "
            + " / ".join(n.text for n in notices if n.level == "error")
        )
    told = tuple(dict.fromkeys(notices))
    return Gathered(tuple(sessions), tuple(left_out), digests, told)


def _read(
    read: StudyFolder,
    row: TableRow,
    names: Naming,
    beside: Sequence[TableRow],
    at: dict[Path, list[TableRow]],
    samples: dict[str, TableRow],
    digests: dict[str, str],
    noted: Mapping[Path, str],
) -> tuple[Session, list[Notice]]:
    path, source = read.folder / row["path"], source_of(row["path"])
    if is_outside(row["path"]):
        raise _Refused(
            f"path is {row['path']}, outside the study folder; copy or link the recording into "
            f"{read.folder} and write its path from there"
        )
    place = place_of(path)
    before = at.setdefault(place, [])
    _differs(path, row, before, names)
    before.append(row)
    if not path.exists():
        raise _Refused(f"{path}: there is no such session folder or recording")
    from_session = is_session(path)
    reader_of(path)
    settings = settings_in_file(path)
    if from_session:
        events, _ = read_events(path / EVENTS) if (path / EVENTS).is_file() else ([], False)
        if not any(event.get("event") == "session_ended" for event in events):
            raise _Refused(
                f"{path}: the session was interrupted and never closed; close it with "
                f"`rigidimeter recover {path}`"
            )
    options = _options(read, row, noted, digests)
    if row["join"]:
        epochs, said = _joined(read.folder, row, options, noted, digests)
    else:
        epochs, said = read_recording(path, options)
    files = _files_of_samples(path, from_session=from_session)
    for file in files:
        if file not in noted:
            open_regular(file, RECORDING_BYTES).close()
        digests[str(PurePath(source) / file.relative_to(path))] = noted[file]
    # Before the condition is looked at: a copy under another name is no less a copy.
    digest = noted[path / SAMPLES if from_session else files[0]] if files else ""
    first = samples.get(digest, row) if digest else row
    if first not in before:
        raise _Refused(
            f"{path} holds the same samples as {first['path']} (line {first.line}); "
            "take the copy out"
        )
    samples.setdefault(digest, row)
    condition = names.named(row["condition"])
    if condition is None:
        raise _Refused(names.unknown(row["condition"]))
    epochs, differing = _of_condition(path, row, condition, beside, epochs, names)
    said = [*said, *differing]
    tasks = [task_of(epoch, settings or Settings()) for epoch in epochs]
    entry = SessionEntry(
        row["subject"], row["day"], condition, row["condition"], row["path"], source, row["group"]
    )
    kept = tuple(
        replace(epoch, source=source, condition=condition, task=task)
        for epoch, task in zip(epochs, tasks, strict=True)
    )
    return Session(row, entry, kept, settings), said


def _files_of_samples(path: Path, *, from_session: bool) -> list[Path]:
    """Return the files of a session; of another recording the one that no two of them share.

    Of a folder, such as a BIDS data set, that is its largest file.
    """
    if from_session:
        names = (MANIFEST, SAMPLES, EVENTS, EMG)
        return [path / name for name in names if (path / name).is_file()]
    files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
    return sorted(files, key=lambda file: file.stat().st_size)[-1:]


def _note_others(folder: Path, noted: Mapping[Path, str], digests: dict[str, str]) -> None:
    """Note what else was read below the study, such as a sidecar."""
    below = {path.relative_to(folder): path for path in noted if path.is_relative_to(folder)}
    digests.update({name.as_posix(): noted[path] for name, path in below.items()})


def _options(
    read: StudyFolder, row: TableRow, noted: Mapping[Path, str], digests: dict[str, str]
) -> ReadOptions:
    """Return how a recording is read: by its own mapping file, or that of the study."""
    named = row["mapping"] or read.about.mapping
    if not named:
        return ReadOptions()
    if is_outside(named):
        raise _Refused(f"mapping is {named}, outside the study folder; copy the file into it")
    options = read_mapping(read.folder / named)
    digests[source_of(named)] = noted[read.folder / named]
    return options


def _joined(
    folder: Path,
    row: TableRow,
    options: ReadOptions,
    noted: Mapping[Path, str],
    digests: dict[str, str],
) -> tuple[list[Epoch], list[Notice]]:
    """Read a recording whose torque and motion are in two files, each with its clock."""
    other, offset = row["join"], row["clock_offset"]
    if is_outside(other):
        raise _Refused(f"join is {other}, outside the study folder; copy the file into it")
    found = read_joined(
        [folder / row["path"], folder / other],
        options,
        row.number("clock_offset") if offset not in ("", FOUND) else offset or None,
    )
    digests[source_of(other)] = noted[folder / other]
    return found


def _differs(path: Path, row: TableRow, before: Sequence[TableRow], names: Naming) -> None:
    """Refuse a row of a recording that has one already, but for another of its conditions."""
    for other in before:
        there = f"{path} is in the table already (line {other.line})"
        if names.named(other["condition"]) == names.named(row["condition"]):
            raise _Refused(there)
        if any(other[key] != row[key] for key in ("subject", "day")):
            raise _Refused(
                f"{there}, of subject {other['subject']} on day {other['day']}; rows of one "
                "recording must agree on both"
            )


def _of_condition(
    path: Path,
    row: TableRow,
    condition: str,
    beside: Sequence[TableRow],
    epochs: Sequence[Epoch],
    names: Naming,
) -> tuple[list[Epoch], list[Notice]]:
    """Return the epochs of the row's condition, held against what the recording names itself.

    A recording of several conditions has a row for each (`beside`), and must say which epoch is of
    which.
    """
    others = {names.named(other["condition"]) for other in beside} - {condition}
    said, kept = [], []
    for epoch in epochs:
        recorded = epoch.condition
        if others and not recorded:
            raise _Refused(
                f"{path}: has rows of several conditions, but does not record which epoch "
                f"{epoch.label} is of"
            )
        hidden = names.blinded and recorded in names.defined and recorded not in names.known
        if hidden and others:
            raise _Refused(
                f"{path}: has rows of several codes, but names conditions; it can be analysed with "
                "a key"
            )
        if hidden:
            text = (
                f"{path}: records its condition by name, so who sees the folder is not blinded; "
                "the code of the table is used"
            )
            said.append(Notice("warning", text))
        found = names.named(recorded) if recorded and not hidden else condition
        if found is None:
            raise _Refused(f"{path} records a condition of its own: {names.unknown(recorded)}")
        if found == condition:
            kept.append(epoch)
        elif found not in others:
            by = "" if recorded == found else f" (code {recorded})"
            more = f"a row for {found} is missing" if others else "one of them is wrong"
            raise _Refused(f"the table says {condition}, but {path} records {found}{by}; {more}")
    if others and not kept:
        raise _Refused(f"{path} records no epoch of {condition}; take the row out")
    return kept, said
