"""Estimates as files: JSON with everything, CSV with the epoch table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast, get_args

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import (
    ESTIMATES_BYTES,
    csv_text,
    json_text,
    plain_values,
    read_json,
    size_text,
    write_dictionary_beside,
    write_text,
)
from rigidimeter.core.findings import finding_from
from rigidimeter.core.records import (
    AMPLITUDE,
    BAND_VECTORS,
    PARAMETER_VECTORS,
    PARAMETERS,
    STATISTICS,
    Analysis,
    Axis,
    BandEstimate,
    Delay,
    Fit,
    Outcome,
    Score,
    activity_from,
    readonly,
)

ESTIMATES_SCHEMA = "rigidimeter.estimates/2"

_PARAMETERS = tuple(parameter.name for parameter in PARAMETERS)


def estimates_document(analysis: Analysis) -> dict[str, Any]:
    """Return an analysis as plain values; numbers that do not exist are null."""
    document = {
        "schema": ESTIMATES_SCHEMA,
        "method": analysis.method,
        "method_reason": analysis.method_reason,
        "axis": analysis.axis,
        "weight_in_stiffness": analysis.weight_in_stiffness,
        "delays": [vars(delay) for delay in analysis.delays],
        "pooled": _pooled(analysis.pooled),
        "epochs": [_fit_row(fit) for fit in analysis.fits],
        "fixed_inertia": {
            "inertia_kg_m2": analysis.inertia_kg_m2,
            "epochs": [_fit_row(fit) for fit in analysis.fixed_inertia],
        },
        "scores": [score.row() for score in analysis.scores],
        "sensitivity": [one.row() for one in analysis.sensitivity],
        "across": [finding.row() for finding in analysis.across],
    }
    return dict(plain_values(document))


def write_estimates_json(path: Path, analysis: Analysis) -> None:
    """Write the document of an analysis.

    Raises
    ------
    UserError
        If it would be larger than what is read back.
    """
    text = json_text(estimates_document(analysis))
    size = len(text.encode())
    if size > ESTIMATES_BYTES:
        raise UserError(
            f"{path}: {len(analysis.fits)} epochs take {size_text(size)} as JSON, and at most "
            f"{size_text(ESTIMATES_BYTES)} are read; write them as CSV, or use `rigidimeter batch`"
        )
    write_text(path, text)


def write_estimates_csv(path: Path, analysis: Analysis) -> None:
    """Write the epoch table: one row a fit, with B and K at fixed inertia beside, full precision.

    An analysis of sinusoids alone gives the table of scores.
    """
    rows = analysis.rows()
    # Epochs with EMG have more columns than others.
    columns = dict.fromkeys(name for row in rows for name in row) or ["epoch"]
    write_text(path, csv_text(list(columns), rows))
    write_dictionary_beside(path, "estimates" if analysis.fits else "scores", columns)


def read_estimates(path: Path) -> Analysis:
    """Read back what `write_estimates_json` wrote.

    Raises
    ------
    UserError
        If the file is not such a document.
    """
    document = read_json(path, ESTIMATES_BYTES)
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema != ESTIMATES_SCHEMA:
        raise UserError(f"{path}: schema is {schema!r}; expected {ESTIMATES_SCHEMA!r}")
    try:
        method = str(document["method"])
        fixed = document["fixed_inertia"]
        return Analysis(
            method,
            tuple(_fit(row, method) for row in document["epochs"]),
            tuple(_fit(row, method) for row in fixed["epochs"]),
            _number(fixed["inertia_kg_m2"]),
            tuple(_score(row) for row in document["scores"]),
            _read_pooled(document["pooled"], method),
            tuple(_read_delay(row) for row in document["delays"]),
            str(document["method_reason"]),
            tuple(_band_estimate(row) for row in document["sensitivity"]),
            tuple(map(finding_from, document["across"])),
            _axis(document),
        )
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise UserError(
            f"{path}: is not a complete {ESTIMATES_SCHEMA} document ({error})"
        ) from None


def _axis(document: Mapping[str, Any]) -> Axis:
    """Return how the axis stands."""
    stated = document["axis"]
    if stated not in get_args(Axis):
        raise ValueError(f"axis {stated!r}")
    return cast("Axis", stated)


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


def _read_outcome(row: Mapping[str, Any], numbers: Sequence[str]) -> Outcome:
    kind = row["outcome"]
    if kind not in ("included", "excluded", "failed"):
        raise ValueError(f"outcome {kind!r}")
    if kind == "included" and not all(math.isfinite(_number(row[name])) for name in numbers):
        raise ValueError(f"epoch {row['epoch']} is included without all its numbers")
    return Outcome(kind, str(row["reason"]))


def _fit_row(fit: Fit) -> dict[str, Any]:
    band = list(fit.band_hz) if all(map(math.isfinite, fit.band_hz)) else None
    findings = [finding.row() for finding in fit.findings]
    activity = {} if fit.activity is None else fit.activity.document()
    return fit.row() | activity | {"band_hz": band, "findings": findings}


def _pooled(fits: Sequence[Fit]) -> dict[str, Any] | None:
    """Return the fit to all epochs, and under `conditions` that to each; None without any."""
    if not fits:
        return None
    conditions = {fit.condition: _fit_row(fit) for fit in fits if fit.condition or len(fits) == 1}
    return {**_fit_row(fits[-1]), "conditions": conditions}


def _fit(row: Mapping[str, Any], method: str) -> Fit:
    low, high = row["band_hz"] or (math.nan, math.nan)
    numbers: dict[str, Any] = {
        vector: readonly([_number(row[name + ending]) for name in _PARAMETERS])
        for vector, ending in PARAMETER_VECTORS.items()
    }
    numbers |= {name: _number(row[name]) for name in (*STATISTICS, *AMPLITUDE)}
    return Fit(
        source=str(row["source"]),
        epoch=str(row["epoch"]),
        condition=str(row["condition"]),
        method=method,
        outcome=_read_outcome(row, _PARAMETERS),
        n_samples=int(row["n_samples"]),
        band_hz=(float(low), float(high)),
        findings=tuple(finding_from(found) for found in row["findings"]),
        activity=activity_from(row),
        **numbers,
    )


def _band_estimate(row: Mapping[str, Any]) -> BandEstimate:
    vectors: dict[str, Any] = {
        vector: tuple(_number(row[name + ending]) for name in _PARAMETERS)
        for vector, ending in BAND_VECTORS.items()
    }
    low_hz, high_hz = _number(row["low_hz"]), _number(row["high_hz"])
    return BandEstimate(str(row["condition"]), low_hz, high_hz, str(row["part"]), **vectors)


def _read_delay(row: Mapping[str, Any]) -> Delay:
    return Delay(
        str(row["source"]),
        _number(row["delay_s"]),
        _number(row["delay_s_se"]),
        bool(row["corrected"]),
        str(row["remark"]),
    )


def _read_pooled(row: Mapping[str, Any] | None, method: str) -> tuple[Fit, ...]:
    if row is None:
        return ()
    fits = [_fit(part, method) for part in row["conditions"].values()]
    overall = _fit(row, method)
    return tuple(fits if overall in fits else [*fits, overall])


def _score(row: Mapping[str, Any]) -> Score:
    return Score(
        source=str(row["source"]),
        epoch=str(row["epoch"]),
        condition=str(row["condition"]),
        outcome=_read_outcome(row, ("impulse_nm_s", "work_j")),
        impulse_nm_s=_number(row["impulse_nm_s"]),
        work_j=_number(row["work_j"]),
        n_cycles=int(row["n_cycles"]),
        frequency_hz=_number(row["frequency_hz"]),
    )
