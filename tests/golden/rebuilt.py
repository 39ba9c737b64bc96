"""A room that is being built anew: whose answers may differ by more, and what is to be another.

`rebuilt.toml` names the room. `rebuilt.txt` lists what differs beyond the second tolerance and is
right by the truth of the input, a line each: ``case: what gone: reason``; `what` is a finding, a
key of the table or the last word of a row, and instead of ``gone`` stands ``new``, or ``other`` for
another value or level.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from tests.golden.case import Case
from tests.golden.table import REBUILT, TIGHT, Difference, Row, Tolerance, differences

HERE = Path(__file__).parent
USES: Mapping[str, tuple[str, ...]] = {
    "": (),
    "analysis.estimation": ("estimate", "model", "compare", "batch"),
}
"""The commands that go through a room."""

_LINE = re.compile(r"(?P<case>.+): (?P<name>\S+) (?P<how>gone|new|other): (?P<reason>.+)")


class Expected(NamedTuple):
    """What is to be another in a case."""

    case: str
    name: str
    how: str

    def __str__(self) -> str:
        return f"{self.case}: {self.name} {self.how}"


class Rebuilt(NamedTuple):
    """The room, empty if none, and the reasons of what is expected to differ."""

    room: str = ""
    expected: Mapping[Expected, str] = {}

    def tolerance(self, case: Case) -> Tolerance:
        """Return by how much the answers of a case may differ."""
        return REBUILT if case.commands[-1][0] in USES[self.room] else TIGHT

    def reason(self, case: Case, found: Difference) -> str:
        """Return why it differs; empty if that is not expected."""
        return self.expected.get(Expected(case.name, found.name, found.how), "")

    def unexpected(self, case: Case, kept: Mapping[str, Row], now: Mapping[str, Row]) -> list[str]:
        """Return a line for what differs beyond the tolerance, and for what was to and does not."""
        found = differences(kept, now, self.tolerance(case))
        seen = {(one.name, one.how) for one in found}
        lines = [str(one) for one in found if not self.reason(case, one)]
        missing = [one for one in self.expected if one.case == case.name and one[1:] not in seen]
        return lines + [f"{one}: is expected in rebuilt.txt, and is not so" for one in missing]


def read_rebuilt(folder: Path = HERE) -> Rebuilt:
    """Return what is being built anew."""
    lines = (folder / "rebuilt.txt").read_text(encoding="utf-8").splitlines()
    expected = {}
    for line in filter(None, lines):
        parts = _LINE.fullmatch(line)
        if not parts:
            raise ValueError(f"rebuilt.txt: {line!r} is no `case: what gone|new|other: reason`")
        expected[Expected(parts["case"], parts["name"], parts["how"])] = parts["reason"]
    room = tomllib.loads((folder / "rebuilt.toml").read_text(encoding="utf-8"))["room"]
    return Rebuilt(room, expected)


def columns(case: Case, kept: Mapping[str, Row], now: Mapping[str, Row]) -> Iterator[str]:
    """Yield what differs from the table in two columns, old and new, the largest first."""
    rebuilt = read_rebuilt()
    beyond = {one[:2] for one in differences(kept, now, rebuilt.tolerance(case))}
    for one in largest_first(differences(kept, now)):
        mark = "!" if one[:2] in beyond else " "
        mark = "=" if mark == "!" and rebuilt.reason(case, one) else mark
        far = f"{one.size:+.3g} {one.unit}" if one.unit else one.how
        old, new = (_short(value) for value in (one.old, one.new))
        yield f"{mark} {one.row[:60]:60}  {one.key[:24]:24} {old:>16} {new:>16}  {far}"


def largest_first(found: Iterable[Difference]) -> list[Difference]:
    """Return differences by size: without a number, in standard errors, in percent."""
    order = {"": 0, "standard errors": 1, "%": 2}
    return sorted(found, key=lambda one: (order[one.unit], -abs(one.size)))


def size(found: Iterable[Difference]) -> float:
    """Return the largest in standard errors, infinite for what has no number, 0 without any."""
    return max((abs(one.size) if one.unit != "%" else 0.0 for one in found), default=-math.inf)


def _short(value: object) -> str:
    if isinstance(value, Mapping):
        value = value.get("level", "is there")
    return "" if value is None else f"{value:.7g}" if isinstance(value, float) else str(value)[:16]
