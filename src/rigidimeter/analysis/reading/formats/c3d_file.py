"""C3D, the files of motion capture, read by c3d: the analogue channels with their units.

Points are left out: no joint angle is in them before somebody has said how it follows from markers.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.clocked_table import (
    Stream,
    even_clock,
    table_of_streams,
    unique,
)
from rigidimeter.analysis.reading.formats.stored_arrays import check_count, silent
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import RECORDING_BYTES, open_regular


def read_c3d(path: Path) -> Table:
    """Read the analogue channels of a file.

    Raises
    ------
    UserError
        If it holds none.
    ImportError
        If c3d is not installed.
    Exception
        Whatever c3d raises on a damaged file.
    """
    import c3d

    with open_regular(path, RECORDING_BYTES) as file, silent("c3d"):
        reader = c3d.Reader(file)
        n_channels = reader.analog_used
        if not n_channels:
            raise UserError(
                f"{path} holds no analogue channel; torque and angle are read from those, not from "
                "markers"
            )
        check_count(path, n_channels)
        values = _analogue(reader, path.stat().st_size)
        names = unique([*_texts(reader, "LABELS"), *[""] * n_channels][:n_channels])
        units = _texts(reader, "UNITS")
        stamps = even_clock(0.0, float(reader.analog_rate), values.shape[1])
    columns = dict(zip(names, values, strict=True))
    stream = Stream("analogue", stamps, columns)
    return table_of_streams(str(path), [stream], [dict(zip(names, units, strict=False))])


def _analogue(reader: Any, file_bytes: int) -> NDArray[np.float64]:
    """Return all samples, shape (n_channels, n), if the file has the bytes that it claims."""
    ratio = float(reader.analog_rate) / float(reader.point_rate)
    if not (1 <= ratio < math.inf and abs(ratio - round(ratio)) < 1e-3):
        raise ValueError(f"{ratio:g} analogue samples a frame")
    word = 4 if reader.point_scale < 0 else 2
    frame_bytes = word * (4 * reader.point_used + reader.analog_used * reader.analog_per_frame)
    if reader.frame_count < 1 or reader.frame_count * frame_bytes > file_bytes:
        raise ValueError(f"{reader.frame_count} frames of {frame_bytes} bytes are not in it")
    pieces = [analogue for _, _, analogue in reader.read_frames(copy=False, check_nan=False)]
    return np.concatenate(pieces, axis=1).astype(np.float64)


def _texts(reader: Any, name: str) -> list[str]:
    """Return a parameter of one text a channel; what lies beyond 255 is in LABELS2 and so on."""
    found: list[str] = []
    for more in ("", "2", "3"):
        parameter = reader.get(f"ANALOG:{name}{more}")
        if parameter is not None and parameter.num_elements:
            if parameter.num_elements > len(parameter.bytes):
                raise ValueError(f"ANALOG:{name}{more} holds less than it says")
            found += [str(text).strip(" \0") for text in np.ravel(parameter.string_array)]
    return found
