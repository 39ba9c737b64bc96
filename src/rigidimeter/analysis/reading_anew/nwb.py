"""Neurodata Without Borders: time series by their own clocks, and trials as epochs.

Only what lies in the file itself is read: no link to another file, no data kept in one.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rigidimeter.analysis.reading_anew.arrays import Expansion, check_count
from rigidimeter.analysis.reading_anew.columns import Array, Columns
from rigidimeter.analysis.reading_anew.quantities import LABELS
from rigidimeter.analysis.reading_anew.streams import Stream, columns_of_streams, with_intervals
from rigidimeter.core.files import NESTING

_SERIES = ("TimeSeries", "SpatialSeries", "ElectricalSeries", "AbstractFeatureSeries")


def read_nwb(path: Path) -> Columns:
    """Read the time series of a file, and its trials as labels.

    Every time series with one value a sample, by its own clock, `conversion` and `offset`;
    trials or epochs, without those whose `excluded` is true.

    Raises
    ------
    UserError
        If it holds no signal, or more than a recording does.
    Exception
        Whatever h5py raises on a damaged file.
    """
    import h5py

    expansion = Expansion(path, path.stat().st_size)
    with h5py.File(path, "r") as file:
        found = dict(_series(file, expansion, 0))
        check_count(path, len(found))
        streams: list[Stream] = []
        for name, series in found.items():
            values, unit = _values(series, expansion)
            stamps = _stamps(series, len(values), expansion)
            short = name.rpartition("/")[2]
            if stamps is None or values.ndim > 2:
                continue
            columns = {short: values}
            if values.ndim == 2:  # of several values a sample each is a column
                columns = {f"{short}[{k}]": part for k, part in enumerate(values.T)}
            streams.append(Stream(name, stamps, columns, dict.fromkeys(columns, unit)))
        return _with_trials(columns_of_streams(str(path), streams), file, expansion)


def _inside(group: Any, place: str) -> Any:
    """Return what lies at a place below a group; None for nothing, or a link to another file."""
    import h5py

    own = group.file.filename
    for name in place.split("/"):
        if not isinstance(group, h5py.Group):
            return None
        if isinstance(group.get(name, getlink=True), h5py.ExternalLink):
            return None
        group = group.get(name)
    return group if group is not None and group.file.filename == own else None


def _present(group: Any, place: str) -> Any:
    found = _inside(group, place)
    if found is None:
        raise ValueError(f"{place} is missing")
    return found


def _series(group: Any, expansion: Expansion, depth: int) -> Iterator[tuple[str, Any]]:
    """Yield every time series of a group and of those in it."""
    import h5py

    if depth > NESTING:
        raise ValueError("its groups are nested too deeply")
    for key in group:
        value = _inside(group, key)
        if not isinstance(value, h5py.Group):
            continue
        if _text(value.attrs.get("neurodata_type")) in _SERIES and "data" in value:
            yield value.name, value
        else:
            yield from _series(value, expansion, depth + 1)


def _values(series: Any, expansion: Expansion) -> tuple[Array, str]:
    data = _present(series, "data")
    values = _read(data, expansion)
    values = values.reshape(-1) if values.ndim == 2 and 1 in values.shape else values
    factor = float(data.attrs.get("conversion", 1.0))
    shift = float(data.attrs.get("offset", 0.0))
    if factor != 1.0 or shift != 0.0:
        values = values * factor + shift
    return values, _text(data.attrs.get("unit"))


def _stamps(series: Any, count: int, expansion: Expansion) -> Array | None:
    stamps, start = _inside(series, "timestamps"), _inside(series, "starting_time")
    if stamps is not None:
        return _read(stamps, expansion)
    if start is not None:
        return float(start[()]) + np.arange(count) / float(start.attrs["rate"])
    return None


def _read(dataset: Any, expansion: Expansion) -> Array:
    if dataset.is_virtual or dataset.external:
        raise ValueError(f"the data of {dataset.name} are not in the file")
    expansion.take(dataset.name, dataset.size * 8)
    return np.asarray(dataset[()], dtype=np.float64)


def _with_trials(columns: Columns, file: Any, expansion: Expansion) -> Columns:
    """Add labels of the trials of a file, or else its epochs: their column `epoch`, or number."""
    tables = (_inside(file, place) for place in ("intervals/trials", "intervals/epochs"))
    trials = next((table for table in tables if table is not None), None)
    if trials is None or _inside(trials, "start_time") is None:
        return columns
    starts_s, stops_s = (
        _read(_present(trials, name), expansion) for name in ("start_time", "stop_time")
    )
    labels = {
        name: [_text(cell) for cell in column[()]]
        for name in (*LABELS, "excluded")
        if (column := _inside(trials, name)) is not None
    }
    labels.setdefault("epoch", [str(k + 1) for k in range(starts_s.size)])
    return with_intervals(columns, starts_s, stops_s, labels)


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value or "")
