"""The folder of a session: written, read, recovered, and continued."""

from rigidimeter.core.session.blinded import NO_CODE, codes_of, drawn_codes
from rigidimeter.core.session.checksum import FIELD, ZEROS, checksum_holds, with_checksum
from rigidimeter.core.session.epochs import (
    epoch_extents,
    epoch_of_samples,
    is_session,
    read_session,
    session_settings,
)
from rigidimeter.core.session.event_log import append_event, checked_line, read_events, scan_events
from rigidimeter.core.session.folder import (
    EVENTS,
    MANIFEST,
    SAMPLES,
    Ending,
    SessionWriter,
    locked,
    read_manifest,
)
from rigidimeter.core.session.markers import marker_of, sample_markers
from rigidimeter.core.session.plan import PlannedEpoch, Protocol
from rigidimeter.core.session.recovery import close_files, recover
from rigidimeter.core.session.resume import again, count_epochs, require_all, rest_of
from rigidimeter.core.session.sample_log import (
    BATCH_S,
    SAMPLE_UNITS,
    SCHEMA,
    Sample,
    SampleLog,
    append_line,
    sample_dtypes,
)
from rigidimeter.core.session.sample_reading import TOGETHER, Samples, read_samples, scan_samples
from rigidimeter.core.session.stored_files import read_session_files
