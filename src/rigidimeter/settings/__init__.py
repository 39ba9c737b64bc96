"""Validated settings: TOML with the unit in every key."""

from rigidimeter.settings.diagnostics import DiagnosticLevels, DiagnosticsSettings
from rigidimeter.settings.foresight import MarginsSettings, MultisineSettings, OptimiseSettings
from rigidimeter.settings.load import dump_settings, load_settings, parse_settings
from rigidimeter.settings.models import (
    BlockSettings,
    ControllerSettings,
    EstimationSettings,
    GuardSettings,
    LoopSettings,
    MotionSensorSettings,
    PrbsSettings,
    ProtocolSettings,
    RigSettings,
    ScoreSettings,
    Settings,
    SinusoidSettings,
    SubjectSettings,
    TorqueSensorSettings,
    ZeroingSettings,
)
from rigidimeter.settings.online import OnlineSettings

__all__ = [
    "BlockSettings",
    "ControllerSettings",
    "DiagnosticLevels",
    "DiagnosticsSettings",
    "EstimationSettings",
    "GuardSettings",
    "LoopSettings",
    "MarginsSettings",
    "MotionSensorSettings",
    "MultisineSettings",
    "OnlineSettings",
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
    "dump_settings",
    "load_settings",
    "parse_settings",
]
