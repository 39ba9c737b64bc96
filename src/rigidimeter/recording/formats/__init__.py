"""The formats that are read: a file becomes a table, and a table becomes epochs."""

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
