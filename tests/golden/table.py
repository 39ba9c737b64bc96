"""The table of answers as text: how it is written, read and compared.

A case is a line with its name, then a row for each thing that has numbers: what it is, two blanks
or more, and ``key=value`` for each number or word. Numbers have the digits that are compared.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

Value = float | int | str | None
Row = Mapping[str, Value]
Answers = dict[str, dict[str, Row]]
"""For each case its rows by what they are."""

P_LEAST = 1e-12
"""Below it all p are alike."""


class Tolerance(NamedTuple):
    """By how much an answer may differ.

    Attributes
    ----------
    errors : float
        A number with an error of its own: so many standard errors, or halves of its interval.
    of_error, of_interval : float
        A standard error: this share of it. An end of an interval: this share of half of it.
    logarithm, of_logarithm : float
        p: in log10, and as a share of it.
    relative : float
        Other numbers: this share.
    findings_by_name : bool
        The value of a finding, a size in the unit of its check, is not compared.
    """

    errors: float = 1e-3
    of_error: float = 1e-3
    of_interval: float = 0.0
    logarithm: float = 0.01
    of_logarithm: float = 0.0
    relative: float = 1e-4
    findings_by_name: bool = False


TIGHT = Tolerance()
REBUILT = Tolerance(0.05, 0.05, 0.05, 0.05, 0.05, 0.01, findings_by_name=True)
"""Of a room that is built anew, whose numbers have another rounding and search."""

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


class Difference(NamedTuple):
    """A value of a row that is another now; a row that is gone or new has no key.

    `size` is in standard errors where the value has one, else the share of the old value, and
    infinite where there is no number.
    """

    row: str
    key: str
    old: object
    new: object
    size: float = math.inf
    unit: str = ""

    @property
    def name(self) -> str:
        """The finding, the key, or what the row is called last."""
        finding = re.search(r"findings (\w+)", self.row)
        return finding[1] if finding else self.key or self.row.split()[-1]

    @property
    def how(self) -> str:
        """What has become of it: `gone`, `new` or `other`."""
        return "other" if self.key else "gone" if self.new is None else "new"

    def __str__(self) -> str:
        if not self.key:
            return f"- {self.row}" if self.new is None else f"+ {self.row}  {self.new}"
        far = f" ({self.size:+.3g} {self.unit})" if self.unit else ""
        return f"! {self.row}  {self.key}: {self.old} -> {self.new}{far}"


def differences(
    kept: Mapping[str, Row], found: Mapping[str, Row], tolerance: Tolerance = TIGHT
) -> list[Difference]:
    """Return each value of a case that is another now, and by how much."""
    lines = [Difference(what, "", dict(kept[what]), None) for what in kept if what not in found]
    lines += [Difference(what, "", None, dict(found[what])) for what in found if what not in kept]
    for what in kept:
        for key in {**kept[what], **found[what]} if what in found else ():
            if key == "value" and tolerance.findings_by_name:
                continue
            old, new = kept[what].get(key, "absent"), found[what].get(key, "absent")
            if isinstance(new, str):
                new = _number(new)
            if not _same(key, old, new, kept[what], tolerance):
                far = _how_far(key, old, new, kept[what])
                lines.append(Difference(what, key, old, new, *far))
    return lines


def _same(key: str, old: Value, new: Value, row: Row, tolerance: Tolerance) -> bool:
    if isinstance(old, str) or isinstance(new, str) or old is None or new is None:
        return (old or "") == (new or "")
    if _P.search(key):
        logs = [math.log10(max(value, P_LEAST)) for value in (old, new)]
        may = tolerance.logarithm + tolerance.of_logarithm * abs(logs[0])
        return abs(logs[0] - logs[1]) <= may
    if isinstance(old, int) and isinstance(new, int):
        return old == new
    if math.isnan(old) or math.isnan(new):
        return math.isnan(old) and math.isnan(new)
    return abs(old - new) <= max(_may_differ(key, row, tolerance), ROUNDING)


def _may_differ(key: str, row: Row, tolerance: Tolerance) -> float:
    """Return by how much a number may differ: a share of its error where it has one."""
    value = row.get(key)
    size = abs(value) if isinstance(value, (int, float)) else 0.0
    if key.endswith("_se"):
        return tolerance.of_error * size
    base = re.sub(r"_(low|high)$", "", key)
    error = row.get(f"{base}_se")
    ends = [row.get(base + end) for end in ("_low", "_high")]
    if base in ("estimate", "low", "high"):
        error, ends = row.get("se"), [row.get("low"), row.get("high")]
    known = all(isinstance(end, (int, float)) for end in ends) and ends[0] != ends[1]
    half = abs(ends[1] - ends[0]) / 2 if known else 0.0  # type: ignore[operator]
    of_end = tolerance.of_interval * half if re.search(r"(^|_)(low|high)$", key) else 0.0
    if isinstance(error, float) and error > 0:
        # half of the ninth digit beside it
        return max(tolerance.errors * error + 5e-9 * size, of_end)
    return max(tolerance.errors * half, of_end) if known else tolerance.relative * size


def _how_far(key: str, old: Value, new: Value, row: Row) -> tuple[float, str]:
    if not isinstance(old, (int, float)) or not isinstance(new, (int, float)):
        return math.inf, ""
    error = row.get(re.sub(r"_(low|high)$", "", key) + "_se")
    if isinstance(error, float) and error > 0 and not key.endswith("_se"):
        return (new - old) / error, "standard errors"
    return (100 * (new / old - 1), "%") if old else (math.inf, "")
