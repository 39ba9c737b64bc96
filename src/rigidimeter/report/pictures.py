"""Which epochs and numbers each figure of the report shows, and what it says in words."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar

from rigidimeter.estimation import epoch_signals, scoring_cycles
from rigidimeter.records import Channel, Epoch, Fit, Score
from rigidimeter.report.figures import (
    condition_colours,
    distribution,
    loop,
    loop_limits,
    perturbation,
    spectrum,
    svg_text,
    torque_limit_nm,
    torque_parts,
)
from rigidimeter.report.measures import Measure, condition_name, conditions, measures, short_names
from rigidimeter.report.numbers import number, p_and_r
from rigidimeter.statistics import summarise
from rigidimeter.study import Study

__all__ = [
    "Picture",
    "distribution_pictures",
    "loop_pictures",
    "perturbation_pictures",
    "representative_fits",
    "torque_pictures",
]

TORQUE_WINDOW_S = 7.0
"""How much of an epoch the torque figures show: more would be too dense to read."""


@dataclass(frozen=True)
class Picture:
    """A figure as it is stored: file name without suffix, SVG, alternative text, caption."""

    name: str
    svg: str
    alt: str
    caption: str


def distribution_pictures(study: Study) -> list[Picture]:
    """Return a figure for each measure that has an included value."""
    colours = condition_colours(conditions(study))
    return [
        Picture(
            f"distribution_{measure.name}",
            svg_text(
                distribution(
                    measure.label,
                    {condition_name(key): values for key, values in measure.values.items()},
                    {condition_name(key): colour for key, colour in colours.items()},
                    _test_remark(study, measure),
                )
            ),
            f"{measure.title}, every included epoch a point. {_in_words(measure)}",
            f"{measure.title}.",
        )
        for measure in measures(study)
        if any(measure.values.values())
    ]


def _test_remark(study: Study, measure: Measure) -> str:
    tests = [c.test for c in study.comparisons if c.measure == measure.name]
    if len(tests) != 1 or tests[0] is None:
        return ""
    return p_and_r(tests[0].p, tests[0].r)


def _in_words(measure: Measure) -> str:
    parts = []
    for condition, values in measure.values.items():
        s = summarise(values)
        numbers = f", median {number(s.median)}, quartiles {number(s.q1)} to {number(s.q3)}"
        parts.append(f"{condition_name(condition)}: n = {s.n}{numbers if s.n else ''}")
    return f"{'; '.join(parts)} ({measure.unit})."


def perturbation_pictures(study: Study) -> list[Picture]:
    """Return the perturbation of one epoch and its spectrum, if any was recorded."""
    shown = [epoch for fit in representative_fits(study) if (epoch := _epoch_of(study, fit))]
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
            svg_text(perturbation(channel, _origin_s(epoch))),
            f"Torque perturbation {whose}: it switches between levels up to {number(size)} N·m "
            f"for {number(channel.time_s[-1] - channel.time_s[0])} s.",
            f"The torque perturbation as commanded, {whose}.",
        ),
        Picture(
            "perturbation_spectrum",
            svg_text(spectrum(channel, (low, high))),
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


def torque_pictures(study: Study) -> list[Picture]:
    """Return measured and modelled torque of a representative epoch of each condition."""
    colours = condition_colours(conditions(study))
    found = [
        (fit, epoch, epoch_signals(epoch, fit.method, study.settings.estimation))
        for fit in representative_fits(study)
        if (epoch := _epoch_of(study, fit)) is not None
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
            origin_s=_origin_s(epoch),
            window_s=TORQUE_WINDOW_S,
            limit_nm=limit_nm,
            perturbation=_perturbation(epoch),
        )
        name = condition_name(fit.condition)
        pictures.append(
            Picture(
                f"torque_{position}_{_slug(fit.condition)}",
                svg_text(figure),
                f"{name}: measured and modelled torque of epoch {fit.epoch}, and the parts of "
                f"inertia, damping and stiffness. VAF {number(fit.vaf_percent)} %.",
                f"{name}: {_place(study, fit)}, an included epoch with a middle VAF "
                f"({number(fit.vaf_percent)} %); its first {TORQUE_WINDOW_S:g} s as fitted, in the "
                f"band {number(fit.band_hz[0], 3)} to {number(fit.band_hz[1], 3)} Hz.",
            )
        )
    return pictures


def loop_pictures(study: Study) -> list[Picture]:
    """Return the torque-angle loops of a representative sinusoid epoch of each condition."""
    colours = condition_colours(conditions(study))
    chosen = _representatives(study, study.analysis.scores, lambda score: score.work_j)
    found = [
        (score, scoring_cycles(epoch, study.settings.scores))
        for score in chosen
        if (epoch := _epoch_of(study, score)) is not None
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
                f"loop_{position}_{_slug(score.condition)}",
                svg_text(loop(cycles, colours[score.condition], limits, f"{work} per cycle")),
                f"{name}: torque against angle of epoch {score.epoch}, {cycles.n_cycles} cycles "
                f"at {number(cycles.frequency_hz, 3)} Hz, work {work} per cycle.",
                f"{name}: {_place(study, score)}, an included epoch with a middle work; "
                f"{cycles.n_cycles} cycles.",
            )
        )
    return pictures


def representative_fits(study: Study) -> list[Fit]:
    """Return for each condition the included fit with the median VAF.

    From the fits at fixed inertia, whose damping and stiffness the report compares; from the free
    fits if there are none.
    """
    analysis = study.analysis
    fixed = _representatives(study, analysis.fixed_inertia, lambda fit: fit.vaf_percent)
    return fixed or _representatives(study, analysis.fits, lambda fit: fit.vaf_percent)


_Result = TypeVar("_Result", Fit, Score)


def _representatives(
    study: Study, results: Iterable[_Result], key: Callable[[_Result], float]
) -> list[_Result]:
    """Return for each condition the included result with the median (lower middle) key."""
    results = list(results)
    chosen = []
    for condition in conditions(study):
        ranked = sorted(
            (r for r in results if r.condition == condition and r.outcome.included), key=key
        )
        if ranked:
            chosen.append(ranked[(len(ranked) - 1) // 2])
    return chosen


def _epoch_of(study: Study, result: Fit | Score) -> Epoch | None:
    for epoch in study.epochs:
        if (epoch.source, epoch.label) == (result.source, result.epoch):
            return epoch
    return None


def _place(study: Study, result: Fit | Score) -> str:
    """Return epoch and source: labels repeat from one session to the next."""
    names = short_names(epoch.source for epoch in study.epochs)
    return f"epoch {result.epoch} of {names.get(result.source, result.source)}"


def _origin_s(epoch: Epoch) -> float:
    return min(float(channel.time_s[0]) for channel in epoch.channels.values() if len(channel))


def _slug(condition: str) -> str:
    """Return a name that every file system takes; the position beside it keeps names apart."""
    return re.sub(r"[^A-Za-z0-9]+", "-", condition).strip("-").lower()[:40] or "unnamed"
