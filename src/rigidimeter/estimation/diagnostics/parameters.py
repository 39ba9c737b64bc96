"""Whether a joint can have these numbers."""

from __future__ import annotations

import math

from rigidimeter.estimation.diagnostics.finding_text import judged
from rigidimeter.records import Finding
from rigidimeter.settings import DiagnosticsSettings

__all__ = ["implausible_parameters", "negative_parameters"]

NAMES = ("J", "B", "K")


def negative_parameters(
    parameters: tuple[float, float, float], settings: DiagnosticsSettings
) -> Finding:
    """Return how many of J, B and K are not above zero (none may be)."""
    wrong = [name for name, value in zip(NAMES, parameters, strict=True) if not value > 0]
    value = float(len(wrong))
    turned = len(wrong) == len(NAMES)
    return judged(
        "negative_parameters",
        value,
        0.0,
        settings,
        failed=bool(wrong),
        fact=(
            f"{' and '.join(wrong)} {'is' if len(wrong) == 1 else 'are'} not above zero (0 of 3 "
            "may be)"
            if wrong
            else "J, B and K are above zero"
        ),
        meaning=(
            "the torque has the sign of the joint's reaction"
            if turned
            else "the subject may have pushed, or the channels are late against each other"
        ),
        remedy=(
            "say --reaction"
            if turned
            else "check the stamps of torque and motion, and see the voluntary torque"
        ),
    )


def implausible_parameters(
    parameters: tuple[float, float, float], settings: DiagnosticsSettings
) -> Finding:
    """Return by what factor the worst of J, B and K is outside its range; at most 1 is inside.

    Only sizes are looked at; signs are another check's business.
    """
    J, B, K = (abs(value) for value in parameters)
    factors = {
        f"J = {J:.3g} kg·m² is large": J / settings.inertia_most_kg_m2,
        f"J = {J:.3g} kg·m² is small": settings.inertia_least_kg_m2 / J if J > 0 else math.inf,
        f"B = {B:.3g} N·m·s/rad is large": B / settings.damping_most_nm_s_rad,
        f"K = {K:.3g} N·m/rad is large": K / settings.stiffness_most_nm_rad,
    }
    worst = max(factors, key=lambda text: factors[text])
    value = factors[worst]
    failed = not value <= 1.0
    return judged(
        "implausible_parameters",
        value,
        1.0,
        settings,
        failed=failed,
        fact=(
            f"{worst}, {value:.3g} times the end of its range (at most 1)"
            if failed
            else "J, B and K are of a size that joints have"
        ),
        meaning="no joint of a person or an animal is like that",
        remedy="check the units of torque (N·m) and angle (rad, not degrees) and the time (s)",
    )
