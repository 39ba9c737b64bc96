"""The document of a session as tables, for formats in which people look at tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.clocked_table import (
    EXCLUDED,
    TIME,
    Stream,
    with_intervals,
)
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.files import as_written
from rigidimeter.core.records import FIT_NUMBERS, PARAMETERS

_Row = dict[str, Any]

_HELD = {f"{PARAMETERS[0].name}{ending}" for ending in ("_se", "_low", "_high", "_bound")}
"""Of a J that was held there is nothing to tell."""


def document_tables(about: Mapping[str, Any]) -> dict[str, list[_Row]]:
    """Return the tables of a document by name, without empty ones."""
    estimates = about.get("estimates") or {}
    fixed = (estimates.get("fixed_inertia") or {}).get("epochs", [])
    tables = {
        "epochs": [_plain(epoch) for epoch in about["epochs"]],
        "estimates": [
            _estimate(fit, held)
            for fit, held in zip(estimates.get("epochs", []), fixed, strict=True)
        ],
        "scores": list(estimates.get("scores", [])),
        "ratings": list(about.get("ratings", [])),
        "stimulation": [
            {"condition": name, **facts} for name, facts in about.get("stimulation", {}).items()
        ],
    }
    return {name: rows for name, rows in tables.items() if rows}


def exclusion_reasons(about: Mapping[str, Any]) -> dict[str, str]:
    """Return why epochs do not count, by label: as they ended, or as the estimation found."""
    estimates = about.get("estimates") or {}
    results = [*estimates.get("epochs", ()), *estimates.get("scores", ())]
    found = [(each["epoch"], each) for each in results]
    found += [(each["label"], each) for each in about["epochs"]]
    return {
        name: str(each["reason"]) or str(each["outcome"])
        for name, each in found
        if each["outcome"] != "included"
    }


def sample_labels(stream: Stream, about: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """Return epoch, condition and task of each sample of a stream, as texts, shape (n,).

    They are empty in rests and in epochs that do not count.
    """
    epochs, reasons = about["epochs"], exclusion_reasons(about)
    names = {"epoch": "label", "condition": "condition", "task": "task"}
    labels = {name: [as_written(each[key] or "") for each in epochs] for name, key in names.items()}
    labels[EXCLUDED] = [str(each["label"] in reasons) for each in epochs]
    table = Table("", {TIME: stream.time_s})
    starts_s, stops_s = ([each[key] for each in epochs] for key in ("start_s", "stop_s"))
    columns = with_intervals(table, starts_s, stops_s, labels).columns
    return {name: columns[name] for name in names}


def columns_of(rows: Iterable[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Return rows as columns: numbers with NaN, or texts with an empty one, where there is none."""
    listed = list(rows)
    names = dict.fromkeys(name for row in listed for name in row)
    found: dict[str, list[Any]] = {}
    for name in names:
        cells = [row.get(name) for row in listed]
        present = [cell for cell in cells if cell is not None]
        if all(isinstance(cell, bool) for cell in present) and present:
            found[name] = [str(cell).lower() if cell is not None else "" for cell in cells]
        elif all(isinstance(cell, int | float) for cell in present):
            found[name] = [math.nan if cell is None else float(cell) for cell in cells]
        else:
            found[name] = ["" if cell is None else str(cell) for cell in cells]
    return found


def _plain(epoch: Mapping[str, Any]) -> _Row:
    kept = {key: value for key, value in epoch.items() if not isinstance(value, dict | list)}
    for key in ("motion", "excitation_hz"):
        kept.pop(key, None)
    low_hz, high_hz = epoch.get("excitation_hz") or (None, None)
    frequency_hz = (epoch.get("motion") or {}).get("frequency_hz")
    left_out = "; ".join(
        f"{each['start_s']:g} to {each['stop_s']:g} s: {each['reason']}"
        for each in epoch.get("left_out", ())
    )
    return {
        **kept,
        "excitation_low_hz": low_hz,
        "excitation_high_hz": high_hz,
        "motion_frequency_hz": frequency_hz,
        "left_out": left_out,
        "late_ticks": (epoch.get("ticks") or {}).get("late"),
        "missed_ticks": (epoch.get("ticks") or {}).get("missed"),
    }


def _estimate(fit: Mapping[str, Any], fixed: Mapping[str, Any]) -> _Row:
    kept = {key: value for key, value in fit.items() if key not in ("findings", "band_hz")}
    low_hz, high_hz = fit.get("band_hz") or (None, None)
    findings = "; ".join(f"{each['level']}, {each['name']}" for each in fit.get("findings", ()))
    held = {f"fixed_inertia_{name}": fixed.get(name) for name in FIT_NUMBERS if name not in _HELD}
    return {**kept, "band_low_hz": low_hz, "band_high_hz": high_hz, "findings": findings, **held}
