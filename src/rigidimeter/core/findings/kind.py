"""A kind of finding: its unit, its default level and its templates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Level = Literal["note", "caution", "exclude"]

PARTS = ("headline", "measured", "meaning", "remedy")


@dataclass(frozen=True)
class Kind:
    """One kind of finding.

    The templates are those of `str.format`: with `value`, `limit`, `unit`, `p` (as "p = 0.01"),
    `changes` (of J, B and K, "J +3 %, B −1 %, K 0 %") and the facts of the finding. A fact
    ``variant`` names the variants whose templates take the place of these, the last one first.

    Parameters
    ----------
    name : str
        Of the check, and of its level in `[diagnostics.levels]`.
    unit : str
        Of value and limit.
    level : {"note", "caution", "exclude"}
        What it does unless the settings say otherwise.
    checks : str
        What is looked at, for the documentation.
    headline : str
        At most 15 words, without a full stop.
    measured, meaning : str
        What was measured, and what that means for J, B and K; at most 60 words together.
    remedy : str
        One sentence.
    setting : str
        The key of `[diagnostics]` that sets the limit; empty where it cannot be set.
    variants : mapping
        From the name of a variant to the templates that differ.
    example : mapping
        Values for every field of the templates.
    """

    name: str
    unit: str
    level: Level
    checks: str
    headline: str
    measured: str
    meaning: str
    remedy: str
    setting: str = ""
    variants: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    example: Mapping[str, object] = field(default_factory=dict)

    def template(self, part: str, variant: str = "") -> str:
        """Return one of `PARTS`, as the variants have it."""
        for name in reversed(variant.split()):
            if part in self.variants.get(name, {}):
                return self.variants[name][part]
        text: str = getattr(self, part)
        return text
