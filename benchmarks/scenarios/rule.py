"""One row of the table from its recordings, and whether it keeps the rule.

The answer of a row is wrong if the mean error of J, B or K exceeds 10 %, or if less than 80 % of
the 95 % intervals hold the truth, in single epochs or pooled. A wrong answer must come with the
right finding in at least 90 % of the recordings; a right one may be flagged in at most 5 %. Where
the joint is not one J, B and K, to say so is no false alarm even if their means are right.

A share is above or below a limit where chance, if the true share were the limit, would take it that
far in less than 1 of 20 cases (binomial): of a few recordings, one alone says little.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

Array = NDArray[np.float64]
LARGEST_ERROR = 0.10
LEAST_COVERAGE = 0.80
LEAST_RAISED = 0.90
MOST_DOUBTED = 0.05
CHANCE = 0.05
NOT_ONE_JOINT = ("varying", "missing_term", "lack_of_fit", "residual_perturbation", "loop_bias")
"""What findings begin with that are never false where the joint is not one J, B and K."""


def below(share: float, limit: float, n: int) -> bool:
    """Whether a share of n is below a limit by more than chance."""
    return bool(share < limit and binom.cdf(round(share * n), n, limit) < CHANCE)


def above(share: float, limit: float, n: int) -> bool:
    """Whether a share of n is above a limit by more than chance."""
    return below(1.0 - share, 1.0 - limit, n)


class Answer(NamedTuple):
    """What estimates were, as shares of the truth, each of shape (3,); NaN without any.

    `count` is how many there were.
    """

    bias: Array
    scatter: Array
    coverage: Array
    count: int

    @property
    def off(self) -> bool:
        """Whether J, B or K is off; no answer is not."""
        return bool(np.any(np.abs(self.bias) > LARGEST_ERROR))

    @property
    def wrong(self) -> bool:
        """Whether J, B or K is off or its intervals do not hold; no answer is not wrong."""
        return self.off or any(below(x, LEAST_COVERAGE, self.count) for x in self.coverage)


class Row(NamedTuple):
    """One scenario by one method.

    Attributes
    ----------
    epochs, pooled : Answer
    doubted_epochs, doubted : float
        Shares of the epochs and of the recordings that a finding flags.
    in_vain : float
        Share of the recordings that a finding flags that is false if the answer is right.
    raised : float
        Share of the recordings with a finding that is right for the scenario.
    shares : dict of str to float
        In what share of the recordings each finding was.
    recordings : int
    """

    epochs: Answer
    pooled: Answer
    doubted_epochs: float
    doubted: float
    in_vain: float
    raised: float
    shares: dict[str, float]
    recordings: int

    @property
    def wrong(self) -> bool:
        """Whether the answer is wrong, in single epochs or pooled."""
        return self.epochs.wrong or self.pooled.wrong

    @property
    def breaks(self) -> str:
        """How the row breaks the rule; empty where it does not."""
        if not self.wrong:
            return "false alarm" if above(self.in_vain, MOST_DOUBTED, self.recordings) else ""
        if not below(self.raised, LEAST_RAISED, self.recordings):
            return ""
        if not below(self.doubted, LEAST_RAISED, self.recordings):
            return "misnamed"
        return "silent, off" if self.epochs.off or self.pooled.off else "silent, overconfident"


def row(kept: Sequence[dict[str, Any]], right: Sequence[str], other_model: bool = False) -> Row:
    """Return the row of these recordings.

    Parameters
    ----------
    kept : sequence of mapping
        As `measure` keeps them.
    right : sequence of str
        The beginnings of the findings that are right.
    other_model : bool
        Whether the joint is not one J, B and K.
    """
    truth = np.concatenate([recording["truth"] for recording in kept])
    fits = [fit for recording in kept for fit in recording["fits"]]
    pooled = [(recording["pooled"][0], np.mean(recording["truth"], axis=0))
              for recording in kept if recording["pooled"]]  # fmt: skip
    found = [
        {name for fit in (*one["fits"], *one["pooled"]) for name in fit["doubts"]} for one in kept
    ]
    said = [{name for name in names if name.startswith(tuple(right))} for names in found]
    true = (*right, *NOT_ONE_JOINT) if other_model else ()
    vain = [{name for name in names if not name.startswith(true)} for names in found]
    counts = Counter(name for names in found for name in names)
    n = len(kept)
    return Row(
        _answer(fits, truth),
        _answer([fit for fit, _ in pooled], np.array([mean for _, mean in pooled])),
        float(np.mean([bool(fit["doubts"]) for fit in fits])),
        float(np.mean([bool(names) for names in found])),
        float(np.mean([bool(names) for names in vain])),
        float(np.mean([bool(names) for names in said])),
        {name: count / n for name, count in counts.most_common()},
        n,
    )


def _answer(fits: Sequence[dict[str, Any]], truth: Array) -> Answer:
    if not fits:
        return Answer(*np.full((3, 3), np.nan), 0)
    value, low, high = (
        np.array([fit[key] for fit in fits], dtype=float) for key in ("value", "low", "high")
    )
    there = np.isfinite(value).all(axis=1)
    if not there.any():
        return Answer(*np.full((3, 3), np.nan), 0)
    value, low, high, truth = value[there], low[there], high[there], truth[there]
    error = value / truth - 1.0
    # An interval that is not known holds nothing.
    held = (low <= truth) & (truth <= high)
    return Answer(error.mean(axis=0), error.std(axis=0), held.mean(axis=0), len(error))
