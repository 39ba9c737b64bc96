"""The formats that are read: a file becomes a table, and a table becomes epochs.

Each name is imported when it is first used, as those of `rigidimeter.analysis.reading` are.
"""

from typing import TYPE_CHECKING

from rigidimeter.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from rigidimeter.analysis.reading.formats.read_options import ReadOptions
    from rigidimeter.analysis.reading.formats.readers import (
        READERS,
        Reader,
        formats_text,
        read_content,
        read_recording,
        read_table,
        reader_of,
        settings_in_file,
    )
    from rigidimeter.analysis.reading.formats.table import Table

__all__ = [
    "READERS",
    "ReadOptions",
    "Reader",
    "Table",
    "formats_text",
    "read_content",
    "read_recording",
    "read_table",
    "reader_of",
    "settings_in_file",
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
            "settings_in_file",
        ),
        "table": ("Table",),
    },
)
