"""Whether the joint stayed the same within the epoch: J, B and K with time, angle and phase."""

from __future__ import annotations

from functools import partial

from rigidimeter.analysis.estimation.between_epochs import also
from rigidimeter.analysis.estimation.diagnostics.check_record import Case, Check, Look
from rigidimeter.analysis.estimation.diagnostics.missing_term import terms_found
from rigidimeter.analysis.estimation.diagnostics.varying_lines import varying_lines
from rigidimeter.analysis.estimation.diagnostics.varying_selection import Variation, variation
from rigidimeter.core.findings import Fact
from rigidimeter.core.records import PARAMETERS
from rigidimeter.core.settings import DiagnosticsSettings

WITH_ANGLE = "varying_with_angle"


def varying_look(name: str, found: Variation, settings: DiagnosticsSettings) -> Look | None:
    """Return how far the parameters go with one thing, in % of their means."""
    if name not in found.p:
        return None
    most = settings.max_varying_percent
    changes = sorted(found.changes.get(name, []), key=lambda change: -change.percent)
    if not changes or not changes[0].percent > most:
        return Look(changes[0].percent if changes else 0.0, most, False, p=found.p[name])
    first, *others = (change for change in changes if change.percent > most)
    about = PARAMETERS[first.parameter]
    facts: dict[str, Fact] = {
        "symbol": about.symbol,
        "size_unit": about.unit,
        "low": first.low,
        "low_half": first.low_half,
        "low_at": first.low_at,
        "high": first.high,
        "high_half": first.high_half,
        "high_at": first.high_at,
        "others": also([PARAMETERS[change.parameter].symbol for change in others]),
    }
    return Look(first.percent, most, True, facts, p=first.p)


def _variation(case: Case) -> Variation | None:
    """Return what varies within the epoch; None where that cannot be tested."""
    if case.prepared is None:
        return None
    try:
        lines = varying_lines(case.prepared, case.parameters)
        return variation(lines, case.settings.varying_chance)
    except ValueError:
        return None


def _look(case: Case, name: str) -> Look | None:
    found = case.once(_variation)
    look = None if found is None else varying_look(name, found, case.settings)
    if look is None or not look.failed or name != WITH_ANGLE or not (terms := terms_found(case)):
        return look
    return look._replace(facts={**look.facts, "terms": terms}, variant="with_term")


VARYING_CHECKS = tuple(
    Check(name, (), partial(_look, name=name))
    for name in ("varying_with_time", WITH_ANGLE, "varying_with_phase")
)
"""The checks of a joint that varies within an epoch."""
