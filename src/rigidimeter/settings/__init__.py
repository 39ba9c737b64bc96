"""Validated settings: TOML with the unit in every key."""

from rigidimeter.settings.diagnostics import DiagnosticLevels, DiagnosticsSettings
from rigidimeter.settings.foresight import MarginsSettings, MultisineSettings, OptimiseSettings
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
from rigidimeter.settings.online import OnlineSettings

__all__ = [
    "BlockSettings",
    "ControllerSettings",
    "DiagnosticLevels",
    "DiagnosticsSettings",
    "EstimationSettings",
    "GuardSettings",
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
    "dump_settings",
    "load_settings",
    "parse_settings",
]
