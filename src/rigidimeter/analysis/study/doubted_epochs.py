"""Which checks cast doubt on the epochs of an analysis, or of a comparison and its conditions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Analysis, Fit

OF_SUBJECT = ("tremor", "voluntary_torque", "active_movement", "emg_activity", "loop_bias")
"""Checks of the subject's own torque."""

CAUSES = {
    "tremor": "",
    "varying_with_time": "a joint that changes during the epoch",
    "varying_with_angle": "a joint that changes with the angle",
    "varying_with_phase": "a joint that changes with the imposed movement",
    "voluntary_torque": "torque of the subject's own",
    "active_movement": "torque of the subject's own",
    "emg_activity": "muscle activity",
    "implausible_parameters": "values that no joint has, as wrong units give",
}
"""Checks that say what is wrong, in the order in which they are named; of the others the one that
doubts most epochs is named. A joint that changes leaves torque as a pushing subject does, but a
subject who pushes is hardly ever taken for a joint that changes."""

ALIKE_IN_BOTH = ("between_samples", "varying_between_epochs")
"""Checks that make no difference: of the rig, and of a scatter that is in the test."""

Doubted = Mapping[tuple[str, str], Sequence[str]]


@dataclass(frozen=True)
class Doubt:
    """A check that casts doubt on `epochs` of the `counting` epochs that count.

    On none of them where it is the fit to all of them together that it casts doubt on.
    """

    check: str
    epochs: int
    counting: int


def doubts(analysis: Analysis) -> tuple[Doubt, ...]:
    """Return which checks cast doubt on epochs that count, those of most epochs first."""
    counting = [fit for fit in analysis.fits if fit.outcome.included]
    of_epochs = Counter(name for fit in counting for name in fit.cautions)
    of_pool = {name for fit in analysis.pooled for name in fit.cautions}
    names = [name for name, _ in of_epochs.most_common()]
    names += sorted(of_pool - of_epochs.keys())
    return tuple(Doubt(name, of_epochs[name], len(counting)) for name in names)


def doubted_epochs(c: Comparison, analysis: Analysis) -> Doubted:
    """Return the checks that doubt each epoch which counts in the comparison, where there are any.

    A score is not an estimate: only torque of the subject's own changes it, which may be a note for
    the method of the estimate.
    """
    counting = {(o.source, o.epoch) for name in c.pair for o in c.of(name)}
    found = {}
    for fit in analysis.fits:
        names = [f.name for f in fit.findings if _counts(f, of_score=c.measure.origin == "scores")]
        if names and (fit.source, fit.epoch) in counting:
            found[fit.source, fit.epoch] = names
    return found


def doubted_together(c: Comparison, analysis: Analysis) -> Iterator[tuple[Fit, Finding]]:
    """Yield what a check doubts in all epochs of one of the conditions together."""
    for fit in analysis.pooled:
        if fit.condition in c.pair:
            yield from ((fit, f) for f in fit.findings if _counts(f, of_score=False))


def carried(c: Comparison, doubted: Doubted) -> str:
    """Return which check doubts epochs, and how many of each condition are doubted."""
    counts = Counter(name for names in doubted.values() for name in names)
    first = next((name for name in CAUSES if name in counts), counts.most_common(1)[0][0])
    parts = []
    for condition in c.pair:
        of = c.of(condition)
        carry = sum((o.source, o.epoch) in doubted for o in of)
        parts.append(f"{carry} of {len(of)} epochs in {condition or 'no condition'}")
    others = len(counts) - 1
    more = f" (or {others} other finding{'s' if others > 1 else ''})" if others else ""
    return f"{in_words(first)}{more} in {' and '.join(parts)}"


def in_words(check: str) -> str:
    """Return a check with what it finds, where its name does not say it."""
    return f"{CAUSES[check]} ({check})" if CAUSES.get(check) else check


def _counts(finding: Finding, *, of_score: bool) -> bool:
    if of_score:
        return finding.name in OF_SUBJECT
    return finding.level != "note" and finding.name not in ALIKE_IN_BOTH
