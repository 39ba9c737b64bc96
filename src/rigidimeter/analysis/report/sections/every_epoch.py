"""Every epoch: what was estimated, what was scored, and what was recorded."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from markupsafe import Markup

from rigidimeter.analysis.recording import split_pooled
from rigidimeter.analysis.report.contents import Block, Section, from_result, paragraph, part
from rigidimeter.analysis.report.methods import method_of
from rigidimeter.analysis.report.sections.what_was_done import longest_s
from rigidimeter.analysis.report.shown import Shown
from rigidimeter.core.records import AMPLITUDE, PARAMETER_VECTORS, PARAMETERS, Fit
from rigidimeter.core.units import deg_from_rad
from rigidimeter.core.words import INTERVAL, Column, Table, number

ALL_CONDITIONS = "(all)"
"""What the column of conditions holds for the fit to all epochs of all of them."""

WHO = (
    Column("source", "Source", "source"),
    Column("epoch", "Epoch", "label"),
    Column("condition", "Condition", "condition"),
)
HOW = (Column("outcome", "Outcome", "outcome"), Column("reason", "Reason", "reason"))


def _parameters(prefix: str = "") -> tuple[Column, ...]:
    return tuple(
        Column(
            f"{prefix}{p.name}",
            f"{p.symbol} ({p.unit}) {INTERVAL}",
            ends=(f"{prefix}{p.name}_low", f"{prefix}{p.name}_high"),
        )
        for p in PARAMETERS
    )


AMPLITUDE_SHOWN = tuple(
    Column(name, f"Angle {of} (°)", page_factor=deg_from_rad(1.0), digits=3)
    for name, of in zip(AMPLITUDE, ("SD", "range"), strict=True)
)
"""How far the joint moved, beside K: in the band of the fit, and at all frequencies."""


_ACTIVITY = (
    Column("active_percent", "Muscle active (% of the epoch)"),
    Column("active_left_out_percent", "Left out for it (%)"),
    Column("cocontraction_percent", "Co-contraction (%)"),
    Column("active_stretches", "When", "reason"),
)
"""What the EMG shows, where there is one."""


def _quality(prefix: str = "") -> tuple[Column, ...]:
    return (
        Column(f"{prefix}r_squared", "R²"),
        Column(f"{prefix}vaf_percent", "VAF (%)"),
        Column(f"{prefix}condition_number", "Condition number"),
        Column(f"{prefix}residual_sd_nm", "Residual SD (N·m)"),
    )


def _band(fits: Sequence[Fit]) -> tuple[tuple[Column, ...], str]:
    """Return columns for the band where it differs, else the band for the title."""
    bands = {fit.band_hz for fit in fits if math.isfinite(fit.band_hz[0])}
    if len(bands) != 1:
        low, high = ("band_low_hz", "Band from (Hz)"), ("band_high_hz", "Band to (Hz)")
        return (Column(*low), Column(*high)), ""
    ((low_hz, high_hz),) = bands
    return (), f", band {number(low_hz, 3)} to {number(high_hz, 3)} Hz"


def pooled_table(shown: Shown, note: str) -> Table:
    """Return the fits to all epochs of each condition together, and to all of them."""
    by_condition, overall = split_pooled(shown.analysis)
    band, in_which = _band(shown.analysis.pooled)
    ordered = [name for name in shown.condition_names if name in by_condition]
    named = [(name, by_condition[name]) for name in ordered] + (
        [(ALL_CONDITIONS, overall)] if overall else []
    )
    return Table(
        "pooled",
        f"All epochs of a condition together{in_which}",
        (WHO[2], *_parameters(), *AMPLITUDE_SHOWN, *_quality(), *band),
        [{"condition": condition} | _pooled_row(fit) for condition, fit in named],
        note=note,
        empty="No condition has a fit to all of its epochs.",
    )


def _pooled_row(fit: Fit) -> dict[str, Any]:
    names = [f"{p.name}{ending}" for p in PARAMETERS for ending in PARAMETER_VECTORS.values()]
    names += [*(column.name for column in _quality()), *AMPLITUDE, "n_samples"]
    low, high = fit.band_hz
    return (
        {"method": fit.method}
        | {name: getattr(fit, name) for name in names}
        | {"band_low_hz": low, "band_high_hz": high}
    )


def _epochs(shown: Shown) -> Iterator[Block]:
    analysis = shown.analysis
    yield paragraph(
        Markup(
            "In brackets: 95 % intervals. {}. With the inertia fixed, the intervals of B and K do "
            "not include the error of the median J. The files also have standard errors and, in "
            "columns that end with <code>_bound</code>, the smallest standard error that an "
            "unbiased estimate from the same excitation and noise could have (Cramér–Rao)."
        ).format(method_of(analysis.method).intervals_text)
    )
    band, in_which = _band(analysis.fits)
    found = any(fit.findings for fit in analysis.fits)
    counts = [Column("n_findings", "Findings", "count")] if found else []
    cautions = Column("cautions", "Caution", "reason")
    emg = _ACTIVITY if any(fit.activity for fit in analysis.fits) else ()
    yield from_result(
        shown,
        "estimates",
        f"Inertia, damping and stiffness, epoch by epoch{in_which}",
        *(
            *WHO,
            *HOW,
            *_parameters(),
            *AMPLITUDE_SHOWN,
            *_quality(),
            *band,
            *emg,
            *counts,
            cautions,
        ),
        empty="No epoch was fitted.",
        folding=True,
    )
    prefix = "fixed_inertia_"
    several, value = shown.result.several_subjects, number(analysis.inertia_kg_m2)
    held = "of the subject" if several else f"{value} kg·m²"
    yield from_result(
        shown,
        "estimates",
        f"Damping and stiffness with the inertia fixed at its median ({held}), epoch by epoch",
        *WHO,
        Column(f"{prefix}outcome", "Outcome", "outcome"),
        Column(f"{prefix}reason", "Reason", "reason"),
        *_parameters(prefix),
        *_quality(prefix),
        cautions,
        empty="No epoch was fitted with the inertia fixed.",
        folding=True,
    )
    yield from_result(
        shown,
        "scores",
        "Scores of the epochs with an imposed sinusoid",
        *WHO,
        *HOW,
        Column("impulse_nm_s", "Angular impulse per cycle (N·m·s)"),
        Column("work_j", "Work per cycle (J)"),
        Column("n_cycles", "Cycles", "count"),
        Column("frequency_hz", "Frequency (Hz)"),
        empty="No epoch was scored.",
        folding=True,
    )
    yield Table(
        "epochs",
        "Epochs as recorded",
        (
            *WHO,
            Column("task", "Task", "label"),
            Column("duration_s", "Duration (s)"),
            *(
                [Column("since_change_min", "Since the stimulation changed (min)")]
                if any(epoch.since_change_min is not None for epoch in shown.epochs)
                else []
            ),
            Column("virtual", "Virtual", "label"),
            Column("closed", "Recording ended", "outcome"),
            Column("reason", "Reason", "reason"),
            Column("channels", "Channels", "reason"),
        ),
        _recorded(shown),
        empty="There are no epochs.",
        folding=True,
    )


def _recorded(shown: Shown) -> list[dict[str, Any]]:
    return [
        {
            "source": epoch.source,
            "epoch": epoch.label,
            "condition": epoch.condition,
            "task": epoch.task,
            "duration_s": longest_s(channels),
            "since_change_min": epoch.since_change_min,
            "virtual": epoch.virtual,
            "closed": epoch.closed.kind,
            "reason": epoch.closed.reason,
            "channels": ", ".join(f"{c.name} at {c.rate_hz:.4g} Hz" for c in channels),
        }
        for epoch, channels in zip(shown.epochs, shown.channels, strict=True)
    ]


SECTIONS = part("Tables", Section("tables", "Epoch by epoch", _epochs))
