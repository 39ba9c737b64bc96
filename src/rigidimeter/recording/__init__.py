"""Files, and nothing but files: sessions, other people's recordings, and estimates."""

from rigidimeter.recording.epochs import is_session, read_session, session_settings
from rigidimeter.recording.estimates import (
    ESTIMATES_SCHEMA,
    estimates_document,
    read_estimates,
    write_estimates_csv,
    write_estimates_json,
    write_json,
    write_text,
)
from rigidimeter.recording.folder import SessionWriter, read_manifest
from rigidimeter.recording.recover import Recovery, recover
from rigidimeter.recording.tables import ReadOptions, Table, read_recording, read_table

__all__ = [
    "ESTIMATES_SCHEMA",
    "ReadOptions",
    "Recovery",
    "SessionWriter",
    "Table",
    "estimates_document",
    "is_session",
    "read_estimates",
    "read_manifest",
    "read_recording",
    "read_session",
    "read_table",
    "recover",
    "session_settings",
    "write_estimates_csv",
    "write_estimates_json",
    "write_json",
    "write_text",
]
