"""What a mixed model of examiners' ratings says: its numbers, its rows and its document."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

from rigidimeter.analysis.statistics import (
    Contrast,
    JointTest,
    Mixed,
    contrast,
    difference,
    fit_mixed,
    holm,
    interval_of,
    joint_test,
)
from rigidimeter.analysis.study.measures import off_first
from rigidimeter.analysis.study.rating_table import Rating, groupings

RATINGS_SCHEMA = "rigidimeter.ratings/1"


@dataclass(frozen=True)
class RatingMean:
    """The model's mean rating in one condition, with its 95 % interval by Kenward and Roger."""

    condition: str
    mean: float
    low: float
    high: float


@dataclass(frozen=True)
class RatingsPair:
    """The contrast of two conditions, with p by Holm's method for all pairs."""

    first: str
    second: str
    contrast: Contrast
    p_residual_holm: float
    p_satterthwaite_holm: float
    p_kenward_roger_holm: float


@dataclass(frozen=True)
class RatingsFound:
    """What the ratings say: a model with a mean for each condition, and the contrast of two.

    Attributes
    ----------
    source : str
        The table.
    rows : tuple of Rating
        In the order of the table; the corrected scores in `fit` go with them.
    fit : Mixed
    reference, other : str
        The two conditions of `contrast`; its estimate is other − reference.
    notices : tuple of str
        What is odd about the ratings.
    left_out_lines : tuple of int
        Of rows without a score or a label.
    contrast_days : Contrast or None
        The contrast with an offset for every day too; None where the data cannot separate days, or
        days were not asked for.
    means_days : (float, float)
        The means of the two conditions in that model; NaN without it.
    """

    source: str
    rows: tuple[Rating, ...]
    fit: Mixed
    reference: str
    other: str
    notices: tuple[str, ...] = ()
    left_out_lines: tuple[int, ...] = ()
    contrast_days: Contrast | None = None
    means_days: tuple[float, float] = (math.nan, math.nan)

    @cached_property
    def contrast(self) -> Contrast:
        """The contrast of the two conditions."""
        return difference(self.fit, self.other, self.reference)

    @property
    def by_day(self) -> bool:
        """Whether the model has an offset for each day, so that n − p is too many."""
        return any("day" in name for name in self.fit.variances)

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the contrast; with days after Kenward and Roger, else with n − p."""
        c = self.contrast
        if self.by_day:
            return interval_of(c.estimate, c.se_kenward_roger, c.df_kenward_roger)
        return interval_of(c.estimate, c.se, c.df_residual)

    @cached_property
    def means(self) -> tuple[RatingMean, ...]:
        """The mean of each condition."""
        means = []
        for name in self.fit.conditions:
            one = contrast(self.fit, [float(each == name) for each in self.fit.conditions])
            low, high = interval_of(one.estimate, one.se_kenward_roger, one.df_kenward_roger)
            means.append(RatingMean(name, one.estimate, low, high))
        return tuple(means)

    @cached_property
    def pairs(self) -> tuple[RatingsPair, ...]:
        """The contrasts of every two conditions: a later one less an earlier one, OFF first."""
        names = itertools.combinations(off_first(self.fit.conditions), 2)
        every = {(b, a): difference(self.fit, b, a) for a, b in names}
        residual, satterthwaite, kenward_roger = (
            holm([getattr(c, key) for c in every.values()])
            for key in ("p_residual", "p_satterthwaite", "p_kenward_roger")
        )
        return tuple(
            RatingsPair(*names, c, *p)
            for (names, c), *p in zip(
                every.items(), residual, satterthwaite, kenward_roger, strict=True
            )
        )

    @cached_property
    def joint(self) -> JointTest:
        """The test of all means being equal."""
        return joint_test(self.fit)

    @property
    def model_notices(self) -> tuple[str, ...]:
        """Where a variance is at its boundary or cannot be estimated, in sentences."""
        at_zero = [
            f"the variance of {name} is estimated as zero, its boundary: they differ no more than "
            "the residual explains, so all their offsets are zero and no score is corrected for "
            "them"
            for name in self.fit.at_zero
        ]
        left_out = [
            f"{name} was left out of the model: {reason}; its offsets are zero"
            for name, reason in self.fit.inseparable.items()
        ]
        return (*at_zero, *left_out)

    @property
    def counts(self) -> dict[str, int]:
        """Ratings by condition."""
        return _counts([row.condition for row in self.rows])

    def counts_of(self, grouping: str) -> dict[str, int]:
        """Return how many ratings each label of a grouping has."""
        return _counts(groupings(self.rows, [grouping])[grouping])


def fit_ratings(
    source: str,
    rows: Sequence[Rating],
    random: Sequence[str],
    pair: tuple[str, str],
    notices: Sequence[str] = (),
    left_out_lines: Sequence[int] = (),
) -> RatingsFound:
    """Fit a mean for each condition and a random offset for each label of the groupings.

    Raises
    ------
    ValueError, ArithmeticError
        If the ratings cannot be modelled.
    """
    scores, conditions = [row.score for row in rows], [row.condition for row in rows]
    fit = fit_mixed(scores, conditions, groupings(rows, random))
    return RatingsFound(source, tuple(rows), fit, *pair, tuple(notices), tuple(left_out_lines))


def with_days(found: RatingsFound, fit: Mixed | None) -> RatingsFound:
    """Return the ratings with the contrast of a model that has an offset for every day too."""
    if fit is None:
        return found
    first, second = (
        float(fit.means[fit.conditions.index(name)]) for name in (found.reference, found.other)
    )
    contrast_days = difference(fit, found.other, found.reference)
    return replace(found, contrast_days=contrast_days, means_days=(first, second))


def ratings_document(found: RatingsFound) -> dict[str, Any]:
    """Return everything that was computed; what does not exist is null when it is written."""
    fit = found.fit
    errors = [math.sqrt(value) for value in fit.covariance.diagonal().tolist()]
    return {
        "schema": RATINGS_SCHEMA,
        "source": found.source,
        "n": fit.n,
        "counts": found.counts,
        "means": dict(zip(fit.conditions, fit.means.tolist(), strict=True)),
        "means_se": dict(zip(fit.conditions, errors, strict=True)),
        "means_low": {mean.condition: mean.low for mean in found.means},
        "means_high": {mean.condition: mean.high for mean in found.means},
        "contrast": _contrast(found.contrast, found.other, found.reference),
        "contrast_days": None
        if found.contrast_days is None
        else _contrast(found.contrast_days, found.other, found.reference),
        "contrasts": [
            _contrast(pair.contrast, pair.first, pair.second)
            | {
                "p_residual_holm": pair.p_residual_holm,
                "p_satterthwaite_holm": pair.p_satterthwaite_holm,
                "p_kenward_roger_holm": pair.p_kenward_roger_holm,
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
        "rows": rating_rows(found),
        "left_out_lines": list(found.left_out_lines),
        "notices": [*found.notices, *found.model_notices],
    }


def rating_rows(found: RatingsFound) -> list[dict[str, Any]]:
    """Return every rating as given, and less the offsets."""
    return [
        {name: value for name, value in asdict(row).items() if value != ""}
        | {"corrected": corrected}
        for row, corrected in zip(found.rows, found.fit.corrected.tolist(), strict=True)
    ]


def rating_offsets(found: RatingsFound) -> Iterator[dict[str, Any]]:
    """Yield every offset, with the number of ratings that it was predicted from."""
    for grouping, offsets in found.fit.offsets.items():
        sd, counts = math.sqrt(found.fit.variances[grouping]), found.counts_of(grouping)
        for name, offset in offsets.items():
            yield {"grouping": grouping, "name": name, "ratings": counts[name], "offset": offset,
                   "sd": sd}  # fmt: skip


def rating_contrast(found: RatingsFound) -> Iterator[dict[str, Any]]:
    """Yield the contrast by each choice of degrees of freedom, with its 95 % interval."""
    yield from _choices(found.contrast)
    if found.contrast_days is not None:
        *_, last = _choices(found.contrast_days)
        yield last | {"freedom": f"{last['freedom']}, with an offset for each day too"}


def _choices(c: Contrast) -> Iterator[dict[str, Any]]:
    for name, se, f, df, p in (
        ("residual, n − p", c.se, c.f, c.df_residual, c.p_residual),
        ("Satterthwaite", c.se, c.f, c.df_satterthwaite, c.p_satterthwaite),
        ("Kenward–Roger", c.se_kenward_roger, c.f_kenward_roger, c.df_kenward_roger,
         c.p_kenward_roger),
    ):  # fmt: skip
        low, high = interval_of(c.estimate, se, df)
        yield {"freedom": name, "estimate": c.estimate, "low": low, "high": high, "se": se,
               "f": f, "df": df, "p": p}  # fmt: skip


def _contrast(c: Contrast, first: str, second: str) -> dict[str, Any]:
    who = {"first": first, "second": second, "convention": f"{first} minus {second}"}
    known = ("weights", "df_numerator")  # from first, second: 1, −1 and one contrast
    return who | {name: value for name, value in asdict(c).items() if name not in known}


def _counts(labels: Sequence[str]) -> dict[str, int]:
    return {name: labels.count(name) for name in dict.fromkeys(labels)}
