"""The sentences of a methods paragraph that tell of ratings and tests."""

from __future__ import annotations

import math

from rigidimeter.reporting.measures import condition_name
from rigidimeter.reporting.methods import method_title
from rigidimeter.reporting.references import Cited
from rigidimeter.study import Cohort, Study

__all__ = ["rating_sentences", "test_sentences"]


def rating_sentences(cohort: Cohort, cite: Cited) -> list[str]:
    """Return how examiners' scores were modelled; nothing where there are none."""
    found = cohort.ratings
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


def test_sentences(study: Study, cohort: Cohort, cite: Cited) -> list[str]:
    """Return which tests were made; nothing of those that were not."""
    sentences = []
    if any(c.test is not None for c in study.comparisons):
        sentences.append(
            "Conditions were compared by the two-sided Wilcoxon rank-sum test over epochs "
            "(asymptotic, with tie and continuity correction), r = z/√N, and the Hodges–Lehmann "
            f"shift with the interval that the test gives {cite('hodges')}."
        )
    tested = [test for test in cohort.day_tests if not math.isnan(test.p)]
    if tested:
        confidence = 100 * tested[0].confidence
        sentences.append(
            "Since epochs of one day are no independent observations, conditions were also "
            "compared by a linear mixed model with a mean for each condition and a random "
            f"intercept for {tested[0].model}, with {confidence:g} % intervals and p as by "
            f"{cite.by_name('kenward')}."
        )
        if _shared_days(cohort) and "condition in day" not in tested[0].offsets:
            sentences.append("A day was taken to move both its conditions alike.")
        if any(not math.isnan(test.p_days) for test in tested):
            sentences.append(
                "The medians of the days were compared by the exact two-sided rank-sum test."
            )
    if cohort.effects:
        methods = {effect.effects.method for effect in cohort.effects}
        how = []
        if "BCa" in methods:
            how.append(f"BCa bootstrap intervals that resample whole days {cite('bca')}")
        if "Newcombe" in methods:
            which = "where the conditions do not overlap, " if "BCa" in methods else ""
            how.append(f"{which}Newcombe’s intervals {cite('newcombe')}")
        sentences.append(f"Effect sizes have {'; '.join(how)}.")
        if cohort.differences:
            sentences.append(
                "Effect sizes of two measures were compared by the difference of the sizes of "
                "their rank-biserial correlations, in the same bootstrap."
            )
    if len(tested) > 1 or len(cohort.effects) > 1:
        sentences.append(
            f"P values of several measures were adjusted by Holm’s method {cite('holm')}."
        )
    roads = list(dict.fromkeys(row.method for row in cohort.sensitivity))
    if len(roads) > 1:
        ways = {row.inertia for row in cohort.sensitivity}
        both = ", with J fixed and with J free" if len(ways) > 1 else ""
        named = "; ".join(f"{name}, {method_title(name)}" for name in roads)
        sentences.append(
            f"To see what rests on the method, the comparison was repeated{both} ({named})."
        )
    return sentences


def _shared_days(cohort: Cohort) -> bool:
    days = {(s.subject, s.day) for s in cohort.sessions}
    return len({(s.subject, s.day, s.condition) for s in cohort.sessions}) > len(days)
