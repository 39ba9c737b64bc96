"""BIDS data sets that `rigidimeter export` wrote: a tracking system for each clock."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
from numpy.typing import NDArray

from rigidimeter.documents import open_regular, read_bytes, read_json
from rigidimeter.documents.bounds import RECORDING_BYTES, TABLE_BYTES
from rigidimeter.errors import UserError
from rigidimeter.recording.exported_session import (
    ExportedSession,
    checked_document,
    epochs_of_export,
    exported_settings,
)
from rigidimeter.recording.formats.clocked_table import Stream
from rigidimeter.records import Epoch, Notice
from rigidimeter.settings import Settings

_DESCRIPTION = "dataset_description.json"
_DERIVED = Path("derivatives") / "rigidimeter"


def is_bids(path: Path) -> bool:
    """Whether a folder is a data set that `rigidimeter export` wrote."""
    return (path / _DESCRIPTION).is_file() and (path / _DERIVED).is_dir()


def read_bids(path: Path) -> tuple[list[Epoch], list[Notice]]:
    """Read the epochs of every session of an exported data set.

    Raises
    ------
    UserError
        If a file is missing or damaged.
    """
    epochs: list[Epoch] = []
    notices: list[Notice] = []
    for document in _documents(path):
        about = checked_document(read_json(document), str(document))
        stem = document.name.removesuffix("_session.json")
        place = path / document.parent.relative_to(path / _DERIVED)
        streams = tuple(_stream(place, stem, name) for name in about["streams"])
        found, said = epochs_of_export(ExportedSession(about, streams), str(place / stem))
        epochs += found
        notices += said
    return epochs, notices


def bids_settings(path: Path) -> Settings:
    """Return the settings of the first session of an exported data set."""
    first = next(_documents(path))
    return exported_settings(checked_document(read_json(first), str(first)), str(first))


def _documents(path: Path) -> Iterator[Path]:
    found = sorted((path / _DERIVED).rglob("*_session.json"))
    if not found:
        raise UserError(f"{path}: {_DERIVED} holds no document of a session (*_session.json)")
    yield from found


def _stream(place: Path, stem: str, name: str) -> Stream:
    head, acquisition, tail = stem.partition("_acq-")
    whole = place / f"{head}_tracksys-{name}{acquisition}{tail}"
    channels = tsv_rows(Path(f"{whole}_channels.tsv"))
    names = [row.get("name", "") for row in channels]
    path = Path(f"{whole}_motion.tsv")
    columns = motion_columns(path, names)
    if "time_s" not in columns:
        raise UserError(f"{path}: has no channel time_s, which holds its time stamps")
    return Stream(name, columns.pop("time_s"), columns)


def tsv_rows(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a small table with names in its first line."""
    text = read_bytes(path, TABLE_BYTES).decode("utf-8")
    return list(csv.DictReader(io.StringIO(text), delimiter="\t"))


def motion_columns(path: Path, names: list[str]) -> dict[str, NDArray[np.float64]]:
    """Return the columns of ``_motion.tsv``, which has no names.

    Raises
    ------
    UserError
        If it has others.
    """
    options = pa.csv.ReadOptions(column_names=names)
    parsing = pa.csv.ParseOptions(delimiter="\t")
    kinds = pa.csv.ConvertOptions(
        null_values=["n/a"], column_types=dict.fromkeys(names, pa.float64())
    )
    try:
        with open_regular(path, RECORDING_BYTES) as file:
            table = pa.csv.read_csv(file, options, parsing, kinds)
    except pa.ArrowException as error:
        reason = str(error).splitlines()[0][:120]
        raise UserError(f"{path}: is damaged, not a motion recording ({reason})") from None
    return {name: np.asarray(table[name].to_numpy(), dtype=np.float64) for name in names}
