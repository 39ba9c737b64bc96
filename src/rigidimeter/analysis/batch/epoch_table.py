"""The table of a batch as a Parquet or CSV file, written and read some rows at a time."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterable, Iterator
from functools import cache
from itertools import islice
from pathlib import Path

from rigidimeter.analysis.batch.parts import Row
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import as_read, csv_text, in_place, write_dictionary_beside
from rigidimeter.core.records import Activity, Analysis, Fit, Outcome, Score

ENDINGS = (".parquet", ".csv")
BATCH_SCHEMA = "rigidimeter.batch/1"

_NO_ACTIVITY = Activity((), math.nan, math.nan)
_ROWS = 2_000
"""Rows in memory at a time."""

_FIRST = ("input", "source", "subject", "day", "epoch", "condition", "task", "outcome", "reason",
          "method")  # fmt: skip
_LAST = ("notices", "sha256", "settings_sha256", "version")


@cache
def columns() -> dict[str, type]:
    """Return every column with the type of its cells, in order."""
    named = "", "", ""
    fit = Fit(*named, "", Outcome("failed"), activity=_NO_ACTIVITY)
    cells = Analysis("", (fit,), (fit,), math.nan, ()).rows()[0]
    cells |= Score(*named, Outcome("failed")).row()
    types = {name: type(value) for name, value in cells.items() if name not in _FIRST}
    return dict.fromkeys(_FIRST, str) | types | dict.fromkeys(_LAST, str)


def write_table(path: Path, rows: Iterable[Row]) -> None:
    """Write rows; the file of that name is the older one until the new one is complete.

    Raises
    ------
    UserError
        If it cannot be written.
    """
    write = _write_csv if path.suffix == ".csv" else _write_parquet
    try:
        with in_place(path) as beside:
            write(beside, _chunks(iter(rows)))
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else error
        raise UserError(f"{path}: cannot be written ({reason})") from None
    if path.suffix == ".csv":
        write_dictionary_beside(path, "batch", columns())


def read_table(path: Path) -> Iterator[Row]:
    """Yield the rows of a table that `write_table` wrote, without cells that are empty.

    Raises
    ------
    UserError
        If it is another file.
    """
    try:
        yield from (_read_csv if path.suffix == ".csv" else _read_parquet)(path)
    except (OSError, ValueError, csv.Error) as error:
        raise UserError(
            f"{path}: is there already and is not the table of a batch ({error}); name another "
            "file to write, or remove it"
        ) from None


def _chunks(rows: Iterator[Row]) -> Iterator[list[Row]]:
    while chunk := list(islice(rows, _ROWS)):
        yield chunk


def _write_parquet(path: Path, chunks: Iterable[list[Row]]) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    types = {str: pa.string(), int: pa.int64(), float: pa.float64()}
    schema = pa.schema(
        [(name, types[kind]) for name, kind in columns().items()], {"schema": BATCH_SCHEMA}
    )
    with parquet.ParquetWriter(path, schema) as writer:
        for chunk in chunks:
            writer.write_table(pa.Table.from_pylist(chunk, schema))


def _write_csv(path: Path, chunks: Iterable[list[Row]]) -> None:
    with path.open("w", encoding="utf-8", errors="backslashreplace", newline="") as file:
        file.write(csv_text([*columns()], []))
        for chunk in chunks:
            _, _, lines = csv_text([*columns()], chunk).partition("\n")
            file.write(lines)


def _read_parquet(path: Path) -> Iterator[Row]:
    from pyarrow import parquet

    with parquet.ParquetFile(path) as file:
        if (file.schema_arrow.metadata or {}).get(b"schema") != BATCH_SCHEMA.encode():
            raise ValueError("its columns are others")
        for chunk in file.iter_batches(_ROWS):
            for row in chunk.to_pylist():
                yield {name: cell for name, cell in row.items() if cell is not None}


def _read_csv(path: Path) -> Iterator[Row]:
    with path.open(encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file, strict=True)
        if [*(reader.fieldnames or ())] != [*columns()]:
            raise ValueError("its columns are others")
        for row in reader:
            yield {
                name: as_read(cell) if kind is str else kind(cell)
                for name, kind in columns().items()
                if (cell := row[name])
            }
