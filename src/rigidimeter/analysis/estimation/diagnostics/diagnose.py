"""Every check, and what those find that an epoch allows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rigidimeter.analysis.estimation.bandlimited import bandlimited_signals
from rigidimeter.analysis.estimation.diagnostics.channel_checks import CHANNEL_CHECKS
from rigidimeter.analysis.estimation.diagnostics.check_record import Case, Check, Look
from rigidimeter.analysis.estimation.diagnostics.computed_torque_checks import (
    COMPUTED_TORQUE_CHECKS,
    STATIC_TORQUE_CHECKS,
)
from rigidimeter.analysis.estimation.diagnostics.controller_checks import CONTROLLER_CHECKS
from rigidimeter.analysis.estimation.diagnostics.delay_check import DELAY_CHECKS
from rigidimeter.analysis.estimation.diagnostics.drive_check import DRIVE_CHECKS
from rigidimeter.analysis.estimation.diagnostics.excitation_checks import EXCITATION_CHECKS
from rigidimeter.analysis.estimation.diagnostics.fit_checks import PARAMETER_CHECKS, RESIDUAL_CHECKS
from rigidimeter.analysis.estimation.diagnostics.least_squares_checks import (
    LEAST_SQUARES_CHECKS,
    unbiased,
)
from rigidimeter.analysis.estimation.diagnostics.missing_term import MISSING_TERM_CHECKS
from rigidimeter.analysis.estimation.diagnostics.motion_checks import MOTION_CHECKS
from rigidimeter.analysis.estimation.diagnostics.movement_checks import MOVEMENT_CHECKS
from rigidimeter.analysis.estimation.diagnostics.tremor_check import TREMOR_CHECKS
from rigidimeter.analysis.estimation.diagnostics.varying_selection import VARYING_CHECKS
from rigidimeter.analysis.estimation.found import in_half_intervals
from rigidimeter.analysis.estimation.methods import method_named
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Delay, Fit, Outcome
from rigidimeter.core.units import rad_from_deg

CHECKS: list[Check] = [
    *COMPUTED_TORQUE_CHECKS,
    *CHANNEL_CHECKS,
    *MOTION_CHECKS,
    *EXCITATION_CHECKS,
    *STATIC_TORQUE_CHECKS,
    *RESIDUAL_CHECKS,
    *MISSING_TERM_CHECKS,
    *LEAST_SQUARES_CHECKS,
    *MOVEMENT_CHECKS,
    *TREMOR_CHECKS,
    *VARYING_CHECKS,
    *PARAMETER_CHECKS,
    *CONTROLLER_CHECKS,
    *DELAY_CHECKS,
    *DRIVE_CHECKS,
]
"""Every check of an epoch. Code from outside the package may append its own."""


def diagnose(
    case: Case, seen: Mapping[str, Look | None] | None = None, checks: Sequence[Check] = CHECKS
) -> tuple[Finding, ...]:
    """Return what the checks found for which there is something to look at.

    What several epochs show together is found by `together.checked_together` and, for
    `varying_between_epochs`, where they are fitted together.

    Parameters
    ----------
    case : Case
    seen : mapping of str to Look, optional
        What the checks of the epoch alone have seen already, by name.
    checks : sequence of Check
    """
    seen = seen or {}
    looks = ((one, seen[one.name] if one.name in seen else one.looks(case)) for one in checks)
    return tuple(one.finding(look, case) for one, look in looks if look is not None and look.failed)


def checked(
    prepared: PreparedEpoch,
    fit: Fit,
    delays: Sequence[Delay] = (),
    *,
    exclusions_alone: bool = False,
    by_noise: bool = True,
) -> Fit:
    """Return the fit with what the checks found, excluded if one of them says so.

    Parameters
    ----------
    prepared : PreparedEpoch
    fit : Fit
    delays : sequence of Delay
        Of the torque of all sources.
    exclusions_alone : bool
        Run those checks alone that may exclude the epoch.
    by_noise : bool
        False where J, B and K are used with others by least squares without weights.
    """
    fit = replace(fit, activity=prepared.activity)
    if fit.n_samples == 0 or prepared.obstacle:
        return fit  # the fit has said why
    method = method_named(fit.method)
    by_noise = by_noise and method.by_noise
    case = replace(
        _case(prepared, fit.value),
        fit=fit,
        method=method,
        unbiased=None if method.uses_perturbation else unbiased(prepared, fit, by_noise),
        bias_in_interval=by_noise,
        delay=next((delay for delay in delays if delay.source == fit.source), None),
    )
    levels = case.settings.levels
    checks = [
        one
        for one in CHECKS
        if not exclusions_alone or one.may_exclude or levels.of(one.name) == "exclude"
    ]
    findings = diagnose(case, prepared.once(_seen_without_fit), checks)
    serious = [finding for finding in findings if finding.level == "exclude"]
    outcome = fit.outcome
    if serious and outcome.included:
        said = serious[0].words
        outcome = Outcome("excluded", f"{said.headline}. {said.remedy}".rstrip(". "))
    return in_half_intervals(replace(fit, outcome=outcome, findings=(*fit.findings, *findings)))


def _case(prepared: PreparedEpoch, parameters: Array) -> Case:
    epoch, settings = prepared.epoch, prepared.settings
    from_session = epoch.excitation_hz is not None
    limit_rad = rad_from_deg(settings.guard.position_limit_deg) if from_session else None
    signals = prepared.signals(bandlimited_signals)
    return Case(epoch, signals, parameters, settings.diagnostics, limit_rad, prepared=prepared)


def _seen_without_fit(prepared: PreparedEpoch) -> dict[str, Look | None]:
    """Return what the checks see that do not look at J, B and K."""
    case = _case(prepared, np.full(3, np.nan))
    return {check.name: check.looks(case) for check in CHECKS if not check.of_fit}
