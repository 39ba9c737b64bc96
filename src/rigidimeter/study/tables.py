"""A study's conclusions as plain values and as tables: everything, unrounded.

Two analyses of the same inputs give the same bytes: no time, and no place, is written down.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from rigidimeter.documents import csv_text, plain_values
from rigidimeter.recording import estimates_document
from rigidimeter.study.comparison import Comparison
from rigidimeter.study.results import Cohort, RatingsFound, Study

__all__ = ["STUDY_COMPARISON_SCHEMA", "comparison_row", "study_document", "study_tables"]

STUDY_COMPARISON_SCHEMA = "rigidimeter.study-comparison/1"
TEST = "Wilcoxon rank-sum, two-sided, asymptotic, tie and continuity corrected"


def study_document(study: Study, cohort: Cohort, place: str) -> dict[str, Any]:
    """Return every conclusion of a study; what does not exist is null.

    `place` is the study's folder as sentences name it; it is taken out of them.
    """
    analysis = study.analysis
    document = {
        "schema": STUDY_COMPARISON_SCHEMA,
        "title": study.title,
        "blinded": cohort.blinded,
        "virtual": cohort.virtual,
        "conditions": [asdict(condition) for condition in cohort.conditions],
        "sessions": [asdict(session) for session in cohort.sessions],
        "left_out": [asdict(out) for out in cohort.left_out],
        "method": analysis.method,
        "method_reason": analysis.method_reason,
        "inertia_kg_m2": analysis.inertia_kg_m2,
        "inertia_by_subject": cohort.several,
        "comparisons": [comparison_row(comparison) for comparison in study.comparisons],
        "days": [asdict(day) for day in cohort.days],
        "day_tests": [asdict(test) for test in cohort.day_tests],
        "effects": [asdict(effect) for effect in cohort.effects],
        "effect_differences": [
            {"first": first, "second": second} | asdict(difference)
            for (first, second), difference in cohort.differences.items()
        ],
        "ratings": None if cohort.ratings is None else _ratings(cohort.ratings),
        "sensitivity": [asdict(row) for row in cohort.sensitivity],
        "exclusions": [asdict(exclusion) for exclusion in cohort.exclusions],
        "notices": [
            {"level": notice.level, "text": notice.text.replace(f"{place}/", "")}
            for notice in study.notices
        ],
    }
    plain = plain_values(document)
    assert isinstance(plain, dict)
    return plain


def comparison_row(comparison: Comparison) -> dict[str, Any]:
    """Return one comparison of epochs."""
    names = [name for name in (comparison.reference, comparison.other) if name]
    row = {
        "measure": comparison.measure,
        "unit": comparison.unit,
        "reference": comparison.reference,
        "other": comparison.other,
        "groups": {
            name: asdict(comparison.summaries[name]) | {"excluded": comparison.excluded[name]}
            for name in names
        },
        "test": TEST,
        **(asdict(comparison.test) if comparison.test is not None else {}),
        "remark": comparison.remark,
    }
    plain = plain_values(row)
    assert isinstance(plain, dict)
    return plain


def _ratings(found: RatingsFound) -> dict[str, Any]:
    fit = found.fit
    errors = [math.sqrt(value) for value in fit.covariance.diagonal().tolist()]
    columns = ("condition", "examiner", "subject", "day", "score")
    return {
        "source": found.source,
        "n": fit.n,
        "reference": found.reference,
        "other": found.other,
        "means": dict(zip(fit.conditions, fit.means.tolist(), strict=True)),
        "means_se": dict(zip(fit.conditions, errors, strict=True)),
        "variances": dict(fit.variances),
        "variance_residual": fit.variance_residual,
        "offsets": {name: dict(offsets) for name, offsets in fit.offsets.items()},
        "reml_deviance": fit.deviance,
        "contrast": asdict(found.contrast),
        "contrast_days": None if found.contrast_days is None else asdict(found.contrast_days),
        "rows": [
            dict(zip(columns, row, strict=True)) | {"corrected": corrected}
            for row, corrected in zip(found.rows, fit.corrected.tolist(), strict=True)
        ],
        "notices": list(found.notices),
    }


def study_tables(study: Study, cohort: Cohort) -> dict[str, str]:
    """Return the tables as CSV by file name; one without rows is left out."""
    estimates = estimates_document(study.analysis)
    fixed = estimates["fixed_inertia"]["epochs"]
    epochs = [
        one | {f"fixed_inertia_{name}": value for name, value in two.items() if name in one
               and isinstance(value, float)}
        for one, two in zip(estimates["epochs"], fixed, strict=True)
    ]  # fmt: skip
    whose = {s.source: {"subject": s.subject, "day": s.day} for s in cohort.sessions}
    ratings = cohort.ratings
    tables: dict[str, Sequence[Mapping[str, Any]]] = {
        "comparisons": [_flat(comparison_row(c)) for c in study.comparisons],
        "days": [asdict(day) for day in cohort.days],
        "day_tests": [asdict(test) for test in cohort.day_tests],
        "effects": [_flat(asdict(effect)) for effect in cohort.effects],
        "effect_differences": [
            {"first": first, "second": second} | asdict(difference)
            for (first, second), difference in cohort.differences.items()
        ],
        "ratings": [] if ratings is None else _ratings(ratings)["rows"],
        "sensitivity": [asdict(row) for row in cohort.sensitivity],
        "exclusions": [asdict(exclusion) for exclusion in cohort.exclusions],
        "left_out": [asdict(out) for out in cohort.left_out],
        "epochs": [whose[row["source"]] | _flat(row) for row in epochs],
        "scores": [whose[row["source"]] | _flat(row) for row in estimates["scores"]],
    }
    return {
        f"{name}.csv": csv_text(list(dict.fromkeys(key for row in rows for key in row)), rows)
        for name, rows in tables.items()
        if rows
    }


def _flat(row: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return nested tables as columns with compound names; lists are left out."""
    flat: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{name}_")
        elif not isinstance(value, (list, tuple)):
            flat[prefix + name] = value
    return flat
