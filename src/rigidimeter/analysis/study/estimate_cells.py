"""Estimates and scores of a study with everything that is known of each, as tables for people.

The long table (`rows`) has a row for each measure; these have one for each epoch.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rigidimeter.analysis.reading import estimates_document
from rigidimeter.analysis.study.study import Study
from rigidimeter.core.files import plain_values
from rigidimeter.core.records import AMPLITUDE

_SAME = ("band_hz", *AMPLITUDE)
"""What is the same of the fit with the inertia held."""


def estimate_cells(study: Study) -> Iterator[dict[str, Any]]:
    """Yield each fit with subject and day, and the fit at fixed inertia beside it."""
    whose = _whose(study)
    estimates = estimates_document(study.analysis)
    fixed = estimates["fixed_inertia"]["epochs"]
    for fit, one, two in zip(study.analysis.fits, estimates["epochs"], fixed, strict=True):
        if fit.activity is not None:
            one |= plain_values(fit.activity.row())  # the stretches as a text
        low_hz, high_hz = one.pop("band_hz") or (None, None)
        findings = one.pop("findings")
        cautions = dict.fromkeys(f["name"] for f in findings if f["level"] != "note")
        # A number that does not exist is null.
        numbers = [name for name in two if isinstance(two[name], float | None)]
        beside = [name for name in ("outcome", "reason", *numbers) if name not in _SAME]
        yield (
            whose.get(one["source"], {})
            | one
            | {"band_low_hz": low_hz, "band_high_hz": high_hz}
            | {"n_findings": len(findings), "findings": ", ".join(f["name"] for f in findings)}
            | {"cautions": ", ".join(cautions)}
            | {f"fixed_inertia_{name}": two[name] for name in beside}
        )


def score_cells(study: Study) -> Iterator[dict[str, Any]]:
    """Yield each score with subject and day."""
    whose = _whose(study)
    for row in estimates_document(study.analysis)["scores"]:
        cells = {name: one for name, one in row.items() if not isinstance(one, (list, dict))}
        yield whose.get(row["source"], {}) | cells


def _whose(study: Study) -> dict[str, dict[str, str]]:
    return {one.source: {"subject": one.subject, "day": one.day} for one in study.sessions}
