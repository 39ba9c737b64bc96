"""A row of the comparison: what the paper prints, what we compute, and the verdict.

A check holds one computed number against an interval of acceptance [low, high] that is stated
beside it. The verdict of a row follows from its checks:

    needs data that were never published   ->  cannot be computed from what was published
    every check inside its interval        ->  agrees
    one of them outside                    ->  differs

No verdict is typed in: it changes with the numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from rigidimeter.analysis.report import Figure
from rigidimeter.core.words import number

RowVerdict: TypeAlias = Literal["agrees", "differs", "cannot be computed from what was published"]

AGREES: RowVerdict = "agrees"
DIFFERS: RowVerdict = "differs"
UNPUBLISHED: RowVerdict = "cannot be computed from what was published"
VERDICTS: tuple[RowVerdict, ...] = (AGREES, DIFFERS, UNPUBLISHED)


@dataclass(frozen=True)
class Bound:
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
            **{
                name: value if math.isfinite(value) else None
                for name, value in (("ours", self.ours), ("low", self.low), ("high", self.high))
            },
            "within": self.within,
        }


def within_percent(what: str, unit: str, paper: float, ours: float, percent: float) -> Bound:
    """Allow so many percent of the printed number either way."""
    return near(what, unit, paper, ours, abs(paper) * percent / 100.0)


def near(what: str, unit: str, paper: float, ours: float, margin: float) -> Bound:
    """Allow a margin in the unit of the number either way."""
    return Bound(what, unit, paper, ours, paper - margin, paper + margin)


def rounded(what: str, unit: str, paper: float, ours: float, last_digit: float) -> Bound:
    """Allow half of the last digit that the paper prints."""
    # A number that ends in a five may be rounded either way.
    return near(what, unit, paper, ours, 0.5 * last_digit * (1.0 + 1e-9))


def bounded(
    what: str, unit: str, ours: float, *, low: float = -math.inf, high: float = math.inf
) -> Bound:
    """Hold a number against a statement without one, such as "falls"."""
    return Bound(what, unit, None, ours, low, high)


@dataclass(frozen=True)
class Claim:
    """One equation, figure, table or statement of the paper beside what we compute.

    The words that do not depend on our numbers are in ``statements.toml``; `rows.make_rows` adds
    them.

    Attributes
    ----------
    ours : str
        What we compute, in words and numbers.
    checks : tuple of Bound
        They decide. May be empty only where `unpublished` says what is missing.
    figures : tuple of Figure
    unpublished : str
        What would be needed and was not published; empty where nothing is.
    virtual : bool
        Whether `ours` or the figures come from a virtual study.
    id : str
        For example ``eq-8``.
    source, paper : str
        Where in the paper, and what it prints.
    reading : str
        Which of several possible meanings we use.
    agrees, differs : str
        The reason for either verdict; where there is none, the checks say it.

    Raises
    ------
    ValueError
        If nothing can decide.
    """

    ours: str
    checks: tuple[Bound, ...] = ()
    figures: tuple[Figure, ...] = ()
    unpublished: str = ""
    virtual: bool = False
    id: str = ""
    source: str = ""
    paper: str = ""
    reading: str = ""
    agrees: str = ""
    differs: str = ""

    def __post_init__(self) -> None:
        if not self.checks and not self.unpublished:
            raise ValueError(f"a row has neither a check nor missing data: {self.ours}")

    @property
    def verdict(self) -> RowVerdict:
        """What the rule says."""
        if self.unpublished:
            return UNPUBLISHED
        return AGREES if all(check.within for check in self.checks) else DIFFERS

    @property
    def reason(self) -> str:
        """Why: the sentence written for this verdict, else what the checks found."""
        if self.unpublished:
            return self.unpublished
        written = self.agrees if self.verdict == AGREES else self.differs
        outside = [check for check in self.checks if not check.within]
        if written or not outside:
            return written or "Every number is within its stated tolerance."
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
            "figures": [f"figures/{figure.name}.svg" for figure in self.figures],
        }
