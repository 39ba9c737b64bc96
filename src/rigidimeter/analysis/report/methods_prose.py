"""The methods of a study as paragraphs for a paper, made from the facts of this study alone.

What the recordings and settings do not say is left out: controller, perturbation and limits where
an epoch was not recorded by this program's own loop, and tests that were not made.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from rigidimeter.analysis.estimation import METHODS, Method
from rigidimeter.analysis.report.references import Cited, Prose
from rigidimeter.analysis.study import RATING, Condition, StudyResult
from rigidimeter.analysis.study.drawing import channel_facts
from rigidimeter.core.records import WEIGHT_IN_STIFFNESS, Epoch, Fit
from rigidimeter.core.version import __version__
from rigidimeter.core.words import condition_name, number, plural, series


def methods_prose(result: StudyResult) -> Prose:
    """Return the paragraphs of methods with their references."""
    scored = {(score.source, score.epoch) for score in result.analysis.scores}
    perturbed = [e for e in result.epochs if (e.source, e.label) not in scored]
    imposed = [e for e in result.epochs if (e.source, e.label) in scored]
    cite = Cited()
    paragraphs = [
        [*_design(result, len(perturbed), len(imposed)), *_conditions(result)],
        [*_perturbation(result, perturbed, cite), *_rates(result), *_limits(result)],
        [*_estimation(result, cite), *_scores(result, imposed)],
        _exclusions(result),
        [*rating_sentences(result, cite), *test_sentences(result, cite)],
        _software(result),
    ]
    return Prose(
        tuple(" ".join(sentences) for sentences in paragraphs if sentences),
        tuple(reference.full for reference in cite.found.values()),
    )


_WORDS = ("No", "One", "Two", "Three", "Four", "Five", "Six", "Seven", "Eight", "Nine", "Ten")


def _counted(count: int, noun: str) -> str:
    """Return a count as a sentence begins with it."""
    word = _WORDS[count] if count < len(_WORDS) else str(count)
    return f"{word} {noun}{'' if count == 1 else 's'}"


def _design(result: StudyResult, perturbed: int, imposed: int) -> list[str]:
    subjects = {s.subject for s in result.sessions}
    days = {(s.subject, s.day) for s in result.sessions}
    each = [
        f"{plural(len(own), 'day')} in {condition_name(c.name)}"
        for c in result.conditions
        if (own := {(s.subject, s.day) for s in result.sessions if s.condition == c.name})
    ]
    visits = {(s.subject, s.day, s.condition) for s in result.sessions}
    if len(each) > 1 and len(visits) > len(days):
        each.append(f"{len(visits) - len(days)} of them in more than one condition")
    split = f" ({', '.join(each)})" if len(each) > 1 else ""
    who = _counted(len(subjects), "virtual subject" if result.virtual else "subject")
    verb = "was" if len(subjects) == 1 else "were"
    sentences = [
        f"{who} {verb} measured on {plural(len(days), 'day')}{split}, in "
        f"{plural(len(result.sessions), 'session')}; "
        f"{plural(perturbed, 'epoch')} with a torque perturbation and "
        f"{plural(imposed, 'epoch')} with an imposed sinusoid were recorded."
    ]
    if result.virtual:
        sentences.append(
            "All data come from a simulation of joint, robot and sensors; nobody was measured."
        )
    if result.blinded:
        sentences.append(
            "The analysis was blinded: conditions are codes, and the key was not used."
        )
    return sentences


def _conditions(result: StudyResult) -> list[str]:
    if result.blinded:
        return []  # the stimulation would reveal what the codes mean
    described = [text for c in result.conditions if (text := _stimulation(c))]
    return [f"Conditions: {'; '.join(described)}."] if described else []


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


def _perturbation(result: StudyResult, epochs: Sequence[Epoch], cite: Cited) -> list[str]:
    if not _own(epochs):
        return []
    prbs, controller = result.settings.prbs, result.settings.controller
    return [
        f"In each perturbation epoch the joint received a pseudo-random binary torque of "
        f"±{prbs.amplitude_nm:g} N·m for {prbs.duration_s:g} s: a maximal-length sequence of "
        f"{2**prbs.register_bits - 1} chips at {prbs.clock_hz:g} Hz, designed for "
        f"{prbs.wanted_low_hz:g} to {prbs.wanted_high_hz:g} Hz. An admittance controller let the "
        f"joint move freely {cite('paper')}: torque, low-pass filtered at "
        f"{controller.torque_cutoff_hz:g} Hz, was converted to a velocity command by a virtual "
        f"inertia of {number(controller.inertia_kg_m2, 3)} kg·m² and a virtual damping of "
        f"{number(controller.damping_nm_s_rad, 4)} N·m·s/rad, without stiffness."
    ]


def _rates(result: StudyResult) -> list[str]:
    names = {"torque_nm": "torque", "angle_rad": "angle", "velocity_rad_s": "velocity"}
    rates: dict[str, list[str]] = {}
    facts = [channel for channels in channel_facts(result) for channel in channels]
    for key, name in names.items():
        found = [c.mean_rate_hz for c in facts if c.name == key and math.isfinite(c.mean_rate_hz)]
        if found:
            rates.setdefault(number(float(np.median(found)), 3), []).append(name)
    if not rates:
        return []
    parts = [f"{series(group)} at {rate} samples/s" for rate, group in rates.items()]
    return [f"Sampling rates: {', '.join(parts)}."]


def _limits(result: StudyResult) -> list[str]:
    if not _own(result.epochs):
        return []
    guard = result.settings.guard
    return [
        f"A software guard between controller and drive limited the angle to "
        f"±{guard.position_limit_deg:g} deg, the speed to {guard.speed_limit_deg_s:g} deg/s and "
        f"the acceleration to {guard.acceleration_limit_deg_s2:g} deg/s². It held the arm still "
        f"above {guard.torque_limit_nm:g} N·m or {guard.power_limit_w:g} W, and stopped the "
        f"session above {guard.torque_stop_nm:g} N·m."
    ]


def _estimation(result: StudyResult, cite: Cited) -> list[str]:
    analysis = result.analysis
    if not analysis.fits:
        return []
    band = _band(analysis.fits)
    sentences = [
        f"Inertia J, viscous damping B and stiffness K of J θ″ + B θ′ + K θ = M were estimated "
        f"epoch by epoch {_how(analysis.method, cite)}{band}.",
        f"{WEIGHT_IN_STIFFNESS}.",
    ]
    corrected = [delay for delay in analysis.delays if delay.corrected]
    if corrected:
        sentences.append(
            f"The torque was first shifted by its estimated delay in {len(corrected)} of "
            f"{plural(len(analysis.delays), 'session')}."
        )
    if math.isfinite(analysis.inertia_kg_m2) or result.several_subjects:
        of_whom = (
            "of the same subject in all conditions"
            if result.several_subjects
            else f"of all conditions ({number(analysis.inertia_kg_m2)} kg·m²)"
        )
        sentences.append(
            f"These J, B and K are compared. B and K with J held at its median over all included "
            f"epochs {of_whom}, as in {cite.by_name('paper')}, are among the other methods."
        )
    return sentences


def _how(name: str, cite: Cited) -> str:
    method = method_of(name)
    if method is None:
        return f"by the method “{name}”"
    return " ".join(
        [method.methods_text, *([cite(*method.references)] if method.references else [])]
    )


def _band(fits: Iterable[Fit]) -> str:
    bands = {fit.band_hz for fit in fits if all(map(math.isfinite, fit.band_hz))}
    if len(bands) != 1:
        return ""
    ((low, high),) = bands
    return f" in the band of {low:.3g} to {high:.3g} Hz"


def _scores(result: StudyResult, imposed: Sequence[Epoch]) -> list[str]:
    scores = result.analysis.scores
    if not scores:
        return []
    settings = result.settings.scores
    cycles = sorted({score.n_cycles for score in scores if score.outcome.included})
    count = f"{cycles[0]} cycles" if len(cycles) == 1 else "all complete cycles"
    motion = ""
    if _own(imposed):
        sinusoid = result.settings.sinusoid
        motion = (
            f" of ±{sinusoid.amplitude_deg:g} deg at {sinusoid.frequency_hz:g} Hz for "
            f"{sinusoid.motion_s:g} s"
        )
    return [
        f"Epochs with an imposed sinusoid{motion} gave the angular impulse and the work per "
        f"cycle, averaged over {count}, from torque in the band of {settings.band_low_hz:g} to "
        f"{settings.band_high_hz:g} Hz."
    ]


def _exclusions(result: StudyResult) -> list[str]:
    out = result.exclusions
    total = len(result.epochs)
    if not total:
        return []
    if not out:
        return [f"All {plural(total, 'epoch')} were included."]
    who = Counter[str]({(e.source, e.epoch): e.by for e in out}.values())
    names = {
        "protocol": "that did not end with success",
        "check": "rejected by a check",
        "estimate": "without a valid estimate",
        "operator": "excluded by the operator",
    }
    parts = [f"{who[by]} {text}" for by, text in names.items() if who[by]]
    count = sum(who.values())
    return [
        f"Of {plural(total, 'epoch')} {count} {'was' if count == 1 else 'were'} excluded: "
        f"{', '.join(parts)}."
    ]


def _software(result: StudyResult) -> list[str]:
    libraries = result.provenance.get("libraries", "")
    return [
        f"All results were computed with rigidimeter {__version__}"
        + (f" ({libraries})" if libraries else "")
        + "."
    ]


OFFSETS = {"condition in day": "condition within a day", "subject/day": "day within a subject"}
"""How sentences call what has an offset of its own in a mixed model, where not by its name."""


def offsets_text(names: tuple[str, ...]) -> str:
    """Return of what a model had offsets: ``each subject and each day``."""
    return series([f"each {OFFSETS.get(name, name)}" for name in names])


def rating_sentences(result: StudyResult, cite: Cited) -> list[str]:
    """Return how examiners' scores were modelled; nothing where there are none."""
    found = result.ratings
    if found is None:
        return []
    examiners = len({row.examiner for row in found.rows})
    estimated = tuple(name for name in found.fit.offsets if name not in found.fit.inseparable)
    offsets = f" and a random intercept for {offsets_text(estimated)}" if estimated else ""
    sentences = [
        f"{plural(examiners, 'examiner')} gave {plural(len(found.rows), 'rating')}. They were "
        f"fitted by restricted maximum likelihood with a mean for each condition{offsets}; the "
        f"contrast {condition_name(found.reference)} − {condition_name(found.other)} was tested as "
        f"in {cite.by_name('kenward')}. A corrected score is a score less the predicted offsets."
    ]
    if found.contrast_days is not None:
        sentences.append(
            "The contrast was also tested with a random intercept for each day in addition."
        )
    return sentences


