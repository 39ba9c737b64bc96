"""How precise J, B, K and the scores of each condition of a recording are, from its epochs alone.

A bias, such as that by the subject's own torque, is not in it.
"""

from __future__ import annotations

from collections.abc import Iterable

from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.statistics import Precision, precision_of
from rigidimeter.core.records import PARAMETERS, Analysis, Fit, Score

OF_SCORES = ("impulse_nm_s", "work_j")
"""Measures of imposed sinusoids."""


def condition_precisions(
    recording: Recording, analysis: Analysis
) -> dict[str, dict[str, Precision]]:
    """Return how precise each measure of each condition is, by the name of both.

    J, B and K are those fitted to all epochs of the condition together; scores are means over
    epochs, with an interval from their scatter.

    Parameters
    ----------
    recording : Recording
        What was estimated, for the order of its conditions: that of its protocol, else ``OFF``
        first, then as recorded.
    analysis : Analysis

    Returns
    -------
    dict of str to dict of str to Precision
        Without the conditions and measures of which nothing counts. Measures by stored name.
    """
    together, _ = split_pooled(analysis)
    found = {}
    for name in _in_order(recording, analysis):
        fits = [fit for fit in analysis.fits if fit.condition == name]
        scores = [score for score in analysis.scores if score.condition == name]
        measures = _of_fits(fits, together.get(name)) | _of_scores(scores)
        if measures:
            found[name] = measures
    return found


def split_pooled(analysis: Analysis) -> tuple[dict[str, Fit], Fit | None]:
    """Return the fit to all epochs of each condition, and the one to all epochs if there is one.

    The latter has no condition, as recordings without a name for theirs have none: it comes last.
    """
    recorded = {fit.condition for fit in analysis.fits}
    by_condition: dict[str, Fit] = {}
    overall = None
    for fit in analysis.pooled:
        if fit.condition in by_condition or fit.condition not in recorded:
            overall = fit
        else:
            by_condition[fit.condition] = fit
    return by_condition, overall


def _in_order(recording: Recording, analysis: Analysis) -> list[str]:
    """Return the conditions in the order of the protocol, then as recorded."""
    protocol = [block.condition for block in recording.settings.protocol.blocks]
    estimated = [one.condition for one in analysis.results]
    first = sorted(dict.fromkeys(filter(None, estimated)), key=lambda name: name != "OFF")[:2]
    recorded = (epoch.condition for epoch in recording.epochs)
    names = dict.fromkeys([*first, *recorded, *estimated])
    last = len(protocol)
    return sorted(names, key=lambda name: protocol.index(name) if name in protocol else last)


def _of_fits(fits: Iterable[Fit], together: Fit | None) -> dict[str, Precision]:
    counting = [fit for fit in fits if fit.outcome.included]
    if together is None and len(counting) == 1:
        (together,) = counting
    found = {}
    for k, parameter in enumerate(PARAMETERS):
        values = [float(fit.value[k]) for fit in counting]
        if together is not None and together.outcome.included:
            low, high, se = (float(one[k]) for one in (together.low, together.high, together.se))
            estimate = float(together.value[k]), low, high, se
            found[parameter.name] = precision_of(values, estimate)
        elif values:
            found[parameter.name] = precision_of(values)
    return found


def _of_scores(scores: Iterable[Score]) -> dict[str, Precision]:
    counting = [score for score in scores if score.outcome.included]
    return {
        name: precision_of([getattr(score, name) for score in counting])
        for name in OF_SCORES
        if counting
    }
