"""XDF, the files of Lab Streaming Layer, read by pyxdf: a stream for each clock.

A recording of the streams that `rigidimeter run` sends gives the session's epochs, any other a
table. Clock offsets are applied, and stamps of streams with a nominal rate are straightened, as
pyxdf does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.clocked_table import Stream, table_of_streams, unique
from rigidimeter.analysis.reading.formats.lsl_recording import (
    SAMPLES_TYPE,
    epochs_of_samples,
    settings_of_samples,
)
from rigidimeter.analysis.reading.formats.stored_arrays import silent
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.analysis.reading.formats.xdf_check import check_xdf
from rigidimeter.core.files import RECORDING_BYTES, open_regular
from rigidimeter.core.records import Epoch, Notice
from rigidimeter.core.settings import Settings


@dataclass(frozen=True)
class XdfStream:
    """A stream as pyxdf gives it: its name, its kind, labels and units of its channels."""

    name: str
    kind: str
    labels: tuple[str, ...]
    units: tuple[str, ...]
    time_s: NDArray[np.float64]
    values: Any
    described: Mapping[str, Any]

    @property
    def of_text(self) -> bool:
        """Whether its samples are texts."""
        return not isinstance(self.values, np.ndarray)


def read_xdf(path: Path) -> Table | tuple[list[Epoch], list[Notice]]:
    """Read the streams of a file.

    Raises
    ------
    UserError
        If it holds no signal.
    ImportError
        If pyxdf is not installed.
    Exception
        Whatever pyxdf raises on a damaged file.
    """
    streams = _streams(path)
    sent = next((stream for stream in streams if stream.kind == SAMPLES_TYPE), None)
    if sent is not None:
        markers = [
            (float(at_s), str(text[0]))
            for stream in streams
            if stream.of_text and stream.name == f"{sent.name}Markers"
            for at_s, text in zip(stream.time_s, stream.values, strict=True)
        ]
        return epochs_of_samples(str(path), _columns(sent), markers, sent.described)
    signals = [stream for stream in streams if not stream.of_text]
    first_s = min((float(each.time_s[0]) for each in signals if each.time_s.size), default=0.0)
    units = [dict(zip(_labels(each), each.units, strict=False)) for each in signals]
    named = [Stream(each.name, each.time_s - first_s, _columns(each)) for each in signals]
    return table_of_streams(str(path), named, units)


def xdf_settings(path: Path) -> Settings | None:
    """Return the settings with which a session of ours was recorded; None of any other file."""
    sent = next((stream for stream in _streams(path) if stream.kind == SAMPLES_TYPE), None)
    return None if sent is None else settings_of_samples(sent.described, str(path))


def _streams(path: Path) -> list[XdfStream]:
    import pyxdf

    with open_regular(path, RECORDING_BYTES) as file:
        check_xdf(file, path.stat().st_size)
    # Of damage `check_xdf` has said what is to be said; a stream of one stamp brings a warning.
    with silent("pyxdf.pyxdf"):
        found, _ = pyxdf.load_xdf(str(path))
    return [_stream(each) for each in found]


def _stream(found: Mapping[str, Any]) -> XdfStream:
    info = found["info"]
    described = (info.get("desc") or [None])[0] or {}
    channels = ((described.get("channels") or [None])[0] or {}).get("channel", [])
    units = [_one(each, "unit") for each in channels]
    labels = [_one(each, "label") for each in channels]
    return XdfStream(
        _one(info, "name"),
        _one(info, "type"),
        tuple(labels),
        tuple(units),
        np.asarray(found["time_stamps"], dtype=np.float64),
        found["time_series"],
        described,
    )


def _one(facts: Mapping[str, Any], name: str) -> str:
    return str((facts.get(name) or [""])[0] or "")


def _labels(stream: XdfStream) -> list[str]:
    count = stream.values.shape[1] if stream.values.ndim == 2 else 0
    pairs = zip_longest(stream.labels[:count], range(count))
    return unique(label or f"{stream.name} {k + 1}" for label, k in pairs if k is not None)


def _columns(stream: XdfStream) -> dict[str, NDArray[np.float64]]:
    return {
        label: np.asarray(stream.values[:, k], dtype=np.float64)
        for k, label in enumerate(_labels(stream))
    }
