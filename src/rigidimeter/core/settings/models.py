"""All that can be set, with its unit, its default and its range, and what must fit together.

Every number is declared by `quantity`, which keeps the unit beside the bounds so that a refusal can
name both. The larger sections are in modules of their own; the defaults are the paper's where it
gives a value.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from rigidimeter.core.settings.emg_settings import EmgSettings
from rigidimeter.core.settings.estimation_settings import (
    DiagnosticsSettings,
    EstimationSettings,
    OnlineSettings,
    ScoreSettings,
)
from rigidimeter.core.settings.experiment_settings import (
    DoseSettings,
    MarginsSettings,
    MultisineSettings,
    OptimiseSettings,
    PrbsSettings,
    ProtocolSettings,
    SinusoidSettings,
)
from rigidimeter.core.settings.loop_settings import (
    ControllerSettings,
    GuardSettings,
    LoopSettings,
    ZeroingSettings,
)
from rigidimeter.core.settings.rig_settings import (
    MotionSensorSettings,
    RigSettings,
    SubjectSettings,
    TorqueSensorSettings,
)
from rigidimeter.core.settings.section import Section, quantity


class CommissioningSettings(Section):
    """What is tried on a rig, and what it must come to.

    `swing_deg` and `swing_speed_deg_s` are of the slow known motion, `nudge_deg` of the smaller one
    before it, `step_deg_s` of the quick small velocity steps. The known torque is held for
    `known_torque_s` by hand. For the friction of the drive the joint is moved by `wide_deg`, at
    most 0.8 times the position limit, at up to `wide_speed_deg_s`. Everything else that is compared
    is a limit of the guard, of the zeroing or of the margins.

    Of the daily check: `daily_rest_s` is listened without power and held with it, then the joint
    moves for `daily_motion_s` at up to `daily_speed_deg_s`. The inertia found is compared within
    `inertia_tolerance_percent`, the delay within `delay_tolerance_s` or a tick if that is longer.
    """

    validity_days: float = quantity(180.0, "days", 1.0, 3650.0)
    idle_s: float = quantity(10.0, "s", 0.5, 600.0)
    nudge_deg: float = quantity(0.3, "deg", 0.05, 5.0)
    swing_deg: float = quantity(2.0, "deg", 0.2, 20.0)
    swing_speed_deg_s: float = quantity(10.0, "deg/s", 0.5, 60.0)
    swings: int = quantity(2, "1", 1, 20)
    step_deg_s: float = quantity(8.0, "deg/s", 0.5, 60.0)
    steps_s: float = quantity(3.0, "s", 1.0, 60.0)
    scale_tolerance_percent: float = quantity(2.0, "%", 0.1, 20.0)
    known_tolerance_percent: float = quantity(5.0, "%", 0.1, 20.0)
    known_torque_s: float = quantity(3.0, "s", 0.5, 60.0)
    wide_deg: float = quantity(20.0, "deg", 1.0, 90.0)
    wide_speed_deg_s: float = quantity(60.0, "deg/s", 1.0, 200.0)
    min_rate_percent: float = quantity(90.0, "%", 10.0, 100.0)
    lost_percent: float = quantity(0.1, "%", 0.0, 10.0)
    max_watchdog_s: float = quantity(0.5, "s", 0.01, 5.0)
    watchdog_margin_s: float = quantity(0.1, "s", 0.01, 2.0)
    emergency_stop_wait_s: float = quantity(15.0, "s", 1.0, 120.0)
    daily_validity_h: float = quantity(24.0, "h", 1.0, 168.0)
    daily_rest_s: float = quantity(2.0, "s", 0.5, 60.0)
    daily_motion_s: float = quantity(6.0, "s", 2.0, 60.0)
    daily_speed_deg_s: float = quantity(24.0, "deg/s", 1.0, 120.0)
    inertia_tolerance_percent: float = quantity(20.0, "%", 1.0, 40.0)
    delay_tolerance_s: float = quantity(0.01, "s", 0.001, 0.1)


class SharingSettings(Section):
    """Streams of Lab Streaming Layer during a session of `run`, and NWB after it.

    Parameters
    ----------
    lsl : bool
        Send samples and markers as streams.
    lsl_name : str
        Name of the stream of samples; that of the markers ends in ``Markers``.
    lsl_conditions : bool
        Whether conditions are in the markers; not where who records must not know them.
    nwb_at_close : bool
        Write ``SESSION.nwb`` beside the session folder when the session has ended.
    """

    lsl: bool = False
    lsl_name: str = Field("ElbowRobot", min_length=1, max_length=60)
    lsl_conditions: bool = True
    nwb_at_close: bool = False


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
            "DBS": SubjectSettings(damping_nm_s_rad=0.119, stiffness_nm_rad=1.44),
        }
    )
    protocol: ProtocolSettings = ProtocolSettings()
    dose: DoseSettings = DoseSettings()
    estimation: EstimationSettings = EstimationSettings()
    scores: ScoreSettings = ScoreSettings()
    margins: MarginsSettings = MarginsSettings()
    optimise: OptimiseSettings = OptimiseSettings()
    multisine: MultisineSettings = MultisineSettings()
    diagnostics: DiagnosticsSettings = DiagnosticsSettings()
    online: OnlineSettings = OnlineSettings()
    commissioning: CommissioningSettings = CommissioningSettings()
    sharing: SharingSettings = SharingSettings()
    emg: EmgSettings = EmgSettings()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for sentence in _does_not_fit(self):
            raise ValueError(sentence)
        return self

    @model_serializer(mode="wrap")
    def _without_emg(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out EMG where none is recorded: a session without it is as it always was."""
        values = dict(dump(self))
        if self.emg.source == "none":
            values.pop("emg", None)
        return values


