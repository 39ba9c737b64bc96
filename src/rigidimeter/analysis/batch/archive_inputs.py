"""From what the user names to single inputs: recordings, session folders, sessions of studies."""

from __future__ import annotations

import glob
import hashlib
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from rigidimeter.analysis.reading.formats import READERS, reader_of
from rigidimeter.analysis.study import Naming, naming, place_of
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import RECORDING_BYTES, is_dictionary, open_regular
from rigidimeter.core.study_files import StudyFolder, TableRow, is_study, read_study_folder


@dataclass(frozen=True)
class OfStudy:
    """A session of a study: its folder with its own rows and exclusions alone, and the names."""

    folder: StudyFolder
    names: Naming


@dataclass(frozen=True)
class Input:
    """One recording to be estimated.

    Parameters
    ----------
    path : Path
        As the user named it, or found below that.
    study : OfStudy or None
    refused : str
        Why it cannot be read, where that is known already.
    """

    path: Path
    study: OfStudy | None = None
    refused: str = ""


def inputs_of(named: Iterable[str | Path], apart: Iterable[Path] = ()) -> Iterator[Input]:
    """Yield each input once: of a folder or a pattern everything below it that can be read.

    Parameters
    ----------
    named : iterable of paths
        Files, session folders, study folders, folders of these, and patterns such as ``**/*.csv``.
    apart : iterable of Path
        What is no input though it lies among them: our own output.
    """
    seen = dict.fromkeys(map(place_of, apart), False)
    for path in (one for one in _expanded(named) if not is_dictionary(one)):
        yield from _below(path, seen, asked=True)


def content_digest(path: Path) -> str:
    """Return the SHA-256 of a file, or of the names and digests of all files of a folder.

    Raises
    ------
    UserError, OSError
        If a file cannot be read.
    """
    if not path.is_dir():
        return _file_digest(path)
    digest = hashlib.sha256()
    for file in _files(path):
        digest.update(f"{file.relative_to(path).as_posix()}\0{_file_digest(file)}\n".encode())
    return digest.hexdigest()


def digest_or_nothing(path: Path) -> str:
    """Return the digest of a content; nothing where it cannot be read, which reading explains."""
    try:
        return content_digest(path)
    except (UserError, OSError):
        return ""


def content_bytes(path: Path) -> int:
    """Return how much there is to read; 0 of what cannot be looked at."""
    try:
        return sum(file.stat().st_size for file in (_files(path) if path.is_dir() else [path]))
    except OSError:
        return 0


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


def _file_digest(path: Path) -> str:
    with open_regular(path, RECORDING_BYTES) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _expanded(named: Iterable[str | Path]) -> Iterator[Path]:
    for one in named:
        path = Path(one)
        if glob.has_magic(str(one)) and not path.exists():
            found = sorted(glob.glob(str(one), recursive=True))
            yield from map(Path, found or [str(one)])
        else:
            yield path


def _below(path: Path, seen: dict[Path, bool], *, asked: bool) -> Iterator[Input]:
    """Yield what a path holds; a file in a folder only if its suffix is that of a recording.

    `seen` holds where each path leads that was looked at, and whether it is an input.
    """
    place = place_of(path)
    if place in seen:
        return
    seen[place] = False
    if is_study(path):
        seen[place] = True
        yield from _of_study(path)
    elif _is_recording(path) if path.is_dir() else asked or path.suffix.lower() in _suffixes():
        seen[place] = True
        yield Input(path)
    elif path.is_dir():
        for child in sorted(path.iterdir()) if os.access(path, os.R_OK | os.X_OK) else ():
            if not (child.name.startswith(".") or is_dictionary(child)):
                yield from _below(child, seen, asked=False)
        if asked and not any(is_input and place in one.parents for one, is_input in seen.items()):
            yield Input(path, refused=f"{path}: holds nothing that can be read")


def _suffixes() -> set[str]:
    return {suffix for reader in READERS for suffix in reader.suffixes}


def _is_recording(folder: Path) -> bool:
    try:
        reader_of(folder)
    except UserError:
        return False
    return True


def _of_study(folder: Path) -> Iterator[Input]:
    """Yield the sessions of a study, and what is wrong with its tables."""
    try:
        read = read_study_folder(folder)
        names, said = naming(read)
    except UserError as error:
        yield Input(folder, refused=" / ".join(error.lines))
        return
    for notice in (*read.notices, *said):
        if notice.level == "error":
            yield Input(folder, refused=notice.text)
    rows_at: dict[Path, list[TableRow]] = {}
    for row in read.sessions:
        rows_at.setdefault(place_of(folder / row["path"]), []).append(row)
    for place, rows in rows_at.items():
        own = tuple(out for out in read.exclusions if place_of(folder / out["path"]) == place)
        alone = replace(read, sessions=tuple(rows), exclusions=own, ratings=(), notices=())
        yield Input(folder / rows[0]["path"], OfStudy(alone, names))
