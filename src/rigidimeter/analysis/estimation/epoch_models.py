"""Torque models of one epoch, behind the checks that an estimate of it has to pass.

Terms are fitted by least squares of the measured motion, which torque of the subject's own biases
in a closed loop, and which do not know how the joint moved between the samples. `estimate` has
neither fault where the perturbation was recorded, so what J, B and K alone come to is compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.estimation.bandlimited import band_hz
from rigidimeter.analysis.estimation.diagnostics import checked
from rigidimeter.analysis.estimation.found import found, half_widths
from rigidimeter.analysis.estimation.methods import choose_method, method_named
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Signals, usable_hz
from rigidimeter.analysis.estimation.stretches import longest_part
from rigidimeter.analysis.estimation.terms import (
    Comparison,
    compare_models,
    fit_model,
    fit_models,
    fit_terms,
    wideband_signals,
)
from rigidimeter.core.findings import Effect, Finding
from rigidimeter.core.records import Fit

REFUSING = ("conditioning",)
"""Checks that forbid a choice of terms though an estimate only needs caution: where J, B
and K cannot be told apart, further terms cannot either."""

JOINT = ("inertia", "damping", "stiffness")

OF_SUBJECT = ("voluntary_torque", "active_movement", "tremor")
"""Checks that find torque of the subject's own."""

APART_PERCENT = 100.0
"""Of half the estimate's 95 % interval."""


class EpochModels(NamedTuple):
    """The models of one epoch, the band they were fitted in, and what the checks found."""

    band_hz: tuple[float, float]
    compared: Comparison
    findings: tuple[Finding, ...]


def model_epoch(
    prepared: PreparedEpoch,
    models: Sequence[Sequence[str]],
    *,
    compare: bool = False,
    grow: bool = False,
    high_hz: float | None = None,
) -> EpochModels:
    """Fit models to an epoch, or compare them.

    Parameters
    ----------
    prepared : PreparedEpoch
        With torque and motion on one clock.
    models : sequence of sequences of str
        The terms of each.
    compare : bool
        Let each model predict what it has not seen, and recommend one.
    grow : bool
        As for `compare_models`.
    high_hz : float, optional
        The upper edge of a band that begins at 0 Hz, instead of the band of the settings.

    Raises
    ------
    ValueError
        If the epoch cannot be used; the text says why. So it is where the subject pushed and
        `estimate` has the recorded perturbation, unless models are compared: that is by what no
        linear loop explains.
    """
    band = _band_hz(prepared, high_hz)
    epoch, estimation = prepared.epoch, prepared.settings.estimation
    # By `iv` they would not be biased by torque of the subject's own, and checks would say so of
    # models that are.
    (fit,), _ = method_named("bandlimited").fit([prepared], None, lambda _: None, False)
    fit = checked(prepared, fit, by_noise=False)
    method, _ = choose_method([prepared])
    pushed = [one for one in fit.findings if one.name in OF_SUBJECT and one.level != "note"]
    if pushed and not compare and method_named(method).uses_perturbation:
        raise ValueError(
            f"{pushed[0].name}: {pushed[0].headline}. Least squares, which fits the terms, would "
            "take that for the joint; use `rigidimeter estimate`, which it does not bias where the "
            "perturbation was recorded, or epochs of a relaxed subject"
        )
    motion = wideband_signals(longest_part(epoch), band[1])
    findings = (*_against_estimate(prepared, motion, method), *fit.findings)
    if not compare:
        fitted = fit_models(motion, models, band, estimation.trim_s)
        return EpochModels(band, fitted, findings)
    compared = compare_models(motion, models, band, estimation.trim_s, grow=grow)
    refused = _refused(fit)
    if refused and compared.recommended is not None:
        compared = replace(compared, recommended=None, reason=refused)
    return EpochModels(band, compared, findings)


def _against_estimate(prepared: PreparedEpoch, motion: Signals, method: str) -> list[Finding]:
    """Return by how much J, B and K alone differ from `estimate`, if by more than its interval.

    Both in one band: what the joint has beside J, B and K, as a reflex, then moves both alike.
    """
    band, trim_s = _band_hz(prepared, None), prepared.settings.estimation.trim_s
    highs = ("band_high_hz", "band_high_unknown_hz", "band_high_closed_loop_hz")
    estimation = prepared.settings.estimation.model_copy(update=dict.fromkeys(highs, band[1]))
    settings = prepared.settings.model_copy(update={"estimation": estimation})
    in_band = replace(prepared, settings=settings)
    (own,), _ = method_named(method).fit([in_band], None, lambda _: None, False)
    try:
        alone = fit_terms(motion, JOINT, band, trim_s)
    except ValueError:
        return []  # the checks of the fit say why
    values, half = np.array([one.value for one in alone.parameters]), half_widths(own)
    percent = 100.0 * float(np.max(np.abs(values - own.value) / half))
    if not percent > APART_PERCENT:
        return []
    effect = Effect.of(values - own.value, values, half)
    return [
        found(
            "differs_from_estimate",
            settings.diagnostics,
            percent,
            APART_PERCENT,
            effect=effect,
            facts={"method": method},
        )
    ]


def clock_of_models(
    aligned: PreparedEpoch,
    recorded: PreparedEpoch,
    models: Sequence[Sequence[str]],
    *,
    high_hz: float | None = None,
) -> tuple[PreparedEpoch, str]:
    """Return the epoch on the clock on which its models explain more of the torque, and a remark.

    The delay of the torque is found with J, B and K alone. Friction and a reflex look like a delay
    to them, so where terms are asked for that may be what was taken for one, both clocks are tried.

    Parameters
    ----------
    aligned, recorded : PreparedEpoch
        With the delay corrected, and as recorded; the same object where there is none.
    models, high_hz
        As for `model_epoch`.

    Raises
    ------
    ValueError
        If the epoch cannot be used; the text says why.
    """
    if aligned is recorded:
        return aligned, ""
    vaf_percent = []
    for prepared in (aligned, recorded):
        band = _band_hz(prepared, high_hz)
        motion = wideband_signals(longest_part(prepared.epoch), band[1])
        trim_s = prepared.settings.estimation.trim_s
        fits = [fit_model(motion, model, band, trim_s).fit for model in models]
        vaf_percent.append(max((fit.vaf_percent for fit in fits if fit), default=0.0))
    if vaf_percent[0] >= vaf_percent[1]:
        return aligned, ""
    first_s = recorded.epoch.channels["torque_nm"].time_s[0]
    delay_ms = 1e3 * (first_s - aligned.epoch.channels["torque_nm"].time_s[0])
    left = [f"{100 - one:.2g} %" for one in vaf_percent]
    return recorded, (
        f"torque as recorded: J, B and K alone would have it {delay_ms:.2g} ms late, but these "
        f"terms leave {left[1]} of its variance as recorded and {left[0]} if it is moved"
    )


def _band_hz(prepared: PreparedEpoch, high_hz: float | None) -> tuple[float, float]:
    if prepared.obstacle:
        raise ValueError(prepared.obstacle)
    if high_hz is None:
        return band_hz(prepared.epoch, prepared.settings.estimation)
    return (0.0, min(high_hz, usable_hz(prepared.epoch)))


def _refused(fit: Fit) -> str:
    """Return why no model may be recommended for an epoch, or an empty text."""
    if fit.outcome.kind in ("excluded", "failed"):
        return f"none of these models is recommended for this epoch: {fit.outcome.reason}"
    for finding in fit.findings:
        if finding.name in REFUSING:
            return f"none of these models is recommended for this epoch: {finding.headline}"
    return ""