def _does_not_fit(settings: Settings) -> Iterator[str]:
    """Yield a sentence for each two settings that do not go together; the first one is said."""
    guard, rig = settings.guard, settings.rig
    for block in settings.protocol.blocks:
        if block.condition not in settings.subject:
            known = ", ".join(sorted(settings.subject))
            yield (
                f"protocol.blocks names condition {block.condition!r}, but there is no "
                f"[subject.{block.condition}]; known conditions: {known}"
            )
    if settings.sinusoid.amplitude_deg >= guard.position_limit_deg:
        yield (
            f"sinusoid.amplitude_deg = {settings.sinusoid.amplitude_deg:g} deg must stay below "
            f"guard.position_limit_deg = {guard.position_limit_deg:g} deg"
        )
    # A second-order drive has done nearly all it was told after twice its mean lag.
    lag_s = rig.drive_damping_ratio / (math.pi * rig.drive_bandwidth_hz)
    unknown_s = abs(rig.motion.latency_s - rig.motion.stamp_latency_s)
    delay_s = 2 * lag_s + unknown_s + 1 / rig.tick_rate_hz
    if guard.reaction_time_s < delay_s:
        yield (
            f"guard.reaction_time_s = {guard.reaction_time_s:g} s is shorter than this rig may "
            f"take to react ({delay_s:.3g} s: twice the drive's lag, what the stamps of the "
            "encoder do not know of its latency, and one tick); raise it to that"
        )
    if settings.prbs.amplitude_nm >= guard.torque_limit_nm:
        yield (
            f"prbs.amplitude_nm = {settings.prbs.amplitude_nm:g} N·m must stay below "
            f"guard.torque_limit_nm = {guard.torque_limit_nm:g} N·m, at which the rig holds still"
        )
    if settings.controller.torque_cutoff_hz >= rig.tick_rate_hz / 2:
        yield (
            f"controller.torque_cutoff_hz = {settings.controller.torque_cutoff_hz:g} Hz must stay "
            f"below half of rig.tick_rate_hz = {rig.tick_rate_hz:g} Hz"
        )
    if settings.prbs.clock_hz > rig.tick_rate_hz:
        yield (
            f"prbs.clock_hz = {settings.prbs.clock_hz:g} Hz must not exceed rig.tick_rate_hz = "
            f"{rig.tick_rate_hz:g} Hz"
        )
    yield from _sensor_does_not_fit("torque", rig.torque, settings)
    yield from _sensor_does_not_fit("motion", rig.motion, settings)


def _sensor_does_not_fit(
    name: str, sensor: TorqueSensorSettings | MotionSensorSettings, settings: Settings
) -> Iterator[str]:
    rate_hz, tick_rate_hz = sensor.rate_hz, settings.rig.tick_rate_hz
    if sensor.jitter_s * rate_hz >= 1:
        yield (
            f"rig.{name}.jitter_s = {sensor.jitter_s:g} s must be shorter than the "
            f"{1 / rate_hz:g} s between samples at rig.{name}.rate_hz = {rate_hz:g} Hz"
        )
    # The guard goes by the stamp, which may take off more than the latency really is.
    latency_s = max(sensor.latency_s, sensor.stamp_latency_s)
    oldest_s = 1 / rate_hz + latency_s + sensor.jitter_s
    if settings.guard.stale_s <= oldest_s:
        yield (
            f"guard.stale_s = {settings.guard.stale_s:g} s is too short for rig.{name}, whose "
            f"readings may be {oldest_s:.3g} s old; raise it above that"
        )
    if rate_hz > tick_rate_hz:
        yield (
            f"rig.{name}.rate_hz = {rate_hz:g} Hz must not exceed rig.tick_rate_hz = "
            f"{tick_rate_hz:g} Hz"
        )
