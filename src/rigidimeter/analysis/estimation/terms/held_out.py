"""Prediction of blocks that a fit has not seen, and what one model predicts better than another.

The record is cut into blocks in a row; each is predicted by a fit to the others, without a gap at
each side of it, over which filters and reflexes remember. Two models are compared by the
ratio R of their squared errors, summed over the blocks, each block with its pair: what is difficult
for both then cancels (Diebold and Mariano 1995). The gain is 1 − R. ln R has an interval by the
jackknife over the blocks with Student's t, so that no gain can pass 100 %.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.signals import Array

BLOCK_S = 1.0
FEWEST_BLOCKS, MOST_BLOCKS = 8, 24
LARGEST_GAP = 1.0
"""Of a block: a short record must keep something to fit."""

SMALLEST_RATIO = 1e-12
"""Of squared errors: less is rounding."""


class Gain(NamedTuple):
    """What is predicted better, in % of the error of the smaller model, with its interval."""

    percent: float
    low_percent: float
    high_percent: float

    @property
    def text(self) -> str:
        """Value and interval."""
        return f"{self.percent:.3g} % ({self.low_percent:.3g} to {self.high_percent:.3g} %)"


def blocks(count: int, rate_hz: float, gap_s: float) -> Iterator[tuple[slice, NDArray[np.bool_]]]:
    """Yield each block, and the samples that the fit for it may see.

    Parameters
    ----------
    count : int
        Samples of the record.
    rate_hz : float
    gap_s : float
        Left out at each side of a block.
    """
    wanted = round(count / rate_hz / BLOCK_S)
    edges = np.linspace(0, count, min(max(wanted, FEWEST_BLOCKS), MOST_BLOCKS) + 1).astype(int)
    gap = min(round(gap_s * rate_hz), int(LARGEST_GAP * edges[1]))
    for start, stop in pairwise(edges):
        seen = np.ones(count, dtype=np.bool_)
        seen[max(start - gap, 0) : stop + gap] = False
        yield slice(int(start), int(stop)), seen


def block_errors(
    target: Array, columns: Sequence[Array], rate_hz: float, gap_s: float, *, mean: bool = False
) -> Array:
    """Return the sum of squared errors of prediction in each block, shape (b,).

    Parameters
    ----------
    target : array, shape (n,)
    columns : sequence of arrays, shape (n, p)
        The regressors at each point of a grid of nonlinear parameters; each fit takes the best.
    rate_hz, gap_s : float
    mean : bool
        Predict the mean too.
    """
    found = []
    for block, seen in blocks(target.size, rate_hz, gap_s):
        middle = float(np.mean(target[seen])) if mean else 0.0
        best, error = np.inf, float(np.sum((target[block] - middle) ** 2))
        for matrix in columns if columns and columns[0].shape[1] else ():
            lengths = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
            scaled = matrix / lengths
            values, *_ = np.linalg.lstsq(scaled[seen], target[seen] - middle, rcond=1e-8)
            cost = float(np.sum((target[seen] - middle - scaled[seen] @ values) ** 2))
            if cost < best:
                best = cost
                left = target[block] - middle - scaled[block] @ values
                error = float(left @ left)
        found.append(error)
    return np.asarray(found)


def gain(smaller: Array, larger: Array, comparisons: int = 1) -> Gain:
    """Return what the larger model predicts better.

    Parameters
    ----------
    smaller, larger : arrays, shape (b,)
        Errors in the blocks.
    comparisons : int
        The interval is one of so many that hold together with 95 % (Bonferroni).
    """
    total, rest = np.sum(smaller), np.sum(larger)
    blocks_used = smaller.size
    without = np.log(np.maximum((rest - larger) / (total - smaller), SMALLEST_RATIO))
    spread = np.sqrt((blocks_used - 1) / blocks_used * np.sum((without - np.mean(without)) ** 2))
    half = float(scipy.stats.t.ppf(1 - 0.025 / comparisons, blocks_used - 1) * spread)
    ratio = max(float(rest / total), SMALLEST_RATIO)
    return Gain(*(100.0 * (1.0 - ratio * np.exp(power)) for power in (0.0, half, -half)))
