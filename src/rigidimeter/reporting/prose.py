"""The methods of a study as a paragraph for a paper, made of facts of this study alone.

What the recordings and settings do not say is not said: controller, perturbation and limits are
left out where an epoch was not recorded by this program's own loop, a test that was not made has no
sentence, and only what is named is cited.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rigidimeter import __version__
from rigidimeter.records import Epoch, Fit
from rigidimeter.reporting.measures import condition_name
from rigidimeter.reporting.methods import method_of
from rigidimeter.reporting.numbers import number
from rigidimeter.reporting.prose_statistics import rating_sentences, test_sentences
from rigidimeter.reporting.references import Cited, Prose
from rigidimeter.settings import Settings
from rigidimeter.study import Condition, StudyResult

__all__ = ["methods_prose"]


By = Literal["protocol", "check", "estimate", "operator"]


@dataclass(frozen=True)
class _Facts:
    """What the sentences draw on."""

    study: StudyResult
    perturbed: tuple[Epoch, ...]
    imposed: tuple[Epoch, ...]

    @property
    def settings(self) -> Settings:
        return self.study.settings


def methods_prose(study: StudyResult) -> Prose:
    """Return the paragraph of methods with its references."""
    scored = {(score.source, score.epoch) for score in study.analysis.scores}
    facts = _Facts(
        study,
        tuple(e for e in study.epochs if (e.source, e.label) not in scored),
        tuple(e for e in study.epochs if (e.source, e.label) in scored),
    )
    cite = Cited()
    paragraphs = [
        [*_design(facts), *_conditions(facts)],
        [*_perturbation(facts, cite), *_rates(facts), *_limits(facts)],
        [*_estimation(facts, cite), *_scores(facts)],
        _exclusions(facts),
        [*rating_sentences(study, cite), *test_sentences(study, cite)],
        _software(facts),
    ]
    return Prose(
        tuple(" ".join(sentences) for sentences in paragraphs if sentences),
        tuple(reference.full for reference in cite.found.values()),
    )


def _plural(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


_WORDS = ("No", "One", "Two", "Three", "Four", "Five", "Six", "Seven", "Eight", "Nine", "Ten")


def _counted(count: int, noun: str) -> str:
    """Return a count as a sentence begins with it."""
    word = _WORDS[count] if count < len(_WORDS) else str(count)
    return f"{word} {noun}{'' if count == 1 else 's'}"


def _design(facts: _Facts) -> list[str]:
    study = facts.study
    subjects = {s.subject for s in study.sessions}
    days = {(s.subject, s.day) for s in study.sessions}
    each = [
        f"{_plural(len(own), 'day')} in {condition_name(c.name)}"
        for c in study.conditions
        if (own := {(s.subject, s.day) for s in study.sessions if s.condition == c.name})
    ]
    visits = {(s.subject, s.day, s.condition) for s in study.sessions}
    if len(each) > 1 and len(visits) > len(days):
        each.append(f"{len(visits) - len(days)} of them in more than one condition")
    split = f" ({', '.join(each)})" if len(each) > 1 else ""
    who = _counted(len(subjects), "virtual subject" if study.virtual else "subject")
    verb = "was" if len(subjects) == 1 else "were"
    sentences = [
        f"{who} {verb} measured on {_plural(len(days), 'day')}{split}, in "
        f"{_plural(len(study.sessions), 'session')}; "
        f"{_plural(len(facts.perturbed), 'epoch')} with a torque perturbation and "
        f"{_plural(len(facts.imposed), 'epoch')} with an imposed sinusoid were recorded."
    ]
    if study.virtual:
        sentences.append(
            "All data were made by a simulation of joint, robot and sensors; nobody was measured."
        )
    if study.blinded:
        sentences.append(
            "The analysis was made blinded: conditions are codes, and the key was not used."
        )
    return sentences


def _conditions(facts: _Facts) -> list[str]:
    if facts.study.blinded:
        return []  # a code must not be told by its stimulation
    told = [text for c in facts.study.conditions if (text := _stimulation(c))]
    return [f"Conditions: {'; '.join(told)}."] if told else []


def _stimulation(c: Condition) -> str:
    parts = [c.title] if c.title else []
    if c.frequency_hz is not None:
        parts.append(f"{c.frequency_hz:g} Hz")
    if c.amplitude is not None:
        parts.append(f"{c.amplitude:g} {c.amplitude_unit}".rstrip())
    if c.pulse_width_us is not None:
        parts.append(f"pulse width {c.pulse_width_us:g} µs")
    if c.electrodes:
        parts.append(f"electrodes {c.electrodes}")
    if c.wash_in_min is not None:
        parts.append(f"wash-in {c.wash_in_min:g} min")
    return f"{condition_name(c.name)}, {', '.join(parts)}" if parts else ""


def _own(epochs: Sequence[Epoch]) -> bool:
    """Return whether this program's loop recorded them, so that its settings say how."""
    return bool(epochs) and all(e.excitation_hz is not None or e.motion is not None for e in epochs)


