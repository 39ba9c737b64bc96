"""Which model: fitted on the first part of a recording, judged on the rest.

More terms always fit better; they predict better only if they are there. Among the models whose
held-out residual variance is within 5 % of the least, the one with the fewest parameters is
recommended.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from rigidimeter.estimation.bandlimited import band_hz, bandlimited_signals
from rigidimeter.estimation.diagnostics import reconstructed_torque_nm
from rigidimeter.estimation.diagnostics.movement_checks import voluntary_torque
from rigidimeter.estimation.methods import fit_epoch
from rigidimeter.estimation.screening import before_fit
from rigidimeter.estimation.signals import Signals, motion_channels
from rigidimeter.estimation.terms.catalogue import REFLEXES, parse_terms
from rigidimeter.estimation.terms.reflex import REFLEX_KINDS
from rigidimeter.estimation.terms.term_fit import TermsFit, fit_terms, predicted_vaf_percent
from rigidimeter.estimation.terms.wideband import wideband_signals
from rigidimeter.records import Epoch
from rigidimeter.settings import USABLE_FRACTION_OF_RATE, Settings

BASE = ("inertia", "damping", "stiffness")

NEARLY_AS_GOOD = 1.05
"""Held-out residual variance, over the least, up to which fewer parameters are preferred."""

SMALL_P = 0.01


@dataclass(frozen=True)
class ModelRow:
    """One model: its fit, and where models are compared the VAF of what it predicts.

    `fit` is None where the model could not be fitted; `problem` then says why.
    """

    terms: tuple[str, ...]
    fit: TermsFit | None
    held_out_vaf_percent: float = math.nan
    problem: str = ""


@dataclass(frozen=True)
class Comparison:
    """A row for each model, the recommended one among them (None if no model could be fitted)."""

    rows: tuple[ModelRow, ...]
    recommended: ModelRow | None
    reason: str


class EpochModels(NamedTuple):
    """The models of one epoch, and the band they were fitted in."""

    band_hz: tuple[float, float]
    compared: Comparison


def candidates(terms: Sequence[str]) -> list[tuple[str, ...]]:
    """Return models from J, B, K up to the named terms: alone, with each further one, with all.

    A reflex named without its dynamics is tried with each.
    """
    terms = parse_terms(terms)
    base = tuple(name for name in terms if name in (*BASE, "offset")) or terms[:1]
    more = [name for name in terms if name not in base]
    plain = [name for name in more if name.rstrip("+-") == "reflex"]
    more += [name.replace("reflex", kind) for name in plain for kind in REFLEX_KINDS[1:]]
    steps = [base, *((*base, name) for name in more), terms]
    return list(dict.fromkeys(steps))


def compare_models(
    motion: Signals,
    models: Sequence[Sequence[str]],
    band_hz: tuple[float, float],
    trim_s: float = 1.0,
) -> Comparison:
    """Fit each model on the first half, predict the second, and recommend one.

    Parameters
    ----------
    motion : Signals
        Wide-band.
    models : sequence of sequences of str
        The terms of each.
    band_hz, trim_s
        As for `fit_terms`; the cut between the halves is trimmed on both sides.
    """
    half = round(0.5 * motion.time_s.size)
    first, rest = _part(motion, slice(0, half)), _part(motion, slice(half, None))
    rows = []
    for model in models:
        row = fit_model(first, model, band_hz, trim_s)
        if row.fit is not None:
            row = replace(row, held_out_vaf_percent=predicted_vaf_percent(row.fit, rest))
        rows.append(row)
    return Comparison(tuple(rows), *_recommend(rows))


def fit_model(
    motion: Signals, terms: Sequence[str], band_hz: tuple[float, float], trim_s: float = 1.0
) -> ModelRow:
    """Fit one model; one that cannot be fitted says why."""
    try:
        fit = fit_terms(motion, terms, band_hz, trim_s)
    except ValueError as error:
        return ModelRow(parse_terms(terms), None, problem=str(error))
    return ModelRow(fit.terms, fit)


def model_epoch(
    epoch: Epoch,
    models: Sequence[Sequence[str]],
    settings: Settings,
    *,
    compare: bool = False,
    high_hz: float | None = None,
) -> EpochModels:
    """Fit models to an epoch, or compare them.

    Parameters
    ----------
    epoch : Epoch
        With torque and motion on one clock.
    models : sequence of sequences of str
        The terms of each.
    settings : Settings
    compare : bool
        Fit to the first half, predict the second and recommend a model; else fit to all of it.
    high_hz : float, optional
        The upper edge of a band that begins at 0 Hz, instead of the band of the settings.

    Raises
    ------
    ValueError
        If the epoch cannot be used; the text says why.
    """
    estimation = settings.estimation
    obstacle = before_fit(epoch, estimation)
    if obstacle:
        raise ValueError(obstacle)
    band = band_hz(epoch, estimation)
    if high_hz is not None:
        used = [epoch.channels["torque_nm"], *motion_channels(epoch)]
        slowest_hz = min(channel.rate_hz for channel in used)
        band = (0.0, min(high_hz, USABLE_FRACTION_OF_RATE * slowest_hz))
    motion = wideband_signals(epoch, band[1])
    if not compare:
        rows = (fit_model(motion, model, band, estimation.trim_s) for model in models)
        return EpochModels(band, Comparison(tuple(rows), None, ""))
    compared = compare_models(motion, models, band, estimation.trim_s)
    pushes = _voluntary_torque(epoch, settings)
    if pushes:
        compared = replace(compared, recommended=None, reason=pushes)
    return EpochModels(band, compared)


def _voluntary_torque(epoch: Epoch, settings: Settings) -> str:
    """Return why held-out data cannot choose a model, or an empty text.

    In the closed loop the subject's own torque is in the motion in both halves alike, so a term
    that fits it predicts it too, and says nothing of the joint.
    """
    if "perturbation_nm" not in epoch.channels:
        return ""
    fit = fit_epoch(epoch, "iv", settings)
    if fit.n_samples == 0:
        return ""
    signals = bandlimited_signals(epoch, settings.estimation)
    own_nm = reconstructed_torque_nm(signals, fit.value)
    look = voluntary_torque(own_nm, signals, settings.diagnostics)
    if not look.failed:
        return ""
    return (
        f"{look.value:.2g} % of the torque's variance is the subject's own, which the loop puts "
        "into the motion too; a term that fits it predicts it in both halves and says nothing "
        "about the joint"
    )


def _part(motion: Signals, part: slice) -> Signals:
    return replace(
        motion,
        time_s=motion.time_s[part],
        torque_nm=motion.torque_nm[part],
        acceleration_rad_s2=motion.acceleration_rad_s2[part],
        velocity_rad_s=motion.velocity_rad_s[part],
        angle_rad=motion.angle_rad[part],
    )


def _recommend(rows: Sequence[ModelRow]) -> tuple[ModelRow | None, str]:
    fitted = [(row, row.fit) for row in rows if row.fit is not None]
    if not fitted:
        return None, "no model could be fitted"
    best, _ = max(fitted, key=lambda pair: pair[0].held_out_vaf_percent)
    least = 100.0 - best.held_out_vaf_percent
    good = [
        pair for pair in fitted if 100.0 - pair[0].held_out_vaf_percent <= NEARLY_AS_GOOD * least
    ]
    chosen, fit = min(good, key=lambda pair: (pair[1].n_parameters, pair[1].bic))
    named = "+".join(chosen.terms)
    reason = f"{named}: predicts {chosen.held_out_vaf_percent:.2f} % of the part it has not seen"
    if chosen is not best:
        reason += (
            f", and {'+'.join(best.terms)} with {best.held_out_vaf_percent:.2f} % does not "
            "justify its additional parameters"
        )
    elif len(fitted) > 1:
        second = max(row.held_out_vaf_percent for row, _ in fitted if row is not chosen)
        reason += f", the next best {second:.2f} %"
    if fit.test.input_p < SMALL_P:
        reason += "; its residual still depends on the velocity, so a term may be missing"
    elif not any(name in REFLEXES for name in chosen.terms) and fit.test.ljung_box_p < SMALL_P:
        reason += "; its residual is coloured"
    return chosen, reason
