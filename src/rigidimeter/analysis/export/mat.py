"""MATLAB files, version 5: a structure for each clock, and one for each table of the document."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from numpy.typing import NDArray

from rigidimeter.analysis.export.document_tables import columns_of, document_tables, sample_labels
from rigidimeter.analysis.export.exported_sessions import ExportedSession
from rigidimeter.core.files import json_text

_SHOWN = ("software", "virtual", "subject", "day", "condition", "part", "source")


def write_mat(session: ExportedSession, path: Path) -> None:
    """Write one session; `torque.time_s` and `torque.torque_nm` are columns of one length.

    `torque.epoch`, `condition` and `task` have a row of letters for each sample, as for `cellstr`.
    The character array `document` is the whole document as JSON, for `jsondecode`.
    """
    about = session.about
    values: dict[str, Any] = {
        stream.name: {
            "time_s": stream.time_s,
            **stream.columns,
            **{name: texts.astype(str) for name, texts in sample_labels(stream, about).items()},
        }
        for stream in session.streams
    }
    for name, rows in document_tables(about).items():
        values[name] = {key: _cells(cells) for key, cells in columns_of(rows).items()}
    values["session"] = {key: about[key] for key in _SHOWN}
    values["document"] = json_text(about)
    scipy.io.savemat(path, values, oned_as="column", do_compression=True, long_field_names=True)


def _cells(cells: list[Any]) -> NDArray[Any]:
    """Return numbers as a column of doubles, texts as a cell array."""
    if all(isinstance(cell, float) for cell in cells):
        return np.array(cells)
    found = np.empty(len(cells), dtype=object)
    found[:] = cells
    return found
