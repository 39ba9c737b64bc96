"""Archives of arrays: NumPy's, and Parquet and Arrow files.

Nothing is unpickled. A schema of Arrow whose metadata has ``virtual = true`` is that of a simulated
recording.
"""

from __future__ import annotations

import functools
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.arrays import Expansion, Stored, check_count
from rigidimeter.analysis.reading_anew.columns import Array, Column, Columns
from rigidimeter.analysis.reading_anew.structures import columns_of_variables
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import printable

VIRTUAL = b"virtual"
"""The key, in the metadata of a schema, of whether the recording was simulated: true or false."""
_FILE = b"ARROW1"


def read_npz(path: Path) -> Columns:
    """Read a NumPy archive (``numpy.savez``): the headers of its arrays, and those that are used.

    Arrays by name; a single value `rate_hz`, `fs_hz`, `fs` or `sampling_rate_hz`; a matrix
    `data` with `names`, `columns`, `channels` or `labels`; columns of other matrices as `q[0]`;
    nothing is unpickled.

    Raises
    ------
    UserError
        If it holds a single array, or Python objects, or more than a recording does.
    Exception
        Whatever zipfile, zlib and NumPy raise on a damaged archive.
    """
    with path.open("rb") as file:
        if file.read(6) == np.lib.format.MAGIC_PREFIX:
            raise UserError(
                f"{path} holds a single unnamed array; save the columns by name, with numpy.savez"
            )
        with zipfile.ZipFile(file) as archive:
            members = archive.infolist()
            check_count(path, len(members))
            expansion = Expansion(path, file.seek(0, 2))
            entries = {
                member.filename.removesuffix(".npy"): _stored(path, archive, member, expansion)
                for member in members
            }
    return columns_of_variables(str(path), entries)


def _stored(
    path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo, expansion: Expansion
) -> Stored:
    name = member.filename.removesuffix(".npy")
    if name == member.filename:  # of another program
        return Stored.of(np.empty(0, dtype="V1"))
    with archive.open(member) as file:
        shape, dtype, start = _header(file)
    stored = Stored(dtype, shape, functools.partial(_read, path, member, name, expansion))
    if dtype.hasobject:
        raise UserError(
            f"{path}: {name} holds Python objects, which are not read because they could run "
            "code; save it as an array of numbers or of text"
        )
    # NumPy makes room for the whole array before it reads its first value.
    if start + stored.size * dtype.itemsize != member.file_size:
        raise ValueError(f"{name} has another size than its header says")
    return stored


def _header(file: Any) -> tuple[tuple[int, ...], np.dtype[Any], int]:
    """Return shape, type and first byte of the data of an array of NumPy's format."""
    version = np.lib.format.read_magic(file)
    if version == (1, 0):
        shape, _, dtype = np.lib.format.read_array_header_1_0(file)
    else:
        shape, _, dtype = np.lib.format.read_array_header_2_0(file)
    if any(length < 0 for length in shape):
        raise ValueError("an array has a negative length")
    return shape, dtype, file.tell()


def _read(path: Path, member: zipfile.ZipInfo, name: str, expansion: Expansion) -> NDArray[Any]:
    expansion.take(name, member.file_size)
    with (
        path.open("rb") as file,
        zipfile.ZipFile(file) as archive,
        archive.open(member) as entry,
    ):
        return np.asarray(np.lib.format.read_array(entry, allow_pickle=False))


def read_arrow(path: Path) -> Columns:
    """Read a Parquet file, an Arrow file (Feather) or an Arrow stream.

    The unit of a field in its metadata under `unit`, or in its name; `virtual = true` in the
    metadata of a simulated recording.

    Raises
    ------
    UserError
        If it holds more than a recording does.
    Exception
        Whatever Arrow raises on a damaged file.
    """
    import pyarrow as pa
    import pyarrow.ipc
    import pyarrow.parquet

    expansion = Expansion(path, path.stat().st_size)
    with path.open("rb") as file:
        start = file.read(6)
        file.seek(0)
        if start[:4] == b"PAR1":
            parquet = pa.parquet.ParquetFile(file)
            n_rows, schema = parquet.metadata.num_rows, parquet.schema_arrow
            check_count(path, len(schema))

            def read(name: str) -> Any:
                expansion.take(name, 8 * n_rows)
                return pa.parquet.read_table(path, columns=[name])[name]
        else:
            _check_first(file.read(8), path.stat().st_size)
            file.seek(0)
            opened = pa.ipc.open_file if start == _FILE else pa.ipc.open_stream
            table = opened(file).read_all()
            n_rows, schema = table.num_rows, table.schema
            check_count(path, len(schema))
            expansion.take("its columns", table.nbytes)

            def read(name: str) -> Any:
                return table[name]

    columns, others = {}, {}
    for field in schema:
        name, about = printable(field.name), field.metadata or {}
        unit = (about.get(b"unit") or about.get(b"units") or b"").decode("utf-8", "replace")
        convert = _converted(field.type)
        if convert is None:
            others[name] = f"a column of {field.type}"
            continue
        unit = "s" if convert is _seconds else unit
        columns[name] = Column(_reading(convert, read, field.name), n_rows, unit)
    virtual = (schema.metadata or {}).get(VIRTUAL) == b"true"
    return Columns(str(path), columns, others=others, virtual=virtual)


def _reading(
    convert: Callable[[Any], NDArray[Any]], read: Callable[[str], Any], name: str
) -> Callable[[], NDArray[Any]]:
    return lambda: convert(read(name))


def _converted(kind: Any) -> Callable[[Any], NDArray[Any]] | None:
    """Return what makes a column of a type of Arrow; None where it makes none."""
    from pyarrow import types

    if types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind):
        return _numbers
    if types.is_timestamp(kind) or types.is_duration(kind):
        return _seconds
    is_labels = types.is_dictionary(kind) and types.is_string(kind.value_type)
    return _texts if types.is_string(kind) or types.is_large_string(kind) or is_labels else None


def _check_first(start: bytes, file_bytes: int) -> None:
    """Refuse a first message that says it is longer than the file: Arrow makes room for it."""
    if start[:6] == _FILE:
        return
    marked = start[:4] == b"\xff\xff\xff\xff"  # since Arrow 0.15
    length = int.from_bytes(start[4:8] if marked else start[:4], "little", signed=True)
    if not 0 <= length <= file_bytes:
        raise ValueError(f"its first message has {length} bytes")


def _numbers(column: Any) -> Array:
    return np.asarray(column.cast("float64", safe=False).to_numpy(), dtype=np.float64)


def _seconds(column: Any) -> Array:
    """Return dates or durations as seconds since the first."""
    stamps = column.to_numpy()
    return np.asarray((stamps - stamps[:1]) / np.timedelta64(1, "s"), dtype=np.float64)


def _texts(column: Any) -> NDArray[Any]:
    cells = np.empty(len(column), dtype=object)
    cells[:] = ["" if cell is None else cell for cell in column.to_pylist()]
    return cells
