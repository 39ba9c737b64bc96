"""What can be set, with its unit, its default and its allowed range.

Every number is declared by `quantity`, which keeps the unit beside the bounds so that a refusal can
name both. The defaults are the paper's where it gives a value.
"""

from __future__ import annotations

import math
from typing import Literal, Self

from pydantic import Field, model_validator

from rigidimeter.settings.base import Section, quantity
from rigidimeter.settings.commissioning import CommissioningSettings
from rigidimeter.settings.diagnostics import DiagnosticsSettings
from rigidimeter.settings.foresight import MarginsSettings, MultisineSettings, OptimiseSettings
from rigidimeter.settings.online import OnlineSettings
from rigidimeter.units import per_rad_from_per_deg

__all__ = [
    "BlockSettings",
    "ControllerSettings",
    "EstimationSettings",
    "GuardSettings",
    "LoopSettings",
    "MarginsSettings",
    "MotionSensorSettings",
    "MultisineSettings",
    "OptimiseSettings",
    "PrbsSettings",
    "ProtocolSettings",
    "RigSettings",
    "ScoreSettings",
    "Settings",
    "SinusoidSettings",
    "SubjectSettings",
    "TorqueSensorSettings",
    "ZeroingSettings",
    "quantity",
]


class ControllerSettings(Section):
    """The admittance M_PRBS − M_meas = J_c θ'' + B_c θ' (Eq. 5), per radian.

    The paper prints both values per degree in Sec. 2.4.2 (0.0008 and 0.028) and per radian in
    App. A. Only the reading per degree gives the position SD of about 4 deg that it reports.
    """

    inertia_kg_m2: float = quantity(per_rad_from_per_deg(0.0008), "kg·m²", 0.0, 10.0, above=True)
    damping_nm_s_rad: float = quantity(per_rad_from_per_deg(0.028), "N·m·s/rad", 0.0, 100.0)
    torque_cutoff_hz: float = quantity(20.0, "Hz", 0.5, 1000.0)
    tracking_gain_per_s: float = quantity(1.0, "1/s", 0.0, 50.0)


class GuardSettings(Section):
    """Limits that hold whatever the controller asks for.

    `reaction_time_s` is how long the drive may take to have done what it was told, plus how far the
    stamp of an angle reading may be wrong; braking for the position limit begins that much earlier.

    Above `torque_limit_nm` or `power_limit_w` the rig holds still and the operator may go on. It
    stops, latched, above `torque_stop_nm`, when more than `energy_limit_j` goes to and fro between
    rig and joint within a second, when the angle is more than `following_limit_deg` from where the
    commands should have brought it, and when a reading is older than `stale_s`.
    """

    position_limit_deg: float = quantity(40.0, "deg", 1.0, 180.0)
    speed_limit_deg_s: float = quantity(200.0, "deg/s", 1.0, 1000.0)
    acceleration_limit_deg_s2: float = quantity(6000.0, "deg/s²", 10.0, 100000.0)
    reaction_time_s: float = quantity(0.02, "s", 0.0, 0.2)
    stale_s: float = quantity(0.1, "s", 0.002, 0.5)
    following_limit_deg: float = quantity(2.0, "deg", 0.1, 45.0)
    torque_limit_nm: float = quantity(10.0, "N·m", 0.01, 200.0)
    torque_stop_nm: float = quantity(20.0, "N·m", 0.01, 400.0)
    power_limit_w: float = quantity(20.0, "W", 0.01, 1000.0)
    energy_limit_j: float = quantity(5.0, "J", 0.01, 1000.0)

    @model_validator(mode="after")
    def _stop_above_hold(self) -> Self:
        if self.torque_stop_nm < self.torque_limit_nm:
            raise ValueError(
                f"torque_stop_nm = {self.torque_stop_nm:g} N·m must not be below torque_limit_nm "
                f"= {self.torque_limit_nm:g} N·m: the rig pauses at the one and stops at the other"
            )
        return self


class LoopSettings(Section):
    """When a loop that falls behind stops the rig: so many late ticks in a row, or one so late."""

    missed_in_a_row: int = quantity(20, "1", 1, 1000)
    stall_s: float = quantity(0.1, "s", 0.005, 1.0)


