"""The table of answers as text: how it is written, read and compared.

A case is a line with its name, then a row for each thing that has numbers: what it is, two blanks
or more, and ``key=value`` for each number or word. Numbers have the digits that are compared.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

Value = float | int | str | None
Row = Mapping[str, Value]
Answers = dict[str, dict[str, Row]]
"""For each case its rows by what they are."""

P_DIGITS, P_LEAST = 0.01, 1e-12
"""p agrees in two digits of its logarithm; below the least all are alike."""

ERROR_SHARE = 1e-3
"""Of the standard error, or of half the interval: by how much a number may differ."""

RELATIVE = 1e-4
"""For numbers without an error of their own."""

ROUNDING = 1e-12
"""What is smaller is the rounding of another processor: no answer is so small."""

_P = re.compile(r"(^|_)p(_|$)")


def text_of(answers: Answers) -> str:
    """Return the table, cases in the order of their names."""
    return "\n".join(line for name in sorted(answers) for line in _lines(name, answers[name]))


def _lines(name: str, rows: Mapping[str, Row]) -> Iterator[str]:
    yield f"[{name}]"
    for what, row in rows.items():
        yield "  ".join([what, *(f"{key}={_cell(key, row[key])}" for key in row)])
    yield ""


def _cell(key: str, value: Value) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    if not isinstance(value, float):
        return str(value)
    return f"{value:.4g}" if _P.search(key) or key.endswith("_se") else f"{value:.9g}"


def read(path: Path) -> Answers:
    """Return the table of a file; numbers are texts that look like one."""
    answers: Answers = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            rows: dict[str, Row] = answers.setdefault(line[1:-1], {})
        elif line:
            what, *cells = re.split(r"  +", line)
            rows[what] = {key: _number(cell) for key, _, cell in (c.partition("=") for c in cells)}
    return answers


def _number(cell: str) -> Value:
    try:
        return int(cell) if re.fullmatch(r"-?\d+", cell) else float(cell)
    except ValueError:
        return cell


def differences(kept: Mapping[str, Row], found: Mapping[str, Row]) -> list[str]:
    """Return a line for each value of a case that is another now, and by how much."""
    lines = [f"- {what}" for what in kept if what not in found]
    lines += [f"+ {what}  {dict(found[what])}" for what in found if what not in kept]
    for what in kept:
        for key in {**kept[what], **found[what]} if what in found else ():
            old, new = kept[what].get(key, "absent"), found[what].get(key, "absent")
            if isinstance(new, str):
                new = _number(new)
            if not _same(key, old, new, kept[what]):
                lines.append(
                    f"! {what}  {key}: {old} -> {new}{_how_far(key, old, new, kept[what])}"
                )
    return lines


def _same(key: str, old: Value, new: Value, row: Row) -> bool:
    if isinstance(old, str) or isinstance(new, str) or old is None or new is None:
        return (old or "") == (new or "")
    if _P.search(key):
        logs = [math.log10(max(value, P_LEAST)) for value in (old, new)]
        return abs(logs[0] - logs[1]) <= P_DIGITS
    if isinstance(old, int) and isinstance(new, int):
        return old == new
    if math.isnan(old) or math.isnan(new):
        return math.isnan(old) and math.isnan(new)
    return abs(old - new) <= max(_tolerance(key, row), ROUNDING)


def _tolerance(key: str, row: Row) -> float:
    """Return by how much a number may differ: a share of its error where it has one."""
    value = row.get(key)
    size = abs(value) if isinstance(value, (int, float)) else 0.0
    if key.endswith("_se"):
        return ERROR_SHARE * size
    base = re.sub(r"_(low|high)$", "", key)
    error = row.get(f"{base}_se")
    ends = [row.get(base + end) for end in ("_low", "_high")]
    if base in ("estimate", "low", "high"):
        error, ends = row.get("se"), [row.get("low"), row.get("high")]
    if isinstance(error, float) and error > 0:
        return ERROR_SHARE * error + 5e-9 * size  # half of the ninth digit
    if all(isinstance(end, (int, float)) for end in ends) and ends[0] != ends[1]:
        return ERROR_SHARE * abs(ends[1] - ends[0]) / 2  # type: ignore[operator]
    return RELATIVE * size


def _how_far(key: str, old: Value, new: Value, row: Row) -> str:
    if not isinstance(old, (int, float)) or not isinstance(new, (int, float)):
        return ""
    error = row.get(re.sub(r"_(low|high)$", "", key) + "_se")
    if isinstance(error, float) and error > 0 and not key.endswith("_se"):
        return f" ({(new - old) / error:+.3g} standard errors)"
    return f" ({100 * (new / old - 1):+.3g} %)" if old else ""
