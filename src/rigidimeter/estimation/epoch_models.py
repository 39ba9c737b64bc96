"""Torque models of one epoch, behind the checks that an estimate of it has to pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from rigidimeter.estimation.bandlimited import band_hz
from rigidimeter.estimation.diagnostics import checked
from rigidimeter.estimation.methods import choose_method, method_named
from rigidimeter.estimation.prepared import PreparedEpoch
from rigidimeter.estimation.signals import motion_channels
from rigidimeter.estimation.stretches import longest_part
from rigidimeter.estimation.terms import Comparison, compare_models, fit_model, wideband_signals
from rigidimeter.records import Finding, Fit
from rigidimeter.settings import USABLE_FRACTION_OF_RATE

REFUSING = ("conditioning",)
"""Checks that forbid a choice of terms though an estimate only is in doubt: where J, B and K cannot
be told apart, further terms cannot either."""


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
        If the epoch cannot be used; the text says why.
    """
    if prepared.obstacle:
        raise ValueError(prepared.obstacle)
    epoch, estimation = prepared.epoch, prepared.settings.estimation
    band = band_hz(epoch, estimation)
    if high_hz is not None:
        used = [epoch.channels["torque_nm"], *motion_channels(epoch)]
        slowest_hz = min(channel.rate_hz for channel in used)
        band = (0.0, min(high_hz, USABLE_FRACTION_OF_RATE * slowest_hz))
    fit = _estimate(prepared)
    motion = wideband_signals(longest_part(epoch), band[1])
    if not compare:
        rows = (fit_model(motion, model, band, estimation.trim_s) for model in models)
        return EpochModels(band, Comparison(tuple(rows), None, ""), fit.findings)
    compared = compare_models(motion, models, band, estimation.trim_s, grow=grow)
    refused = _refused(fit)
    if refused and compared.recommended is not None:
        compared = replace(compared, recommended=None, reason=refused)
    return EpochModels(band, compared, fit.findings)


def _estimate(prepared: PreparedEpoch) -> Fit:
    """Return J, B and K as `estimate` gives them, with what the checks found."""
    name, _ = choose_method([prepared.epoch])
    (fit,), _ = method_named(name).fit([prepared], None, lambda _: None, False)
    return checked(prepared, fit)


def _refused(fit: Fit) -> str:
    """Return why no model may be recommended for an epoch, or an empty text."""
    if fit.outcome.kind in ("excluded", "failed"):
        return f"none of these models is recommended for this epoch: {fit.outcome.reason}"
    for finding in fit.findings:
        if finding.name in REFUSING:
            return f"none of these models is recommended for this epoch: {finding.text}"
    return ""
