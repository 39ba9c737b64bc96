"""A room that is being built anew: its answers have a second tolerance (`rebuilt.toml`)."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from tests.golden.case import Case
from tests.golden.table import REBUILT, TIGHT, Difference, Row, Tolerance, differences

LISTED = Path(__file__).with_name("rebuilt.toml")
_LINE = re.compile(r"(?P<case>.+): (?P<name>\S+) (?P<how>gone|new|other): (?P<reason>.+)")


class Expected(NamedTuple):
    """What is to be another in a case."""

    case: str
    name: str
    how: str

    def __str__(self) -> str:
        return f"{self.case}: {self.name} {self.how}"


class Rebuilt(NamedTuple):
    """The commands that go through the room, and the reasons of what is expected to differ."""

    commands: Collection[str] = ()
    expected: Mapping[Expected, str] = {}

    def tolerance(self, case: Case) -> Tolerance:
        """Return by how much the answers of a case may differ."""
        return REBUILT if case.commands[-1][0] in self.commands else TIGHT

    def reason(self, case: Case, found: Difference) -> str:
        """Return why it differs; empty if that is not expected."""
        return self.expected.get(Expected(case.name, found.name, found.how), "")

    def unexpected(self, case: Case, kept: Mapping[str, Row], now: Mapping[str, Row]) -> list[str]:
        """Return a line for what differs beyond the tolerance, and for what was to and does not."""
        found = differences(kept, now, self.tolerance(case))
        seen = {(one.name, one.how) for one in found}
        lines = [str(one) for one in found if not self.reason(case, one)]
        missing = [one for one in self.expected if one.case == case.name and one[1:] not in seen]
        return lines + [f"{one}: is expected in {LISTED.name}, and is not so" for one in missing]


def read_rebuilt(path: Path = LISTED) -> Rebuilt:
    """Return what is being built anew."""
    listed, expected = tomllib.loads(path.read_text(encoding="utf-8")), {}
    for line in listed["expected"]:
        parts = _LINE.fullmatch(line)
        if not parts:
            raise ValueError(f"{path.name}: {line!r} is no `case: what gone|new|other: reason`")
        expected[Expected(parts["case"], parts["name"], parts["how"])] = parts["reason"]
    return Rebuilt(listed["commands"], expected)


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
