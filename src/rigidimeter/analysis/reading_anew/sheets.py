"""Sheets of Excel and OpenDocument files.

A sheet is a table as a text is: its names may stand below other lines, with a row of units. Cells
that are dates or times of day become seconds.
"""

from __future__ import annotations

import datetime as dt
import io
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.arrays import Expansion, check_count
from rigidimeter.analysis.reading_anew.columns import Column, Columns
from rigidimeter.analysis.reading_anew.mapping import Mapping
from rigidimeter.analysis.reading_anew.text.heads import HEAD_LINES, Head, found_head
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import MIB, open_regular

# Of a sheet with a million rows, as many as one may have, of ten columns.
_BYTES = 256 * MIB

_EXAMPLE = "time_s, torque_nm, angle_rad"


def read_spreadsheet(path: Path, said: Mapping) -> Columns:
    """Read the one sheet with a recording, or the one that the user names.

    A sheet, read as text is; ``--table`` names one of several.

    Raises
    ------
    UserError
        If there is no such sheet, or several.
    ImportError
        Without python-calamine.
    Exception
        Whatever zipfile and calamine raise on a damaged file.
    """
    sheets = _sheets(path)
    if said.table:
        if said.table not in sheets:
            raise UserError(
                f"{path}: there is no sheet {said.table!r}; it has {', '.join(map(repr, sheets))}"
            )
        return _table(path, said.table, sheets[said.table], said)
    found: list[Columns] = []
    refusals: list[str] = []
    names: list[str] = []
    for name, rows in sheets.items():
        try:
            found.append(_table(path, name, rows, said))
            names.append(name)
        except UserError as error:
            refusals.append(str(error))
    if len(found) > 1:
        which = f"say which, as in --table {names[0]!r} (of {', '.join(map(repr, names))})"
        raise UserError(f"{path}: {len(found)} sheets hold a table; {which}")
    if not found:
        raise UserError(*refusals or [f"{path} holds no sheet with cells"])
    return found[0]


def _sheets(path: Path) -> dict[str, list[list[Any]]]:
    with open_regular(path, _BYTES) as file:
        data = file.read()
    if data[:2] == b"PK":
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            check_count(path, len(members))
            Expansion(path, len(data)).take("its sheets", sum(one.file_size for one in members))
            if archive.testzip() is not None:  # also a member that is larger than it states
                raise ValueError("an entry is damaged")
    from python_calamine import CalamineWorkbook

    try:
        book = CalamineWorkbook.from_filelike(io.BytesIO(data))
        sheets = ((name, book.get_sheet_by_name(name).to_python()) for name in book.sheet_names)
        return {name: rows for name, rows in sheets if rows}
    except BaseException as error:
        if isinstance(error, Exception) or type(error).__name__ != "PanicException":
            raise
        raise ValueError(str(error)) from None  # a panic of calamine is no Exception


def _table(path: Path, sheet: str, rows: list[list[Any]], said: Mapping) -> Columns:
    source = f"{path}, sheet {sheet}"
    numbered = [
        (number, row)
        for number, row in enumerate(rows, start=1)
        if number > said.skip_rows and any(cell not in ("", None) for cell in row)
    ]
    lines = ["\t".join(map(_text, row)).rstrip("\t") for _, row in numbered[:HEAD_LINES]]
    if not lines:
        raise UserError(f"{source}: has no rows")
    head = found_head(source, lines, "", said.names, _EXAMPLE)
    body = numbered[head.n_before :]
    while body and not any(isinstance(cell, int | float) for cell in body[-1][1]):
        body.pop()  # remarks below the rows
    if len(body) < 2:
        raise UserError(f"{source}: has fewer than 2 rows of numbers")
    columns: dict[str, Column] = {}
    for index, name in enumerate(head.names):
        cells = [row[index] if index < len(row) else "" for _, row in body]
        values, in_seconds = _column(cells)
        columns[name] = Column.of(values, "s" if in_seconds else head.units.get(name, ""))
    _no_more_cells(source, head, body)
    return Columns(source, columns, lines=np.array([number for number, _ in body], np.int64))


def _no_more_cells(source: str, head: Head, body: Sequence[tuple[int, list[Any]]]) -> None:
    for number, row in body:
        if any(cell not in ("", None) for cell in row[len(head.names) :]):
            raise UserError(
                f"{source}, line {number} has more cells than the {len(head.names)} columns that "
                "are named; name the others or clear their cells"
            )


def _text(cell: object) -> str:
    if isinstance(cell, dt.datetime):
        return cell.isoformat(" ")
    return " ".join(str("" if cell is None else cell).replace('"', "'").split())


def _column(cells: Sequence[Any]) -> tuple[NDArray[Any], bool]:
    """Return a column as numbers or texts, and whether it was dates or times, now in seconds."""
    filled = [cell for cell in cells if cell not in ("", None)]
    if any(isinstance(cell, dt.datetime) for cell in filled) and all(
        isinstance(cell, dt.date) for cell in filled
    ):
        first = _when(filled[0])
        return _numbers(cells, lambda cell: (_when(cell) - first).total_seconds()), True
    if filled and all(isinstance(cell, dt.timedelta) for cell in filled):
        return _numbers(cells, lambda cell: cell.total_seconds()), True
    if filled and all(isinstance(cell, dt.time) for cell in filled):
        return _numbers(
            cells, lambda t: 3600.0 * t.hour + 60.0 * t.minute + t.second + 1e-6 * t.microsecond
        ), True
    if all(isinstance(cell, int | float) and not isinstance(cell, bool) for cell in filled):
        return _numbers(cells, float), False
    return np.array([_text(cell) for cell in cells], dtype=object), False


def _when(cell: dt.date) -> dt.datetime:
    """Return a date as the midnight at which calamine gives it without a time of day."""
    return cell if isinstance(cell, dt.datetime) else dt.datetime.combine(cell, dt.time())


def _numbers(cells: Sequence[Any], number: Any) -> NDArray[np.float64]:
    return np.array([np.nan if cell in ("", None) else number(cell) for cell in cells], np.float64)
