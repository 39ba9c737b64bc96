"""Settings of what is computed from an epoch: estimate, scores, checks, live estimate."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Self

from pydantic import create_model, model_validator

from rigidimeter.core.findings import KINDS, STUDY_KINDS, Level, default_level
from rigidimeter.core.records import Axis
from rigidimeter.core.settings.section import Section, quantity

USABLE_FRACTION_OF_RATE = 0.4
"""A channel carries information up to half its rate; interpolation is good to about 0.4 of it."""

FEWEST_LINES = 8
"""Spectral lines that a band must hold for a fit of J, B and K."""


class EstimationSettings(Section):
    """How J, B and K are estimated from an epoch.

    `band_high_closed_loop_hz` applies to the methods that weight each frequency by its noise:
    higher, they gain precision where the subject pushes slowly, and take a soft cuff for the joint.
    Checks and models with terms see the signals to `band_high_hz` where the perturbation is known,
    and to `band_high_unknown_hz` where it is not.

    `torque_lowpass_hz` is the corner of the low-pass in the torque sensor or its amplifier, a
    Butterworth filter of the given order; 0 where there is none, or none below half the rate. What
    it does to the torque is then done to the motion too.

    With `leave_out_active`, stretches in which the EMG shows an active muscle are left out, unless
    the muscle follows the motion.
    """

    ascending: ClassVar = (
        ("band_low_hz", "band_high_hz"),
        ("band_low_hz", "band_high_unknown_hz"),
        ("band_low_hz", "band_high_closed_loop_hz"),
    )

    band_low_hz: float = quantity(0.15, "Hz", 0.001, 100.0)
    band_high_hz: float = quantity(10.0, "Hz", 0.1, 1000.0)
    band_high_unknown_hz: float = quantity(50.0, "Hz", 0.1, 1000.0)
    band_high_closed_loop_hz: float = quantity(30.0, "Hz", 0.1, 1000.0)
    torque_lowpass_hz: float = quantity(0.0, "Hz", 0.0, 100000.0)
    torque_lowpass_order: int = quantity(2, "1", 1, 8)
    trim_s: float = quantity(1.0, "s", 0.0, 60.0)
    min_epoch_s: float = quantity(5.0, "s", 1.0, 600.0)
    published_highpass_hz: float = quantity(0.2, "Hz", 0.001, 10.0)
    published_highpass_order: int = quantity(2, "1", 1, 6)
    correct_delay: bool = True
    max_delay_s: float = quantity(0.04, "s", 0.001, 0.2)
    leave_out_active: bool = True


class ScoreSettings(Section):
    """How the impulse and work scores are computed (Sec. 2.3)."""

    ascending: ClassVar = (("band_low_hz", "band_high_hz"),)

    band_low_hz: float = quantity(0.2, "Hz", 0.001, 10.0)
    band_high_hz: float = quantity(5.0, "Hz", 0.1, 100.0)
    cycles: int = quantity(8, "1", 1, 1000)
    discard_s: float = quantity(1.0, "s", 0.0, 60.0)

    def cycles_in(self, length_s: float, frequency_hz: float) -> int:
        """Return how many whole cycles are scored of a motion without its discarded ends."""
        return min(self.cycles, math.floor(length_s * frequency_hz + 1e-6))


_LEVELS: Any = {
    kind.name: (Level, kind.level) for kind in KINDS.values() if kind not in STUDY_KINDS
}


class DiagnosticLevels(create_model("Levels", __base__=Section, **_LEVELS)):  # type: ignore[misc]
    """What a check that fails does: leave a note, ask for caution, or exclude the epoch.

    The names and defaults are those of the kinds of findings.

    By default a check excludes the epoch if it shows that a channel did not measure or that the
    numbers are meaningless, as where J, B and K are all below zero: the torque's sign is wrong. One
    negative or unlikely parameter does not: leaving out epochs because of their result shifts the
    median of the others.
    """

    def of(self, name: str) -> Level:
        """Return the level of a finding; of a check from outside the package that of its kind."""
        level: Level = getattr(self, name, default_level(name))
        return level


class DiagnosticsSettings(Section):
    """Thresholds of the checks. `min_` and `max_` are the ends of what is accepted.

    `axis` is how the joint's axis stands. About a vertical axis K includes nothing of the limb's
    weight. `gravity_nm` is m g l, the moment of the limb's weight about the axis when the limb is
    horizontal; 0 where it is not known or the axis is vertical. `gravity_angle_deg` is the limb's
    angle from hanging straight down where the angle that is recorded is 0, in its direction.

    `subject_present` is whether a person is on the axis. It is false on a bench, and in sessions of
    `run` for which it was written that nobody is in the rig.
    """

    ascending: ClassVar = (
        ("voluntary_low_hz", "voluntary_high_hz"),
        ("tremor_low_hz", "tremor_high_hz"),
        ("min_inertia_kg_m2", "max_inertia_kg_m2"),
    )

    max_condition_number: float = quantity(10.0, "1", 1.0, 1e6)
    min_coherence: float = quantity(0.5, "1", 0.0, 1.0)
    min_band_share_percent: float = quantity(50.0, "%", 0.0, 100.0)
    max_single_frequency_percent: float = quantity(85.0, "%", 1.0, 100.0)
    min_computed_torque_percent: float = quantity(1e-3, "%", 0.0, 100.0)
    min_static_torque_percent: float = quantity(0.5, "%", 0.0, 100.0)
    min_residual_flatness: float = quantity(0.7, "1", 0.0, 1.0)
    max_residual_perturbation_percent: float = quantity(10.0, "%", 0.0, 100.0)
    max_lack_of_fit_percent: float = quantity(2.0, "%", 0.0, 100.0)
    max_band_sensitivity_percent: float = quantity(3.0, "%", 0.0, 100.0)
    min_r_squared: float = quantity(0.3, "1", -100.0, 1.0)
    max_between_samples_percent: float = quantity(1.0, "%", 0.0, 100.0)
    min_held_out_vaf_percent: float = quantity(0.0, "%", -1000.0, 100.0)
    voluntary_low_hz: float = quantity(0.3, "Hz", 0.01, 20.0)
    voluntary_high_hz: float = quantity(4.0, "Hz", 0.05, 50.0)
    max_voluntary_share_percent: float = quantity(15.0, "%", 0.0, 100.0)
    tremor_low_hz: float = quantity(4.0, "Hz", 1.0, 50.0)
    tremor_high_hz: float = quantity(12.0, "Hz", 1.0, 50.0)
    max_tremor_share_percent: float = quantity(3.0, "%", 0.0, 100.0)
    max_loop_bias_percent: float = quantity(50.0, "%", 0.0, 1000.0)
    max_unweighted_percent: float = quantity(10.0, "%", 0.0, 1000.0)
    active_torque_nm: float = quantity(0.1, "N·m", 0.0, 100.0, above=True)
    active_share_percent: float = quantity(50.0, "%", 0.0, 1000.0)
    max_active_percent: float = quantity(20.0, "%", 0.0, 100.0)
    min_burst_s: float = quantity(0.25, "s", 0.01, 10.0)
    emg_baseline_factor: float = quantity(3.0, "1", 1.0, 1000.0, above=True)
    max_emg_active_percent: float = quantity(20.0, "%", 0.0, 100.0)
    max_varying_percent: float = quantity(10.0, "%", 0.0, 1000.0)
    varying_chance: float = quantity(0.005, "1", 0.001, 0.5)
    max_saturated_percent: float = quantity(0.5, "%", 0.0, 100.0)
    max_frozen_s: float = quantity(0.1, "s", 0.0, 60.0)
    max_left_out_percent: float = quantity(50.0, "%", 0.0, 100.0)
    axis: Axis = "unknown"
    subject_present: bool = True
    gravity_nm: float = quantity(0.0, "N·m", 0.0, 1000.0)
    gravity_angle_deg: float = quantity(0.0, "deg", -180.0, 180.0)
    max_velocity_scale_percent: float = quantity(10.0, "%", 0.1, 1000.0)
    max_velocity_delay_ms: float = quantity(5.0, "ms", 0.01, 1000.0)
    max_velocity_shape_percent: float = quantity(5.0, "%", 0.0, 1000.0)
    max_missed_ticks_percent: float = quantity(0.1, "%", 0.0, 100.0)
    max_limited_percent: float = quantity(1.0, "%", 0.0, 100.0)
    max_position_percent: float = quantity(98.0, "%", 1.0, 100.0)
    max_controller_misfit_percent: float = quantity(20.0, "%", 0.0, 1000.0)
    min_inertia_kg_m2: float = quantity(1e-5, "kg·m²", 0.0, 10.0)
    max_inertia_kg_m2: float = quantity(1.0, "kg·m²", 0.0, 100.0, above=True)
    max_damping_nm_s_rad: float = quantity(50.0, "N·m·s/rad", 0.0, 1000.0, above=True)
    max_stiffness_nm_rad: float = quantity(2000.0, "N·m/rad", 0.0, 100000.0, above=True)
    levels: DiagnosticLevels = DiagnosticLevels()

    @model_validator(mode="after")
    def _weight_about_axis(self) -> Self:
        if self.axis == "vertical" and self.gravity_nm > 0:
            raise ValueError(
                f'axis = "vertical" and gravity_nm = {self.gravity_nm:g} N·m contradict each '
                "other, for about a vertical axis the limb's weight has no moment; set axis = "
                '"horizontal", or gravity_nm = 0'
            )
        return self


class OnlineSettings(Section):
    """The band of the causal filters, and how long the live estimate remembers.

    A sample counts 1/e after `forgetting_s`; a step of a parameter is followed from 10 to 90 % in
    2.2 times that. While the motion has less than `rest_share_percent` of its usual power,
    the estimate is neither updated nor forgotten.
    """

    ascending: ClassVar = (("band_low_hz", "band_high_hz"),)

    band_low_hz: float = quantity(0.15, "Hz", 0.001, 100.0)
    band_high_hz: float = quantity(10.0, "Hz", 0.1, 1000.0)
    forgetting_s: float = quantity(5.0, "s", 0.05, 3600.0)
    rest_share_percent: float = quantity(1.0, "%", 0.0, 50.0)
    rest_window_s: float = quantity(0.5, "s", 0.01, 60.0)
