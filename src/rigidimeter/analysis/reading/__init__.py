"""Recordings of any laboratory, as epochs, arrays of a notebook, and the files of estimates.

Each name is imported when it is first used: a program that reads estimates needs no reader of
recordings.
"""

from typing import TYPE_CHECKING

from rigidimeter.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from rigidimeter.analysis.reading.blinded_recording import with_codes
    from rigidimeter.analysis.reading.estimate_files import (
        ESTIMATES_SCHEMA,
        estimates_document,
        read_estimates,
        write_estimates_csv,
        write_estimates_json,
    )
    from rigidimeter.analysis.reading.example_data import data
    from rigidimeter.analysis.reading.formats import ReadOptions, read_recording
    from rigidimeter.analysis.reading.from_arrays import identify
    from rigidimeter.analysis.reading.recording import Recording, read

__all__ = [
    "ESTIMATES_SCHEMA",
    "ReadOptions",
    "Recording",
    "data",
    "estimates_document",
    "identify",
    "read",
    "read_estimates",
    "read_recording",
    "with_codes",
    "write_estimates_csv",
    "write_estimates_json",
]

__getattr__ = lazy_names(
    __name__,
    {
        "blinded_recording": ("with_codes",),
        "estimate_files": (
            "estimates_document",
            "read_estimates",
            "write_estimates_csv",
            "write_estimates_json",
        ),
        "example_data": ("data",),
        "from_arrays": ("identify",),
        "formats": ("ReadOptions", "read_recording"),
        "recording": ("Recording", "read"),
    },
)
