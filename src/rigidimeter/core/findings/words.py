"""From a finding's numbers to its sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping
from string import Formatter
from typing import Any, NamedTuple

from rigidimeter.core.findings.kind import EXAMPLE, Kind
from rigidimeter.core.findings.kinds import KINDS
from rigidimeter.core.words import Shown, p_text

WHEN: Mapping[str, str] = {
    "instrument": "When the recorded perturbation is used as the instrument",
    "small_bias": "When the bias by the loop is small",
    "in_interval": "When the intervals include the bias",
    "first_order": "When the intervals include the bias to the first order only",
    "negligible": "When the effect is negligible",
    "unknown": "When the bias cannot be computed",
    "not_known": "When the controller is not known",
    "at_rest": "When the joint did not move",
    "chance": "When it may be due to chance",
    "too_much": "When more was active than may be left out",
    "noise": "When not all of the intervals lie below zero",
    "reaction": "When all of the intervals lie below zero",
    "of_settings": "When the drive is that of the settings",
    "unknown_drive": "When the drive is not known",
    "friction": "When the drive may have friction",
    "as_sampled": "When the torque is used as it was sampled",
    "several": "When several terms are missing",
    "answered": "When J, B and K are those beside it",
    "beside": "When they are, without a recorded perturbation",
    "motion": "Without a recorded perturbation",
    "withheld": "When something else follows the perturbation as well",
    "coupling": "When the coupling is compliant",
    "shown": "When the recording shows the controller",
    "per_degree": "When the settings seem to be per degree",
    "per_degree_twice": "When the settings seem to be multiplied by 57.3",
    "left_out": "When that part is left out",
    "moved": "When leaving it out moves J, B or K beyond its interval",
    "locked": "When the muscle follows the motion",
    "followed": "When the drive was identified",
    "velocity": "When the velocity fits worse",
    "angle": "When the angle fits worse",
    "flagged": "When the epochs of one condition have a finding",
    "degrees": "When degrees may have been read as radians",
    "hides": "When no difference is found",
    "held": "When the interval holds a difference worth finding",
    "values": "When there are too few values for any test",
    "negative": "When some values of a table are negative",
    "zero": "When the reference is 0",
    "together": "When all epochs of a condition have it together",
}
"""When a variant of the words is used."""

NO_CHANGE = 0.05
"""In %: less is shown as 0."""

MOST_CHANGE = 100.0
"""In %: more is shown as that, for it is a share of what is left of J, B or K without the effect,
which is then small and itself not known."""


class Words(NamedTuple):
    """Headline (at most 15 words), details (at most 60) and remedy (one sentence, or empty)."""

    headline: str
    details: str
    remedy: str


def words_of(name: str, facts: Mapping[str, Any]) -> Words:
    """Return the words of a finding.

    Parameters
    ----------
    name : str
        Of its kind. A kind that is not known, or a finding without what the templates show, is
        told by its numbers.
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
    """Return the words of a kind with its example, usual ones first, and when each are used."""
    shown = {**EXAMPLE, **kind.example, "unit": kind.unit}
    found = []
    for variant in ("", *kind.variants):
        when = WHEN.get(variant, f"When it is {variant}") if variant else "For example"
        facts = {**shown, **kind.examples.get(variant, {}), "variant": variant}
        found.append((when, words_of(kind.name, facts)))
    return found


def _shown(facts: Mapping[str, Any]) -> dict[str, Any]:
    shown: dict[str, Any] = {}
    for name, fact in facts.items():
        shown[name] = Shown(fact) if isinstance(fact, float) else fact
    if isinstance(shown.get("value"), Shown):
        shown["value"].limit = float(facts.get("limit", math.nan))
    for name in ("p", "remains"):
        if math.isfinite(facts.get(name, math.nan)):
            shown[name] = p_text(facts[name])
    if "percent_of" in facts:
        shown["changes"] = ", ".join(
            f"{symbol} {_change(percent)} %"
            for symbol, percent in zip("JBK", facts["percent_of"], strict=True)
            if math.isfinite(percent)
        )
    return shown


def _change(percent: float) -> str:
    if abs(percent) > MOST_CHANGE:
        side = "above" if percent > 0 else "below"
        return f"{side} {Shown(math.copysign(MOST_CHANGE, percent)):+.0f}"
    return "0" if abs(percent) < NO_CHANGE else f"{Shown(percent):+.2g}"


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
