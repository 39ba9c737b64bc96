"""A finding with its level, which follows what it does to J, B and K."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.findings import KINDS, UNKNOWN_EFFECT, Effect, Fact, Finding, default_level
from rigidimeter.core.records import Fit
from rigidimeter.core.settings import DiagnosticsSettings

UNKNOWN_WIDTH = 0.1
"""The share of a parameter that stands for half its interval where a method gives none."""


def half_widths(fit: Fit) -> Array:
    """Return half the 95 % intervals of J, B and K; without intervals `UNKNOWN_WIDTH` of them."""
    half = 0.5 * (fit.high - fit.low)
    return np.where(np.isfinite(half), half, np.abs(fit.value) * UNKNOWN_WIDTH)


def found(
    name: str,
    settings: DiagnosticsSettings,
    value: float,
    limit: float = math.nan,
    *,
    p: float = math.nan,
    epochs: tuple[str, ...] = (),
    condition: str = "",
    effect: Effect = UNKNOWN_EFFECT,
    facts: Mapping[str, Fact] | None = None,
    variant: str = "",
    harmless: str = "",
    excludes: bool = False,
) -> Finding:
    """Return a finding with the level of the settings.

    It is a note where it is known not to matter, unless the settings set another level than the
    default.

    Parameters
    ----------
    name : str
    settings : DiagnosticsSettings
    value, limit, p, epochs, condition, effect, facts
        As for `Finding`.
    variant : str
        Of the wording.
    harmless : str
        The variant that says why it does not move J, B or K by more than their intervals; empty
        where it does.
    excludes : bool
        The numbers mean nothing: by default the epoch is excluded.
    """
    level = settings.levels.of(name)
    if level == default_level(name):
        if not harmless and effect.negligible:
            harmless = "negligible"
        level = "exclude" if excludes else "note" if harmless else level
    named = " ".join(filter(None, (variant, harmless)))
    shown = {**(facts or {}), **({"variant": named} if named else {})}
    unit = KINDS[name].unit if name in KINDS else ""
    return Finding(name, level, value, limit, unit, p, epochs, condition, effect, shown)


def in_half_intervals(fit: Fit) -> Fit:
    """Return the fit with the effects of its findings in half intervals as well."""

    def completed(one: Finding) -> Finding:
        percent, of_half = one.effect
        if not any(map(math.isfinite, percent)) or any(map(math.isfinite, of_half)):
            return one
        share = np.array(percent) / 100.0
        bias = np.abs(fit.value) * share / (1.0 + share)  # of what they would be without it
        return replace(one, effect=Effect.of(bias, fit.value, half_widths(fit)))

    return replace(fit, findings=tuple(map(completed, fit.findings)))
