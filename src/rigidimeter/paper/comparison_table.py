"""A row of the ledger: what the paper prints, what the product computes, and who is right by rule.

A row rests on checks. A check holds one computed number against an interval of acceptance
[low, high] that is stated beside it. The verdict follows:

    needs data that were never published   ->  cannot be computed from what was published
    every check inside its interval        ->  agrees
    one of them outside                    ->  differs

Nobody types a verdict: change a number and it turns.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, TypeAlias

from rigidimeter.reporting.numbers import number

__all__ = [
    "AGREES",
    "DIFFERS",
    "UNPUBLISHED",
    "VERDICTS",
    "Check",
    "Picture",
    "Row",
    "Verdict",
    "bounded",
    "near",
    "rounded",
    "within_percent",
]

Verdict: TypeAlias = Literal["agrees", "differs", "cannot be computed from what was published"]

AGREES: Verdict = "agrees"
DIFFERS: Verdict = "differs"
UNPUBLISHED: Verdict = "cannot be computed from what was published"
VERDICTS: tuple[Verdict, ...] = (AGREES, DIFFERS, UNPUBLISHED)


@dataclass(frozen=True)
class Check:
    """One computed number and the interval in which it counts as what the paper says.

    Attributes
    ----------
    what, unit : str
    paper : float or None
        As printed, or what the printed equation comes to; None where the paper makes a statement
        without a number.
    ours : float
    low, high : float
        The interval of acceptance, ends included; one of them may be infinite.
    """

    what: str
    unit: str
    paper: float | None
    ours: float
    low: float
    high: float

    @property
    def within(self) -> bool:
        """Whether our number lies inside; NaN never does."""
        return self.low <= self.ours <= self.high

    @property
    def allowed(self) -> str:
        """The interval in words."""
        if math.isinf(self.low):
            return f"at most {number(self.high)}"
        if math.isinf(self.high):
            return f"at least {number(self.low)}"
        return f"{number(self.low)} to {number(self.high)}"

    def as_dict(self) -> dict[str, Any]:
        """Return what is stored; an open end is null, and so is a number that is none."""
        return {
            "what": self.what,
            "unit": self.unit,
            "paper": self.paper,
            "ours": _finite(self.ours),
            "low": _finite(self.low),
            "high": _finite(self.high),
            "within": self.within,
        }


def within_percent(what: str, unit: str, paper: float, ours: float, percent: float) -> Check:
    """Allow so many percent of the printed number either way."""
    return near(what, unit, paper, ours, abs(paper) * percent / 100.0)


def near(what: str, unit: str, paper: float, ours: float, margin: float) -> Check:
    """Allow a margin in the unit of the number either way."""
    return Check(what, unit, paper, ours, paper - margin, paper + margin)


def rounded(what: str, unit: str, paper: float, ours: float, last_digit: float) -> Check:
    """Allow half of the last digit that the paper prints."""
    # A number that ends in a five may be rounded either way.
    return near(what, unit, paper, ours, 0.5 * last_digit * (1.0 + 1e-9))


def bounded(
    what: str, unit: str, ours: float, *, low: float = -math.inf, high: float = math.inf
) -> Check:
    """Hold a number against a statement without one, such as "falls"."""
    return Check(what, unit, None, ours, low, high)


class Picture(NamedTuple):
    """A figure as it is stored: file name without suffix, SVG, alternative text, caption."""

    name: str
    svg: str
    alt: str
    caption: str


@dataclass(frozen=True)
class Row:
    """One equation, figure, table or statement of the paper beside what the product makes of it.

    Attributes
    ----------
    id : str
        For example ``eq-8``.
    source : str
        Where in the paper.
    paper, ours : str
        What it prints, and what we compute, in words and numbers.
    reading : str
        How we take it.
    checks : tuple of Check
        What decides. May be empty only where `unpublished` says what is missing.
    because : mapping of verdict to str
        The reason for each verdict that can be foreseen; for another one the checks speak.
    unpublished : str
        What would be needed and was not published; empty where nothing is.
    pictures : tuple of Picture
    virtual : bool
        Whether `ours` or the pictures come from a virtual study.

    Raises
    ------
    ValueError
        If nothing can decide.
    """

    id: str
    source: str
    paper: str
    ours: str
    reading: str
    checks: tuple[Check, ...]
    because: Mapping[Verdict, str] = field(default_factory=dict)
    unpublished: str = ""
    pictures: tuple[Picture, ...] = ()
    virtual: bool = False

    def __post_init__(self) -> None:
        if not self.checks and not self.unpublished:
            raise ValueError(f"row {self.id} has neither a check nor anything that is missing")

    @property
    def verdict(self) -> Verdict:
        """What the rule says."""
        if self.unpublished:
            return UNPUBLISHED
        return AGREES if all(check.within for check in self.checks) else DIFFERS

    @property
    def reason(self) -> str:
        """Why: the sentence foreseen for this verdict, else what the checks found."""
        if self.unpublished:
            return self.unpublished
        return self.because.get(self.verdict) or self._from_checks()

    def _from_checks(self) -> str:
        outside = [check for check in self.checks if not check.within]
        if not outside:
            return "Every number is within its stated tolerance."
        return " ".join(
            f"{check.what}: {number(check.ours)} {check.unit}".rstrip()
            + f" is outside what would agree ({check.allowed})."
            for check in outside
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the row as it is stored in ``ledger.json``."""
        return {
            "id": self.id,
            "source": self.source,
            "paper": self.paper,
            "ours": self.ours,
            "verdict": self.verdict,
            "reason": self.reason,
            "reading": self.reading,
            "virtual": self.virtual,
            "checks": [check.as_dict() for check in self.checks],
            "figures": [f"figures/{picture.name}.svg" for picture in self.pictures],
        }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
