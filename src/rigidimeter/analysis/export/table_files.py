"""Tables for other programs: one for each clock, others for epochs and estimates.

They are a folder of CSV or Parquet files, in which `session.json` holds the document, or a MATLAB
file of version 5 with a structure for each. Each sample has the labels of its epoch, so that a
program finds them in any of the tables.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
import scipy.io
from numpy.typing import NDArray

from rigidimeter.analysis.export.document_tables import columns_of, document_tables, sample_labels
from rigidimeter.analysis.export.exported_sessions import ExportedSession
from rigidimeter.analysis.reading.formats.arrow_file import VIRTUAL
from rigidimeter.analysis.reading.formats.clocked_table import Stream
from rigidimeter.core.files import csv_text, json_text, write_json, write_text

DOCUMENT = "session.json"
_SHOWN = ("software", "virtual", "subject", "day", "condition", "part", "source")


def write_csv(session: ExportedSession, folder: Path) -> None:
    """Write a folder of CSV tables; a number that is missing is an empty cell."""
    options = pa.csv.WriteOptions(quoting_style="needed")

    def write(table: pa.Table, path: Path) -> None:
        pa.csv.write_csv(table, path, write_options=options)

    _write(session, folder, ".csv", write)


def write_parquet(session: ExportedSession, folder: Path) -> None:
    """Write a folder of Parquet tables, each column with its unit in the schema."""
    _write(session, folder, ".parquet", lambda table, path: pa.parquet.write_table(table, path))


def _write(
    session: ExportedSession,
    folder: Path,
    suffix: str,
    write: Callable[[pa.Table, Path], None],
) -> None:
    folder.mkdir()
    for stream in session.streams:
        write(_stream_table(stream, session.about), folder / f"{stream.name}{suffix}")
    for name, rows in document_tables(session.about).items():
        columns = list(dict.fromkeys(key for row in rows for key in row))
        write_text(folder / f"{name}.csv", csv_text(columns, rows))
    write_json(folder / DOCUMENT, session.about)


def _stream_table(stream: Stream, about: Mapping[str, Any]) -> pa.Table:
    """Return a stream as an Arrow table; what is missing is null, a unit metadata of its field."""
    known = {"time_s": "s", **about["units"]}
    fields, arrays = [], []
    for name, values in {"time_s": stream.time_s, **stream.columns}.items():
        arrays.append(pa.array(values, from_pandas=True))
        unit = {"unit": str(known.get(name, "1"))}
        fields.append(pa.field(name, arrays[-1].type, metadata=unit))
    for name, texts in sample_labels(stream, about).items():
        arrays.append(pa.array(texts, pa.string(), mask=texts == ""))
        fields.append(pa.field(name, pa.string()))
    virtual = {VIRTUAL: b"true" if about["virtual"] else b"false"}
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=virtual))


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
