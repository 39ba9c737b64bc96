"""The sentences of the methods paragraphs on ratings and tests."""

from __future__ import annotations

import math

from rigidimeter.analysis.report.method_words import method_title
from rigidimeter.analysis.report.references import Cited
from rigidimeter.analysis.study import RATING, StudyResult
from rigidimeter.core.words import condition_name, plural, series

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
        f"contrast {condition_name(found.other)} − {condition_name(found.reference)} was tested as "
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
