"""Whether the joint stayed the same within the epoch: J, B and K with time, angle and phase."""

from __future__ import annotations

from functools import partial

from rigidimeter.analysis.estimation.between_epochs import in_full, p_text
from rigidimeter.analysis.estimation.diagnostics.check_record import Case, Check, Look
from rigidimeter.analysis.estimation.diagnostics.missing_term import terms_found
from rigidimeter.analysis.estimation.diagnostics.varying_lines import varying_lines
from rigidimeter.analysis.estimation.diagnostics.varying_selection import (
    Change,
    Variation,
    variation,
)
from rigidimeter.core.records import PARAMETERS
from rigidimeter.core.settings import DiagnosticsSettings

WITH_ANGLE = "varying_with_angle"
WITH = {
    "varying_with_time": "time",
    WITH_ANGLE: "the angle",
    "varying_with_phase": "the phase of the movement",
}


def varying_look(name: str, found: Variation, settings: DiagnosticsSettings) -> Look | None:
    """Return how far the parameters go with one thing, in % of their means."""
    if name not in found.p:
        return None
    most = settings.max_varying_percent
    changes = sorted(found.changes.get(name, []), key=lambda change: -change.percent)
    if not changes:
        p = p_text(found.p[name])
        fact = f"no change of J, B or K with {WITH[name]} is beyond chance ({p})"
        return Look(0.0, most, False, fact)
    large = [change for change in changes if change.percent > most]
    text = "; ".join(_sentence(change, most) for change in large or changes[:1])
    return Look(
        changes[0].percent,
        most,
        bool(large),
        f"with {WITH[name]} {text} (at most {most:g} %)",
    )


def _sentence(change: Change, most: float) -> str:
    _, symbol, unit, _ = PARAMETERS[change.parameter]
    return (
        f"{symbol} goes from {change.low:.3g} ± {change.low_half:.2g} {unit} {change.low_at} to "
        f"{change.high:.3g} ± {change.high_half:.2g} {unit} {change.high_at}, a range of "
        f"{in_full(change.percent, '.0f', limit=most)} % of the mean, by chance {p_text(change.p)}"
    )


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
    return look._replace(
        meaning=f"{_OF_NO_ANGLE}; {terms}, which missing_term names, may look like this as well",
        remedy=f"include what missing_term names and see whether J, B and K still change; {_ABOUT}",
    )


_MEANING = "the estimate is a mean over a joint that was not the same throughout, and its interval"
_OF_NO_ANGLE = f"{_MEANING} holds for no angle in particular"
_ABOUT = "use a smaller perturbation about each angle of interest, and state the angle"

VARYING_CHECKS = tuple(
    Check(name, (), partial(_look, name=name), meaning, remedy)
    for name, meaning, remedy in (
        (
            "varying_with_time",
            f"{_MEANING} says nothing of how far it went",
            "cut the epoch into shorter ones, or fit the part in which the joint did not change",
        ),
        (
            WITH_ANGLE,
            _OF_NO_ANGLE,
            _ABOUT,
        ),
        (
            "varying_with_phase",
            f"{_MEANING} holds for no phase in particular",
            "estimate each phase by itself, from many cycles, or hold the joint still",
        ),
    )
)
"""The checks of a joint that varies within an epoch."""
