"""Every check, and what those find that an epoch allows."""

from __future__ import annotations

from dataclasses import replace

from rigidimeter.estimation.bandlimited import bandlimited_signals
from rigidimeter.estimation.diagnostics.channel_checks import CHANNEL_CHECKS
from rigidimeter.estimation.diagnostics.check_record import Case, Check
from rigidimeter.estimation.diagnostics.excitation_checks import EXCITATION_CHECKS
from rigidimeter.estimation.diagnostics.fit_checks import PARAMETER_CHECKS, RESIDUAL_CHECKS
from rigidimeter.estimation.diagnostics.movement_checks import MOVEMENT_CHECKS
from rigidimeter.estimation.prepared import PreparedEpoch
from rigidimeter.records import Finding, Fit, Outcome
from rigidimeter.units import rad_from_deg

__all__ = ["CHECKS", "checked", "diagnose"]

CHECKS: list[Check] = [
    *CHANNEL_CHECKS,
    *EXCITATION_CHECKS,
    *RESIDUAL_CHECKS,
    *MOVEMENT_CHECKS,
    *PARAMETER_CHECKS,
]
"""Every check of an epoch. Code from outside the package may append its own."""


def diagnose(case: Case) -> tuple[Finding, ...]:
    """Run every check for which there is something to look at; passed ones are among the findings.

    The one check of several epochs together, `lack_of_fit`, is made where they are fitted together.
    """
    found = []
    for check in CHECKS:
        if all(case.has(name) for name in check.needs):
            look = check.function(case)
            if look is not None:
                found.append(check.finding(look, case.settings))
    return tuple(found)


def checked(prepared: PreparedEpoch, fit: Fit) -> Fit:
    """Return the fit with what the checks found, excluded if one of them says so."""
    epoch, settings = prepared.epoch, prepared.settings
    if fit.n_samples == 0 or prepared.obstacle:
        return fit  # the fit has said why
    signals = prepared.signals(bandlimited_signals)
    from_session = epoch.excitation_hz is not None
    limit_rad = rad_from_deg(settings.guard.position_limit_deg) if from_session else None
    case = Case(epoch, signals, fit.value, settings.diagnostics, position_limit_rad=limit_rad)
    findings = diagnose(case)
    failed = [finding for finding in findings if finding.remedy]
    grave = [finding for finding in failed if finding.level == "exclude"]
    outcome = fit.outcome
    if grave and outcome.included:
        outcome = Outcome("excluded", f"{grave[0].text}; {grave[0].remedy}")
    return replace(fit, outcome=outcome, findings=tuple(failed))