def day_tests_in_words(result: StudyResult) -> list[str]:
    """Return the test by days of each measure; that of the ratings is told with their model."""
    return [
        c.days.test for c in result.comparisons if c.days and c.days.test and c.measure != RATING
    ]


def test_sentences(result: StudyResult, cite: Cited) -> list[str]:
    """Return which tests were made; nothing of those that were not."""
    sentences = []
    if any(c.test is not None for c in result.comparisons):
        sentences.append(
            "Conditions were compared by the two-sided Wilcoxon rank-sum test over epochs "
            "(asymptotic, with tie and continuity correction), r = z/√N, and the Hodges–Lehmann "
            f"shift with the interval of the same test {cite('hodges')}."
        )
    tested = [c.days for c in result.comparisons if c.days and not math.isnan(c.days.p)]
    used = day_tests_in_words(result)
    if used:
        sentences.append(
            "Because epochs of one day are not independent, conditions were also compared by the "
            f"means of the days: {'; '.join(dict.fromkeys(used))}, with "
            f"{100 * tested[0].confidence:g} % intervals."
        )
        if any(" alone at weight " in words for words in used):
            sentences.append(
                "The weights follow from the numbers of days, not from the measured values."
            )
        if any(not words.startswith("paired") for words in used):
            sentences.append(
                "Variances were estimated from each kind of days by itself, without assuming them "
                f"equal; degrees of freedom are those of {cite.by_name('satterthwaite')}, fewer "
                "where a variance comes from few days."
            )
        if any(not math.isnan(days.p_days) for days in tested):
            sentences.append(
                "The medians of the days were compared by the exact two-sided rank-sum test."
            )
    sentences += _effects(result, cite)
    if len(tested) > 1 or sum(c.effects is not None for c in result.comparisons) > 1:
        sentences.append(
            f"P values of several measures were adjusted by Holm’s method {cite('holm')}."
        )
    methods = list(dict.fromkeys(row.method for row in result.sensitivity))
    if len(methods) > 1:
        both = len({row.inertia for row in result.sensitivity}) > 1
        named = "; ".join(f"{name}, {method_title(name)}" for name in methods)
        sentences.append(
            "To show how the result depends on the method of estimation, the comparison was "
            f"repeated with other methods{', with J fixed and with J free' if both else ''} "
            f"({named})."
        )
    return sentences


