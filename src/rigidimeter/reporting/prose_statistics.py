"""The sentences of a methods paragraph that tell of ratings and tests."""

from __future__ import annotations

import math

from rigidimeter.reporting.measures import condition_name
from rigidimeter.reporting.methods import method_title
from rigidimeter.reporting.references import Cited
from rigidimeter.study import StudyResult

__all__ = ["rating_sentences", "test_sentences"]


def rating_sentences(study: StudyResult, cite: Cited) -> list[str]:
    """Return how examiners' scores were modelled; nothing where there are none."""
    found = study.ratings
    if found is None:
        return []
    examiners = len({row[1] for row in found.rows})
    groupings = [
        {"subject/day": "day within a subject"}.get(name, name)
        for name in found.fit.offsets
        if name not in found.fit.untold
    ]
    offsets = (
        f" and a random intercept for each {' and for each '.join(groupings)}" if groupings else ""
    )
    return [
        f"{examiners} examiner{'' if examiners == 1 else 's'} gave {len(found.rows)} ratings. "
        "They were fitted by restricted maximum likelihood with a mean for each condition"
        f"{offsets}; the contrast {condition_name(found.reference)} − "
        f"{condition_name(found.other)} was tested as by {cite.by_name('kenward')}. A corrected "
        "score is a score less the predicted offsets."
        + (
            " The contrast was tested with a random intercept for each day too."
            if found.contrast_days is not None
            else ""
        )
    ]


def test_sentences(study: StudyResult, cite: Cited) -> list[str]:
    """Return which tests were made; nothing of those that were not."""
    sentences = []
    if any(c.test is not None for c in study.comparisons):
        sentences.append(
            "Conditions were compared by the two-sided Wilcoxon rank-sum test over epochs "
            "(asymptotic, with tie and continuity correction), r = z/√N, and the Hodges–Lehmann "
            f"shift with the interval that the test gives {cite('hodges')}."
        )
    tested = [
        c.days
        for c in study.comparisons
        if c.measure.origin != "ratings" and c.days is not None and not math.isnan(c.days.p)
    ]
    if tested:
        confidence = 100 * tested[0].confidence
        sentences.append(
            "Since epochs of one day are not independent, conditions were also "
            "compared by a linear mixed model with a mean for each condition and a random "
            f"intercept for {tested[0].model}, with {confidence:g} % intervals and p as by "
            f"{cite.by_name('kenward')}."
        )
        if _shared_days(study) and "condition in day" not in tested[0].offsets:
            sentences.append("A day was taken to move both its conditions alike.")
        if any(not math.isnan(test.p_days) for test in tested):
            sentences.append(
                "The medians of the days were compared by the exact two-sided rank-sum test."
            )
    effects = [c.effects for c in study.comparisons if c.effects is not None]
    if effects:
        intervals = {effect.method for effect in effects}
        how = []
        if "BCa" in intervals:
            how.append(f"BCa bootstrap intervals that resample whole days {cite('bca')}")
        if "Newcombe" in intervals:
            which = "where the conditions do not overlap, " if "BCa" in intervals else ""
            how.append(f"{which}Newcombe’s intervals {cite('newcombe')}")
        sentences.append(f"Effect sizes have {'; '.join(how)}.")
        if study.differences:
            sentences.append(
                "Effect sizes of two measures were compared by the difference of the sizes of "
                "their rank-biserial correlations, in the same bootstrap."
            )
    if len(tested) > 1 or len(effects) > 1:
        sentences.append(
            f"P values of several measures were adjusted by Holm’s method {cite('holm')}."
        )
    methods = list(dict.fromkeys(row.method for row in study.sensitivity))
    if len(methods) > 1:
        ways = {row.inertia for row in study.sensitivity}
        both = ", with J fixed and with J free" if len(ways) > 1 else ""
        named = "; ".join(f"{name}, {method_title(name)}" for name in methods)
        sentences.append(
            f"To see what depends on the method, the comparison was repeated{both} ({named})."
        )
    return sentences


def _shared_days(study: StudyResult) -> bool:
    days = {(s.subject, s.day) for s in study.sessions}
    return len({(s.subject, s.day, s.condition) for s in study.sessions}) > len(days)
