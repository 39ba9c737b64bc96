"""Validated settings: TOML with the unit in every key."""

from rigidimeter.settings.diagnostics import DiagnosticLevels, DiagnosticsSettings
from rigidimeter.settings.estimation import EstimationSettings, ScoreSettings
from rigidimeter.settings.foresight import MarginsSettings, MultisineSettings, OptimiseSettings
from rigidimeter.settings.load import dump_settings, load_settings, parse_settings
from rigidimeter.settings.loop import (
    GAP_S,
    ControllerSettings,
    GuardSettings,
    LoopSettings,
    ZeroingSettings,
)
from rigidimeter.settings.models import Settings
from rigidimeter.settings.online import OnlineSettings
from rigidimeter.settings.protocol import (
    BlockSettings,
    PrbsSettings,
    ProtocolSettings,
    SinusoidSettings,
)
from rigidimeter.settings.rig import MotionSensorSettings, RigSettings, TorqueSensorSettings
from rigidimeter.settings.subject import SubjectSettings

__all__ = [
    "GAP_S",
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