def _effects(result: StudyResult, cite: Cited) -> list[str]:
    methods = {c.effects.method for c in result.comparisons if c.effects is not None}
    if not methods:
        return []
    how = []
    if "BCa" in methods:
        how.append(f"BCa bootstrap intervals that resample {result.resampled} {cite('bca')}")
    if "Newcombe" in methods:
        which = "where the conditions do not overlap, " if "BCa" in methods else ""
        how.append(f"{which}Newcombe’s intervals {cite('newcombe')}")
    sentences = [f"Effect sizes have {'; '.join(how)}."]
    if result.differences:
        sentences.append(
            "Effect sizes of two measures were compared by the difference of the sizes of their "
            "rank-biserial correlations, in the same bootstrap."
        )
    return sentences


def method_of(name: str) -> Method | None:
    """Return the estimator of that name; None for one of a file that is not known here."""
    return next((method for method in METHODS if method.name == name), None)


def method_title(name: str) -> str:
    """Return what a method does, or its name where it is not known."""
    method = method_of(name)
    return name if method is None else method.title


def interval_basis(name: str) -> str:
    """Return what the intervals of a method hold for."""
    method = method_of(name)
    return "" if method is None else method.intervals_text


def pooled_basis(name: str) -> str:
    """Return what the intervals of all epochs together hold for."""
    method = method_of(name)
    return "" if method is None else method.pooled_text


def is_least_squares(name: str) -> bool:
    """Return whether voluntary torque biases a method: it does not use the perturbation."""
    method = method_of(name)
    return method is not None and not method.uses_perturbation
