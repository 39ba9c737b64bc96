"""What was estimated, as tables: each epoch, the epochs of a condition together, the delays."""

from __future__ import annotations

import math

from rigidimeter.records import Delay, Fit
from rigidimeter.reporting.numbers import number
from rigidimeter.reporting.page_table import Cell, Column, Table
from rigidimeter.study import StudyResult, split_pooled

__all__ = ["ALL_CONDITIONS", "HOW", "WHO", "delays_table", "fits_table", "pooled_table"]

ALL_CONDITIONS = "(all)"
"""What the column of conditions holds for the fit to all epochs of all of them."""

WHO = (
    Column("source", "Source", "source"),
    Column("epoch", "Epoch", "label"),
    Column("condition", "Condition", "condition"),
)
HOW = (Column("outcome", "Outcome", "outcome"), Column("reason", "Reason", "reason"))

_PARAMETERS = (
    ("inertia_kg_m2", "J (kg·m²)"),
    ("damping_nm_s_rad", "B (N·m·s/rad)"),
    ("stiffness_nm_rad", "K (N·m/rad)"),
)
_INTERVAL = "[95\N{NO-BREAK SPACE}%\N{NO-BREAK SPACE}interval]"


def _estimates() -> tuple[Column, ...]:
    """Return for each parameter its value, standard error, 95 % interval and bound."""
    columns: list[Column] = []
    for name, heading in _PARAMETERS:
        ends = (f"{name}_low", f"{name}_high")
        symbol = heading[0]
        columns += [
            Column(name, f"{heading} {_INTERVAL}", ends=ends),
            Column(f"{name}_se", f"SE of {heading}", on_page=False),
            Column(ends[0], f"{symbol} from", on_page=False),
            Column(ends[1], f"{symbol} to", on_page=False),
            Column(f"{name}_bound", f"Least SE of {heading}", on_page=False),
        ]
    return tuple(columns)


_ESTIMATES = _estimates()
_QUALITY = (
    Column("r_squared", "R²"),
    Column("vaf_percent", "VAF (%)"),
    Column("condition_number", "Condition number"),
    Column("residual_sd_nm", "Residual SD (N·m)"),
    Column("n_samples", "Samples", "count", on_page=False),
)


def fits_table(name: str, caption: str, fits: tuple[Fit, ...]) -> Table:
    """List fits, one row an epoch, with what the checks found in each."""
    numbers = (*_ESTIMATES, *_QUALITY)
    band, in_which = _band(fits)
    columns = (
        *WHO,
        Column("method", "Method", "text", on_page=False),
        *HOW,
        *numbers,
        *band,
        Column("n_findings", "Findings", "count", on_page=any(fit.findings for fit in fits)),
        Column("findings", "Names of the findings", "text", on_page=False),
    )
    rows = tuple(
        (
            *(fit.source, fit.epoch, fit.condition, fit.method),
            *(fit.outcome.kind, fit.outcome.reason),
            *_values(fit, numbers),
            *fit.band_hz,
            len(fit.findings),
            ", ".join(finding.name for finding in fit.findings),
        )
        for fit in fits
    )
    return Table(name, caption + in_which, columns, rows)


def pooled_table(study: StudyResult) -> Table:
    """List the fits to all epochs of each condition together, and to all of them."""
    numbers = (*_ESTIMATES, *_QUALITY)
    by_condition, overall = split_pooled(study.analysis)
    band, in_which = _band(study.analysis.pooled)
    columns = (WHO[2], Column("method", "Method", "text", on_page=False), *numbers, *band)
    named = [*by_condition.items()] + ([(ALL_CONDITIONS, overall)] if overall else [])
    rows = tuple(
        (condition, fit.method, *_values(fit, numbers), *fit.band_hz) for condition, fit in named
    )
    return Table("pooled", f"All epochs of a condition together{in_which}", columns, rows)


def delays_table(study: StudyResult) -> Table:
    """List how late the torque is in each source, and what was done about it."""
    columns = (
        WHO[0],
        Column("delay_s", "Torque late by (ms)", page_factor=1e3),
        Column("delay_s_se", "SE (ms)", page_factor=1e3),
        Column("corrected", "Corrected", "label"),
        Column("done", "What was done", "reason"),
    )
    rows = tuple(
        (d.source, d.delay_s, d.delay_s_se, "yes" if d.corrected else "no", _done(d))
        for d in study.analysis.delays
    )
    return Table("delays", "Delay of the torque against the motion", columns, rows)


def _done(delay: Delay) -> str:
    if not delay.corrected:
        return delay.remark
    way = "earlier" if delay.delay_s > 0 else "later"
    moved = f"the torque was moved {way} by it before anything was fitted or scored"
    return f"{moved}; {delay.remark}" if delay.remark else moved


def _band(fits: tuple[Fit, ...]) -> tuple[tuple[Column, Column], str]:
    """Return the columns of the band, off the page where one band can stand in the caption."""
    bands = {fit.band_hz for fit in fits if math.isfinite(fit.band_hz[0])}
    alike = len(bands) == 1
    columns = (
        Column("band_low_hz", "Band from (Hz)", on_page=not alike),
        Column("band_high_hz", "Band to (Hz)", on_page=not alike),
    )
    if not alike:
        return columns, ""
    low, high = bands.pop()
    return columns, f", band {number(low, 3)} to {number(high, 3)} Hz"


def _values(fit: Fit, columns: tuple[Column, ...]) -> list[Cell]:
    return [getattr(fit, column.name) for column in columns]
