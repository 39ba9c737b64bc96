"""The ratings of a study as plain values and as rows of tables."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from rigidimeter.statistics import Contrast, interval_of

if TYPE_CHECKING:
    from rigidimeter.study.results import RatingsFound

__all__ = ["rating_contrast", "rating_offsets", "rating_rows", "ratings_values"]


def ratings_values(found: RatingsFound) -> dict[str, Any]:
    """Return the model, its contrasts and its ratings as a comparison document holds them."""
    fit = found.fit
    errors = [math.sqrt(value) for value in fit.covariance.diagonal().tolist()]
    return {
        "source": found.source,
        "n": fit.n,
        "reference": found.reference,
        "other": found.other,
        "means": dict(zip(fit.conditions, fit.means.tolist(), strict=True)),
        "means_se": dict(zip(fit.conditions, errors, strict=True)),
        "means_low": {mean.condition: mean.low for mean in found.means},
        "means_high": {mean.condition: mean.high for mean in found.means},
        "variances": dict(fit.variances),
        "variance_residual": fit.variance_residual,
        "offsets": {name: dict(offsets) for name, offsets in fit.offsets.items()},
        "reml_deviance": fit.deviance,
        "contrast": asdict(found.contrast),
        "contrast_days": None if found.contrast_days is None else asdict(found.contrast_days),
        "rows": rating_rows(found),
        "notices": list(found.notices),
    }


def rating_rows(found: RatingsFound) -> list[dict[str, Any]]:
    """Return every rating as given, and less the offsets."""
    columns = ("condition", "examiner", "subject", "day", "score")
    return [
        dict(zip(columns, row, strict=True)) | {"corrected": corrected}
        for row, corrected in zip(found.rows, found.fit.corrected.tolist(), strict=True)
    ]


def rating_offsets(found: RatingsFound) -> Iterator[dict[str, Any]]:
    """Yield every offset; the count of ratings where one column of the table tells it."""
    for grouping, offsets in found.fit.offsets.items():
        sd = math.sqrt(found.fit.variances[grouping])
        place = {"examiner": 1, "subject": 2}.get(grouping)
        for name, offset in offsets.items():
            count = None if place is None else sum(row[place] == name for row in found.rows)
            yield {"grouping": grouping, "name": name, "ratings": count, "offset": offset, "sd": sd}


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
