"""Parquet and Arrow files: columns, with units where the schema states them.

A schema whose metadata has ``virtual = true`` is that of a simulated recording.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.ipc
import pyarrow.parquet
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.stored_arrays import Expansion, check_count
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.files import RECORDING_BYTES, open_regular, printable

VIRTUAL = b"virtual"
"""The key, in the metadata of a schema, of whether the recording was simulated: true or false."""

_FILE = b"ARROW1"


def read_arrow(path: Path) -> Table:
    """Read a Parquet file, an Arrow file (Feather) or an Arrow stream.

    Raises
    ------
    UserError
        If it holds more than a recording does.
    Exception
        Whatever Arrow raises on a damaged file.
    """
    expansion = Expansion(path, path.stat().st_size)
    with open_regular(path, RECORDING_BYTES) as file:
        start = file.read(6)
        file.seek(0)
        if start[:4] == b"PAR1":
            parquet = pa.parquet.ParquetFile(file)
            rows, schema = parquet.metadata.num_rows, parquet.schema_arrow
            check_count(path, len(schema))
            expansion.take("its columns", 8 * rows * len(schema))
            table = parquet.read()
        else:
            _check_first(file.read(8), path.stat().st_size)
            file.seek(0)
            opened = pa.ipc.open_file if start == _FILE else pa.ipc.open_stream
            table = opened(file).read_all()
            check_count(path, len(table.schema))
            expansion.take("its columns", table.nbytes)
    units = {}
    for field in table.schema:
        unit = (field.metadata or {}).get(b"unit") or (field.metadata or {}).get(b"units")
        if unit:
            units[printable(field.name)] = unit.decode("utf-8", "replace")
    columns, others = {}, {}
    for name in table.column_names:
        kind = table.schema.field(name).type
        if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
            columns[printable(name)] = _numbers(table[name])
        elif pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
            columns[printable(name)], units[printable(name)] = _seconds(table[name]), "s"
        elif pa.types.is_string(kind) or pa.types.is_large_string(kind) or _is_labels(kind):
            columns[printable(name)] = _texts(table[name])
        else:
            others[printable(name)] = f"a column of {kind}"
    virtual = (table.schema.metadata or {}).get(VIRTUAL) == b"true"
    return Table(str(path), columns, others=others, units=units, virtual=virtual)


def _check_first(start: bytes, file_bytes: int) -> None:
    """Refuse a first message that says it is longer than the file: Arrow makes room for it."""
    if start[:6] == _FILE:
        return
    marked = start[:4] == b"\xff\xff\xff\xff"  # since Arrow 0.15
    length = int.from_bytes(start[4:8] if marked else start[:4], "little", signed=True)
    if not 0 <= length <= file_bytes:
        raise ValueError(f"its first message has {length} bytes")


def _is_labels(kind: Any) -> bool:
    return bool(pa.types.is_dictionary(kind) and pa.types.is_string(kind.value_type))


def _numbers(column: Any) -> NDArray[np.float64]:
    return np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)


def _seconds(column: Any) -> NDArray[np.float64]:
    """Return dates or durations as seconds since the first."""
    stamps = column.to_numpy()
    return np.asarray((stamps - stamps[:1]) / np.timedelta64(1, "s"), dtype=np.float64)


def _texts(column: Any) -> NDArray[Any]:
    cells = np.empty(len(column), dtype=object)
    cells[:] = ["" if cell is None else cell for cell in column.to_pylist()]
    return cells
