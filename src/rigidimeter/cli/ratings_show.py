"""A model of ratings as JSON and as text."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigidimeter.statistics import Contrast, Mixed
    from rigidimeter.study.rating_table import Ratings

__all__ = ["RATINGS_SCHEMA", "model_notices", "ratings_document", "ratings_lines"]

RATINGS_SCHEMA = "rigidimeter.ratings/1"
CONFIDENCE = 0.95


def ratings_document(
    source: str, ratings: Ratings, fit: Mixed, pair: tuple[str, str], notices: Sequence[str]
) -> dict[str, Any]:
    """Return everything that was computed, unrounded; what does not exist is null."""
    from rigidimeter.statistics import difference, holm, joint_test, pairwise

    every = pairwise(fit)
    p_values = (holm([c.p_residual for c in every.values()]), holm(
        [c.p_satterthwaite for c in every.values()]
    ))  # fmt: skip
    return {
        "schema": RATINGS_SCHEMA,
        "source": source,
        "n": fit.n,
        "counts": _counts([row.condition for row in ratings.rows]),
        "means": _by_condition(fit, fit.means),
        "means_se": _by_condition(fit, [math.sqrt(v) for v in fit.covariance.diagonal()]),
        "contrast": _contrast(difference(fit, *pair), pair),
        "contrasts": [
            _contrast(c, names) | {"p_residual_holm": one, "p_satterthwaite_holm": two}
            for (names, c), one, two in zip(every.items(), *p_values, strict=True)
        ],
        "joint": _finite(asdict(joint_test(fit))),
        "offsets": dict(next(iter(fit.offsets.values()))),
        "offsets_by": {name: dict(found) for name, found in fit.offsets.items()},
        "variance_examiner": fit.variances.get("examiner"),
        "variance_residual": fit.variance_residual,
        "variances": dict(fit.variances),
        "reml_deviance": fit.deviance,
        "corrected": fit.corrected.tolist(),
        "rows": [
            {name: value for name, value in asdict(row).items() if value != ""}
            | {"corrected": corrected}
            for row, corrected in zip(ratings.rows, fit.corrected.tolist(), strict=True)
        ],
        "left_out_lines": list(ratings.left_out),
        "notices": list(notices),
    }


def model_notices(fit: Mixed) -> list[str]:
    """Say in words where a variance is at its boundary or cannot be told."""
    said = [
        f"the variance of {name} is estimated as zero, its boundary: they differ no more than the "
        "residual explains, so all their offsets are zero and no score is corrected for them"
        for name in fit.at_zero
    ]
    for name, reason in fit.untold.items():
        said.append(f"{name} was left out of the model: {reason}; its offsets are zero")
    return said


def ratings_lines(
    source: str, ratings: Ratings, fit: Mixed, pair: tuple[str, str], notices: Sequence[str]
) -> list[str]:
    """Return the table and its sentences."""
    from rigidimeter.statistics import difference, joint_test, pairwise

    conditions = [row.condition for row in ratings.rows]
    offsets = " + ".join(f"offset of {name}" for name in fit.variances)
    lines = [
        f"{source}: {fit.n} ratings in {len(fit.conditions)} conditions",
        f"score = mean of condition + {offsets} + error, fitted by REML",
        "",
        f"{'condition':>12}  {'n':>4}  {'mean':>8}  {'SE':>8}",
    ]
    for index, name in enumerate(fit.conditions):
        se = math.sqrt(fit.covariance[index, index])
        count = conditions.count(name)
        lines.append(f"{name:>12}  {count:4d}  {fit.means[index]:8.4f}  {se:8.4f}")
    for group, found in fit.offsets.items():
        labels = _labels(ratings, group)
        lines += ["", f"{group:>12}  {'n':>4}  {'offset':>8}"]
        lines += [f"{name:>12}  {labels.count(name):4d}  {b:8.4f}" for name, b in found.items()]
        variance = fit.variances[group]
        lines.append(f"Variance of {group}: {variance:.4g} (SD {math.sqrt(variance):.4g}).")
    residual = fit.variance_residual
    lines.append(f"Variance of the residual: {residual:.4g} (SD {math.sqrt(residual):.4g}).")
    lines += ["", *_contrast_lines(difference(fit, *pair), pair)]
    if len(fit.conditions) > 2:
        lines += ["", "All pairs (p unadjusted; Holm's are in the JSON file):"]
        for names, c in pairwise(fit).items():
            lines.append(
                f"  {names[0]} minus {names[1]}: {c.estimate:.4g}, SE {c.se:.4g}, "
                f"p {c.p_residual:.3g} (residual), {c.p_satterthwaite:.3g} (Satterthwaite)"
            )
        j = joint_test(fit)
        lines.append(
            f"All means equal: F({j.df_numerator}, {j.df_residual:.4g}) = {j.f:.4g}, "
            f"p = {j.p_residual:.3g}; Satterthwaite F({j.df_numerator}, {j.df_satterthwaite:.4g}), "
            f"p = {j.p_satterthwaite:.3g}"
        )
    lines += ["", "Corrected score = score less the offsets of its groups."]
    if notices:
        lines += ["", "To be known:", *(f"  - {text}" for text in notices)]
    return lines


def _contrast_lines(c: Contrast, pair: tuple[str, str]) -> list[str]:
    from scipy.stats import t

    first, second = pair
    reach = float(t.isf((1 - CONFIDENCE) / 2, c.df_residual)) * c.se
    way = "higher" if c.estimate > 0 else "lower" if c.estimate < 0 else "neither higher nor lower"
    return [
        f"{first} minus {second}: {c.estimate:.4g} "
        f"[{c.estimate - reach:.4g} to {c.estimate + reach:.4g}, 95 %], SE {c.se:.4g}",
        f"  F(1, {c.df_residual:.4g}) = {c.f:.4g}, p = {c.p_residual:.3g}   "
        "residual degrees of freedom, n − p",
        f"  F(1, {c.df_satterthwaite:.4g}) = {c.f:.4g}, p = {c.p_satterthwaite:.3g}   "
        "Satterthwaite",
        f"  F(1, {c.df_kenward_roger:.4g}) = {c.f_kenward_roger:.4g}, "
        f"p = {c.p_kenward_roger:.3g}   Kenward and Roger",
        f"{first} was rated {way} than {second}; a positive difference means {first} is higher.",
    ]


def _contrast(c: Contrast, pair: tuple[str, str]) -> dict[str, Any]:
    return {"first": pair[0], "second": pair[1], "convention": f"{pair[0]} minus {pair[1]}"} | {
        name: value for name, value in _finite(asdict(c)).items() if name != "weights"
    }


def _finite(values: dict[str, Any]) -> dict[str, Any]:
    return {k: None if isinstance(v, float) and math.isnan(v) else v for k, v in values.items()}


def _by_condition(fit: Mixed, values: Any) -> dict[str, float]:
    return {name: float(value) for name, value in zip(fit.conditions, values, strict=True)}


def _counts(labels: Sequence[str]) -> Mapping[str, int]:
    return {name: labels.count(name) for name in dict.fromkeys(labels)}


def _labels(ratings: Ratings, group: str) -> list[str]:
    if group == "subject/day":
        return [f"{row.subject}/{row.day}" for row in ratings.rows]
    return [getattr(row, group) for row in ratings.rows]
