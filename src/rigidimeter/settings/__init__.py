"""Validated settings: TOML with the unit in every key."""

from rigidimeter.settings.estimation_settings import (
    FEWEST_LINES,
    USABLE_FRACTION_OF_RATE,
    DiagnosticLevels,
    DiagnosticsSettings,
    EstimationSettings,
    Level,
    OnlineSettings,
    ScoreSettings,
)
from rigidimeter.settings.experiment_settings import (
    BlockSettings,
    MarginsSettings,
    PrbsSettings,
    ProtocolSettings,
    SinusoidSettings,
)
from rigidimeter.settings.load import (
    changed_settings,
    dump_settings,
    load_settings,
    parse_settings,
    settings_from,
)
from rigidimeter.settings.loop_settings import (
    GAP_S,
    LONGEST_STEP,
    ControllerSettings,
    GuardSettings,
    ZeroingSettings,
)
from rigidimeter.settings.models import Settings
from rigidimeter.settings.rig_settings import (
    MotionSensorSettings,
    RigSettings,
    SubjectSettings,
    TorqueSensorSettings,
)

__all__ = ["Settings", "load_settings", "parse_settings"]
