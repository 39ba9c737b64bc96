"""Estimates and scores as tables, with subject and day, and any table as the text of a CSV file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rigidimeter.analysis.reading import estimates_document
from rigidimeter.analysis.study_anew.study import Study
from rigidimeter.core.files import csv_text, plain_values
from rigidimeter.core.records import AMPLITUDE

Rows = Sequence[Mapping[str, Any]]


def estimates_table(study: Study) -> Iterator[dict[str, Any]]:
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
        same = ("band_hz", *AMPLITUDE)
        beside = {name: two[name] for name in ("outcome", "reason", *numbers) if name not in same}
        yield {
            **whose.get(one["source"], {}),
            **one,
            "band_low_hz": low_hz,
            "band_high_hz": high_hz,
            "n_findings": len(findings),
            "findings": ", ".join(finding["name"] for finding in findings),
            "cautions": ", ".join(cautions),
            **{f"fixed_inertia_{name}": value for name, value in beside.items()},
        }


def scores_table(study: Study) -> Iterator[dict[str, Any]]:
    """Yield each score with subject and day."""
    whose = _whose(study)
    for row in estimates_document(study.analysis)["scores"]:
        cells = {name: one for name, one in row.items() if not isinstance(one, list | dict)}
        yield whose.get(row["source"], {}) | cells


def _whose(study: Study) -> dict[str, dict[str, str]]:
    return {s.source: {"subject": s.subject, "day": s.day} for s in study.sessions}


def table_csv(rows: Rows) -> str:
    """Return a table as CSV; a column is there if any row has it."""
    return csv_text(columns_of_rows(rows), rows)


def columns_of_rows(rows: Rows) -> list[str]:
    """Return the columns of a table, in their order."""
    return list(dict.fromkeys(name for row in rows for name in row))
