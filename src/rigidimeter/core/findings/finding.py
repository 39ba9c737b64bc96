"""A finding: what a check measured, and what that does to J, B and K."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from rigidimeter.core.errors import arguments_named
from rigidimeter.core.findings.kind import Level
from rigidimeter.core.findings.kinds import KINDS
from rigidimeter.core.findings.words import Words, words_of

SERIOUS_FIRST: tuple[Level, ...] = ("exclude", "caution", "note")

Three = tuple[float, float, float]
Fact = float | int | str

NEGLIGIBLE_PERCENT = 1.0
"""Of J, B and K: an effect that is smaller, and within half the intervals, is only noted."""

_NAN: Three = (math.nan,) * 3


class Effect(NamedTuple):
    """By how much J, B and K are too high because of a finding; NaN where that is not known.

    Attributes
    ----------
    percent : (float, float, float)
        Of J, B and K as they would be without it.
    half_intervals : (float, float, float)
        Of half their 95 % intervals.
    """

    percent: Three = _NAN
    half_intervals: Three = _NAN

    @classmethod
    def of(cls, bias: Iterable[float], values: Iterable[float], half: Iterable[float]) -> Effect:
        """Return the effect of a bias on estimates.

        Parameters
        ----------
        bias, values, half : arrays, shape (3,)
            By how much J, B and K are too high; the estimates; half their 95 % intervals. In SI.
        """
        each = [*zip(bias, values, half, strict=True)]
        percent = [100.0 * b / abs(v - b) if v != b else math.nan for b, v, _ in each]
        return cls(_three(percent), _three([b / h if h else math.nan for b, _, h in each]))

    @property
    def negligible(self) -> bool:
        """Whether it is known and small: below 1 % of each, and below half each interval."""
        return all(abs(one) < NEGLIGIBLE_PERCENT for one in self.percent) and all(
            abs(one) < 1.0 for one in self.half_intervals
        )


UNKNOWN_EFFECT = Effect()


@dataclass(frozen=True, eq=False)
class Finding:
    """What one check found. Its words are made from it: `headline`, `details`, `remedy`.

    Parameters
    ----------
    name : str
        The check, as the settings name it.
    level : {"note", "caution", "exclude"}
        `note` is for information; `caution` asks to look at the epoch before its numbers are used;
        `exclude` says that they mean nothing.
    value, limit : float
        What was measured, and the limit that it passed; NaN where there is none.
    unit : str
        Of both.
    p : float
        Probability of as much by chance, where that was tested.
    epochs : tuple of str
        The labels of the epochs that show it together; empty for one epoch's own fit.
    condition : str
    effect : Effect
        On J, B and K.
    facts : mapping
        Further numbers and names that the sentences show. `variant` names the wording.
    """

    name: str
    level: Level
    value: float
    limit: float = math.nan
    unit: str = ""
    p: float = math.nan
    epochs: tuple[str, ...] = ()
    condition: str = ""
    effect: Effect = UNKNOWN_EFFECT
    facts: Mapping[str, Fact] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("value", "limit", "p"):
            object.__setattr__(self, name, _number(getattr(self, name)))
        object.__setattr__(self, "effect", Effect(*map(_three, self.effect)))
        plain = {k: float(v) if isinstance(v, float) else v for k, v in self.facts.items()}
        object.__setattr__(self, "facts", plain)

    def __eq__(self, other: object) -> bool:
        """Equal in every field; numbers that are NaN in both are equal."""
        return isinstance(other, Finding) and repr(self) == repr(other)

    def __hash__(self) -> int:
        return hash((self.name, self.level, self.epochs, self.condition))

    @property
    def words(self) -> Words:
        """Headline, details and remedy."""
        return words_of(self.name, self._shown)

    @property
    def headline(self) -> str:
        """What was found, in at most 15 words, without a full stop."""
        return self.words.headline

    @property
    def details(self) -> str:
        """What was measured and what it means for J, B and K, in at most 60 words."""
        return self.words.details

    @property
    def remedy(self) -> str:
        """What to do about it in Python: one sentence, empty where nothing is to be done.

        `words` has that of the command line, as reports and files have it.
        """
        return arguments_named(self.words.remedy)

    @property
    def harmless(self) -> bool:
        """Whether it changes nothing: a note after which nothing is to be done."""
        return self.level == "note" and self.name in KINDS and not self.remedy

    @property
    def _shown(self) -> dict[str, Any]:
        """What the templates may name."""
        own = {"value": self.value, "limit": self.limit, "unit": self.unit, "p": self.p}
        changes = {"percent_of": self.effect.percent} if self.effect != UNKNOWN_EFFECT else {}
        return {**self.facts, **own, **changes, "condition": self.condition}

    def row(self) -> dict[str, Any]:
        """Return it as documents have it, with its words."""
        return {
            "name": self.name,
            "level": self.level,
            "value": self.value,
            "unit": self.unit,
            "limit": self.limit,
            "p": self.p,
            "epochs": list(self.epochs),
            "condition": self.condition,
            "effect": {
                "percent": list(self.effect.percent),
                "half_intervals": list(self.effect.half_intervals),
            },
            "facts": dict(self.facts),
            **self.words._asdict(),
        }


def found_between(
    name: str, facts: Mapping[str, Fact], value: float = math.nan, limit: float = math.nan
) -> Finding:
    """Return a finding of recordings beside each other (`STUDY_KINDS`), with the level of its kind.

    Parameters
    ----------
    name : str
    facts : mapping
        What its templates show; `variant` names the wording.
    value, limit : float
    """
    return Finding(name, KINDS[name].level, value, limit, KINDS[name].unit, facts=facts)


def finding_from(row: Mapping[str, Any]) -> Finding:
    """Return the finding of a document's row.

    Raises
    ------
    KeyError, TypeError, ValueError
        If the row is none.
    """
    level: Level = row["level"]
    if level not in SERIOUS_FIRST:
        raise ValueError(f"finding level {level!r}")
    effect = row["effect"]
    return Finding(
        str(row["name"]),
        level,
        _number(row["value"]),
        _number(row["limit"]),
        str(row["unit"]),
        _number(row["p"]),
        tuple(map(str, row["epochs"])),
        str(row["condition"]),
        Effect(_three(effect["percent"]), _three(effect["half_intervals"])),
        {str(k): math.nan if v is None else v for k, v in row["facts"].items()},
    )


def _number(value: Any) -> float:
    return math.nan if value is None or math.isnan(value) else float(value)


def _three(values: Sequence[Any]) -> Three:
    J, B, K = map(_number, values)
    return J, B, K
