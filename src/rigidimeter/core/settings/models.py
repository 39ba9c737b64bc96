"""All that can be set, with its unit, its default and its range, and what must fit together.

Every number is declared by `quantity`, which keeps the unit beside the bounds so that a refusal can
name both. The sections are in modules of their own; the defaults are the paper's where it gives a
value.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Self

from pydantic import Field, model_validator

from rigidimeter.core.settings.commissioning_settings import CommissioningSettings
from rigidimeter.core.settings.estimation_settings import (
    DiagnosticsSettings,
    EstimationSettings,
    OnlineSettings,
    ScoreSettings,
)
from rigidimeter.core.settings.experiment_settings import (
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
from rigidimeter.core.settings.section import Section


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
    estimation: EstimationSettings = EstimationSettings()
    scores: ScoreSettings = ScoreSettings()
    margins: MarginsSettings = MarginsSettings()
    optimise: OptimiseSettings = OptimiseSettings()
    multisine: MultisineSettings = MultisineSettings()
    diagnostics: DiagnosticsSettings = DiagnosticsSettings()
    online: OnlineSettings = OnlineSettings()
    commissioning: CommissioningSettings = CommissioningSettings()
    sharing: SharingSettings = SharingSettings()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for sentence in _does_not_fit(self):
            raise ValueError(sentence)
        return self


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
