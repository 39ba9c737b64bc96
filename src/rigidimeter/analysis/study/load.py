"""From the table of sessions to epochs: what can be read is, what cannot is left out and stated.

A session is left out, with a sentence, if it is missing or unreadable, was interrupted, is there
twice, disagrees with the table about its condition, or was commanded otherwise than most.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePath

from rigidimeter.analysis.estimation import task_of
from rigidimeter.analysis.reading import ReadOptions, read_recording
from rigidimeter.analysis.reading.channels.joining import FOUND
from rigidimeter.analysis.reading.channels.mapping_file import read_mapping
from rigidimeter.analysis.reading.formats import reader_of, settings_in_file
from rigidimeter.analysis.reading.recording import read_joined
from rigidimeter.analysis.study.session_checks import (
    Session,
    commanded_otherwise,
    other_settings,
    twice,
)
from rigidimeter.analysis.study.study import LeftOut, Naming, SessionEntry
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import RECORDING_BYTES, noted_digests, open_regular
from rigidimeter.core.records import Epoch, Notice, Outcome
from rigidimeter.core.session import EMG, EVENTS, MANIFEST, SAMPLES, is_session, read_events
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import StudyFolder, TableRow, is_outside


@dataclass(frozen=True)
class Recordings:
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
    outside : bool
        Whether anything was read that is not below the study.
    """

    sessions: tuple[Session, ...]
    left_out: tuple[LeftOut, ...]
    digests: Mapping[str, str]
    notices: tuple[Notice, ...]
    outside: bool = False

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


@dataclass
class _Seen:
    """What was read so far: the rows of each place, whose samples they are, what was noted."""

    rows_at: dict[Path, list[TableRow]] = field(default_factory=dict)
    samples: dict[str, TableRow] = field(default_factory=dict)
    digests: dict[str, str] = field(default_factory=dict)
    outside: bool = False


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


def load(
    read: StudyFolder, names: Naming, *, progress: Callable[[float], None] = lambda _: None
) -> Recordings:
    """Read every session of the table.

    Parameters
    ----------
    read : StudyFolder
    names : Naming
    progress : callable
        Called with the share of the sessions that was read since, 1 in all.

    Raises
    ------
    UserError
        If not one can be read.
    """
    sessions: list[Session] = []
    left_out: list[LeftOut] = []
    notices: list[Notice] = []
    seen = _Seen()
    rows_at: dict[Path, list[TableRow]] = {}
    for row in read.sessions:
        rows_at.setdefault(place_of(read.folder / row["path"]), []).append(row)
    for row in read.sessions:
        beside = rows_at[place_of(read.folder / row["path"])]
        found = _read(read, row, names, beside, seen)
        if isinstance(found, str):
            out, notice = _out(read.folder, row, found)
            left_out.append(out)
            notices.append(notice)
        else:
            sessions.append(found[0])
            notices += found[1]
        progress(1.0 / len(read.sessions))
    for find in (twice, commanded_otherwise):
        for row, reason in find(sessions):
            out, notice = _out(read.folder, row, reason)
            left_out.append(out)
            notices.append(notice)
            sessions = [session for session in sessions if session.row is not row]
    notices += other_settings(sessions)
    if not sessions:
        raise UserError(
            f"{read.folder}: no session is left to analyse: "
            + " / ".join(n.text for n in notices if n.level == "error")
        )
    return Recordings(
        tuple(sessions),
        tuple(left_out),
        seen.digests,
        tuple(dict.fromkeys(notices)),
        seen.outside,
    )


def _read(
    read: StudyFolder, row: TableRow, names: Naming, beside: Sequence[TableRow], seen: _Seen
) -> tuple[Session, list[Notice]] | str:
    """Return a session and its notices, or why it does not count."""
    # One that is changed while it is read is refused, so digest and result belong together.
    with noted_digests() as noted:
        try:
            return _session(read, row, names, beside, seen, noted)
        except (_Refused, UserError) as error:
            return " / ".join(str(error).splitlines())
        except OSError as error:  # such as a path too long for the file system
            return f"{row['path']}: cannot be read ({error.strerror or error})"
        finally:
            below = [path for path in noted if path.is_relative_to(read.folder)]
            seen.outside |= len(below) < len(noted)
            for path in below:
                seen.digests[path.relative_to(read.folder).as_posix()] = noted[path]


def _out(folder: Path, row: TableRow, reason: str) -> tuple[LeftOut, Notice]:
    """Return that a session is left out, and the sentence on it, after file and line."""
    text = reason if reason.startswith(row.where) else f"{row.where}: {reason}"
    bare = text.replace(f"{folder}/", "")
    out = LeftOut(source_of(row["path"]), row["subject"], row["day"], row["condition"], bare)
    return out, Notice("error", f"{text}; the session is left out")


def _session(
    read: StudyFolder,
    row: TableRow,
    names: Naming,
    beside: Sequence[TableRow],
    seen: _Seen,
    noted: Mapping[Path, str],
) -> tuple[Session, list[Notice]]:
    path, source = read.folder / row["path"], source_of(row["path"])
    _inside("path", row["path"], f"copy or link the recording into {read.folder}", "write its path")
    before = seen.rows_at.setdefault(place_of(path), [])
    _differs(path, row, before, names)
    before.append(row)
    if not path.exists():
        raise _Refused(f"{path}: there is no such session folder or recording")
    reader_of(path)
    settings = settings_in_file(path)
    _is_closed(path)
    options = _options(read, row)
    if row["join"]:
        epochs, notices = _joined(read.folder, row, options)
    else:
        epochs, notices = read_recording(path, options)
    for file in _files_of_samples(path):
        if file not in noted:
            open_regular(file, RECORDING_BYTES).close()
        seen.digests[str(PurePath(source) / file.relative_to(path))] = noted[file]
    _is_no_copy(path, row, before, seen, noted)
    condition = names.named(row["condition"])
    if condition is None:
        raise _Refused(names.unknown(row["condition"]))
    epochs, differing = _of_condition(path, condition, beside, epochs, names)
    tasks = [task_of(epoch, settings or Settings()) for epoch in epochs]
    who = row["subject"], row["day"]
    entry = SessionEntry(*who, condition, row["condition"], row["path"], source, row["group"])
    kept = tuple(
        replace(epoch, source=source, condition=condition, task=task)
        for epoch, task in zip(epochs, tasks, strict=True)
    )
    return Session(row, entry, kept, settings), [*notices, *differing]


