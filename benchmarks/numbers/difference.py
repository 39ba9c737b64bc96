"""Numbers against those that were kept: how far apart, one by one."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from benchmarks.numbers.documents import Numbers, Value

__all__ = ["Compared", "Difference", "compare"]


class Difference(NamedTuple):
    """One value that was something else.

    Attributes
    ----------
    name : str
    row : str
        Of which row of its column; empty for a single value.
    before, now : float, str or None
    relative : float
        Of the larger of the two; infinite where they are not two numbers.
    """

    name: str
    row: str
    before: Value
    now: Value
    relative: float

    def __str__(self) -> str:
        where = f"{self.name} [{self.row}]" if self.row else self.name
        return f"{where}: {self.before!r} is now {self.now!r} ({self.relative:.2g})"


class Compared(NamedTuple):
    """How two sets of numbers compare.

    Attributes
    ----------
    values : int
        Values compared.
    worst : Difference or None
        The pair that is farthest apart; None if all are equal.
    differing : list of Difference
        Those farther apart than is allowed.
    missing, new : list of str
        Names on one side only.
    """

    values: int
    worst: Difference | None
    differing: list[Difference]
    missing: list[str]
    new: list[str]


def compare(before: Numbers, now: Numbers, tolerance: float) -> Compared:
    """Compare two sets of numbers, each within a relative tolerance.

    Examples
    --------
    >>> found = compare({"p": 0.5, "n": 3.0}, {"p": 0.5, "n": 4.0, "r": 0.1}, 1e-9)
    >>> print(found.values, found.worst, found.new)
    2 n: 3.0 is now 4.0 (0.25) ['r']
    """
    differences = [
        difference
        for name in before.keys() & now.keys()
        for difference in _differences(name, before, now)
    ]
    unequal = [one for one in differences if one.relative > 0.0]
    return Compared(
        values=len(differences),
        worst=max(unequal, key=lambda one: one.relative, default=None),
        differing=sorted(
            (one for one in unequal if one.relative > tolerance), key=lambda one: one[:2]
        ),
        missing=[name for name in before if name not in now],
        new=[name for name in now if name not in before],
    )


def _differences(name: str, before: Numbers, now: Numbers) -> Iterator[Difference]:
    one, two = before[name], now[name]
    if not isinstance(one, list) or not isinstance(two, list):
        one, two = one if isinstance(one, list) else [one], two if isinstance(two, list) else [two]
        rows = [""]
    else:
        labels = before.get(f"{name.rpartition('/')[0]}/row")
        rows = [str(label) for label in labels] if isinstance(labels, list) else []
    if len(one) != len(two):
        length = f"{len(one)} values", f"{len(two)} values"
        yield Difference(name, "", *length, math.inf)
        return
    for index, (a, b) in enumerate(zip(one, two, strict=True)):
        row = rows[index] if index < len(rows) else str(index)
        yield Difference(name, row, a, b, _relative(a, b))


def _relative(before: Value, now: Value) -> float:
    """Return how far apart two values are, of the larger of them."""
    if before == now:
        return 0.0
    if not isinstance(before, float) or not isinstance(now, float):
        return math.inf
    return abs(before - now) / max(abs(before), abs(now))
