"""The signals of one recorded epoch, as the page draws them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from rigidimeter.errors import UserError
from rigidimeter.recording.event_log import read_events
from rigidimeter.recording.sample_reading import read_samples
from rigidimeter.recording.session_folder import EVENTS, SAMPLES
from rigidimeter.units import deg_from_rad

MOST_POINTS = 4000
RAW = (
    ("torque [N·m]", "torque_nm", 1.0),
    ("angle [deg]", "angle_rad", deg_from_rad(1.0)),
    ("perturbation [N·m]", "perturbation_nm", 1.0),
)
FITTED = ("torque_nm", "joint_torque_nm", "subject_torque_nm")
NAMES = ("measured", "J θ″ + B θ′ + K θ", "difference")


def epoch_traces(folder: Path, label: str, fitted: Path) -> list[dict[str, Any]]:
    """Return panes: each with a title, names of its lines, and times with one list for each line.

    Parameters
    ----------
    folder : Path
        A session.
    label : str
        Of the epoch.
    fitted : Path
        Measured and modelled torque, as `estimate --subject-torque` writes them; it may not exist.

    Raises
    ------
    UserError
        If there is no such epoch, or it has no samples.
    """
    events, _ = read_events(folder / EVENTS)
    numbers = [
        event["epoch"]
        for event in events
        if event.get("event") == "epoch_started" and event["label"] == label
    ]
    samples = read_samples(folder / SAMPLES)
    rows = np.flatnonzero(np.isin(samples["epoch"], numbers))
    if not rows.size:
        raise UserError(f"{folder.name} has no samples of epoch {label}")
    time_s = samples["time_s"][rows]
    panes = [
        _pane(title, [""], time_s, [factor * samples[key][rows]]) for title, key, factor in RAW
    ]
    if fitted.is_file():
        table = pd.read_csv(fitted, dtype={"epoch": str})
        of_epoch = table[table["epoch"] == label]
        if len(of_epoch):
            lines = [of_epoch[column].to_numpy() for column in FITTED]
            title = "torque in the band of the fit [N·m]"
            panes.append(_pane(title, NAMES, of_epoch["time_s"].to_numpy(), lines))
    return panes


def _pane(
    title: str, names: Any, time_s: NDArray[np.float64], lines: list[NDArray[np.float64]]
) -> dict[str, Any]:
    """Return a pane with every so many samples; NaN is a gap."""
    step = max(1, math.ceil(time_s.size / MOST_POINTS))

    def values(column: NDArray[np.float64]) -> list[float | None]:
        return [round(v, 6) if math.isfinite(v) else None for v in column[::step].tolist()]

    return {"title": title, "names": list(names), "data": [values(time_s), *map(values, lines)]}
