"""Files, and nothing but files: sessions, other people's recordings, and estimates.

Each name is imported when it is first used: the processes of a session write files, and would
otherwise load the readers of every format before the arm may move.
"""

from typing import TYPE_CHECKING

from rigidimeter.lazy_names import lazy_names

if TYPE_CHECKING:
    from rigidimeter.recording.estimate_files import (
        ESTIMATES_SCHEMA,
        estimates_document,
        read_estimates,
        write_estimates_csv,
        write_estimates_json,
    )
    from rigidimeter.recording.formats import ReadOptions, read_recording
    from rigidimeter.recording.recording import Recording, read
    from rigidimeter.recording.recovery import recover
    from rigidimeter.recording.session_epochs import is_session, read_session, session_settings
    from rigidimeter.recording.session_folder import SessionWriter, read_manifest

__all__ = [
    "ESTIMATES_SCHEMA",
    "ReadOptions",
    "Recording",
    "SessionWriter",
    "estimates_document",
    "is_session",
    "read",
    "read_estimates",
    "read_manifest",
    "read_recording",
    "read_session",
    "recover",
    "session_settings",
    "write_estimates_csv",
    "write_estimates_json",
]

__getattr__ = lazy_names(
    __name__,
    {
        "estimate_files": (
            "estimates_document",
            "read_estimates",
            "write_estimates_csv",
            "write_estimates_json",
        ),
        "formats": ("ReadOptions", "read_recording"),
        "recording": ("Recording", "read"),
        "recovery": ("recover",),
        "session_epochs": ("is_session", "read_session", "session_settings"),
        "session_folder": ("SessionWriter", "read_manifest"),
    },
)
