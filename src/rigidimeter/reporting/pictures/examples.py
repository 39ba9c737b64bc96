"""Epochs that stand for their condition: perturbation, torque and loops."""

from __future__ import annotations

import math

from rigidimeter.estimation import Signals, epoch_signals, scoring_cycles
from rigidimeter.records import Channel, Epoch, Fit
from rigidimeter.reporting.figures import (
    condition_colours,
    loop,
    loop_limits,
    perturbation,
    spectrum,
    torque_limit_nm,
    torque_parts,
)
from rigidimeter.reporting.measures import condition_name, short_names
from rigidimeter.reporting.numbers import number
from rigidimeter.reporting.pictures.stored_figure import (
    Picture,
    analysed_epoch,
    drawn,
    origin_s,
    place,
    representative_fits,
    representatives,
    slug,
)
from rigidimeter.study import StudyResult

__all__ = ["loop_pictures", "perturbation_pictures", "torque_pictures"]

TORQUE_WINDOW_S = 7.0
"""How much of an epoch the torque figures show: more would be too dense to read."""


def perturbation_pictures(study: StudyResult) -> list[Picture]:
    """Return the perturbation of one epoch and its spectrum, if any was recorded."""
    shown = [epoch for fit in representative_fits(study) if (epoch := analysed_epoch(study, fit))]
    for epoch in (*shown, *study.epochs):
        channel = _perturbation(epoch)
        if channel is not None:
            break
    else:
        return []
    prbs = study.settings.prbs
    low, high = epoch.excitation_hz or (prbs.wanted_low_hz, prbs.wanted_high_hz)
    where = short_names(one.source for one in study.epochs)[epoch.source]
    whose = f"of epoch {epoch.label} of {where} ({condition_name(epoch.condition)})"
    size = float(max(abs(channel.values)))
    return [
        Picture(
            "perturbation",
            drawn(study, perturbation(channel, origin_s(epoch))),
            f"Torque perturbation {whose}: it switches between levels up to {number(size)} N·m "
            f"for {number(channel.time_s[-1] - channel.time_s[0])} s.",
            f"The torque perturbation as commanded, {whose}.",
        ),
        Picture(
            "perturbation_spectrum",
            drawn(study, spectrum(channel, (low, high))),
            f"Power spectral density of the perturbation with the wanted band, {low:g} to "
            f"{high:g} Hz, marked.",
            f"Its power spectral density (Hann-windowed periodogram of the whole), the wanted "
            f"band of {low:g} to {high:g} Hz marked.",
        ),
    ]


def _perturbation(epoch: Epoch) -> Channel | None:
    """Return the perturbation if there is enough of it to draw."""
    channel = epoch.channels.get("perturbation_nm")
    if channel is None or len(channel) < 16:
        return None
    low, high = float(min(channel.values)), float(max(channel.values))
    return channel if math.isfinite(high - low) and high > low else None


def torque_pictures(study: StudyResult) -> list[Picture]:
    """Return measured and modelled torque of a representative epoch of each condition."""
    colours = condition_colours(study.condition_names)
    found = [
        (fit, epoch, epoch_signals(epoch, fit.method, study.settings.estimation))
        for fit in representative_fits(study)
        if (epoch := analysed_epoch(study, fit)) is not None
    ]
    limit_nm = max(
        (torque_limit_nm(signals, fit, TORQUE_WINDOW_S) for fit, _, signals in found), default=0.0
    )
    pictures = []
    for position, (fit, epoch, signals) in enumerate(found, start=1):
        figure = torque_parts(
            signals,
            fit,
            colours[fit.condition],
            origin_s=origin_s(epoch),
            window_s=TORQUE_WINDOW_S,
            limit_nm=limit_nm,
            perturbation=_perturbation(epoch),
        )
        name = condition_name(fit.condition)
        pictures.append(
            Picture(
                f"torque_{position}_{slug(fit.condition)}",
                drawn(study, figure),
                f"{name}: measured and modelled torque of epoch {fit.epoch}, and the parts of "
                f"inertia, damping and stiffness. VAF {number(fit.vaf_percent)} %.",
                f"{name}: {place(study, fit)}, an included epoch with a middle VAF "
                f"({number(fit.vaf_percent)} %); its first {TORQUE_WINDOW_S:g} s in the band "
                f"{_hz(signals.band_hz)}{_fitted_elsewhere(signals, fit)}.",
            )
        )
    return pictures


def _hz(band_hz: tuple[float, float]) -> str:
    return f"{number(band_hz[0], 3)} to {number(band_hz[1], 3)} Hz"


def _fitted_elsewhere(signals: Signals, fit: Fit) -> str:
    """Return the band of the fit where it is not the one that is drawn."""
    if fit.band_hz == signals.band_hz:
        return ""
    return f"; fit and VAF are of the lines from {_hz(fit.band_hz)}"


def loop_pictures(study: StudyResult) -> list[Picture]:
    """Return the torque-angle loops of a representative sinusoid epoch of each condition."""
    colours = condition_colours(study.condition_names)
    chosen = representatives(study, study.analysis.scores, lambda score: score.work_j)
    found = [
        (score, scoring_cycles(epoch, study.settings.scores))
        for score in chosen
        if (epoch := analysed_epoch(study, score)) is not None
    ]
    if not found:
        return []
    limits = loop_limits(cycles for _, cycles in found)
    pictures = []
    for position, (score, cycles) in enumerate(found, start=1):
        name = condition_name(score.condition)
        work = f"{number(score.work_j)} J"
        pictures.append(
            Picture(
                f"loop_{position}_{slug(score.condition)}",
                drawn(study, loop(cycles, colours[score.condition], limits, f"{work} per cycle")),
                f"{name}: torque against angle of epoch {score.epoch}, {cycles.n_cycles} cycles "
                f"at {number(cycles.frequency_hz, 3)} Hz, work {work} per cycle.",
                f"{name}: {place(study, score)}, an included epoch with a middle work; "
                f"{cycles.n_cycles} cycles.",
            )
        )
    return pictures
