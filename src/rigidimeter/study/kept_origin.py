"""What a kept result was made of, held against what there is now: program, options, files."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Mapping
from importlib import resources
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rigidimeter.documents import open_regular, plain_values
from rigidimeter.documents.bounds import RECORDING_BYTES
from rigidimeter.errors import UserError
from rigidimeter.recording.study_folder import StudyFolder
from rigidimeter.recording.study_toml import is_outside
from rigidimeter.settings import Settings, dump_settings
from rigidimeter.study.archive import ANALYSIS, INPUTS, results_changed
from rigidimeter.study.sessions import place_of
from rigidimeter.version import __version__

Asked = Mapping[str, Any]
"""The options of an analysis, as JSON has them."""

_SHOWN = 60
"""Characters of a value in a message."""

_LIBRARIES = ("numpy", "scipy", "pandas", "pyarrow")


class Stale(Exception):
    """A kept result no longer holds, for the reason given."""


def asked(
    *,
    method: str = "auto",
    settings: Settings | None = None,
    band_hz: tuple[float, float] | None = None,
    controller: tuple[float, float] | None = None,
    pair: tuple[str | None, str | None] = (None, None),
    seed: int = 1,
    resamples: int = 9999,
) -> Asked:
    """Return the options of an analysis of a study as JSON has them, named as on a command line.

    The defaults are those of `compare`.
    """
    values = {
        "--method": method,
        "--settings": None if settings is None else dump_settings(settings),
        "--band-hz": band_hz,
        "--controller": controller,
        "--reference": pair[0],
        "--other": pair[1],
        "--seed": seed,
        "--resamples": resamples,
    }
    return dict(plain_values(values))


def made_by() -> dict[str, str]:
    """Return the program and what it computes with, by name: versions, and its source's SHA-256."""
    return {
        "rigidimeter": __version__,
        "source code": _source_digest(),
        "python": f"{platform.python_version()} {platform.system()} {platform.machine()}",
        **{name: version(name) for name in _LIBRARIES},
    }


def _source_digest() -> str:
    """Return the SHA-256 of the names and contents of all modules of this program."""
    with resources.as_file(resources.files("rigidimeter")) as package:
        digest = hashlib.sha256()
        for path in sorted(package.rglob("*.py")):
            digest.update(f"{path.relative_to(package).as_posix()}\0".encode())
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def check_making(document: Mapping[str, Any], asked: Asked, folder: Path) -> None:
    """Find a difference in the program, the options, or the name of the study in its messages.

    Raises
    ------
    Stale
    """
    for name, now in made_by().items():
        before = document["made_by"].get(name)
        if before != now:
            how = "has changed" if name == "source code" else f"was {_shown(before)}, and is {now}"
            raise Stale(f"{name} {how}")
    for name, now in asked.items():
        before = document["asked"].get(name)
        if before != now:
            raise Stale(f"{name} was {_shown(before)}, and is {_shown(now)}")
    if document["folder"] not in ("", str(folder)):
        raise Stale(f"the study was named {_shown(document['folder'])}, and is {folder}")


def _shown(value: Any) -> str:
    return "another" if isinstance(value, dict) else json.dumps(value)[:_SHOWN]


def check_files(document: Mapping[str, Any], read: StudyFolder) -> None:
    """Find what has changed, the small tables first; every file is read once at most.

    Raises
    ------
    Stale
    """
    files = dict(document["files"])
    for name, digest in read.digests.items():
        if files.pop(name, None) != digest:
            raise Stale(f"{name} has changed")
    places = places_of(read)
    if places != document["places"]:
        before = document["places"]
        name = next(n for n in {**before, **places} if before.get(n) != places.get(n))
        raise Stale(f"the files of {name} are not those of then")
    analysis = read.folder / ANALYSIS
    if (changed := results_changed(analysis)) or digest_of(analysis / INPUTS) != document["inputs"]:
        raise Stale(f"{ANALYSIS}/{changed or INPUTS} has changed")
    for name, digest in files.items():
        if digest_of(read.folder / name) != digest:
            raise Stale(f"{name} has changed")


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file; nothing where it cannot be read."""
    try:
        with open_regular(path, RECORDING_BYTES) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (UserError, OSError):
        return ""


def places_of(read: StudyFolder) -> dict[str, list[str]]:
    """Return where each recording lies and the names of the files beside it.

    A file that was not there, such as one that describes a recording, may be there now.
    """
    found: dict[str, list[str]] = {}
    root = place_of(read.folder)
    for row in read.sessions:
        for name in filter(None, (row["path"], row["join"], row["mapping"] or read.about.mapping)):
            path = read.folder / name
            if name in found or is_outside(name):
                continue
            try:
                found[name] = [os.path.relpath(place_of(path), root), *_files_of(path, read.folder)]
            except OSError as error:  # such as a name that is too long; its session is left out
                found[name] = [str(error.strerror)]
    return found


def _files_of(path: Path, study: Path) -> list[str]:
    """Return what is below a folder, or beside a file and above it in the study."""
    if path.is_dir():
        return sorted(each.relative_to(path).as_posix() for each in path.rglob("*"))
    above = [each for each in path.parents if each.is_relative_to(study) and each.is_dir()]
    beside = (each for parent in above for each in parent.iterdir())
    return sorted(each.relative_to(study).as_posix() for each in beside if each.is_file())