def _inside(column: str, path: str, remedy: str, then: str = "") -> None:
    """Refuse a path that leads out of the study."""
    if is_outside(path):
        after = f" and {then} from there" if then else ""
        raise _Refused(f"{column} is {path}, outside the study folder; {remedy}{after}")


def _is_closed(path: Path) -> None:
    """Refuse a session of this program that was interrupted."""
    if not is_session(path):
        return
    events, _ = read_events(path / EVENTS) if (path / EVENTS).is_file() else ([], False)
    if not any(event.get("event") == "session_ended" for event in events):
        raise _Refused(
            f"{path}: the session was interrupted and never closed; close it with "
            f"`rigidimeter recover {path}`"
        )


def _is_no_copy(
    path: Path,
    row: TableRow,
    before: Sequence[TableRow],
    seen: _Seen,
    noted: Mapping[Path, str],
) -> None:
    """Refuse a recording whose samples are those of another, whatever its condition."""
    files = _files_of_samples(path)
    if not files:
        return
    digest = noted[path / SAMPLES if is_session(path) else files[0]]
    first = seen.samples.setdefault(digest, row)
    if first not in before:
        raise _Refused(
            f"{path} holds the same samples as {first['path']} (line {first.line}); "
            "take the copy out"
        )


def _files_of_samples(path: Path) -> list[Path]:
    """Return the files of a session; of another recording the one that no two of them share.

    Of a folder, such as a BIDS data set, that is its largest file.
    """
    if is_session(path):
        names = (MANIFEST, SAMPLES, EVENTS, EMG)
        return [path / name for name in names if (path / name).is_file()]
    files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
    return sorted(files, key=lambda file: file.stat().st_size)[-1:]


def _options(read: StudyFolder, row: TableRow) -> ReadOptions:
    """Return how a recording is read: by its own mapping file, or that of the study."""
    named = row["mapping"] or read.about.mapping
    if not named:
        return ReadOptions()
    _inside("mapping", named, "copy the file into it")
    return read_mapping(read.folder / named)


def _joined(folder: Path, row: TableRow, options: ReadOptions) -> tuple[list[Epoch], list[Notice]]:
    """Read a recording whose torque and motion are in two files, each with its clock."""
    _inside("join", row["join"], "copy the file into it")
    offset = row["clock_offset"]
    return read_joined(
        [folder / row["path"], folder / row["join"]],
        options,
        row.number("clock_offset") if offset not in ("", FOUND) else offset or None,
    )


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
    condition: str,
    beside: Sequence[TableRow],
    epochs: Sequence[Epoch],
    names: Naming,
) -> tuple[list[Epoch], list[Notice]]:
    """Return the epochs of the row's condition, compared with what the recording names itself.

    A recording of several conditions has a row for each (`beside`), and must say which epoch is of
    which.
    """
    others = {names.named(other["condition"]) for other in beside} - {condition}
    notices, kept = [], []
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
            notices.append(Notice("warning", text))
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
    return kept, notices


def without_excluded(
    read: StudyFolder, found: Recordings
) -> tuple[tuple[Epoch, ...], dict[tuple[str, str], TableRow], list[Notice]]:
    """Return the epochs with the operator's exclusions, the rows that met one, and what met none.

    The rows are by source and label.
    """
    epochs = {(epoch.source, epoch.label): epoch for epoch in found.epochs}
    labels: dict[str, list[str]] = {}
    for source, label in epochs:
        labels.setdefault(source, []).append(label)
    places = {place_of(read.folder / s.entry.path): s.entry.source for s in found.sessions}
    left_out = {place_of(read.folder / out.path) for out in found.left_out}
    met: dict[tuple[str, str], TableRow] = {}
    notices = []
    for row in read.exclusions:
        path, place = row["path"], place_of(read.folder / row["path"])
        key = (places.get(place, ""), row["epoch"])
        if key in met:
            text = f"{row.where}: epoch {row['epoch']} of {path} is out already (line "
            notices.append(Notice("warning", f"{text}{met[key].line}); the first reason counts"))
        elif key in epochs:
            met[key] = row
            by = f" ({row['by']})" if row["by"] else ""
            epochs[key] = replace(epochs[key], closed=Outcome("excluded", f"{row['reason']}{by}"))
        elif place in places:
            there = ", ".join(labels.get(places[place], [])) or "none"
            text = f"{row.where}: {path} has no epoch {row['epoch']}; its epochs are {there}"
            notices.append(Notice("error", text))
        elif place not in left_out:
            near = difflib.get_close_matches(source_of(path), labels, n=1, cutoff=0.5)
            hint = f"; the nearest is {near[0]}" if near else ""
            text = f"{row.where}: {path} is no session of {read.about.sessions}{hint}"
            notices.append(Notice("error", text))
    return tuple(epochs.values()), met, notices
