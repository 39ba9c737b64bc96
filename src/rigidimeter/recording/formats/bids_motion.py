"""BIDS-Motion of other programs: ``_motion.tsv``, whose channels, units and rate are beside it.

A tracking system has a clock: its channel of type LATENCY, or else its sampling frequency.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.documents import read_json
from rigidimeter.errors import UserError
from rigidimeter.recording.formats.bids_dataset import motion_columns, tsv_rows
from rigidimeter.recording.formats.clocked_table import Stream, even_clock, table_of_streams, unique
from rigidimeter.recording.formats.stored_arrays import check_count
from rigidimeter.recording.formats.table import Table

_END = "_motion.tsv"
_DESCRIPTION = "dataset_description.json"


def is_bids_motion(path: Path) -> bool:
    """Whether a path is a motion recording, or a data set with one."""
    if path.is_dir():
        return (path / _DESCRIPTION).is_file() and any(path.rglob(f"*{_END}"))
    return path.name.endswith(_END) and _beside(path, "channels.tsv").is_file()


def read_bids_motion(path: Path) -> Table:
    """Read a motion recording; of a data set the one that it has, with all its tracking systems.

    Raises
    ------
    UserError
        If the data set has several, or a file is missing or damaged.
    """
    files = sorted(path.rglob(f"*{_END}")) if path.is_dir() else [path]
    check_count(path, len(files))
    runs = {re.sub(r"_tracksys-[^_]+", "", str(file)): file for file in files}
    if len(runs) > 1:
        shown = ", ".join(str(file.relative_to(path)) for file in list(runs.values())[:5])
        raise UserError(
            f"{path}: has {len(runs)} motion recordings ({shown}); give one of them, or several "
            "with the tracking systems of one recording and --join"
        )
    pairs = [_stream(file) for file in files]
    return table_of_streams(str(path), [one for one, _ in pairs], [units for _, units in pairs])


def _stream(path: Path) -> tuple[Stream, dict[str, str]]:
    channels = tsv_rows(_beside(path, "channels.tsv"))
    check_count(path, len(channels))
    names = unique(row.get("name") or "" for row in channels)
    columns = motion_columns(path, names)
    latency = [
        name
        for name, row in zip(names, channels, strict=True)
        if (row.get("type") or "").upper() == "LATENCY"
    ]
    count = next((values.size for values in columns.values()), 0)
    if latency:
        time_s: NDArray[np.float64] = columns[latency[0]]
    else:
        time_s = even_clock(0.0, _rate_hz(path, channels), count)
    units = {
        name: row.get("units") or ""
        for name, row in zip(names, channels, strict=True)
        if name not in latency
    }
    system = re.search(r"_tracksys-([^_]+)", path.name)
    kept = {name: columns[name] for name in units}
    return Stream(system[1] if system else "motion", time_s, kept), units


def _rate_hz(path: Path, channels: list[dict[str, Any]]) -> float:
    beside = _beside(path, "motion.json")
    about = read_json(beside) if beside.is_file() else {}
    stated = about.get("SamplingFrequency") if isinstance(about, Mapping) else None
    if not isinstance(stated, int | float):
        stated = next((row.get("sampling_frequency") for row in channels), None)
    try:
        return float(stated)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise UserError(
            f"{path}: has no channel of type LATENCY, and {beside.name} states no SamplingFrequency"
        ) from None


def _beside(path: Path, end: str) -> Path:
    return path.with_name(path.name.removesuffix(_END) + f"_{end}")
