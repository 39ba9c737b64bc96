"""How many days a study would need where none of its tests could decide.

The SD of the difference of one day is that of `rigidimeter.planning.days_needed`, with the scatter
between epochs of these recordings and the scatter of days that is assumed there, since a single day
does not show it.
"""

from __future__ import annotations

import math
from dataclasses import replace

from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.core.records import PARAMETERS
from rigidimeter.planning import ASSUMED, day_difference_sd, pairs_needed

WANTED = 0.2
"""The difference, as a share of the reference."""

_MIN_EPOCHS = 3
"""With fewer epochs of a condition their scatter is the assumed one."""


def days_to_decide(c: Comparison) -> int | None:
    """Return how many days with both conditions would show a difference of `WANTED`.

    With as many epochs a day as there are, at a power of 0.8 and a level of 0.05 for this measure
    alone. None for other measures than J, B and K, and where a condition has no epoch.
    """
    title = {parameter.name: parameter.title for parameter in PARAMETERS}.get(c.measure.name)
    each = [c.of(name) for name in c.pair]
    if title is None or c.measure.origin != "fits" or not all(each):
        return None
    values = [math.fsum(o.value for o in own) / len(own) for own in each]
    days = [len({(o.subject, o.day, o.source) for o in own}) for own in each]
    epochs = [max(round(len(own) / n), 1) for own, n in zip(each, days, strict=True)]
    scatter = ASSUMED[title]
    if min(map(len, each)) >= _MIN_EPOCHS:
        within = max(c.summaries[name].sd_percent for name in c.pair)
        scatter = replace(scatter, between_epochs_percent=within)
    if min(values) <= 0:
        return None
    sd = day_difference_sd(scatter, (values[0], values[1]), (0.0, 0.0), (epochs[0], epochs[1]))
    return pairs_needed(WANTED * values[0], sd)
