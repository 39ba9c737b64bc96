"""MATLAB tables and timetables as MATLAB saves them, written by mat-io.

mat-io writes no units, so these are put into its properties before they are written.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from rigidimeter.analysis.reading.formats.mat_objects import mat_io


def table(columns: Mapping[str, np.ndarray], units: Sequence[str]) -> object:
    mat_io(Path(), "")  # without its warnings
    from matio.utils.converters.mattables import table_to_mat
    from matio.utils.matclass import MatlabOpaque

    properties = table_to_mat(pd.DataFrame(dict(columns)))
    properties["props"][0, 0]["VariableUnits"] = _cell(units)
    return MatlabOpaque(properties, "table")


def timetable(
    columns: Mapping[str, np.ndarray], units: Sequence[str], times: np.ndarray | float
) -> object:
    """`times` are durations or dates, or the rate in samples/s."""
    mat_io(Path(), "")
    from matio.utils.converters.mattables import timetable_to_mat
    from matio.utils.matclass import MatlabOpaque

    frame = pd.DataFrame(dict(columns))
    rate_hz = float(times) if isinstance(times, float) else 0.0
    seconds = pd.to_timedelta(np.zeros(len(frame)), unit="s")
    frame.index = seconds if rate_hz else pd.Index(times)
    frame.index.name = "Time"
    properties = timetable_to_mat(frame)
    about = properties["any"][0, 0]
    about["varUnits"] = _cell(units)
    if rate_hz:
        about["rowTimes"] = _even(rate_hz)
    return MatlabOpaque(properties, "timetable")


def save(path: Path, version: str = "v7", **values: object) -> None:
    from matio import save_to_mat

    save_to_mat(str(path), dict(values), version=version)


def _cell(texts: Sequence[str]) -> np.ndarray:
    cell = np.empty((1, len(texts)), dtype=object)
    cell[0] = [np.array([text]) for text in texts]
    return cell


def _even(rate_hz: float) -> np.ndarray:
    from matio.utils.matclass import MatlabOpaque

    even = np.empty((1, 1), [(name, object) for name in
                    ("origin", "specifiedAsRate", "stepSize", "sampleRate")])  # fmt: skip
    origin, step = (
        MatlabOpaque({"millis": np.array([[millis]]), "fmt": "s"}, "duration")
        for millis in (0.0, 1e3 / rate_hz)
    )
    even[0, 0] = (origin, np.array([[True]]), step, np.array([[rate_hz]]))
    return even
