"""From a finding's numbers to its sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping
from string import Formatter
from typing import Any, NamedTuple

from rigidimeter.core.findings.kind import EXAMPLE, Kind
from rigidimeter.core.findings.kinds import KINDS
from rigidimeter.core.words import Shown, p_text

NO_CHANGE = 0.05
"""In %: less is shown as 0."""


class Words(NamedTuple):
    """Headline (at most 15 words), details (at most 60) and remedy (one sentence)."""

    headline: str
    details: str
    remedy: str


def words_of(name: str, facts: Mapping[str, Any]) -> Words:
    """Return the words of a finding.

    Parameters
    ----------
    name : str
        Of its kind. A kind that is not known, or a finding without what the templates show, as
        from an older file, is told by its numbers.
    facts : mapping
        `value`, `limit`, `unit`, `p`, `percent_of` (of J, B and K, if known), and what else is
        shown.
    """
    kind, shown = KINDS.get(name), _shown(facts)
    if kind is None or not _fields(kind, str(facts.get("variant", ""))) <= shown.keys():
        return _by_numbers(name, shown)
    headline, measured, meaning, remedy = (
        kind.template(part, str(facts.get("variant", ""))).format_map(shown)
        for part in ("headline", "measured", "meaning", "remedy")
    )
    return Words(headline, f"{measured} {meaning}", remedy)


def explained(kind: Kind) -> list[tuple[str, Words]]:
    """Return the words of a kind with its example, for each variant by its name."""
    shown = {**EXAMPLE, **kind.example, "unit": kind.unit}
    return [
        (variant, words_of(kind.name, {**shown, "variant": variant}))
        for variant in ("", *kind.variants)
    ]


def _shown(facts: Mapping[str, Any]) -> dict[str, Any]:
    shown: dict[str, Any] = {}
    for name, fact in facts.items():
        shown[name] = Shown(fact) if isinstance(fact, float) else fact
    if isinstance(shown.get("value"), Shown):
        shown["value"].limit = float(facts.get("limit", math.nan))
    if math.isfinite(facts.get("p", math.nan)):
        shown["p"] = p_text(facts["p"])
    if "percent_of" in facts:
        shown["changes"] = ", ".join(
            f"{symbol} {'0' if abs(percent) < NO_CHANGE else f'{Shown(percent):+.2g}'} %"
            for symbol, percent in zip("JBK", facts["percent_of"], strict=True)
            if math.isfinite(percent)
        )
    return shown


def _fields(kind: Kind, variant: str) -> set[str]:
    templates = (
        kind.template(part, variant) for part in ("headline", "measured", "meaning", "remedy")
    )
    return {name for text in templates for _, name, _, _ in Formatter().parse(text) if name}


def _by_numbers(name: str, shown: Mapping[str, Any]) -> Words:
    words, unit = name.replace("_", " "), f" {shown['unit']}" if shown.get("unit") else ""
    headline = f"{words}: {shown['value']:.3g}{unit}, limit {shown['limit']:.3g}{unit}"
    details = f"{shown['text']}." if shown.get("text") else f"{headline}."
    return Words(headline, details, str(shown.get("remedy", "")))
