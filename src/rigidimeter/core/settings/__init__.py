"""Validated settings: TOML with the unit in every key."""

from rigidimeter.core.settings.emg_settings import LEAST_RATE_HZ, EmgSettings
from rigidimeter.core.settings.estimation_settings import (
    FEWEST_LINES,
    USABLE_FRACTION_OF_RATE,
    DiagnosticLevels,
    DiagnosticsSettings,
    EstimationSettings,
    OnlineSettings,
    ScoreSettings,
)
from rigidimeter.core.settings.experiment_settings import (
    BlockSettings,
    DoseSettings,
    MarginsSettings,
    PrbsSettings,
    ProtocolSettings,
    SinusoidSettings,
)
from rigidimeter.core.settings.load import (
    changed_settings,
    dump_settings,
    load_settings,
    parse_settings,
    read_section,
    settings_from,
)
from rigidimeter.core.settings.loop_settings import (
    GAP_S,
    LONGEST_STEP,
    SOFTLY,
    ControllerSettings,
    GuardSettings,
    ZeroingSettings,
)
from rigidimeter.core.settings.messages import validated
from rigidimeter.core.settings.models import CommissioningSettings, Settings
from rigidimeter.core.settings.recorded import recorded_settings, with_new_names
from rigidimeter.core.settings.rig_settings import (
    DriveSideSettings,
    MotionSensorSettings,
    RigSettings,
    SubjectSettings,
    TorqueSensorSettings,
)
from rigidimeter.core.settings.section import Section, quantity

__all__ = ["Settings", "load_settings", "parse_settings"]
