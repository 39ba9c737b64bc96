"""XDF, the files of Lab Streaming Layer, read by pyxdf: a stream for each clock.

Clock offsets are applied, and stamps of streams with a nominal rate are straightened, as
pyxdf does.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from rigidimeter.analysis.reading_anew.arrays import silent
from rigidimeter.analysis.reading_anew.columns import Array, Columns, unique
from rigidimeter.analysis.reading_anew.streams import Stream, columns_of_streams


def read_xdf(path: Path) -> Columns:
    """Read the streams of a file; those of text are left out.

    A clock for each stream; offsets applied and stamps straightened.

    Raises
    ------
    UserError
        If it holds no signal.
    ImportError
        If pyxdf is not installed.
    Exception
        Whatever pyxdf raises on a damaged file.
    """
    import pyxdf

    with path.open("rb") as file:
        if file.read(4) != b"XDF:":
            raise ValueError("it does not begin with XDF:")
    with silent("pyxdf.pyxdf"):  # a stream of one stamp brings a warning
        found, _ = pyxdf.load_xdf(str(path))
    signals = [one for one in found if isinstance(one["time_series"], np.ndarray)]
    starts = [float(one["time_stamps"][0]) for one in signals if len(one["time_stamps"])]
    return columns_of_streams(
        str(path), [_stream(one, min(starts, default=0.0)) for one in signals]
    )


def _stream(found: Mapping[str, Any], first_s: float) -> Stream:
    info, values = found["info"], found["time_series"]
    described = (info.get("desc") or [None])[0] or {}
    channels = ((described.get("channels") or [None])[0] or {}).get("channel", [])
    name, count = _one(info, "name"), values.shape[1] if values.ndim == 2 else 0
    pairs = zip_longest((_one(each, "label") for each in channels[:count]), range(count))
    labels = unique(label or f"{name} {k + 1}" for label, k in pairs if k is not None)
    units = dict(zip(labels, (_one(each, "unit") for each in channels), strict=False))
    columns: dict[str, Array] = {
        label: np.asarray(values[:, k], dtype=np.float64) for k, label in enumerate(labels)
    }
    stamps = np.asarray(found["time_stamps"], dtype=np.float64) - first_s
    return Stream(name, stamps, columns, units)


def _one(facts: Mapping[str, Any], name: str) -> str:
    return str((facts.get(name) or [""])[0] or "")