class ZeroingSettings(Section):
    """Before the first epoch of a run the joint is held still and the torque sensor zeroed.

    A mean above `bias_limit_nm` means that the sensor was zeroed under load or has another
    calibration; a standard deviation above `noise_limit_nm` that the subject moves or a wire is
    loose. Either way the run does not begin.
    """

    duration_s: float = quantity(2.0, "s", 0.1, 60.0)
    bias_limit_nm: float = quantity(1.0, "N·m", 0.001, 100.0)
    noise_limit_nm: float = quantity(0.1, "N·m", 0.0001, 100.0)


class PrbsSettings(Section):
    """The torque perturbation: a maximal-length pseudo-random binary sequence."""

    register_bits: int = quantity(7, "1", 3, 20)
    clock_hz: float = quantity(20.0, "Hz", 0.1, 1000.0)
    amplitude_nm: float = quantity(1.0, "N·m", 0.0, 50.0, above=True)
    duration_s: float = quantity(20.0, "s", 1.0, 3600.0)
    wanted_low_hz: float = quantity(0.15, "Hz", 0.001, 100.0)
    wanted_high_hz: float = quantity(10.0, "Hz", 0.01, 500.0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.wanted_low_hz >= self.wanted_high_hz:
            raise ValueError("wanted_low_hz must be below wanted_high_hz")
        return self


class SinusoidSettings(Section):
    """The position perturbation for the impulse and work scores."""

    frequency_hz: float = quantity(1.0, "Hz", 0.05, 10.0)
    amplitude_deg: float = quantity(20.0, "deg", 0.1, 90.0)
    motion_s: float = quantity(10.0, "s", 1.0, 600.0)
    duration_s: float = quantity(20.0, "s", 1.0, 3600.0)
    taper_s: float = quantity(1.0, "s", 0.0, 10.0)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.motion_s > self.duration_s:
            raise ValueError("motion_s must not exceed duration_s")
        if 2 * self.taper_s > self.motion_s:
            raise ValueError("taper_s must be at most half of motion_s")
        return self


class TorqueSensorSettings(Section):
    """The virtual torque sensor. `stamp_latency_s` is the part of the latency its stamps know."""

    rate_hz: float = quantity(1000.0, "Hz", 1.0, 20000.0)
    noise_sd_nm: float = quantity(0.005, "N·m", 0.0, 10.0)
    resolution_nm: float = quantity(0.0005, "N·m", 0.0, 1.0)
    latency_s: float = quantity(0.001, "s", 0.0, 0.1)
    stamp_latency_s: float = quantity(0.001, "s", 0.0, 0.1)
    jitter_s: float = quantity(0.0, "s", 0.0, 0.1)


class MotionSensorSettings(Section):
    """The virtual encoder: angle and velocity sampled together."""

    rate_hz: float = quantity(1000.0, "Hz", 1.0, 20000.0)
    angle_resolution_deg: float = quantity(2.25e-4, "deg", 0.0, 1.0)
    velocity_resolution_deg_s: float = quantity(0.01, "deg/s", 0.0, 10.0)
    latency_s: float = quantity(0.001, "s", 0.0, 0.1)
    stamp_latency_s: float = quantity(0.001, "s", 0.0, 0.1)
    jitter_s: float = quantity(0.0, "s", 0.0, 0.1)


class RigSettings(Section):
    """The virtual rig: loop rate, drive and sensors."""

    tick_rate_hz: float = quantity(1000.0, "Hz", 50.0, 5000.0)
    drive_bandwidth_hz: float = quantity(50.0, "Hz", 1.0, 2000.0)
    drive_damping_ratio: float = quantity(0.7071, "1", 0.6, 0.99)
    torque: TorqueSensorSettings = TorqueSensorSettings()
    motion: MotionSensorSettings = MotionSensorSettings()


class SubjectSettings(Section):
    """A virtual subject in one condition.

    Each epoch draws J, B and K log-normally about the medians given here, with the coefficients of
    variation given here.
    """

    inertia_kg_m2: float = quantity(0.0045, "kg·m²", 0.0, 10.0, above=True)
    damping_nm_s_rad: float = quantity(0.1368, "N·m·s/rad", 0.0, 100.0)
    stiffness_nm_rad: float = quantity(1.751, "N·m/rad", 0.0, 10000.0)
    inertia_cv_percent: float = quantity(0.0, "%", 0.0, 100.0)
    damping_cv_percent: float = quantity(0.0, "%", 0.0, 100.0)
    stiffness_cv_percent: float = quantity(0.0, "%", 0.0, 100.0)
    voluntary_sd_nm: float = quantity(0.0, "N·m", 0.0, 10.0)
    voluntary_low_hz: float = quantity(0.3, "Hz", 0.01, 20.0)
    voluntary_high_hz: float = quantity(4.0, "Hz", 0.05, 50.0)
    tremor_amplitude_nm: float = quantity(0.0, "N·m", 0.0, 10.0)
    tremor_frequency_hz: float = quantity(5.0, "Hz", 1.0, 20.0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.voluntary_low_hz >= self.voluntary_high_hz:
            raise ValueError("voluntary_low_hz must be below voluntary_high_hz")
        return self


class BlockSettings(Section):
    """A run of epochs of one task in one condition."""

    task: Literal["prbs", "sinusoid"] = "prbs"
    condition: str = Field("OFF", min_length=1, max_length=40)
    epochs: int = quantity(4, "1", 1, 1000)


class ProtocolSettings(Section):
    """Blocks of epochs in order, with random rests in between.

    With `repeat_limited`, an epoch in which the arm came to a limit is run again at the end, once.
    """

    blocks: list[BlockSettings] = Field(
        default_factory=lambda: [BlockSettings(task="prbs"), BlockSettings(task="sinusoid")],
        min_length=1,
    )
    rests_s: list[float] = Field([10.0, 20.0], min_length=1, json_schema_extra={"unit": "s"})
    return_s: float = quantity(3.0, "s", 0.5, 60.0)
    repeat_limited: bool = False

    @model_validator(mode="after")
    def _rests_hold_the_return(self) -> Self:
        for rest_s in self.rests_s:
            if not self.return_s <= rest_s <= 3600:
                raise ValueError(
                    f"rests_s holds {rest_s:g} s; each rest must last at least return_s "
                    f"({self.return_s:g} s) and at most 3600 s"
                )
        return self


class EstimationSettings(Section):
    """How J, B and K are estimated from an epoch.

    `band_high_hz` applies where the perturbation is known; `band_high_unknown_hz` where it is not,
    since an imposed motion may excite the joint far above the paper's 10 Hz;
    `band_high_closed_loop_hz` to the methods that weight each frequency by its noise. Higher, they
    gain precision where the subject pushes slowly, and take a soft cuff for the joint.

    `intervals` says how standard errors and intervals are made: "hac" holds for any residual,
    "bootstrap" draws blocks, "white" takes the residual for white within the band.
    """

    band_low_hz: float = quantity(0.15, "Hz", 0.001, 100.0)
    band_high_hz: float = quantity(10.0, "Hz", 0.1, 1000.0)
    band_high_unknown_hz: float = quantity(50.0, "Hz", 0.1, 1000.0)
    band_high_closed_loop_hz: float = quantity(30.0, "Hz", 0.1, 1000.0)
    trim_s: float = quantity(1.0, "s", 0.0, 60.0)
    shortest_epoch_s: float = quantity(5.0, "s", 1.0, 600.0)
    published_highpass_hz: float = quantity(0.2, "Hz", 0.001, 10.0)
    published_highpass_order: int = quantity(2, "1", 1, 6)
    intervals: Literal["hac", "bootstrap", "white"] = "hac"
    bootstrap_draws: int = quantity(999, "1", 100, 100_000)
    correct_delay: bool = True
    longest_delay_s: float = quantity(0.04, "s", 0.001, 0.2)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        highest = min(self.band_high_hz, self.band_high_unknown_hz, self.band_high_closed_loop_hz)
        if self.band_low_hz >= highest:
            raise ValueError(
                "band_low_hz must be below band_high_hz, band_high_unknown_hz and "
                "band_high_closed_loop_hz"
            )
        return self


class ScoreSettings(Section):
    """How the impulse and work scores are computed (Sec. 2.3)."""

    band_low_hz: float = quantity(0.2, "Hz", 0.001, 10.0)
    band_high_hz: float = quantity(5.0, "Hz", 0.1, 100.0)
    cycles: int = quantity(8, "1", 1, 1000)
    discard_s: float = quantity(1.0, "s", 0.0, 60.0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.band_low_hz >= self.band_high_hz:
            raise ValueError("band_low_hz must be below band_high_hz")
        return self


class Settings(Section):
    """Everything that can be set, one table of the TOML file for each field."""

    seed: int = Field(1, ge=0, le=2**32 - 1, json_schema_extra={"unit": "1"})
    controller: ControllerSettings = ControllerSettings()
    guard: GuardSettings = GuardSettings()
    loop: LoopSettings = LoopSettings()
    zeroing: ZeroingSettings = ZeroingSettings()
    prbs: PrbsSettings = PrbsSettings()
    sinusoid: SinusoidSettings = SinusoidSettings()
    rig: RigSettings = RigSettings()
    subject: dict[str, SubjectSettings] = Field(
        default_factory=lambda: {
            "OFF": SubjectSettings(),
            "DBS": SubjectSettings(damping_nm_s_rad=0.115, stiffness_nm_rad=1.42),
        }
    )
    protocol: ProtocolSettings = ProtocolSettings()
    estimation: EstimationSettings = EstimationSettings()
    scores: ScoreSettings = ScoreSettings()
    margins: MarginsSettings = MarginsSettings()
    optimise: OptimiseSettings = OptimiseSettings()
    multisine: MultisineSettings = MultisineSettings()
    diagnostics: DiagnosticsSettings = DiagnosticsSettings()
    online: OnlineSettings = OnlineSettings()
    commissioning: CommissioningSettings = CommissioningSettings()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for block in self.protocol.blocks:
            if block.condition not in self.subject:
                known = ", ".join(sorted(self.subject))
                raise ValueError(
                    f"protocol.blocks names condition {block.condition!r}, but there is no "
                    f"[subject.{block.condition}]; known conditions: {known}"
                )
        if self.sinusoid.amplitude_deg >= self.guard.position_limit_deg:
            raise ValueError(
                f"sinusoid.amplitude_deg = {self.sinusoid.amplitude_deg:g} deg must stay below "
                f"guard.position_limit_deg = {self.guard.position_limit_deg:g} deg"
            )
        rig = self.rig
        # A second-order drive has done nearly all it was told after twice its mean lag.
        lag_s = rig.drive_damping_ratio / (math.pi * rig.drive_bandwidth_hz)
        unknown_s = abs(rig.motion.latency_s - rig.motion.stamp_latency_s)
        delay_s = 2 * lag_s + unknown_s + 1 / rig.tick_rate_hz
        if self.guard.reaction_time_s < delay_s:
            raise ValueError(
                f"guard.reaction_time_s = {self.guard.reaction_time_s:g} s is shorter than this "
                f"rig may take to react ({delay_s:.3g} s: twice the drive's lag, what the stamps "
                "of the encoder do not know of its latency, and one tick); raise it to that"
            )
        if self.prbs.amplitude_nm >= self.guard.torque_limit_nm:
            raise ValueError(
                f"prbs.amplitude_nm = {self.prbs.amplitude_nm:g} N·m must stay below "
                f"guard.torque_limit_nm = {self.guard.torque_limit_nm:g} N·m, at which the rig "
                "holds still"
            )
        if self.controller.torque_cutoff_hz >= self.rig.tick_rate_hz / 2:
            raise ValueError(
                f"controller.torque_cutoff_hz = {self.controller.torque_cutoff_hz:g} Hz must stay "
                f"below half of rig.tick_rate_hz = {self.rig.tick_rate_hz:g} Hz"
            )
        if self.prbs.clock_hz > self.rig.tick_rate_hz:
            raise ValueError(
                f"prbs.clock_hz = {self.prbs.clock_hz:g} Hz must not exceed rig.tick_rate_hz = "
                f"{self.rig.tick_rate_hz:g} Hz"
            )
        for name, sensor in (("torque", self.rig.torque), ("motion", self.rig.motion)):
            rate = sensor.rate_hz
            if sensor.jitter_s * rate >= 1:
                raise ValueError(
                    f"rig.{name}.jitter_s = {sensor.jitter_s:g} s must be shorter than the "
                    f"{1 / rate:g} s between samples at rig.{name}.rate_hz = {rate:g} Hz"
                )
            oldest_s = 1 / rate + sensor.latency_s + sensor.jitter_s
            if self.guard.stale_s <= oldest_s:
                raise ValueError(
                    f"guard.stale_s = {self.guard.stale_s:g} s is too short for rig.{name}, whose "
                    f"readings may be {oldest_s:.3g} s old; raise it above that"
                )
            if rate > self.rig.tick_rate_hz:
                raise ValueError(
                    f"rig.{name}.rate_hz = {rate:g} Hz must not exceed rig.tick_rate_hz = "
                    f"{self.rig.tick_rate_hz:g} Hz"
                )
        return self
