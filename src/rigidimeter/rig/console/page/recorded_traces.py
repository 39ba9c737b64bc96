"""The signals of one recorded epoch and their spectra, as the page draws them.

A spectrum is the root of the one-sided power spectral density by Welch's method: a density of
amplitude in unit/√Hz. White noise of SD s at f samples a second lies at s √(2 / f).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import EVENTS, SAMPLES, read_events, read_samples
from rigidimeter.core.spectrum import density
from rigidimeter.core.units import deg_from_rad

MAX_POINTS = 4000
MIN_SAMPLES = 16
"""Of fewer there is no spectrum."""

MIN_PART = 1e-4
"""Densities below this part of the largest are not drawn: a filter's stop band, rounding."""

RAW = (
    ("torque", "N·m", "torque_nm", 1.0),
    ("angle", "deg", "angle_rad", deg_from_rad(1.0)),
    ("perturbation", "N·m", "perturbation_nm", 1.0),
    ("drive's torque", "N·m", "drive_torque_nm", 1.0),
)
"""What is drawn of an epoch as recorded, unless it has no values."""

FITTED = ("torque_nm", "joint_torque_nm", "subject_torque_nm")
NAMES = ("measured", "J θ″ + B θ′ + K θ", "difference")


def epoch_panes(folder: Path, label: str, fitted: Path) -> list[dict[str, Any]]:
    """Return panes: title, names of the lines, times with a list for each line, and the spectrum.

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
        _pane(name, unit, [""], time_s, [factor * samples[key][rows]])
        for name, unit, key, factor in RAW
        if np.isfinite(samples[key][rows]).any()
    ]
    if fitted.is_file():
        table = pd.read_csv(fitted, dtype={"epoch": str})
        of_epoch = table[table["epoch"] == label]
        if len(of_epoch):
            lines = [of_epoch[column].to_numpy() for column in FITTED]
            name = "torque in the band of the fit"
            panes.append(_pane(name, "N·m", NAMES, of_epoch["time_s"].to_numpy(), lines))
    return panes


def _pane(
    name: str, unit: str, names: Any, time_s: NDArray[np.float64], lines: list[NDArray[np.float64]]
) -> dict[str, Any]:
    """Return a pane with every so many samples; NaN is a gap."""
    step = max(1, math.ceil(time_s.size / MAX_POINTS))
    return {
        "title": f"{name} [{unit}]",
        "names": list(names),
        "data": [as_json(column[::step]) for column in (time_s, *lines)],
        "spectrum": {"title": f"spectrum [{unit}/√Hz]", "data": amplitude_densities(time_s, lines)},
    }


def amplitude_densities(
    time_s: NDArray[np.float64], lines: list[NDArray[np.float64]]
) -> list[list[float | None]]:
    """Return frequencies in Hz, and of each line the density of its amplitude in unit/√Hz.

    Samples that are missing, or no numbers, lie on straight lines.
    """
    if time_s.size < MIN_SAMPLES:
        return [[], *([] for _ in lines)]
    every_s = float(np.median(np.diff(time_s)))
    grid_s = np.arange(time_s[0], time_s[-1] + every_s / 2, every_s)
    frequency_hz, roots = np.empty(0), []
    for line in lines:
        known = np.isfinite(line)
        even = np.interp(grid_s, time_s[known], line[known]) if known.any() else 0.0 * grid_s
        frequency_hz, power = density(even, 1.0 / every_s)
        roots.append(np.sqrt(power))
    drawn_from = MIN_PART * max(float(np.max(root[1:])) for root in roots)
    drawn = [np.where(root > drawn_from, root, np.nan)[1:] for root in roots]
    return [as_json(frequency_hz[1:]), *map(as_json, drawn)]


def as_json(column: NDArray[np.float64]) -> list[float | None]:
    """Return numbers with nine digits; none where there is no number."""
    return [float(f"{v:.9g}") if math.isfinite(v) else None for v in column.tolist()]
