"""The frozen types that travel between the rooms.

Every name ends in its unit. Arrays are float64 and read-only once inside a record.
"""

from rigidimeter.core.records.activity import ActiveStretch, Activity, activity_from
from rigidimeter.core.records.analysis_record import (
    Analysis,
    FindingGroup,
    grouped,
    notes_text,
)
from rigidimeter.core.records.epochs import (
    CHANNEL_UNITS,
    EMG_CHANNELS,
    LATE_TICK,
    LOST_SAMPLES,
    Axis,
    Channel,
    Epoch,
    LeftOut,
    Motion,
    Notice,
    Outcome,
    Task,
    Ticks,
    readonly,
)
from rigidimeter.core.records.estimates import (
    AMPLITUDE,
    BAND_VECTORS,
    FIT_NUMBERS,
    PARAMETER_VECTORS,
    PARAMETERS,
    STATISTICS,
    BandEstimate,
    Delay,
    Fit,
    Score,
    degrees,
)
