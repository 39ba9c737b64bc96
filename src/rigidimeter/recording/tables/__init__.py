"""Recordings that others made: a file becomes a table, and a table becomes epochs."""

from rigidimeter.recording.tables.readers import read_recording, read_table
from rigidimeter.recording.tables.table import ReadOptions, Table

__all__ = ["ReadOptions", "Table", "read_recording", "read_table"]
