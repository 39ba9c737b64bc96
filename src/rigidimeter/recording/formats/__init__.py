"""The formats that are read: a file becomes a table, and a table becomes epochs.

Each name is imported when it is first used, as those of `rigidimeter.recording` are.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

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

_MODULES = {
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
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
    return found
