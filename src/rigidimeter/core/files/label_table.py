"""Small tables of labels and numbers, such as the sessions, ratings and exclusions of a study.

Columns are separated by comma, semicolon or tab and named in the first line. Comment lines start
with ``#``. Where the separator is not the comma, numbers may have a decimal comma.
"""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rigidimeter.core.errors import UserError
from rigidimeter.core.files.escaping import NUMBER_TEXT, as_read, printable
from rigidimeter.core.files.size_limits import MAX_COLUMNS, TABLE_BYTES, TABLE_CELLS, TABLE_ROWS
from rigidimeter.core.files.text_lines import content, is_missing, read_utf8

_EXAMPLE = "condition,examiner,score"
_THOUSANDS = re.compile(r"(?<![\d.])\d{1,3}(?:,\d{3})+\.\d")
"""What looks like a number with commas between thousands and a decimal point."""


@dataclass(frozen=True)
class TextTable:
    """A small table in which every cell is text.

    Attributes
    ----------
    source : str
        The file.
    columns : mapping of str to tuple of str
        By name, in the file's order; cells without the blanks around them.
    lines : tuple of int
        The line of the file in which each row begins; the header is line 1.
    delimiter : str
        What separates the columns.
    """

    source: str
    columns: Mapping[str, tuple[str, ...]]
    lines: tuple[int, ...]
    delimiter: str = ","

    def column(self, name: str, option: str) -> tuple[str, ...]:
        """Return a column.

        Raises
        ------
        UserError
            If there is no such column; the sentence names the option that chose it.
        """
        if name not in self.columns:
            known = ", ".join(self.columns)
            raise UserError(
                f"{self.source}: there is no column {name}; its columns are {known}. Name the "
                f"right one with {option}"
            )
        return self.columns[name]

    def number(self, name: str, row: int) -> float | None:
        """Return a cell as a number, None where it is missing.

        Raises
        ------
        UserError
            If it is neither.
        """
        return cell_number(self.columns[name][row], name, f"{self.source}, line {self.lines[row]}")


def cell_number(text: str, name: str, where: str) -> float | None:
    """Return a cell of the column `name` as a number, None where it is missing.

    Raises
    ------
    UserError
        If it is neither.
    """
    if is_missing(text):
        return None
    if not NUMBER_TEXT.fullmatch(text):
        raise UserError(
            f"{where}: {name} is {text!r}, which is not a number; write a number, or leave the "
            "cell empty where there is none"
        )
    value = float(text.replace(",", "."))
    if abs(value) == float("inf"):
        raise UserError(f"{where}: {name} is {text}, which is too large")
    return value


def read_text_table(path: Path, *, may_be_empty: bool = False) -> TextTable:
    """Read a small table of labels and numbers; every cell stays text.

    Raises
    ------
    UserError
        If it is not such a file, or has no rows and may not be empty.
    """
    source = str(path)
    data, numbers = content(read_utf8(path, TABLE_BYTES))
    if not data.strip():
        raise UserError(f"{source} is empty; its first line must name the columns")
    first, _, body = data.partition(b"\n")
    delimiter, header = first_line_names(source, first.decode("utf-8"), _EXAMPLE)
    names = checked_names(source, header)
    refuse_duplicates(source, names)
    rows: list[tuple[str, ...]] = []
    lines: list[int] = []
    for cells, line in _rows(source, body.decode("utf-8"), delimiter):
        if len(cells) != len(names):
            where, row = f"{source}, line {numbers[1 + line]}", ",".join(cells)
            raise wrong_count(where, row, len(cells), len(names), delimiter)
        if any(cells):
            rows.append(cells)
            lines.append(int(numbers[1 + line]))
    if len(rows) > TABLE_ROWS or len(rows) * len(names) > TABLE_CELLS:
        raise UserError(
            f"{source}: has {len(rows)} rows of {len(names)} columns; a table of labels and "
            f"numbers may have {TABLE_ROWS} rows and {TABLE_CELLS} cells, so leave out what is not "
            "needed"
        )
    if not rows and not may_be_empty:
        raise UserError(f"{source} names its columns in line {numbers[0]} but has no rows")
    columns = zip(*rows, strict=True) if rows else itertools.repeat((), len(names))
    return TextTable(source, dict(zip(names, columns, strict=True)), tuple(lines), delimiter)


def _rows(source: str, body: str, delimiter: str) -> Iterator[tuple[tuple[str, ...], int]]:
    """Yield the cells of each row, and the line in which it begins, counted from 0."""
    if not body.strip():
        return
    reader = csv.reader(io.StringIO(body, newline="\n"), delimiter=delimiter, skipinitialspace=True)
    begins = 0
    try:
        for cells in reader:
            yield tuple(as_read(cell.strip()) for cell in cells), begins
            begins = reader.line_num
    except csv.Error as error:  # such as a quote that is never closed
        raise UserError(f"{source} is not a readable table: {error}") from None


def first_line_names(source: str, text: str, example: str) -> tuple[str, list[str]]:
    """Return what separates the columns that a line names, and the names.

    Raises
    ------
    UserError
        If it holds numbers.
    """
    delimiter = next((mark for mark in "\t;," if mark in text), ",")
    names = [name.strip().strip("\"'").strip() for name in cells_of(text, delimiter)]
    cells = names if len(names) > 1 else text.split()
    if any(cells) and all(NUMBER_TEXT.fullmatch(cell) for cell in cells if cell):
        raise UserError(
            f"{source}: its first line holds numbers ({', '.join(cells[:3])}"
            f"{', ...' if len(cells) > 3 else ''}), but it must name the columns, as in {example}; "
            "or name them with --names"
        )
    return delimiter, names


def checked_names(source: str, names: Sequence[str]) -> list[str]:
    """Return names of columns as messages can show them, `column 2` where there is none.

    Raises
    ------
    UserError
        If there are too many.
    """
    if len(names) > MAX_COLUMNS:
        raise UserError(
            f"{source}: its first line names {len(names)} columns; at most {MAX_COLUMNS} are read, "
            "so leave out those that are not needed"
        )
    shown = [printable(name.strip().strip("\"'").strip()) for name in names]
    return [name or f"column {index}" for index, name in enumerate(shown, start=1)]


def refuse_duplicates(source: str, names: Sequence[str]) -> None:
    """Refuse two columns of one name.

    Raises
    ------
    UserError
    """
    for index, name in enumerate(names):
        if name in names[:index]:
            raise UserError(f"{source}: two columns are named {name}; each must have its own name")


def cells_of(line: str, delimiter: str) -> list[str]:
    """Return the cells of one line; those between blanks without a delimiter."""
    if not delimiter:
        return line.split()
    try:
        return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error:
        return line.split(delimiter)


def wrong_count(
    where: str, row: str, count: int, n_names: int, delimiter: str, namer: str = "first line"
) -> UserError:
    """Return the refusal of a row that has another number of cells than there are names."""
    hint = ""
    if delimiter == "," and count > n_names:
        hint = "; where numbers have a decimal comma, separate the columns by semicolons"
        if _THOUSANDS.search(row):
            hint = "; write numbers without a comma between thousands, or in quotes"
    return UserError(
        f"{where} has {count} value{'' if count == 1 else 's'}, but the {namer} names {n_names} "
        f"columns{hint}"
    )
