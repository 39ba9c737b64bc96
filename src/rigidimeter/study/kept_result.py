"""The result of a study as a file, which a report takes while nothing has changed that made it.

    STUDY/analysis/kept.json    what made it, of what, and every number; no sample but of examples

It holds the SHA-256 of every file that was read, the names of the files beside them, the options,
the versions, the SHA-256 of this program's source, and that of the `inputs.json` that was written
with it. A checksum covers all of it. It is read as JSON by the types of the records.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

from rigidimeter.documents import parse_json, read_bytes, replace_file, text_bytes
from rigidimeter.documents.bounds import DOCUMENT_BYTES
from rigidimeter.documents.typed_values import Records, WrongValue, plain_of
from rigidimeter.errors import UserError, refused
from rigidimeter.extensions import loaded
from rigidimeter.recording.checksum import FIELD, ZEROS, checksum_holds, with_checksum
from rigidimeter.recording.study_folder import StudyFolder, read_study_folder
from rigidimeter.records import Channel, Epoch
from rigidimeter.settings import dump_settings, parse_settings
from rigidimeter.study.archive import ANALYSIS, INPUTS, UNCHANGED
from rigidimeter.study.blinding import naming
from rigidimeter.study.drawn_signals import DrawnSignals
from rigidimeter.study.kept_origin import (
    Asked,
    Stale,
    check_files,
    check_making,
    digest_of,
    made_by,
    places_of,
)
from rigidimeter.study.ratings_model import rated
from rigidimeter.study.results import StudyResult
from rigidimeter.study.study_analysis import StudyRead

KEPT = "kept.json"
KEPT_SCHEMA = "rigidimeter.kept-study/1"

_MADE_ANEW = ("ratings", "provenance", "changes", "prepared", "settings", "drawn", "epochs")
"""Fields of a result that are made of the tables, or are kept in another way."""

_KINDS = {
    "made_by": dict,
    "asked": dict,
    "folder": str,
    "files": dict,
    "places": dict,
    "inputs": str,
    "settings": dict,
    "result": dict,
    "epochs": list,
    "drawn": dict,
}


class KeptStudy(NamedTuple):
    """A kept result that still holds, with the tables of its study and the digests of its files."""

    result: StudyResult
    folder: StudyFolder
    digests: Mapping[str, str]


class _NotHeld(Mapping[str, Channel]):
    """The channels of an epoch whose samples were not read."""

    def __getitem__(self, name: str) -> Channel:
        raise self._refusal()

    def __iter__(self) -> Iterator[str]:
        raise self._refusal()

    def __len__(self) -> int:
        raise self._refusal()

    @staticmethod
    def _refusal() -> LookupError:
        return LookupError(
            "the samples of a kept study are not held; what a page shows of them is made in "
            "study.drawing.drawn_signals"
        )


def keep_result(read: StudyRead, result: StudyResult, asked: Asked) -> None:
    """Write a result with what it was made of; nothing is written where nothing changed.

    What is too large to be read again, was read from outside the study, or was analysed with files
    of `--load`, is not kept.

    Parameters
    ----------
    read : StudyRead
    result : StudyResult
        With `drawn`, and after `archive.keep`.
    asked : mapping
        The options.

    Raises
    ------
    UserError
        If the file cannot be written.
    """
    path = read.folder.folder / ANALYSIS / KEPT
    if loaded():
        return
    content = b"" if read.gathered.elsewhere else _content(read, result, asked)
    with refused(path, "cannot be written"):
        if not content or len(content) > DOCUMENT_BYTES:
            path.unlink(missing_ok=True)
        elif not path.is_file() or path.read_bytes() != content:
            replace_file(path, content)


def _content(read: StudyRead, result: StudyResult, asked: Asked) -> bytes:
    folder = read.folder.folder
    mentioned = any(str(folder) in notice.text for notice in result.notices)
    try:
        document = {
            "checksum": ZEROS,
            "schema": KEPT_SCHEMA,
            "made_by": made_by(),
            "asked": asked,
            "folder": str(folder) if mentioned else "",
            "files": {**read.folder.digests, **read.gathered.digests},
            "places": places_of(read.folder),
            "inputs": digest_of(folder / ANALYSIS / INPUTS),
            "settings": dump_settings(result.settings),
            "result": {name: plain_of(getattr(result, name)) for name in _fields()},
            "epochs": [plain_of(replace(epoch, channels={})) for epoch in result.epochs],
            "drawn": plain_of(result.drawn),
        }
    except (TypeError, UserError):
        return b""  # something that is not written, or is too large
    text = json.dumps(document, ensure_ascii=False, allow_nan=False)
    return with_checksum(text_bytes(text))


def take_kept(folder: Path, asked: Asked, key: Path | None = None) -> tuple[KeptStudy | None, str]:
    """Return the kept result of a study, or None and why it does not hold.

    The reason is empty where nothing was kept.

    Parameters
    ----------
    folder : Path
    asked : mapping
        The options with which the result is wanted.
    key : Path, optional
        A blinding key kept elsewhere.
    """
    path = folder / ANALYSIS / KEPT
    if not path.exists():
        return None, ""
    if loaded():  # they may add to the page what needs samples
        return None, "files are loaded with --load"
    try:
        document = _document(path)
        read = read_study_folder(folder, key)
        check_making(document, asked, folder)
        check_files(document, read)
        return KeptStudy(_result(document, read), read, document["files"]), ""
    except Stale as stale:
        return None, str(stale)
    except UserError:  # of a table, which is said where it is read again
        return None, "a table cannot be read"


def _document(path: Path) -> dict[str, Any]:
    try:
        content = read_bytes(path, DOCUMENT_BYTES)
        sound = content.startswith(b"{" + FIELD) and checksum_holds(content)
        document = parse_json(content, str(path)) if sound else None
    except UserError:
        document = None
    if (
        not isinstance(document, dict)
        or document.get("schema") != KEPT_SCHEMA
        or not all(isinstance(document.get(name), kind) for name, kind in _KINDS.items())
    ):
        raise Stale(f"{ANALYSIS}/{KEPT} is damaged")
    return document


def _fields() -> dict[str, Any]:
    """Return the fields of a result that are kept as they are, with their types."""
    hints = get_type_hints(StudyResult)
    return {name: hint for name, hint in hints.items() if name not in _MADE_ANEW}


def _result(document: Mapping[str, Any], folder: StudyFolder) -> StudyResult:
    records = Records()
    try:
        values: dict[str, Any] = {
            name: records.read(hint, document["result"].get(name))
            for name, hint in _fields().items()
        }
        epochs = records.read(tuple[Epoch, ...], document["epochs"])
        drawn = records.read(DrawnSignals, document["drawn"])
        if len(drawn.channels) != len(epochs):
            raise WrongValue("the channels of another number of epochs")
        settings = parse_settings(document["settings"], source=KEPT)
    except (WrongValue, UserError):
        raise Stale(f"{ANALYSIS}/{KEPT} is damaged") from None
    names, _ = naming(folder)
    pair = values["reference"], values["other"]
    ratings, _ = rated(folder, replace(names, pair=pair))
    return StudyResult(
        **values,
        settings=settings,
        epochs=tuple(replace(epoch, channels=_NotHeld()) for epoch in epochs),
        drawn=drawn,
        ratings=ratings,
        changes=(UNCHANGED,),
    )
