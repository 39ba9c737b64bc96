"""Validated settings: TOML with the unit in every key."""

from rigidimeter.settings.diagnostics_settings import DiagnosticLevels, DiagnosticsSettings
from rigidimeter.settings.estimation_settings import EstimationSettings, ScoreSettings
from rigidimeter.settings.load import (
    dump_settings,
    load_settings,
    parse_settings,
    settings_from,
)
from rigidimeter.settings.loop_settings import (
    GAP_S,
    ControllerSettings,
    GuardSettings,
    LoopSettings,
    ZeroingSettings,
)
from rigidimeter.settings.models import Settings
from rigidimeter.settings.online_settings import OnlineSettings
from rigidimeter.settings.prediction_settings import (
    MarginsSettings,
    MultisineSettings,
    OptimiseSettings,
)
from rigidimeter.settings.protocol_settings import (
    BlockSettings,
    PrbsSettings,
    ProtocolSettings,
    SinusoidSettings,
)
from rigidimeter.settings.rig_settings import (
    MotionSensorSettings,
    RigSettings,
    TorqueSensorSettings,
)
from rigidimeter.settings.subject_settings import SubjectSettings

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
    "settings_from",
]
