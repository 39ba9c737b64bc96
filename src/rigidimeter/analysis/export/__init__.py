"""Sessions and studies in the formats that archives and other programs take."""

from rigidimeter.analysis.export.exported_sessions import (
    ExportedSession,
    sessions_of_recording,
    sessions_of_study,
)
from rigidimeter.analysis.export.formats import FORMATS, Format, export_sessions, format_named
