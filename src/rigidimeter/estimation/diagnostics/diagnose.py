"""All checks that an epoch allows, and a text that says what they found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from rigidimeter.estimation.bandlimited import bandlimited_signals
from rigidimeter.estimation.diagnostics.channels import (
    frozen,
    guard_limited,
    position_limit,
    saturation,
)
from rigidimeter.estimation.diagnostics.excitation_checks import (
    band_share,
    coherence,
    conditioning,
    imposed_sinusoid,
)
from rigidimeter.estimation.diagnostics.kinematics import (
    velocity_delay,
    velocity_fit,
    velocity_scale,
)
from rigidimeter.estimation.diagnostics.movement import (
    active_movement,
    emg_activity,
    reconstructed_torque_nm,
    voluntary_torque,
)
from rigidimeter.estimation.diagnostics.parameters import (
    implausible_parameters,
    negative_parameters,
)
from rigidimeter.estimation.diagnostics.residuals import (
    held_out_vaf,
    residual_perturbation,
    residual_whiteness,
)
from rigidimeter.estimation.screening import before_fit
from rigidimeter.estimation.signals import Array, Signals
from rigidimeter.records import Epoch, Finding, Fit, Outcome
from rigidimeter.settings import DiagnosticsSettings, Settings
from rigidimeter.units import rad_from_deg

__all__ = ["checked", "diagnose", "summary"]


def diagnose(
    epoch: Epoch,
    signals: Signals,
    parameters: tuple[float, float, float],
    settings: DiagnosticsSettings,
    *,
    residual_nm: Array | None = None,
    limited: ArrayLike | None = None,
    position_limit_rad: float | None = None,
) -> tuple[Finding, ...]:
    """Run every check for which there is something to look at.

    Parameters
    ----------
    epoch : Epoch
        As recorded. Coherence and the residual's correlation need `perturbation_nm`, muscle
        activity `emg_v`.
    signals : Signals
        What was fitted.
    parameters : (float, float, float)
        J in kg·m², B in N·m·s/rad, K in N·m/rad.
    settings : DiagnosticsSettings
    residual_nm : array, shape (n,), optional
        Torque less what was fitted; made from the parameters if not given.
    limited : array, shape (m,), optional
        The recorded column of what the guard changed.
    position_limit_rad : float, optional
        Where the position limit was, each way from angle 0.

    Returns
    -------
    tuple of Finding
        The passed ones among them, in the order: channels, excitation, residual, movement,
        parameters.
    """
    voluntary_nm = reconstructed_torque_nm(signals, parameters)
    if residual_nm is None:
        residual_nm = -voluntary_nm
    cause = epoch.channels.get("perturbation_nm")
    perturbed = cause is not None and len(cause) > 1 and float(np.ptp(cause.values)) > 0.0
    found = [saturation(epoch, settings), frozen(epoch, settings)]
    if {"angle_rad", "velocity_rad_s"} <= set(epoch.channels):
        fitted = velocity_fit(epoch)
        if np.isfinite(fitted).all():  # what does not move is found by others
            found += [velocity_scale(fitted, settings), velocity_delay(fitted, settings)]
    if limited is not None:
        found.append(guard_limited(limited, settings))
    if position_limit_rad is not None and "angle_rad" in epoch.channels:
        found.append(position_limit(epoch.channels["angle_rad"], position_limit_rad, settings))
    found += [
        conditioning(signals, settings),
        imposed_sinusoid(epoch, settings),
        band_share(epoch, signals, settings),
    ]
    if perturbed:
        found.append(coherence(epoch, signals, settings))
    found.append(residual_whiteness(residual_nm, signals, settings))
    if perturbed:
        found.append(residual_perturbation(epoch, residual_nm, signals, settings))
    found += [
        held_out_vaf(signals, settings),
        voluntary_torque(voluntary_nm, signals, settings),
        active_movement(voluntary_nm, signals, settings),
    ]
    if "emg_v" in epoch.channels:
        found.append(emg_activity(epoch.channels["emg_v"], settings))
    found += [
        negative_parameters(parameters, settings),
        implausible_parameters(parameters, settings),
    ]
    return tuple(found)


def summary(findings: Sequence[Finding]) -> str:
    """Return what is wrong, the gravest first, one line for each; or that nothing is.

    A check that passed is only counted.
    """
    failed = [finding for finding in findings if finding.remedy]
    passed = len(findings) - len(failed)
    if not failed:
        return f"all {passed} checks passed"
    order = ("exclude", "doubt", "note")
    lines = [
        f"{finding.level}: {finding.text}. Remedy: {finding.remedy}."
        for finding in sorted(failed, key=lambda finding: order.index(finding.level))
    ]
    return "\n".join([*lines, f"{passed} of {len(findings)} checks passed"])


def checked(epoch: Epoch, fit: Fit, settings: Settings) -> Fit:
    """Return the fit with what the checks found, excluded if one of them says so."""
    if fit.n_samples == 0:
        return fit
    if before_fit(epoch, settings.estimation):
        return fit  # the fit has said why
    signals = bandlimited_signals(epoch, settings.estimation)
    from_session = epoch.excitation_hz is not None
    limit_rad = rad_from_deg(settings.guard.position_limit_deg) if from_session else None
    findings = diagnose(
        epoch,
        signals,
        (fit.inertia_kg_m2, fit.damping_nm_s_rad, fit.stiffness_nm_rad),
        settings.diagnostics,
        position_limit_rad=limit_rad,
    )
    failed = [finding for finding in findings if finding.remedy]
    grave = [finding for finding in failed if finding.level == "exclude"]
    outcome = fit.outcome
    if grave and outcome.included:
        outcome = Outcome("excluded", f"{grave[0].text}; {grave[0].remedy}")
    return replace(fit, outcome=outcome, findings=tuple(failed))
