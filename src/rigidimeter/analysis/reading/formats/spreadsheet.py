"""Sheets of Excel and OpenDocument files.

A sheet is a table as a text is: its names may stand below other lines, with a row of units. Cells
that are dates or times of day become seconds.
"""

from __future__ import annotations

import datetime as dt
import io
import os
import subprocess
import sys
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.stored_arrays import Expansion, check_count
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.analysis.reading.formats.text_head import HEAD_LINES, Head, Layout, found_head
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import MIB, open_regular, size_text

SPREADSHEET_BYTES = 256 * MIB
"""Of a sheet with a million rows, as many as one may have, of ten columns."""

SHEET_BYTES = 4096 * MIB
"""Of memory, for one sheet; a million rows of ten columns take 800 MB."""

_TRIAL = """
import io, sys
from python_calamine import CalamineWorkbook
data = sys.stdin.buffer.read()
try:
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[1]),) * 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
except (ImportError, ValueError):
    pass
try:
    book = CalamineWorkbook.from_filelike(io.BytesIO(data))
except Exception:
    CalamineWorkbook.from_path(sys.argv[2])  # states that an OpenDocument sheet has too many cells
    raise
for name in book.sheet_names:
    print(name, flush=True)
    book.get_sheet_by_name(name)
"""
_EXAMPLE = "time_s, torque_nm, angle_rad"


def read_spreadsheet(path: Path, layout: Layout | None = None) -> Table:
    """Read the one sheet with a recording, or the one that the user names.

    Raises
    ------
    UserError
        If there is no such sheet, or several.
    ImportError
        Without python-calamine.
    Exception
        Whatever zipfile and calamine raise on a damaged file.
    """
    layout = layout or Layout()
    sheets = _sheets(path)
    if layout.table:
        if layout.table not in sheets:
            raise UserError(
                f"{path}: there is no sheet {layout.table!r}; it has {', '.join(map(repr, sheets))}"
            )
        return _table(path, layout.table, sheets[layout.table], layout)
    found: list[Table] = []
    refusals: list[str] = []
    names: list[str] = []
    for name, rows in sheets.items():
        try:
            found.append(_table(path, name, rows, layout))
            names.append(name)
        except UserError as error:
            refusals.append(str(error))
    if len(found) > 1:
        raise UserError(
            f"{path}: {len(found)} sheets hold a table; say which, as in --table {names[0]!r} (of "
            f"{', '.join(map(repr, names))})"
        )
    if not found:
        raise UserError(*refusals or [f"{path} holds no sheet with cells"])
    return found[0]


def _sheets(path: Path) -> dict[str, list[list[Any]]]:
    with open_regular(path, SPREADSHEET_BYTES) as file:
        data = file.read()
    if data[:2] == b"PK":
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            check_count(path, len(members))
            Expansion(path, len(data)).take("its sheets", sum(one.file_size for one in members))
            if archive.testzip() is not None:  # also a member that is larger than it states
                raise ValueError("an entry is damaged")
    from python_calamine import CalamineWorkbook

    _check_size(path, data)
    try:
        book = CalamineWorkbook.from_filelike(io.BytesIO(data))
        sheets = ((name, book.get_sheet_by_name(name).to_python()) for name in book.sheet_names)
        return {name: rows for name, rows in sheets if rows}
    except BaseException as error:
        if isinstance(error, Exception) or type(error).__name__ != "PanicException":
            raise
        raise ValueError(str(error)) from None  # a panic of calamine is no Exception


def _check_size(path: Path, data: bytes) -> None:
    """Refuse a workbook that ends the process: a sheet takes memory up to its last row and column.

    Calamine takes it at once, and where there is not as much, Rust aborts. So another process tries
    first; what is an exception there is one here.
    """
    command = [sys.executable, "-P", "-c", _TRIAL, str(SHEET_BYTES), os.fspath(path)]
    tried = subprocess.run(
        command, input=data, capture_output=True, check=False, env=os.environ | {"PYTHONUTF8": "1"}
    )
    if tried.returncode not in (0, 1) or b"Cell limit exceeded" in tried.stderr:
        names = tried.stdout.decode("utf-8", "replace").splitlines()
        sheet = f", sheet {names[-1]}" if names else ""
        raise UserError(
            f"{path}{sheet}: needs more than {size_text(SHEET_BYTES)} or is damaged; a cell far "
            "below or to the right of the recording makes a sheet that large, so delete the rows "
            "and columns beyond it, or save the sheet as CSV"
        )


def _table(path: Path, sheet: str, rows: list[list[Any]], layout: Layout) -> Table:
    source = f"{path}, sheet {sheet}"
    numbered = [
        (number, row)
        for number, row in enumerate(rows, start=1)
        if number > layout.skip_rows and any(cell not in ("", None) for cell in row)
    ]
    lines = ["\t".join(map(_text, row)).rstrip("\t") for _, row in numbered[:HEAD_LINES]]
    if not lines:
        raise UserError(f"{source}: has no rows")
    head = found_head(source, lines, "", layout.names, _EXAMPLE)
    body = numbered[head.n_before :]
    while body and not any(isinstance(cell, int | float) for cell in body[-1][1]):
        body.pop()  # remarks below the rows
    if len(body) < 2:
        raise UserError(f"{source}: has fewer than 2 rows of numbers")
    columns, units = {}, dict(head.units)
    for index, name in enumerate(head.names):
        cells = [row[index] if index < len(row) else "" for _, row in body]
        columns[name], in_seconds = _column(cells)
        if in_seconds:
            units[name] = "s"
    _no_more_cells(source, head, body)
    return Table(
        source, columns, lines=np.array([number for number, _ in body], np.int64), units=units
    )


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
            cells,
            lambda t: 3600.0 * t.hour + 60.0 * t.minute + t.second + 1e-6 * t.microsecond,
        ), True
    if all(isinstance(cell, int | float) and not isinstance(cell, bool) for cell in filled):
        return _numbers(cells, float), False
    return np.array([_text(cell) for cell in cells], dtype=object), False


def _when(cell: dt.date) -> dt.datetime:
    """Return a date as the midnight at which calamine gives it without a time of day."""
    return cell if isinstance(cell, dt.datetime) else dt.datetime.combine(cell, dt.time())


def _numbers(cells: Sequence[Any], number: Any) -> NDArray[np.float64]:
    return np.array([np.nan if cell in ("", None) else number(cell) for cell in cells], np.float64)
