"""How the study was made: epochs by task and condition, and the settings."""

from __future__ import annotations

import math

import numpy as np
from pydantic import BaseModel

from rigidimeter.records import Epoch
from rigidimeter.reporting.page_table import Cell, Column, Table
from rigidimeter.settings import Settings
from rigidimeter.study import StudyResult
from rigidimeter.units import rad_from_deg

__all__ = ["design_table", "epoch_counts", "epoch_duration_s", "settings_table"]

_TASKS = {"prbs": "torque perturbation", "sinusoid": "imposed sinusoid", None: "not stated"}


def epoch_duration_s(epoch: Epoch) -> float:
    """Return how long the longest channel of an epoch lasts; NaN without samples."""
    spans = [float(c.time_s[-1] - c.time_s[0]) for c in epoch.channels.values() if len(c)]
    return max(spans, default=math.nan)


def epoch_counts(study: StudyResult) -> Table:
    """Count the epochs of each task and condition, with their durations."""
    columns = (
        Column("task", "Task", "text"),
        Column("condition", "Condition", "condition"),
        Column("epochs", "Epochs", "count"),
        Column("virtual_epochs", "Of them virtual", "count"),
        Column("median_duration_s", "Median duration (s)"),
        Column("shortest_s", "Shortest (s)"),
        Column("longest_s", "Longest (s)"),
    )
    rows: list[tuple[Cell, ...]] = []
    for task, title in _TASKS.items():
        for condition in study.condition_names:
            group = [e for e in study.epochs if e.task == task and e.condition == condition]
            durations = [d for e in group if math.isfinite(d := epoch_duration_s(e))]
            if not group:
                continue
            spread = (
                (float(np.median(durations)), min(durations), max(durations))
                if durations
                else (math.nan,) * 3
            )
            virtual = sum(epoch.virtual for epoch in group)
            rows.append((title, condition, len(group), virtual, *spread))
    return Table("counts", "Epochs by task and condition", columns, tuple(rows))


def design_table(study: StudyResult) -> Table:
    """Return the settings that define the measurement and the analysis."""
    s = study.settings
    prbs, guard, sinusoid = s.prbs, s.guard, s.sinusoid
    length = 2**prbs.register_bits - 1
    degree = rad_from_deg(1.0)
    rows: list[tuple[Cell, ...]] = [
        ("Controller", "virtual inertia J_c", s.controller.inertia_kg_m2, "kg·m²/rad"),
        ("Controller", "the same per degree", s.controller.inertia_kg_m2 * degree, "kg·m²/deg"),
        ("Controller", "virtual damping B_c", s.controller.damping_nm_s_rad, "N·m·s/rad"),
        (
            "Controller",
            "the same per degree",
            s.controller.damping_nm_s_rad * degree,
            "N·m·s/deg",
        ),
        ("Controller", "torque low-pass", s.controller.torque_cutoff_hz, "Hz"),
        ("PRBS", "amplitude, either way", prbs.amplitude_nm, "N·m"),
        ("PRBS", "duration", prbs.duration_s, "s"),
        ("PRBS", "clock", prbs.clock_hz, "Hz"),
        ("PRBS", f"length of the {prbs.register_bits}-bit sequence", length, "chips"),
        ("PRBS", "its period", length / prbs.clock_hz, "s"),
        ("PRBS", "wanted band from", prbs.wanted_low_hz, "Hz"),
        ("PRBS", "wanted band to", prbs.wanted_high_hz, "Hz"),
        ("Sinusoid", "amplitude, either way", sinusoid.amplitude_deg, "deg"),
        ("Sinusoid", "frequency", sinusoid.frequency_hz, "Hz"),
        ("Sinusoid", "motion", sinusoid.motion_s, "s"),
        ("Limits", "position, either way", guard.position_limit_deg, "deg"),
        ("Limits", "speed", guard.speed_limit_deg_s, "deg/s"),
        ("Limits", "acceleration", guard.acceleration_limit_deg_s2, "deg/s²"),
        ("Estimation", "band from", s.estimation.band_low_hz, "Hz"),
        ("Estimation", "band to, perturbation known", s.estimation.band_high_hz, "Hz"),
        ("Estimation", "band to, perturbation unknown", s.estimation.band_high_unknown_hz, "Hz"),
        ("Estimation", "band to, iv, spectral and ml", s.estimation.band_high_closed_loop_hz, "Hz"),
        ("Scores", "band from", s.scores.band_low_hz, "Hz"),
        ("Scores", "band to", s.scores.band_high_hz, "Hz"),
        ("Scores", "cycles", s.scores.cycles, "cycles"),
    ]
    columns = (
        Column("part", "Part", "text"),
        Column("quantity", "Quantity", "text"),
        Column("value", "Value", "setting"),
        Column("unit", "Unit", "text"),
    )
    caption = "The settings of this study"
    return Table("design", caption, columns, tuple(rows))


def settings_table(settings: Settings) -> Table:
    """Return every setting by its key, with its unit."""
    columns = (
        Column("key", "Key", "text"),
        Column("value", "Value", "text"),
        Column("unit", "Unit", "text"),
    )
    return Table("settings", "Every setting", columns, tuple(_flat("", settings)))


def _flat(prefix: str, value: object, unit: str = "") -> list[tuple[Cell, ...]]:
    """Return key, value and unit of whatever a model, a mapping or a list holds."""
    rows: list[tuple[Cell, ...]] = []
    if isinstance(value, BaseModel):
        for name, field in type(value).model_fields.items():
            extra = field.json_schema_extra
            field_unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
            rows += _flat(f"{prefix}.{name}".lstrip("."), getattr(value, name), field_unit)
    elif isinstance(value, dict):
        for name, item in value.items():
            rows += _flat(f"{prefix}.{name}", item, unit)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            rows += _flat(f"{prefix}[{index}]", item, unit)
    else:
        rows.append((prefix, repr(value) if isinstance(value, float) else str(value), unit))
    return rows
