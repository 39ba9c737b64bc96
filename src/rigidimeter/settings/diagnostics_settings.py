"""Settings of the checks on an epoch: thresholds, and what a check that fails does to the epoch.

The names of `[diagnostics.levels]` are the names of the findings.
"""

from __future__ import annotations

from typing import Literal, Self

from pydantic import model_validator

from rigidimeter.settings.section import Section, quantity

__all__ = ["DiagnosticLevels", "DiagnosticsSettings", "Level"]

Level = Literal["note", "doubt", "exclude"]


class DiagnosticLevels(Section):
    """What each check does when it fails: only say so, cast doubt, or exclude the epoch.

    Those exclude by default that say the channels did not measure, or that the numbers mean
    nothing. A negative or unlikely parameter only casts doubt: leaving out epochs for their result
    shifts the median of those that stay.
    """

    conditioning: Level = "doubt"
    coherence: Level = "doubt"
    band_share: Level = "doubt"
    imposed_sinusoid: Level = "exclude"
    residual_whiteness: Level = "note"
    residual_perturbation: Level = "doubt"
    lack_of_fit: Level = "doubt"
    held_out_vaf: Level = "exclude"
    voluntary_torque: Level = "doubt"
    active_movement: Level = "doubt"
    emg_activity: Level = "doubt"
    saturation: Level = "exclude"
    frozen: Level = "exclude"
    velocity_scale: Level = "exclude"
    velocity_delay: Level = "doubt"
    guard_limited: Level = "doubt"
    position_limit: Level = "doubt"
    negative_parameters: Level = "doubt"
    implausible_parameters: Level = "doubt"


class DiagnosticsSettings(Section):
    """Thresholds of the checks. `_least` and `_most` are the ends of what is taken as sound."""

    condition_number_most: float = quantity(10.0, "1", 1.0, 1e6)
    coherence_least: float = quantity(0.5, "1", 0.0, 1.0)
    band_share_least_percent: float = quantity(50.0, "%", 0.0, 100.0)
    single_frequency_most_percent: float = quantity(85.0, "%", 1.0, 100.0)
    residual_flatness_least: float = quantity(0.7, "1", 0.0, 1.0)
    residual_perturbation_most_percent: float = quantity(10.0, "%", 0.0, 100.0)
    lack_of_fit_most_percent: float = quantity(2.0, "%", 0.0, 100.0)
    held_out_vaf_least_percent: float = quantity(0.0, "%", -1000.0, 100.0)
    voluntary_low_hz: float = quantity(0.3, "Hz", 0.01, 20.0)
    voluntary_high_hz: float = quantity(4.0, "Hz", 0.05, 50.0)
    voluntary_share_most_percent: float = quantity(15.0, "%", 0.0, 100.0)
    active_torque_nm: float = quantity(0.1, "N·m", 0.0, 100.0, above=True)
    active_share_percent: float = quantity(50.0, "%", 0.0, 1000.0)
    active_most_percent: float = quantity(20.0, "%", 0.0, 100.0)
    emg_window_s: float = quantity(0.25, "s", 0.01, 10.0)
    emg_baseline_factor: float = quantity(3.0, "1", 1.0, 1000.0, above=True)
    emg_active_most_percent: float = quantity(20.0, "%", 0.0, 100.0)
    saturated_most_percent: float = quantity(0.5, "%", 0.0, 100.0)
    frozen_most_s: float = quantity(0.1, "s", 0.0, 60.0)
    velocity_scale_most_percent: float = quantity(10.0, "%", 0.1, 1000.0)
    velocity_delay_most_ms: float = quantity(5.0, "ms", 0.01, 1000.0)
    limited_most_percent: float = quantity(1.0, "%", 0.0, 100.0)
    position_most_percent: float = quantity(98.0, "%", 1.0, 100.0)
    inertia_least_kg_m2: float = quantity(1e-5, "kg·m²", 0.0, 10.0)
    inertia_most_kg_m2: float = quantity(1.0, "kg·m²", 0.0, 100.0, above=True)
    damping_most_nm_s_rad: float = quantity(50.0, "N·m·s/rad", 0.0, 1000.0, above=True)
    stiffness_most_nm_rad: float = quantity(2000.0, "N·m/rad", 0.0, 100000.0, above=True)
    levels: DiagnosticLevels = DiagnosticLevels()

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.voluntary_low_hz >= self.voluntary_high_hz:
            raise ValueError("voluntary_low_hz must be below voluntary_high_hz")
        if self.inertia_least_kg_m2 >= self.inertia_most_kg_m2:
            raise ValueError("inertia_least_kg_m2 must be below inertia_most_kg_m2")
        return self
