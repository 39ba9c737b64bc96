"""MATLAB files that `rigidimeter export` wrote: a structure for each clock, and the document."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy

from rigidimeter.documents import open_regular, parse_json
from rigidimeter.documents.bounds import RECORDING_BYTES
from rigidimeter.recording.exported_session import (
    EXPORT_SCHEMA,
    ExportedSession,
    checked_document,
    epochs_of_export,
    exported_settings,
)
from rigidimeter.recording.formats.clocked_table import Stream
from rigidimeter.recording.formats.mat_check import check_mat5
from rigidimeter.recording.formats.stored_arrays import Expansion
from rigidimeter.records import Epoch, Notice
from rigidimeter.settings import Settings

_MARK = "document"


def is_mat_export(path: Path) -> bool:
    """Whether a MATLAB file holds the document of an exported session."""
    try:
        return EXPORT_SCHEMA in _text(path)
    except Exception:  # another file, or a damaged one, of which its own reader says what is wrong
        return False


def read_mat_export(path: Path) -> tuple[list[Epoch], list[Notice]]:
    """Read the epochs of an exported session.

    Raises
    ------
    UserError
        If its document is damaged.
    Exception
        Whatever scipy raises on a damaged file.
    """
    about = _about(path)
    loaded = _loaded(path, [str(name) for name in about["streams"]])
    streams = []
    for name, columns in about["streams"].items():
        found = {key: np.atleast_1d(np.asarray(loaded[name][key], float)) for key in columns}
        streams.append(Stream(name, np.atleast_1d(loaded[name]["time_s"]).astype(float), found))
    return epochs_of_export(ExportedSession(about, tuple(streams)), str(path))


def mat_export_settings(path: Path) -> Settings:
    """Return the settings with which an exported session was recorded."""
    return exported_settings(_about(path), str(path))


def _about(path: Path) -> dict[str, Any]:
    return checked_document(parse_json(_text(path).encode(), f"{path}: document"), str(path))


def _text(path: Path) -> str:
    return str(_loaded(path, [_MARK])[_MARK])


def _loaded(path: Path, names: list[str]) -> dict[str, Any]:
    with open_regular(path, RECORDING_BYTES) as file:
        size = path.stat().st_size
        expansion = Expansion(path, size)
        check_mat5(file, size, lambda n_bytes: expansion.take("a variable", n_bytes))
        file.seek(0)
        return dict(scipy.io.loadmat(file, simplify_cells=True, variable_names=names))  # type: ignore[arg-type]
