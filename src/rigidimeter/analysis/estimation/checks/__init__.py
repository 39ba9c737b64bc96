"""What an epoch and its fit show: functions from them to findings, and the level of a finding.

A check returns a list, empty where nothing was found or there is nothing to look at. Torque of the
subject's own comes back by the loop and pulls J, B and K of least squares; whether that matters
is told by `Pull`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rigidimeter.analysis.estimation.grid import Array
from rigidimeter.core.findings import KINDS, UNKNOWN_EFFECT, Effect, Fact, Finding, default_level
from rigidimeter.core.records import Fit
from rigidimeter.core.settings import DiagnosticsSettings

UNKNOWN_WIDTH = 0.1
"""The share of a parameter that stands for half its interval where a method gives none."""

HELD = 0.05
"""Of a parameter: a bias that the interval holds is known to the first order, so that the square of
this share of it is not."""


def half_widths(fit: Fit) -> Array:
    """Return half the 95 % intervals of J, B and K; without intervals `UNKNOWN_WIDTH` of them."""
    half = 0.5 * (fit.high - fit.low)
    return np.where(np.isfinite(half), half, np.abs(fit.value) * UNKNOWN_WIDTH)


class Pull(NamedTuple):
    """What torque that is not the robot's does to an estimate.

    Attributes
    ----------
    bias : array, shape (3,), or None
        By how much J, B and K are off because it comes back by the loop, NaN where it is too much
        to be told; None where no loop is known.
    in_interval : bool
        Whether the intervals hold that bias.
    instruments : bool
        Whether instruments were used: then there is none.
    """

    bias: Array | None = None
    in_interval: bool = False
    instruments: bool = False

    def large(self, fit: Fit, most_percent: float) -> bool:
        """Return whether the bias of J, B or K is more than so many % of half its interval, or NaN.

        One that the interval holds must also be more than `HELD` of the parameter.
        """
        held = HELD * np.abs(fit.value) if self.in_interval else 0.0
        most = np.maximum(most_percent / 100.0 * half_widths(fit), held)
        return self.bias is None or not np.all(np.abs(self.bias) <= most)

    def harmless(self, fit: Fit, settings: DiagnosticsSettings) -> tuple[str, dict[str, Fact]]:
        """Return the variant that says why it does not move the estimate, and what that shows.

        The variant is empty where it does.
        """
        if self.instruments:
            return "instrument", {"method": fit.method}
        half = half_widths(fit)
        if self.bias is None or self.large(fit, settings.max_loop_bias_percent):
            return "", {}
        if not self.in_interval:
            return "small_bias", {"share": float(np.max(100.0 * np.abs(self.bias) / half))}
        # Torque that shows no joint is not the joint's.
        return ("in_interval" if np.all(np.abs(fit.value) > half) else ""), {}

    def told(self, fit: Fit, settings: DiagnosticsSettings, **facts: Fact) -> dict[str, Any]:
        """Return what a finding says of such torque: its harm, its effect, and facts."""
        harmless, why = self.harmless(fit, settings)
        bias = np.zeros(3) if self.instruments else self.bias
        effect = UNKNOWN_EFFECT if bias is None else Effect.of(bias, fit.value, half_widths(fit))
        return {"harmless": harmless, "effect": effect, "facts": facts | why}


def found(
    name: str,
    settings: DiagnosticsSettings,
    value: float,
    limit: float = math.nan,
    *,
    effect: Effect = UNKNOWN_EFFECT,
    facts: Mapping[str, Fact] | None = None,
    variant: str = "",
    harmless: str = "",
    excludes: bool = False,
    **more: Any,
) -> Finding:
    """Return a finding with the level of the settings.

    It is a note where it is known not to matter, unless the settings set another level than the
    default.

    Parameters
    ----------
    name : str
    settings : DiagnosticsSettings
    value, limit, effect, facts
        As for `Finding`.
    variant : str
        Of the wording.
    harmless : str
        The variant that says why it does not move J, B or K by more than their intervals; empty
        where it does.
    excludes : bool
        The numbers mean nothing: by default the epoch is excluded.
    **more
        What else a `Finding` has.
    """
    level = settings.levels.of(name)
    if level == default_level(name):
        if not harmless and effect.negligible:
            harmless = "negligible"
        level = "exclude" if excludes else "note" if harmless else level
    named = " ".join(filter(None, (variant, harmless)))
    shown = {**(facts or {}), **({"variant": named} if named else {})}
    unit = KINDS[name].unit if name in KINDS else ""
    return Finding(name, level, value, limit, unit, effect=effect, facts=shown, **more)


def at_most(
    name: str, settings: DiagnosticsSettings, value: float, most: float, **more: Any
) -> list[Finding]:
    """Return what is `found` where a value is above a limit, or no number."""
    return [] if value <= most else [found(name, settings, value, most, **more)]


def at_least(
    name: str, settings: DiagnosticsSettings, value: float, least: float, **more: Any
) -> list[Finding]:
    """Return what is `found` where a value is below a limit, or no number."""
    return [] if value >= least else [found(name, settings, value, least, **more)]


def in_half_intervals(fit: Fit) -> Fit:
    """Return the fit with its findings as they are told of it.

    Each has the condition of the fit, and the effect that it has in % in half intervals as well.
    """

    def completed(one: Finding) -> Finding:
        one = replace(one, condition=one.condition or fit.condition)
        percent, of_half = one.effect
        if not any(map(math.isfinite, percent)) or any(map(math.isfinite, of_half)):
            return one
        share = np.array(percent) / 100.0
        bias = np.abs(fit.value) * share / (1.0 + share)  # of what they would be without it
        return replace(one, effect=Effect.of(bias, fit.value, half_widths(fit)))

    return replace(fit, findings=tuple(map(completed, fit.findings)))
