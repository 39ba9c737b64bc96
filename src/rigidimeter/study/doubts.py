"""Which checks cast doubt on the epochs of an analysis."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from rigidimeter.records import Analysis


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
    of_epochs = Counter(name for fit in counting for name in fit.doubts)
    of_pool = {name for fit in analysis.pooled for name in fit.doubts}
    names = [name for name, _ in of_epochs.most_common()]
    names += sorted(of_pool - of_epochs.keys())
    return tuple(Doubt(name, of_epochs[name], len(counting)) for name in names)


def doubt_sentence(analysis: Analysis) -> list[str]:
    """Return the sentence on doubts that goes with whatever is concluded; nothing without any."""
    parts = [
        f"{doubt.check} in {doubt.epochs} of {doubt.counting} epochs"
        if doubt.epochs
        else f"{doubt.check} in all epochs together"
        for doubt in doubts(analysis)
    ]
    return [f"Checks cast doubt on J, B or K: {', '.join(parts)}."] if parts else []
