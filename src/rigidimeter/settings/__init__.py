"""Validated settings: TOML with the unit in every key."""

from rigidimeter.settings.load import dump_settings, load_settings, parse_settings
from rigidimeter.settings.models import (
    BlockSettings,
    ControllerSettings,
    EstimationSettings,
    GuardSettings,
    MotionSensorSettings,
    PrbsSettings,
    ProtocolSettings,
    RigSettings,
    ScoreSettings,
    Settings,
    SinusoidSettings,
    SubjectSettings,
    TorqueSensorSettings,
)

__all__ = [
    "BlockSettings",
    "ControllerSettings",
    "EstimationSettings",
    "GuardSettings",
    "MotionSensorSettings",
    "PrbsSettings",
    "ProtocolSettings",
    "RigSettings",
    "ScoreSettings",
    "Settings",
    "SinusoidSettings",
    "SubjectSettings",
    "TorqueSensorSettings",
    "dump_settings",
    "load_settings",
    "parse_settings",
]
