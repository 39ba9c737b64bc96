"""Tables for other programs: one for each clock, others for epochs and estimates.

They are a folder of CSV or Parquet files, in which `session.json` holds the document, or a MATLAB
file of version 5 with a structure for each. Each sample has the labels of its epoch, so that a
program finds them in any of the tables.
"""

from __future__ import annotations

import re
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
from rigidimeter.core.files import (
    DICTIONARY,
    Meaning,
    csv_text,
    dictionary_text,
    json_text,
    write_json,
    write_text,
)
from rigidimeter.core.session import SAMPLE_UNITS

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
    columns: dict[str, list[str]] = {}
    for stream in session.streams:
        table, name = _stream_table(stream, session.about), f"{stream.name}{suffix}"
        write(table, folder / name)
        columns[name] = table.schema.names
    samples = dict.fromkeys(columns, "samples")
    for stem, rows in document_tables(session.about).items():
        name = f"{stem}.csv"
        columns[name] = list(dict.fromkeys(key for row in rows for key in row))
        write_text(folder / name, csv_text(columns[name], rows))
    write_text(folder / DICTIONARY, dictionary_text(columns, samples, _recorded()))
    write_json(folder / DOCUMENT, session.about)


def _recorded() -> dict[str, Meaning]:
    """Return what only a session records: what its manifest says, less the unit."""
    found = {}
    for column, said in SAMPLE_UNITS.items():
        stated = re.match(r"(?:(N·m|rad/s|rad|s|1)\b,? ?)?", said)
        words = said[stated.end() :] if stated else said
        if column not in ("time_s", "epoch") and words:
            found[column] = Meaning((stated and stated[1]) or "1", words)
    return found


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
