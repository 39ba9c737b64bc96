"""BIDS-Motion: ``_motion.tsv``, whose channels, units and rate are beside it.

A tracking system has a clock: its channel of type LATENCY, or else its sampling frequency. Events
with a column `epoch` are the epochs.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rigidimeter.analysis.reading_anew.arrays import check_count
from rigidimeter.analysis.reading_anew.columns import Array, Columns, even_clock, unique
from rigidimeter.analysis.reading_anew.quantities import LABELS
from rigidimeter.analysis.reading_anew.streams import Stream, columns_of_streams, with_intervals
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import RECORDING_BYTES, TABLE_BYTES, open_regular, read_bytes, read_json

_END = "_motion.tsv"
_DESCRIPTION = "dataset_description.json"


def is_bids_motion(path: Path) -> bool:
    """Whether a path is a motion recording, or a data set or a folder in it with one."""
    if path.is_dir():
        inside = any((each / _DESCRIPTION).is_file() for each in (path, *path.resolve().parents))
        return inside and any(path.rglob(f"*{_END}"))
    return path.name.endswith(_END) and _beside(path, "channels.tsv").is_file()


def read_bids_motion(path: Path) -> Columns:
    """Read a motion recording; of a folder the one that it has, with all its tracking systems.

    `…_motion.tsv` with `_channels.tsv` and `_motion.json` beside it, or a data set with one
    recording; a clock for each tracking system; events with a column `epoch` are epochs.

    Raises
    ------
    UserError
        If the folder has several, or a file is missing or damaged.
    """
    files = sorted(path.rglob(f"*{_END}")) if path.is_dir() else [path]
    check_count(path, len(files))
    runs = {re.sub(r"_tracksys-[^_]+", "", str(file)): file for file in files}
    if len(runs) > 1:
        shown = ", ".join(str(file.relative_to(path)) for file in list(runs.values())[:5])
        raise UserError(
            f"{path}: has {len(runs)} motion recordings ({shown}); give a folder with one of them, "
            "or the files of its tracking systems and --join"
        )
    columns = columns_of_streams(str(path), [_stream(file) for file in files])
    (run,) = runs
    events = Path(run.removesuffix(_END) + "_events.tsv")
    return _with_events(columns, events) if events.is_file() else columns


def _with_events(columns: Columns, path: Path) -> Columns:
    """Add labels of events, where they say to which epoch they belong."""
    rows = _tsv_rows(path)
    if not rows or not {"onset", "duration", "epoch"} <= rows[0].keys():
        return columns
    try:
        starts_s = [float(row["onset"]) for row in rows]
        stops_s = [float(row["onset"]) + float(row["duration"]) for row in rows]
    except (TypeError, ValueError):
        raise UserError(f"{path}: an event has no number as onset and duration, in s") from None
    named = [name for name in (*LABELS, "excluded") if name in rows[0]]
    labels = {name: [row[name] or "" for row in rows] for name in named}
    return with_intervals(columns, starts_s, stops_s, labels)


def _stream(path: Path) -> Stream:
    channels = _tsv_rows(_beside(path, "channels.tsv"))
    check_count(path, len(channels))
    names = unique(row.get("name") or "" for row in channels)
    columns = _motion_columns(path, names)
    latency = [
        name
        for name, row in zip(names, channels, strict=True)
        if (row.get("type") or "").upper() == "LATENCY"
    ]
    count = next((values.size for values in columns.values()), 0)
    if latency:
        time_s: Array = columns[latency[0]]
    else:
        time_s = even_clock(0.0, _rate_hz(path, channels), count)
    units = {
        name: row.get("units") or ""
        for name, row in zip(names, channels, strict=True)
        if name not in latency
    }
    system = re.search(r"_tracksys-([^_]+)", path.name)
    kept = {name: columns[name] for name in units}
    return Stream(system[1] if system else "motion", time_s, kept, units)


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


def _tsv_rows(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a small table with names in its first line."""
    text = read_bytes(path, TABLE_BYTES).decode("utf-8")
    return list(csv.DictReader(io.StringIO(text), delimiter="\t"))


def _motion_columns(path: Path, names: list[str]) -> dict[str, Array]:
    """Return the columns of ``_motion.tsv``, which has no names.

    Raises
    ------
    UserError
        If it has others.
    """
    import pyarrow as pa
    import pyarrow.csv

    options = pa.csv.ReadOptions(column_names=names)
    parsing = pa.csv.ParseOptions(delimiter="\t")
    kinds = pa.csv.ConvertOptions(
        null_values=["n/a"], column_types=dict.fromkeys(names, pa.float64())
    )
    try:
        with open_regular(path, RECORDING_BYTES) as file:
            table = pa.csv.read_csv(file, options, parsing, kinds)
    except pa.ArrowException as error:
        reason = str(error).splitlines()[0][:120]
        raise UserError(f"{path}: is damaged, not a motion recording ({reason})") from None
    return {name: np.asarray(table[name].to_numpy(), dtype=np.float64) for name in names}
