"""The settings of recorded sessions, whose files are never rewritten: older names are read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rigidimeter.core.settings.load import parse_settings
from rigidimeter.core.settings.models import Settings

_RENAMED: Mapping[str, Mapping[str, str]] = {
    "guard": {"least_inertia_kg_m2": "min_inertia_kg_m2"},
    "estimation": {"shortest_epoch_s": "min_epoch_s", "longest_delay_s": "max_delay_s"},
    "diagnostics": {
        "condition_number_most": "max_condition_number",
        "coherence_least": "min_coherence",
        "band_share_least_percent": "min_band_share_percent",
        "single_frequency_most_percent": "max_single_frequency_percent",
        "computed_torque_least_percent": "min_computed_torque_percent",
        "static_torque_least_percent": "min_static_torque_percent",
        "residual_flatness_least": "min_residual_flatness",
        "residual_perturbation_most_percent": "max_residual_perturbation_percent",
        "lack_of_fit_most_percent": "max_lack_of_fit_percent",
        "band_sensitivity_most_percent": "max_band_sensitivity_percent",
        "r_squared_least": "min_r_squared",
        "between_samples_most_percent": "max_between_samples_percent",
        "held_out_vaf_least_percent": "min_held_out_vaf_percent",
        "voluntary_share_most_percent": "max_voluntary_share_percent",
        "tremor_share_most_percent": "max_tremor_share_percent",
        "loop_bias_most_percent": "max_loop_bias_percent",
        "active_most_percent": "max_active_percent",
        "emg_window_s": "min_burst_s",
        "emg_active_most_percent": "max_emg_active_percent",
        "varying_most_percent": "max_varying_percent",
        "saturated_most_percent": "max_saturated_percent",
        "frozen_most_s": "max_frozen_s",
        "left_out_most_percent": "max_left_out_percent",
        "velocity_scale_most_percent": "max_velocity_scale_percent",
        "velocity_delay_most_ms": "max_velocity_delay_ms",
        "velocity_shape_most_percent": "max_velocity_shape_percent",
        "missed_ticks_most_percent": "max_missed_ticks_percent",
        "limited_most_percent": "max_limited_percent",
        "position_most_percent": "max_position_percent",
        "controller_misfit_most_percent": "max_controller_misfit_percent",
        "inertia_least_kg_m2": "min_inertia_kg_m2",
        "inertia_most_kg_m2": "max_inertia_kg_m2",
        "damping_most_nm_s_rad": "max_damping_nm_s_rad",
        "stiffness_most_nm_rad": "max_stiffness_nm_rad",
    },
    "commissioning": {
        "least_rate_percent": "min_rate_percent",
        "watchdog_longest_s": "max_watchdog_s",
    },
}
"""By table, the name that a key had and the one that it has."""

_REMOVED = {"estimation": ("intervals", "bootstrap_draws"), "levels": ("differs_from_estimate",)}
_LEVELS = {"doubt": "caution"}


def recorded_settings(values: Any, *, source: str) -> Settings:
    """Return the settings that a session was recorded with.

    Raises
    ------
    UserError
        As `parse_settings`; a key that no version had is refused.
    """
    return parse_settings(with_new_names(values), source=source)


def with_new_names(values: Any) -> Any:
    """Return recorded settings with the names that their keys have now; others as they are."""
    if not isinstance(values, Mapping):
        return values
    renamed = dict(values)
    for table, given in values.items():
        if isinstance(given, Mapping):
            names, gone = _RENAMED.get(table, {}), _REMOVED.get(table, ())
            renamed[table] = {names.get(k, k): v for k, v in given.items() if k not in gone}
    diagnostics = renamed.get("diagnostics")
    if isinstance(diagnostics, Mapping) and isinstance(diagnostics.get("levels"), Mapping):
        levels = diagnostics["levels"]
        found = {k: v for k, v in levels.items() if k not in _REMOVED["levels"]}
        kept = {k: _LEVELS.get(v, v) if isinstance(v, str) else v for k, v in found.items()}
        renamed["diagnostics"] = {**diagnostics, "levels": kept}
    return renamed
