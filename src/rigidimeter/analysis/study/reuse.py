"""Nothing is computed twice: the study of a folder in which nothing has changed is taken from it.

    STUDY/analysis/rows.parquet      the rows by every method, and as JSON what stands beside them
    STUDY/analysis/estimates.json    the estimates that are concluded from

They are used where everything that they were made of is as it was: what was asked; this software
and what it computes with; every file that was read, by its SHA-256; the names and sizes of all
files, for one that is new may be read, too. Ratings are modelled, deviations from a plan looked for
and everything tested and concluded anew.

The whole study is used or nothing: J is held at the median of a subject, a method is chosen from
all epochs, and a session is left out for what most others are. Nothing is kept of one group of
subjects, with what files of the user add to the package, or where something outside was read, a
folder is a link or a file cannot be read.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import scipy

import rigidimeter
from rigidimeter.analysis.reading import read_estimates
from rigidimeter.analysis.study.from_folder import ANALYSIS, Loaded, load_study, primary_of
from rigidimeter.analysis.study.load import Recordings
from rigidimeter.analysis.study.ratings import study_ratings
from rigidimeter.analysis.study.rows import parquet_bytes, read_with_beside
from rigidimeter.analysis.study.session_checks import deviations
from rigidimeter.analysis.study.study import Exclusion, LeftOut, SessionEntry, Study, naming
from rigidimeter.core.errors import UserError
from rigidimeter.core.extensions import loaded as files_of_the_user
from rigidimeter.core.records import Notice
from rigidimeter.core.settings import Settings, dump_settings, parse_settings
from rigidimeter.core.study_files import read_study_folder
from rigidimeter.core.version import __version__

ROWS, ESTIMATES = "rows.parquet", "estimates.json"

_RECORDS = {"sessions": SessionEntry, "left_out": LeftOut, "exclusions": Exclusion,
            "notices": Notice}  # fmt: skip
_AS_THEY_ARE = ("reference", "other", "further", "virtual", "partly_virtual")


def stored_study(
    folder: Path,
    *,
    key: Path | None = None,
    settings: Settings | None = None,
    method: str = "auto",
    pair: tuple[str | None, str | None] = (None, None),
    adjust: Callable[[Settings], Settings],
    results: Mapping[str, str],
) -> tuple[Loaded, Study] | None:
    """Return a study as it was analysed before, without its recordings; None if that is not known.

    Parameters
    ----------
    folder : Path
    key, settings, method, pair
        As `load_study`.
    adjust : callable
        Changes the settings of the folder before it is analysed.
    results : mapping of str to str
        SHA-256 of the files of the analysis as they were written, by name.
    """
    analysis = folder / ANALYSIS
    kept = (ROWS, ESTIMATES)
    try:
        if files_of_the_user() or any(file_digest(analysis / n) != results.get(n) for n in kept):
            return None
        rows, text = read_with_beside(analysis / ROWS)
        found = json.loads(text)
        asked = _asked(folder, key=key, settings=settings, method=method, pair=pair)
        if found["asked"] != asked | {"place": found["asked"]["place"] and str(folder)}:
            return None
        read = read_study_folder(folder, key)
        if found["tables"] != read.digests or found["there"] != _there(folder):
            return None
        if any(file_digest(folder / name) != each for name, each in found["recordings"].items()):
            return None
        estimates = read_estimates(analysis / ESTIMATES)
        as_read = parse_settings(found["as_read"])
        options = adjust(as_read)
        if found["settings"] != dump_settings(options):
            return None
    except (UserError, OSError, ValueError, KeyError):
        return None
    records: dict[str, Any] = {
        name: tuple(kind(**one) for one in found[name]) for name, kind in _RECORDS.items()
    }
    sessions = records["sessions"]
    names, _ = naming(read)
    names = replace(names, pair=(found["reference"], found["other"]))
    primary = primary_of(read, (one.day for one in sessions))
    if [one.text for one in primary.notices] != found["of_primary"]:
        return None
    groups = {one.subject: one.group for one in sessions}
    again = partial(load_study, folder, key=key, settings=settings, method=method, pair=pair)
    further = tuple(found["further"])
    recordings = Recordings((), records["left_out"], found["recordings"], ())
    loaded = Loaded(
        *(read, names, recordings, (), {}, options, found["method"], (), further, primary),
        again,
        as_read,
    )
    study = Study(
        rows,
        *names.pair,
        further,
        title=read.about.title,
        primary=primary,
        settings=options,
        conditions=names.conditions,
        **records,
        deviations=deviations(folder, sessions),
        ratings=study_ratings(read, names, groups)[0],
        blinded=names.blinded,
        virtual=found["virtual"],
        partly_virtual=found["partly_virtual"],
        digests={**read.digests, **found["recordings"]},
        analysis=estimates,
        folder_read=again,
    )
    return loaded, study


def rows_file(loaded: Loaded, study: Study) -> bytes | None:
    """Return what `stored_study` needs as the content of a file; None where nothing is kept."""
    folder, asked = loaded.folder.folder, dict(loaded.again.keywords)
    if not loaded.recordings.sessions:  # it is from there
        return (folder / ANALYSIS / ROWS).read_bytes()
    there = _there(folder)
    said, key = " ".join(one.text for one in study.notices), str(loaded.folder.files.get("key"))
    # A key that is named in a notice may lie elsewhere the next time.
    outside = there is None or loaded.recordings.outside or key in said
    if outside or asked.pop("group", None) or files_of_the_user():
        return None
    found = {
        "asked": _asked(folder, **asked) | {"place": str(folder) if str(folder) in said else ""},
        "tables": loaded.folder.digests,
        "recordings": loaded.recordings.digests,
        "there": there,
        "method": loaded.method,
        "as_read": dump_settings(loaded.as_read),
        "settings": dump_settings(study.settings),
        "of_primary": [one.text for one in loaded.primary.notices],
        **{name: getattr(study, name) for name in _AS_THEY_ARE},
        **{name: [_fields(one) for one in getattr(study, name)] for name in _RECORDS},
    }
    return parquet_bytes(study.rows, json.dumps(found))


def _fields(record: Any) -> dict[str, Any]:
    return dict(vars(record)) if hasattr(record, "__dict__") else record._asdict()


def _asked(
    folder: Path,
    *,
    key: Path | None,
    settings: Settings | None,
    method: str,
    pair: tuple[str | None, str | None],
) -> dict[str, Any]:
    """Return what was asked, and of which software, but for what the tables hold."""
    code = hashlib.sha256()
    for path in sorted(Path(rigidimeter.__file__).parent.rglob("*.py")):
        code.update(path.read_bytes())
    return {
        "software": [__version__, code.hexdigest()],
        "with": [np.__version__, scipy.__version__, pd.__version__],
        "settings": None if settings is None else dump_settings(settings),
        "method": method,
        "pair": list(pair),
    }


def _there(folder: Path) -> dict[str, int] | None:
    """Return every folder of a study and the size of every file, but for the kept analysis.

    None where a folder is a link, in which nothing is looked for, and where anything cannot be
    read: it may be another time, and be as large.
    """
    found = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if name.parts[0] == ANALYSIS:
            continue
        if (path.is_symlink() and path.is_dir()) or not os.access(path, os.R_OK):
            return None
        found[name.as_posix()] = path.stat().st_size if path.is_file() else 0
    return found


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file as it is now."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
