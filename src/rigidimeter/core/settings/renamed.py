"""Older names of settings: read wherever settings are read, never written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rigidimeter.core.errors import UserError

RENAMED: Mapping[str, Mapping[str, str]] = {
    "guard": {"least_inertia_kg_m2": "min_inertia_kg_m2"},
    "estimation": {
        "shortest_epoch_s": "min_epoch_s",
        "longest_delay_s": "max_delay_s",
    },
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

OLDER_LEVEL, LEVEL = "doubt", "caution"
"""What a value of [diagnostics.levels] was called, and what it is."""

SHOWN = 3
"""So many keys are named: a recorded session has all of them."""


def with_new_names(values: Mapping[str, Any], source: str) -> tuple[dict[str, Any], str]:
    """Return nested settings with each key under its new name, and one sentence for the user.

    The sentence is empty where no key had its older name.

    Raises
    ------
    UserError
        If a key is given under both names.
    """
    renamed, found = dict(values), []
    for table, names in RENAMED.items():
        given = values.get(table)
        if not isinstance(given, Mapping):
            continue
        for old, new in names.items():
            if old in given and new in given:
                raise UserError(
                    f"{source}: {table}.{old} is the older name of {table}.{new}, and both are "
                    f"given; leave out {old}"
                )
            if old in given:
                found.append(f"{table}.{old} is now {table}.{new}")
        renamed[table] = {names.get(key, key): value for key, value in given.items()}
    diagnostics = renamed.get("diagnostics")
    levels = diagnostics.get("levels") if isinstance(diagnostics, Mapping) else None
    if isinstance(levels, Mapping) and any(level == OLDER_LEVEL for level in levels.values()):
        found.append(f'"{OLDER_LEVEL}" in diagnostics.levels is now "{LEVEL}"')
        kept = {key: LEVEL if level == OLDER_LEVEL else level for key, level in levels.items()}
        renamed["diagnostics"] = {**renamed["diagnostics"], "levels": kept}
    if not found:
        return renamed, ""
    more = f", and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
    which = "the older names were read" if len(found) > 1 else "the older name was read"
    return renamed, f"{source}: {', '.join(found[:SHOWN])}{more}; {which}"
