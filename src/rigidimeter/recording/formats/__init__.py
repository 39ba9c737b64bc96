"""Recordings that others made: a file becomes a table, and a table becomes epochs."""

from rigidimeter.recording.formats.readers import read_recording, read_table
from rigidimeter.recording.formats.table_epochs import ReadOptions, Table

__all__ = ["ReadOptions", "Table", "read_recording", "read_table"]
