"""A mixed model of the ratings in any table, with every contrast of its conditions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rigidimeter.errors import UserError
from rigidimeter.recording.formats import TextTable
from rigidimeter.statistics import (
    Contrast,
    JointTest,
    Mixed,
    difference,
    fit_mixed,
    holm,
    interval_of,
    joint_test,
    pairwise,
)
from rigidimeter.study.rating_table import RANDOM, Rating, groupings, ratings_of
from rigidimeter.study.ratings_model import variance_notices

__all__ = ["RatingsModel", "RatingsPair", "model_ratings", "ratings_document"]

RATINGS_SCHEMA = "rigidimeter.ratings/1"


@dataclass(frozen=True)
class RatingsPair:
    """The contrast of two conditions, with p by Holm's method for all pairs."""

    first: str
    second: str
    contrast: Contrast
    p_residual_holm: float
    p_satterthwaite_holm: float


@dataclass(frozen=True)
class RatingsModel:
    """What the ratings of a table say.

    Attributes
    ----------
    source : str
    rows : tuple of Rating
    left_out_lines : tuple of int
        Of rows without a score or a label.
    fit : Mixed
    pair : (str, str)
        The two conditions of `contrast`; the estimate is first − second.
    contrast : Contrast
    low, high : float
        The 95 % interval of the contrast with residual degrees of freedom.
    pairs : tuple of RatingsPair
        Every two conditions.
    joint : JointTest
        Of all means being equal.
    notices, model_notices : tuple of str
        What is odd about the ratings, and about the variances of the model.
    """

    source: str
    rows: tuple[Rating, ...]
    left_out_lines: tuple[int, ...]
    fit: Mixed
    pair: tuple[str, str]
    contrast: Contrast
    low: float
    high: float
    pairs: tuple[RatingsPair, ...]
    joint: JointTest
    notices: tuple[str, ...]
    model_notices: tuple[str, ...]

    @property
    def counts(self) -> dict[str, int]:
        """Ratings by condition."""
        return _counts([row.condition for row in self.rows])

    def counts_of(self, grouping: str) -> dict[str, int]:
        """Return how many ratings each label of a grouping has."""
        return _counts(groupings(self.rows, [grouping])[grouping])


def model_ratings(
    table: TextTable,
    columns: Mapping[str, str],
    random: Sequence[str] = ("examiner",),
    *,
    scale: tuple[float, float] = (0.0, 3.0),
    step: float = 0.5,
    pair: tuple[str, str] | None = None,
) -> RatingsModel:
    """Fit a mean for each condition and a random offset for each label of the groupings.

    Parameters
    ----------
    table : TextTable
    columns : mapping of str to str
        What the table calls condition, score, examiner, subject and day.
    random : sequence of str
        Names out of `RANDOM`.
    scale : tuple of float
        Lowest and highest rating there is.
    step : float
        Of the scale; 0 for none.
    pair : (str, str), optional
        The contrast; by default the first two conditions, ``OFF`` first where it occurs.

    Raises
    ------
    UserError
        If an option is wrong, or the table holds no ratings that can be modelled.
    """
    chosen = tuple(dict.fromkeys(random))
    for name in chosen:
        if name not in RANDOM:
            raise UserError(f"--random {name}: must be one of {', '.join(RANDOM)}")
    if not (scale[0] < scale[1] and step >= 0 and abs(sum(scale)) < float("inf")):
        raise UserError(
            f"--scale {scale[0]:g} {scale[1]:g} --step {step:g}: write the lowest and then the "
            "highest rating, and a step of 0 or more"
        )
    found = ratings_of(table, columns, chosen, scale, step)
    conditions = [row.condition for row in found.rows]
    first, second = pair or _first_two(conditions)
    for name in (first, second):
        if name not in conditions:
            known = ", ".join(dict.fromkeys(conditions))
            raise UserError(f"--contrast {name}: there is no such condition; rated are: {known}")
    if first == second:
        raise UserError(f"--contrast {first} {second}: name two different conditions")
    try:
        fit = fit_mixed(
            [row.score for row in found.rows], conditions, groupings(found.rows, chosen)
        )
    except (ValueError, ArithmeticError) as error:
        raise UserError(f"{table.source}: {error}") from None
    contrast = difference(fit, first, second)
    low, high = interval_of(contrast.estimate, contrast.se, contrast.df_residual)
    every = pairwise(fit)
    adjusted = zip(
        holm([c.p_residual for c in every.values()]),
        holm([c.p_satterthwaite for c in every.values()]),
        strict=True,
    )
    return RatingsModel(
        source=table.source,
        rows=found.rows,
        left_out_lines=found.left_out,
        fit=fit,
        pair=(first, second),
        contrast=contrast,
        low=low,
        high=high,
        pairs=tuple(
            RatingsPair(*names, c, *p)
            for (names, c), p in zip(every.items(), adjusted, strict=True)
        ),
        joint=joint_test(fit),
        notices=found.notices,
        model_notices=tuple(variance_notices(fit)),
    )


def _first_two(conditions: Sequence[str]) -> tuple[str, str]:
    first, second, *_ = sorted(dict.fromkeys(conditions), key=lambda name: name != "OFF")
    return first, second


def ratings_document(found: RatingsModel) -> dict[str, Any]:
    """Return everything that was computed; what does not exist is null when it is written."""
    fit = found.fit
    return {
        "schema": RATINGS_SCHEMA,
        "source": found.source,
        "n": fit.n,
        "counts": found.counts,
        "means": dict(zip(fit.conditions, fit.means.tolist(), strict=True)),
        "means_se": {
            name: math.sqrt(variance)
            for name, variance in zip(fit.conditions, fit.covariance.diagonal(), strict=True)
        },
        "contrast": _contrast(found.contrast, *found.pair),
        "contrasts": [
            _contrast(pair.contrast, pair.first, pair.second)
            | {
                "p_residual_holm": pair.p_residual_holm,
                "p_satterthwaite_holm": pair.p_satterthwaite_holm,
            }
            for pair in found.pairs
        ],
        "joint": asdict(found.joint),
        "offsets": dict(next(iter(fit.offsets.values()))),
        "offsets_by": {name: dict(offsets) for name, offsets in fit.offsets.items()},
        "variance_examiner": fit.variances.get("examiner"),
        "variance_residual": fit.variance_residual,
        "variances": dict(fit.variances),
        "reml_deviance": fit.deviance,
        "corrected": fit.corrected.tolist(),
        "rows": [
            {name: value for name, value in asdict(row).items() if value != ""}
            | {"corrected": corrected}
            for row, corrected in zip(found.rows, fit.corrected.tolist(), strict=True)
        ],
        "left_out_lines": list(found.left_out_lines),
        "notices": [*found.notices, *found.model_notices],
    }


def _contrast(c: Contrast, first: str, second: str) -> dict[str, Any]:
    who = {"first": first, "second": second, "convention": f"{first} minus {second}"}
    return who | {name: value for name, value in asdict(c).items() if name != "weights"}


def _counts(labels: Sequence[str]) -> dict[str, int]:
    return {name: labels.count(name) for name in dict.fromkeys(labels)}
