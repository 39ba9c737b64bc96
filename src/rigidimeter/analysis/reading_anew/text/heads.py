"""Where the rows of a text begin, and what its columns are called.

Mostly the first line names the columns. Other files have a block of lines before it, a row of units
below it, their names in a comment, or no names at all.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from rigidimeter.analysis.reading_anew.columns import MISSING, number, unique
from rigidimeter.analysis.reading_anew.text.cells import GROUPED
from rigidimeter.analysis.reading_anew.units import factor, unit_of
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import (
    NUMBER_TEXT,
    cells_of,
    checked_names,
    first_line_names,
    refuse_duplicates,
)

DELIMITERS = ("\t", ";", ",", "|", "")
"""The last one stands for blanks."""
HEAD_LINES = 400
_RUN = 5
_FEW = 2
_LABEL = re.compile(r"[^\W\d_][\w .-]*")
_STAMP = re.compile(r"[\d:./T -]*:[\d:.,]+Z?")
_SAMPLING = (
    r"(?i)(?<![^\W_])(?:sampl|abtast|[ée]chant|campion|muestr|bemonster|measurement rate|fs\b)"
)
_AMOUNT = r"(\d+(?:[.,]\d+)?)"
_RATE = re.compile(_SAMPLING + rf"\D*?{_AMOUNT}\s*(k?)Hz")
_RATE_BEHIND = re.compile(_SAMPLING + rf"[^\d\n]*?[\[(_](k?)Hz\b[^\d\n]*{_AMOUNT}")
_INTERVAL = re.compile(
    r"(?i)(?<![^\W_])(?:dt|abtastzeit|(?:sampl|abtast|bemonster)\w*[\s_-]*(?:interval|period)\w*"
    rf"|abtastintervall)(?![^\W_])\D*?{_AMOUNT}\s*(ms|msec|s|sec|us|µs)(?![^\W_/])(?!\s*/)"
)
_ANY_RATE = re.compile(rf"(?i)\brate\b[^\d\n]*?{_AMOUNT}\s*(k?)Hz")
# Says that rows were left out, so that a rate beside it may be that of all rows.
_DECIMATED = re.compile(
    r"(?i)(?:decimat|d[ée]cim[ée]|decimeer|dezimier|diezm|(?:down|re|sub|sous|unter)[\s-]?(?:sampl"
    r"|abtast|[ée]chant)|\bthinned|\baverag|\bevery\s+\d+(?:nd|rd|th)\b)"
    r"(?!\w*[\s:=]*(?:1|no|none|off)\b(?![.,:]\d))"
)
# What beside a rate leaves no doubt of it.
_PLAIN = re.compile(
    r"(?i)\w*(?:decimat|sampl)\w*\s+from\s+[\d.,]+\s*k?Hz|\bnot\s+\w*(?:decimat|sampl)\w*"
    r"|\b\d+[\s-]*bits?\b"
)
# A second number in the clause of a rate may say how many of its rows there are.
_NUMBER_BESIDE = re.compile(r"[^;|\t\n]*?\d")


@dataclass(frozen=True)
class Head:
    """What comes before the rows.

    Parameters
    ----------
    delimiter : str
        Of the rows; nothing for blanks.
    names : list of str
    n_before : int
        Lines before the first row, without comments and blank lines.
    units : mapping of str to str
        By name.
    facts : mapping of str to float or str
        Such as a sampling rate.
    in_pairs : bool
        Whether every second column is a channel, with its own time in the column before it.
    """

    delimiter: str
    names: list[str]
    n_before: int
    units: Mapping[str, str] = field(default_factory=dict)
    facts: Mapping[str, float | str] = field(default_factory=dict)
    in_pairs: bool = False


def first_line_head(source: str, text: str, example: str) -> Head:
    """Return the head of a table whose first line names the columns.

    Raises
    ------
    UserError
        If it does not.
    """
    delimiter, names = first_line_names(source, text, example)
    return Head(delimiter, unique(checked_names(source, names)), 1)


def found_head(
    source: str, lines: Sequence[str], comment: str, names: Sequence[str], example: str
) -> Head:
    """Return the head of a recording.

    Parameters
    ----------
    source : str
    lines : sequence of str
        The first `HEAD_LINES`, without comments and blank lines.
    comment : str
        The last comment before the first of them.
    names : sequence of str
        As the user gave them; empty where the file has them.
    example : str

    Raises
    ------
    UserError
        If no row or no names are found.
    """
    if not names and (head := _standard(source, lines, example)) is not None:
        return replace(head, facts=stated_rate([comment]))
    for start in range(len(lines)):
        for delimiter in DELIMITERS:
            count = _run_of_rows(lines[start : start + _RUN], delimiter)
            if count >= 2:
                return _named(source, lines, start, delimiter, count, comment, names, example)
    return first_line_head(source, lines[0], example)


def _standard(source: str, lines: Sequence[str], example: str) -> Head | None:
    """Return the head where the first line, and at most a row of units below it, is no row."""
    delimiter = next((mark for mark in DELIMITERS[:3] if mark in lines[0]), ",")
    names = cells_of(lines[0], delimiter)
    if len(names) < 2 or any(NUMBER_TEXT.fullmatch(name.strip()) for name in names):
        return None
    units = units_row(lines[1], delimiter) if len(lines) > 1 else None
    below = lines[2 if units else 1 :][:3]
    for line in below:
        cells = cells_of(line, delimiter)
        if len(cells) != len(names) or not any(_is_number(cell) for cell in cells):
            return None
    head = first_line_head(source, lines[0], example)
    if not units or len(units) != len(head.names):
        return head
    stated = {name: unit for name, unit in zip(head.names, units, strict=True) if unit}
    return Head(delimiter, head.names, 2, stated)


def _named(
    source: str,
    lines: Sequence[str],
    start: int,
    delimiter: str,
    count: int,
    comment: str,
    names: Sequence[str],
    example: str,
) -> Head:
    if names:
        if len(names) != count:
            raise UserError(
                f"{source}: its rows have {count} columns, but --names gives {len(names)}"
            )
        shown = checked_names(source, names)
        refuse_duplicates(source, shown)
        return Head(delimiter, shown, start)
    at = start - 1
    units = units_row(lines[at], delimiter) if at >= 0 else None
    if units is not None and len(units) == count and at > 0:
        at -= 1
    else:
        above = units_row(lines[at - 1], delimiter) if at > 0 else None
        units = above if above is not None and len(above) == count else None
    for text in (lines[at].lstrip("% ") if at >= 0 else "", comment):
        for mark in dict.fromkeys((delimiter, *DELIMITERS)):
            found = cells_of(text, mark)
            while len(found) > count and not found[-1].strip():
                found.pop()
            if len(found) == count and not any(_is_number(cell) for cell in found):
                shown = unique(checked_names(source, found))
                stated = dict(zip(shown, units or [""] * count, strict=True))
                stated = {name: unit for name, unit in stated.items() if unit}
                return Head(delimiter, shown, start, stated, stated_rate([*lines[:start], comment]))
    if start <= _FEW:
        return first_line_head(source, lines[0], example)
    raise UserError(
        f"{source}: the rows have {count} columns, but the line before them does not name as many; "
        "name them with --names"
    )


def stated_rate(lines: Sequence[str]) -> dict[str, float | str]:
    """Return the sampling rate that lines before the rows state, if they state one.

    Where they state another number or another rate beside it, or say that rows were left out, it is
    the text of those lines.
    """
    found, others, told = set[float](), set[float](), list[str]()
    doubtful = False
    for stated in lines:
        line = _PLAIN.sub("", stated)
        matches = [*_RATE.finditer(line), *_RATE_BEHIND.finditer(line), *_INTERVAL.finditer(line)]
        rates = {rate for match in matches if (rate := _rate_hz(match))}
        others |= {rate for match in _ANY_RATE.finditer(line) if (rate := _rate_hz(match))}
        beside = any(_NUMBER_BESIDE.match(line, match.end()) for match in matches)
        left_out = _DECIMATED.search(line) is not None
        found |= rates
        doubtful |= beside or left_out
        told += [stated.strip()] if rates or left_out or _ANY_RATE.search(line) else []
    if found and (doubtful or others - found):
        return {"rate_hz": "; ".join(dict.fromkeys(told))}
    return {"rate_hz": found.pop()} if len(found) == 1 else {}


def _rate_hz(match: re.Match[str]) -> float | None:
    """Return the rate that a number and a unit state: kHz or Hz, or of an interval its inverse."""
    number, unit = sorted(match.groups(), key=lambda text: not text[:1].isdigit())
    amount = float(number.replace(",", "."))
    if match.re is _INTERVAL:
        return 1.0 / (amount * (factor(unit, "time") or 1.0)) if amount else None
    return amount * (1000.0 if unit else 1.0)


def _run_of_rows(lines: Sequence[str], delimiter: str) -> int:
    """Return how many cells each of some lines has, where all are rows of numbers; else 0."""
    counts = {_row(line, delimiter) for line in lines}
    return counts.pop() if len(counts) == 1 and len(lines) > 1 else 0


def _row(line: str, delimiter: str) -> int:
    cells = [cell.strip() for cell in cells_of(line, delimiter)]
    while len(cells) > 2 and not cells[-1]:
        cells.pop()
    n_numbers = sum(_is_number(cell) for cell in cells)
    if n_numbers < 2 or not (_is_number(cells[0]) or _STAMP.fullmatch(cells[0])):
        return 0
    fine = all(
        _is_number(cell) or cell.lower() in MISSING or _LABEL.fullmatch(cell) for cell in cells[1:]
    )
    return len(cells) if fine else 0


def units_row(line: str, delimiter: str) -> list[str] | None:
    """Return the units that a line states, one a column; None where it holds anything else."""
    units = [cell.strip().strip("[](){}\"'").strip() for cell in cells_of(line, delimiter)]
    stated = [unit for unit in units if unit and unit != "-"]
    if not stated or not all(unit_of(unit) for unit in stated):
        return None
    return ["" if unit == "-" else unit for unit in units]


def _is_number(cell: str) -> bool:
    cell = cell.strip()
    if NUMBER_TEXT.fullmatch(cell) or GROUPED.fullmatch(cell):
        return True
    if not cell[-1:].isdigit():  # no name of a number, such as nan
        return False
    try:
        number(cell)
    except ValueError:
        return False
    return True
