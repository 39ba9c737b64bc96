"""A check as a value: what was measured, what it must be, how it came out, what would help."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Outcome = Literal["passed", "failed", "not possible here", "not tried"]

NOBODY = "only a person can tell; commission again without --yes"


@dataclass(frozen=True)
class RigCheck:
    """One check.

    Parameters
    ----------
    name : str
        What was checked; the same words in every record.
    value : float or str or None
        What was found, in `unit`.
    unit : str
        Empty for a word, ``"1"`` for a pure number.
    limit : str
        What it must be, in words and numbers.
    outcome : str
        "passed", "failed", "not possible here", or "not tried" where nobody was there to do it.
    remedy : str
        What to do about it; where it passed a remark, as a rule empty.
    """

    name: str
    value: float | str | None
    unit: str
    limit: str
    outcome: Outcome
    remedy: str = ""

    @property
    def passed(self) -> bool:
        """Whether it is as it must be."""
        return self.outcome == "passed"

    @property
    def words(self) -> str:
        """What was found, with its unit."""
        return self.value if isinstance(self.value, str) else with_unit(self.value, self.unit)

    @property
    def sentence(self) -> str:
        """What was found and what to do, for a refusal."""
        return f"{self.name}: {self.words}, must be {self.limit}; {self.remedy}"


def below(name: str, value: float, unit: str, limit: float, remedy: str) -> RigCheck:
    """Return the check that a number is at most a limit; one that is not finite is not."""
    return _check(name, value, unit, f"at most {with_unit(limit, unit)}", value <= limit, remedy)


def above(name: str, value: float, unit: str, limit: float, remedy: str) -> RigCheck:
    """Return the check that a number is at least a limit."""
    return _check(name, value, unit, f"at least {with_unit(limit, unit)}", value >= limit, remedy)


def within_tolerance(
    name: str, value: float, unit: str, wanted: float, percent: float, remedy: str
) -> RigCheck:
    """Return the check that a number is as wanted, but for so many percent."""
    good = abs(value - wanted) <= 0.01 * percent * abs(wanted)
    return _check(name, value, unit, f"{with_unit(wanted, unit)} ± {percent:g} %", good, remedy)


def yes(name: str, good: bool, found: str, limit: str, remedy: str) -> RigCheck:
    """Return the check of something that is so or not."""
    return RigCheck(name, found, "", limit, "passed" if good else "failed", "" if good else remedy)


def impossible(name: str, limit: str, why: str) -> RigCheck:
    """Return a check that could not be made; `why` is its remedy."""
    return RigCheck(name, None, "", limit, "not possible here", why)


def untried(name: str, limit: str) -> RigCheck:
    """Return a check that takes a person, and nobody was there."""
    return RigCheck(name, None, "", limit, "not tried", NOBODY)


def _check(name: str, value: float, unit: str, limit: str, good: bool, remedy: str) -> RigCheck:
    found = float(value) if math.isfinite(value) else None
    return RigCheck(
        name, found, unit, limit, "passed" if good else "failed", "" if good else remedy
    )


def with_unit(value: float | None, unit: str) -> str:
    """Return a number with its unit; a time below a second in ms.

    >>> with_unit(0.0013, "s"), with_unit(2.5, "s"), with_unit(1.0, "1"), with_unit(None, "s")
    ('1.3 ms', '2.5 s', '1', 'not measurable')
    """
    if value is None:
        return "not measurable"
    if unit == "s" and abs(value) < 1.0:
        value, unit = 1000.0 * value, "ms"
    return f"{value:.4g} {unit}".removesuffix(" 1").rstrip()
