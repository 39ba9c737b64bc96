"""The folder of a session: planned, written, read, recovered, and continued."""

from rigidimeter.core.session.emg_log import EMG, EmgLog, read_emg
from rigidimeter.core.session.epochs import (
    epoch_extents,
    epoch_of_samples,
    is_session,
    read_session,
    session_settings,
)
from rigidimeter.core.session.event_log import (
    append_event,
    checked_line,
    marker_of,
    read_events,
    sample_markers,
    scan_events,
)
from rigidimeter.core.session.folder import (
    EVENTS,
    MANIFEST,
    SAMPLES,
    Ending,
    SessionWriter,
    locked,
    read_manifest,
    read_session_files,
)
from rigidimeter.core.session.plan import (
    NO_CODE,
    PlannedEpoch,
    Protocol,
    again,
    codes_of,
    count_epochs,
    drawn_codes,
    in_codes,
    require_all,
    rest_of,
)
from rigidimeter.core.session.recovery import close_files, recover
from rigidimeter.core.session.sample_log import (
    BATCH_S,
    SAMPLE_SCHEMA,
    SAMPLE_UNITS,
    Sample,
    SampleLog,
    sample_dtypes,
)
from rigidimeter.core.session.sample_reading import (
    TOGETHER,
    StoredSamples,
    read_samples,
    scan_samples,
)
