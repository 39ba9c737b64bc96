"""The formats that are read: a file becomes a table, and a table becomes epochs.

Each name is imported when it is first used, as those of `rigidimeter.recording` are.
"""

from typing import TYPE_CHECKING

from rigidimeter.lazy_names import lazy_names

if TYPE_CHECKING:
    from rigidimeter.recording.formats.read_options import ReadOptions
    from rigidimeter.recording.formats.readers import (
        READERS,
        Reader,
        formats_text,
        read_content,
        read_recording,
        read_table,
        reader_of,
        recorded_settings,
    )
    from rigidimeter.recording.formats.table import Table
    from rigidimeter.recording.formats.text_table import TextTable, read_text_table

__all__ = [
    "READERS",
    "ReadOptions",
    "Reader",
    "Table",
    "TextTable",
    "formats_text",
    "read_content",
    "read_recording",
    "read_table",
    "read_text_table",
    "reader_of",
    "recorded_settings",
]

__getattr__ = lazy_names(
    __name__,
    {
        "read_options": ("ReadOptions",),
        "readers": (
            "READERS",
            "Reader",
            "formats_text",
            "read_content",
            "read_recording",
            "read_table",
            "reader_of",
            "recorded_settings",
        ),
        "table": ("Table",),
        "text_table": ("TextTable", "read_text_table"),
    },
)
