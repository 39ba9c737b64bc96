"""Folders that `rigidimeter export` wrote: CSV or Parquet tables, and their document."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from rigidimeter.documents import open_regular, read_json
from rigidimeter.documents.bounds import RECORDING_BYTES
from rigidimeter.errors import UserError
from rigidimeter.recording.exported_session import (
    DOCUMENT,
    EXPORT_SCHEMA,
    ExportedSession,
    checked_document,
    epochs_of_export,
    exported_settings,
)
from rigidimeter.recording.formats.clocked_table import Stream
from rigidimeter.records import Epoch, Notice
from rigidimeter.settings import Settings


def is_export_folder(path: Path) -> bool:
    """Whether a folder holds the document of an exported session."""
    return (path / DOCUMENT).is_file()


def read_export_folder(path: Path) -> tuple[list[Epoch], list[Notice]]:
    """Read the epochs of an exported session.

    Raises
    ------
    UserError
        If a file is missing or damaged.
    """
    return epochs_of_export(_session(path), str(path))


def export_folder_settings(path: Path) -> Settings:
    """Return the settings with which an exported session was recorded."""
    source = path / DOCUMENT
    return exported_settings(checked_document(read_json(source), str(source)), str(source))


def _session(path: Path) -> ExportedSession:
    source = path / DOCUMENT
    about = checked_document(read_json(source), str(source))
    names = [name for name in about["streams"] if isinstance(name, str)]
    return ExportedSession(about, tuple(_stream(path, name) for name in names))


def _stream(folder: Path, name: str) -> Stream:
    if Path(name).name != name:
        raise UserError(f"{folder / DOCUMENT}: {name!r} is no name of a table beside it")
    found = [
        path for path in (folder / f"{name}.parquet", folder / f"{name}.csv") if path.is_file()
    ]
    if not found:
        raise UserError(f"{folder}: {name}.parquet or {name}.csv of the export is missing")
    path = found[0]
    try:
        with open_regular(path, RECORDING_BYTES) as file:
            read = pa.csv.read_csv if path.suffix == ".csv" else pa.parquet.read_table
            table = read(file)
        columns = {
            column: table[column].cast(pa.float64()).to_numpy().astype(np.float64)
            for column in table.column_names
        }
        return Stream(name, columns.pop("time_s"), columns)
    except (pa.ArrowException, KeyError) as error:
        reason = str(error).splitlines()[0][:120]
        raise UserError(f"{path}: is damaged, not a table of {EXPORT_SCHEMA} ({reason})") from None
