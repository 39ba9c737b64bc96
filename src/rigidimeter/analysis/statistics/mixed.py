"""Ratings by several examiners: a mean for each condition, an offset for each examiner.

    score = Σ_c β_c x_c + Σ_g b_g z_g + e,   b_g ~ N(0, σ_g²),  e ~ N(0, σ²)

One mean for each condition and no intercept, as in Sec. 2.2; random intercepts for examiners, or
for subjects and their days. Fitted by restricted maximum likelihood;
tests of the means are in `analysis.statistics.contrasts`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigidimeter.analysis.statistics.profiled_likelihood import Point, minimise, products
from rigidimeter.analysis.statistics.summary import Array, checked_sample
from rigidimeter.core.files import SCORES_BY_GROUPS_SQUARED

_NOTHING = 1e-10


@dataclass(frozen=True)
class Mixed:
    """A fitted model of scores; everything is in the unit of the scores, or its square.

    Attributes
    ----------
    conditions : tuple of str
        In order of appearance.
    means : ndarray, shape (p,)
        β, one for each condition.
    covariance : ndarray, shape (p, p)
        Of the means.
    variances : mapping of str to float
        σ_g² of each grouping, 0 at the boundary and where it cannot be estimated.
    variance_residual : float
        σ².
    offsets : mapping of str to mapping of str to float
        For each grouping the predicted b of each group (BLUP), which shrinks to 0 with σ_g².
    corrected : ndarray, shape (n,)
        The scores less the offsets of their groups, in the order given.
    deviance : float
        −2 log L, restricted.
    n, df_residual : int
        Number of scores, and n − p.
    at_zero : tuple of str
        Groupings whose variance is estimated as zero.
    inseparable : mapping of str to str
        Groupings that the data cannot separate from something else, and from what.
    point : Point
        The likelihood at its best, for tests.
    blocks : tuple of slice
        The columns of Z of each grouping that was fitted.
    """

    conditions: tuple[str, ...]
    means: Array
    covariance: Array
    variances: Mapping[str, float]
    variance_residual: float
    offsets: Mapping[str, Mapping[str, float]]
    corrected: Array
    deviance: float
    n: int
    df_residual: int
    at_zero: tuple[str, ...]
    inseparable: Mapping[str, str]
    point: Point
    blocks: tuple[slice, ...]


def nested(outer: Sequence[str], inner: Sequence[str]) -> list[str]:
    """Return the labels of `inner` within `outer`: day 1 of one subject is not that of another."""
    return [f"{o}/{i}" for o, i in zip(outer, inner, strict=True)]


def fit_mixed(
    scores: ArrayLike,
    conditions: Sequence[str],
    groups: Mapping[str, Sequence[str]],
) -> Mixed:
    """Fit one mean for each condition and random intercepts for each grouping, by REML.

    Parameters
    ----------
    scores : array_like, shape (n,)
        Finite.
    conditions : sequence of str, length n
        The condition of each score.
    groups : mapping of str to sequence of str of length n
        Groupings by name, the outermost first: ``{"examiner": [...]}``, or ``{"subject": [...],
        "subject/day": nested(subject, day)}``. Crossed, nested and unbalanced data are allowed; a
        group may hold a single score.

    Returns
    -------
    Mixed

    Raises
    ------
    ValueError
        If a score is not finite, lengths differ, fewer scores are given than conditions plus one,
        there are more scores and groups than can be modelled, or the model leaves no residual at
        all (its variance would be zero).


    Notes
    -----
    A grouping that cannot be separated from the condition means, from the residual or from a
    grouping before it is left out, and named in `inseparable`.

    References
    ----------
    Bates, Mächler, Bolker and Walker, Fitting linear mixed-effects models using lme4, J. Stat.
    Softw. 67, 2015. Pinheiro and Bates, Mixed-Effects Models in S and S-PLUS, 2000, ch. 2.

    Examples
    --------
    >>> fit = fit_mixed(
    ...     [1.0, 2.0, 2.0, 3.0, 0.0, 1.5, 1.5, 2.5],
    ...     ["OFF"] * 4 + ["DBS"] * 4,
    ...     {"examiner": ["A", "A", "B", "B"] * 2},
    ... )
    >>> fit.means.round(3).tolist()
    [2.0, 1.375]
    """
    y = checked_sample("the sequence of scores", scores, min_size=0)
    for name, labels in {"conditions": conditions, **groups}.items():
        if len(labels) != y.size:
            raise ValueError(f"{name} has {len(labels)} labels for {y.size} scores")
    n_groups = sum(len(set(labels)) for labels in (conditions, *groups.values()))
    if y.size * n_groups**2 > SCORES_BY_GROUPS_SQUARED:
        raise ValueError(
            f"{y.size} scores in {n_groups} conditions and groups ({', '.join(groups)}) are too "
            f"many for a mixed model; with so many scores at most "
            f"{math.isqrt(int(SCORES_BY_GROUPS_SQUARED / y.size))} are modelled, so check the "
            "columns, or leave out a grouping"
        )
    names, x = _indicators(conditions)
    if y.size <= len(names):
        raise ValueError(f"{y.size} scores cannot give {len(names)} means and their error")
    kept, inseparable = _separable(x, groups)
    members = {name: _indicators(groups[name]) for name in groups}
    z = [members[name][1] for name in kept]
    residual = y - _projected(np.concatenate([x, *z], axis=1), y)
    if residual @ residual <= 1e-20 * max(float(y @ y), np.finfo(float).tiny):
        raise ValueError(
            "the scores do not vary beyond the means and offsets, so there is no error to test "
            "against"
        )
    data = products(y, x, z)
    point = minimise(data)
    df = data.n - data.p
    variance = point.squares / df
    variances, offsets = {}, {}
    corrected = y.copy()
    for name, (levels, columns) in members.items():
        blups = np.zeros(len(levels))
        variances[name] = 0.0
        if name in kept:
            index = kept.index(name)
            variances[name] = float(point.ratios[index]) * variance
            blups = point.ratios[index] * point.zpy[data.blocks[index]] + 0.0  # never −0
        corrected -= columns @ blups
        offsets[name] = dict(zip(levels, blups.tolist(), strict=True))
    return Mixed(
        conditions=names,
        means=data.ols + point.shift,
        covariance=variance * point.unscaled,
        variances=variances,
        variance_residual=variance,
        offsets=offsets,
        corrected=corrected,
        deviance=point.deviance,
        n=data.n,
        df_residual=df,
        at_zero=tuple(name for name in kept if variances[name] == 0),
        inseparable=inseparable,
        point=point,
        blocks=data.blocks,
    )


def _indicators(labels: Sequence[str]) -> tuple[tuple[str, ...], Array]:
    """Return the labels in order of appearance, and one column of zeros and ones for each."""
    names = tuple(dict.fromkeys(labels))
    place = {name: index for index, name in enumerate(names)}
    columns = np.zeros((len(labels), len(names)))
    columns[np.arange(len(labels)), [place[label] for label in labels]] = 1.0
    return names, columns


def _projected(columns: Array, y: Array) -> Array:
    return np.asarray(columns @ np.linalg.lstsq(columns, y)[0])


def _separable(x: Array, groups: Mapping[str, Sequence[str]]) -> tuple[list[str], dict[str, str]]:
    """Return the groupings whose variance can be estimated, and why not for the others.

    Within the residuals, the matrices I and Z_k Z_kᵀ must be linearly independent, and means and
    offsets together must leave a degree of freedom.
    """
    kept: list[str] = []
    inseparable: dict[str, str] = {}
    rests: list[Array] = []
    for name in groups:
        levels, own = _indicators(groups[name])
        rest = own - _projected(x, own)
        z = [_indicators(groups[other])[1] for other in kept] + [own]
        rank = int(np.linalg.matrix_rank(np.concatenate([x, *z], axis=1)))
        if len(levels) == 1:
            inseparable[name] = f"there is only one, {levels[0]}"
        elif np.sum(rest**2) < _NOTHING * len(x):
            inseparable[name] = "it goes with the condition, so the condition means contain it"
        elif len(x) == rank:
            inseparable[name] = "each has too few scores to separate it from the residual"
        elif _dependent([*rests, rest], len(x) - x.shape[1]):
            inseparable[name] = (
                "it cannot be distinguished from the residual or from the grouping before it"
            )
        else:
            kept.append(name)
            rests.append(rest)
    return kept, inseparable


def _dependent(rests: Sequence[Array], free: int) -> bool:
    """Return whether I and the R Rᵀ of these residuals R are linearly dependent."""
    gram = np.empty((len(rests) + 1, len(rests) + 1))
    gram[0, 0] = free
    for i, first in enumerate(rests, start=1):
        gram[0, i] = gram[i, 0] = np.sum(first**2)
        for j, second in enumerate(rests, start=1):
            gram[i, j] = np.sum((first.T @ second) ** 2)
    scale = np.sqrt(np.diag(gram))
    return bool(np.linalg.eigvalsh(gram / np.outer(scale, scale))[0] < _NOTHING)