def _perturbation(facts: _Facts, cite: Cited) -> list[str]:
    if not _own(facts.perturbed):
        return []
    prbs, controller = facts.settings.prbs, facts.settings.controller
    return [
        f"Each perturbation epoch gave the joint a pseudo-random binary torque of "
        f"±{prbs.amplitude_nm:g} N·m for {prbs.duration_s:g} s, a maximal-length sequence of "
        f"{2**prbs.register_bits - 1} chips at {prbs.clock_hz:g} Hz made for "
        f"{prbs.wanted_low_hz:g} to {prbs.wanted_high_hz:g} Hz. An admittance controller left the "
        f"joint free to move {cite('paper')}: torque, low-passed at "
        f"{controller.torque_cutoff_hz:g} Hz, was turned into a velocity command by a virtual "
        f"inertia of {number(controller.inertia_kg_m2, 3)} kg·m² and a virtual damping of "
        f"{number(controller.damping_nm_s_rad, 4)} N·m·s/rad, without stiffness."
    ]


def _rates(facts: _Facts) -> list[str]:
    names = {"torque_nm": "torque", "angle_rad": "angle", "velocity_rad_s": "velocity"}
    rates: dict[str, list[str]] = {}
    for channel, name in names.items():
        found = [
            rate
            for epoch in facts.study.epochs
            if channel in epoch.channels
            and math.isfinite(rate := epoch.channels[channel].mean_rate_hz)
        ]
        if found:
            rates.setdefault(f"{float(np.median(found)):.3g}", []).append(name)
    if not rates:
        return []
    parts = [f"{_series(group)} at {rate} samples/s" for rate, group in rates.items()]
    return [f"Recorded were {', '.join(parts)}."]


def _series(items: Sequence[str]) -> str:
    return " and ".join([", ".join(items[:-1]), items[-1]] if len(items) > 1 else items)


def _limits(facts: _Facts) -> list[str]:
    if not _own(facts.study.epochs):
        return []
    guard = facts.settings.guard
    return [
        f"A guard between controller and drive held the angle within ±{guard.position_limit_deg:g} "
        f"deg, the speed below {guard.speed_limit_deg_s:g} deg/s and the acceleration below "
        f"{guard.acceleration_limit_deg_s2:g} deg/s², held still above {guard.torque_limit_nm:g} "
        f"N·m or {guard.power_limit_w:g} W, and stopped above {guard.torque_stop_nm:g} N·m."
    ]


def _estimation(facts: _Facts, cite: Cited) -> list[str]:
    analysis = facts.study.analysis
    if not analysis.fits:
        return []
    band = _band(analysis.fits)
    method = method_of(analysis.method)
    how = f"by the method “{analysis.method}”"
    if method is not None:
        how = " ".join(
            [method.methods_text, *([cite(*method.references)] * bool(method.references))]
        )
    sentences = [
        f"Inertia J, viscous damping B and stiffness K of J θ″ + B θ′ + K θ = M were estimated "
        f"epoch by epoch {how}{band}."
    ]
    corrected = [delay for delay in analysis.delays if delay.corrected]
    if corrected:
        sentences.append(
            f"The torque was first shifted by its estimated delay in {len(corrected)} of "
            f"{_plural(len(analysis.delays), 'session')}."
        )
    if math.isfinite(analysis.inertia_kg_m2) or facts.study.several_subjects:
        of_whom = (
            "of the same subject in all conditions"
            if facts.study.several_subjects
            else f"of all conditions ({number(analysis.inertia_kg_m2)} kg·m²)"
        )
        sentences.append(
            f"J was then held at its median over all included epochs {of_whom}, and "
            f"B and K were estimated again, as by {cite.by_name('paper')}; those are compared."
        )
    return sentences


def _band(fits: Iterable[Fit]) -> str:
    bands = {fit.band_hz for fit in fits if all(map(math.isfinite, fit.band_hz))}
    if len(bands) != 1:
        return ""
    ((low, high),) = bands
    return f" in the band of {low:.3g} to {high:.3g} Hz"


def _scores(facts: _Facts) -> list[str]:
    scores = facts.study.analysis.scores
    if not scores:
        return []
    settings = facts.settings.scores
    cycles = sorted({score.n_cycles for score in scores if score.outcome.included})
    count = f"{cycles[0]} cycles" if len(cycles) == 1 else "all whole cycles"
    imposed = ""
    if _own(facts.imposed):
        sinusoid = facts.settings.sinusoid
        imposed = (
            f" of ±{sinusoid.amplitude_deg:g} deg at {sinusoid.frequency_hz:g} Hz for "
            f"{sinusoid.motion_s:g} s"
        )
    return [
        f"Epochs with an imposed sinusoid{imposed} gave the angular impulse and the work per "
        f"cycle, means over {count} of torque in the band of {settings.band_low_hz:g} to "
        f"{settings.band_high_hz:g} Hz."
    ]


def _exclusions(facts: _Facts) -> list[str]:
    out = facts.study.exclusions
    total = len(facts.study.epochs)
    if not total:
        return []
    if not out:
        return [f"All {_plural(total, 'epoch')} count; none was excluded."]
    who = Counter({(e.source, e.epoch): e.by for e in out}.values())
    names: dict[By, str] = {
        "protocol": "not ended with success",
        "check": "refused by a check",
        "estimate": "without a valid estimate",
        "operator": "excluded by the operator",
    }
    parts = [f"{who[by]} {text}" for by, text in names.items() if who[by]]
    count = sum(who.values())
    return [
        f"Of {_plural(total, 'epoch')} {count} {'does' if count == 1 else 'do'} not count: "
        f"{', '.join(parts)}."
    ]


def _software(facts: _Facts) -> list[str]:
    libraries = facts.study.provenance.get("libraries", "")
    return [
        f"Everything was computed with rigidimeter {__version__}"
        + (f" ({libraries})" if libraries else "")
        + "."
    ]
