"""The score test of a parameter that varies, and from where to where it goes.

With slow functions s_i(t) the torque is

    M = J a + B v + K θ + Σ_i (j_i s_i a + b_i s_i v + k_i s_i θ) + e

If K does not vary, all k_i are zero. Their instruments are those of the angle times s_i, made
orthogonal to all else in the model: z*. The scores z*(t) e(t), with e the residual of the model
without the k_i, then sum to zero but for noise. They are added up over blocks of half a second,
g_b, longer than whitened noise remembers, so that blocks are independent, whatever their size: a
subject who pushes now and then makes some of them large (White 1980; Bell and McCaffrey 2002). In

    S = (Σ g_b)ᵀ (Σ g_b g_bᵀ)⁻¹ (Σ g_b)

only the signs of the g_b are chance if the joint does not vary, however uneven their sizes, so the
probability is the share of random signs under which S is as large: a randomisation test (Canay,
Romano and Shaikh 2017, Econometrica 85:1013). Signs are drawn only where S is large: n Gaussian
blocks of one size give S/n a beta distribution with q/2 and (n − q)/2, and while that is far from
unlikely, so is S.

No torque of the subject's enters a score by the instruments of the perturbation. Without a
perturbation the motion is its own instrument, and S also counts what the subject moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.diagnostics.varying_lines import VaryingLines
from rigidimeter.analysis.estimation.signals import Array

BLOCK_S = 0.5
UNLIKELY = 0.05
DRAWS = 20_000
"""The least probability is one in so many."""

SIGNS_SEED = 1
"""The same epoch gives the same probability every time."""


class Columns(NamedTuple):
    """Instruments and regressors of some terms, whitened, shape (2m, c) each."""

    instruments: Array
    regressors: Array

    @classmethod
    def joined(cls, parts: Sequence[Columns]) -> Columns:
        """Return the columns side by side."""
        instruments, regressors = zip(*parts, strict=True)
        return cls(np.concatenate(instruments, axis=1), np.concatenate(regressors, axis=1))


class Score(NamedTuple):
    """How the tested terms do.

    Attributes
    ----------
    p : float
        Probability of so large a score if they are zero.
    left : float
        What the model with them leaves of the whitened torque: the sum of squares.
    """

    p: float
    left: float


class Effect(NamedTuple):
    """What a model says of a parameter that varies.

    Attributes
    ----------
    values : array, shape (q + 1,)
        The parameter where all functions are zero, and its coefficients.
    covariance : array, shape (q + 1, q + 1)
    degrees : float
        Of freedom, for Student's t.
    """

    values: Array
    covariance: Array
    degrees: float


def score_test(lines: VaryingLines, target: Array, others: Columns, tested: Columns) -> Score:
    """Test whether terms are zero.

    Parameters
    ----------
    lines : VaryingLines
    target : array, shape (2m,)
        The torque, whitened.
    others : Columns
        Of the terms that the model has anyway.
    tested : Columns
    """
    gram = others.instruments.T @ others.regressors
    both = np.column_stack([target, tested.regressors])
    free = both - others.regressors @ np.linalg.solve(gram, others.instruments.T @ both)
    residual, regressors = free[:, 0], free[:, 1:]
    shared = np.linalg.solve(gram.T, others.regressors.T @ tested.instruments)
    instruments = tested.instruments - others.instruments @ shared
    blocks = _block_scores(lines, instruments, residual)
    p = sign_p(blocks)
    own = np.linalg.solve(instruments.T @ regressors, instruments.T @ residual)
    return Score(p, float(np.sum((residual - regressors @ own) ** 2)))


def sign_p(blocks: Array) -> float:
    """Return the probability of so large an S if only the signs of the blocks are chance.

    Parameters
    ----------
    blocks : array, shape (n, q)
    """
    count, q = blocks.shape
    whitened = np.linalg.solve(np.linalg.cholesky(blocks.T @ blocks), blocks.T)
    statistic = float(np.sum(whitened.sum(axis=1) ** 2))
    even = float(scipy.special.betainc((count - q) / 2, q / 2, max(1 - statistic / count, 0.0)))
    if even > UNLIKELY:
        return even
    drawn = np.sum((whitened @ _signs(count)) ** 2, axis=0)
    return float(1 + np.count_nonzero(drawn >= statistic * (1 - 1e-9))) / (DRAWS + 1)


@lru_cache(maxsize=4)
def _signs(count: int) -> Array:
    """Return random signs, the same every time, shape (count, DRAWS)."""
    drawn = np.random.default_rng(SIGNS_SEED).integers(0, 2, (count, DRAWS))
    signs = np.asarray(2.0 * drawn - 1.0)
    signs.setflags(write=False)
    return signs


def effect(
    lines: VaryingLines, target: Array, base: Columns, tested: Columns, parameter: int
) -> Effect:
    """Return the constant and the coefficients of a parameter, by the model with them.

    Parameters
    ----------
    lines, target
        As for `score_test`.
    base : Columns
        The first three are those of J, B and K.
    tested : Columns
    parameter : int
        Which of J, B and K it is that varies.
    """
    model = Columns.joined([base, tested])
    inverse = np.linalg.inv(model.instruments.T @ model.regressors)
    values = inverse @ (model.instruments.T @ target)
    residual = target - model.regressors @ values
    blocks = _block_scores(lines, model.instruments, residual)
    count, p = len(blocks), values.size
    # Scores in time sum to those of the lines over half the number of samples.
    scale = lines.angle_rad.size / 2
    covariance = inverse @ (blocks.T @ blocks * scale**2 * count / max(count - p, 1)) @ inverse.T
    first = base.instruments.shape[1]
    place = np.array([parameter, *range(first, p)])
    return Effect(values[place], covariance[np.ix_(place, place)], float(max(count - p, 1)))


def _block_scores(lines: VaryingLines, instruments: Array, residual: Array) -> Array:
    """Return the sums of the scores over the blocks, shape (b, c)."""
    m = residual.size // 2
    in_time = lines.in_time(
        np.column_stack([instruments[:m], residual[:m]])
        + 1j * np.column_stack([instruments[m:], residual[m:]])
    )
    scores = in_time[:, :-1] * in_time[:, -1:]
    count = int(lines.duration_s / BLOCK_S)
    return np.asarray(np.add.reduceat(scores, np.arange(count) * len(scores) // count, axis=0))
