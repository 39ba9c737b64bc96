"""Neurodata Without Borders: time series by their own clocks, and trials as epochs.

A file that `rigidimeter export` wrote gives its epochs and settings as they were. Only what lies in
the file itself is read: no link to another file, no data kept in one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.documents import parse_json
from rigidimeter.documents.bounds import DOCUMENT_BYTES, NESTING
from rigidimeter.recording.exported_session import (
    ExportedSession,
    Stream,
    checked_document,
    epochs_of_export,
    exported_settings,
)
from rigidimeter.recording.formats.clocked_table import TIME, table_of_streams
from rigidimeter.recording.formats.stored_arrays import Expansion, check_count
from rigidimeter.recording.formats.table import Table
from rigidimeter.records import Epoch, Notice
from rigidimeter.settings import Settings

_SERIES = ("TimeSeries", "SpatialSeries", "ElectricalSeries", "AbstractFeatureSeries")
_PLACES = {"acquisition": "acquisition", "stimulus": "stimulus/presentation"}
_LABELS = ("epoch", "condition", "task")


def read_nwb(path: Path) -> Table | tuple[list[Epoch], list[Notice]]:
    """Read the time series of a file, or the epochs of an exported session.

    Raises
    ------
    UserError
        If it holds no signal, or more than a recording does.
    Exception
        Whatever h5py raises on a damaged file.
    """
    expansion = Expansion(path, path.stat().st_size)
    with _opened(path) as file:
        about = _document(path, file)
        if about is not None:
            return epochs_of_export(_exported(file, about, expansion), str(path))
        found = dict(_series(file, expansion, 0))
        check_count(path, len(found))
        streams: list[Stream] = []
        units: list[dict[str, str]] = []
        for name, series in found.items():
            values, unit = _values(series, expansion)
            stamps = _stamps(series, len(values), expansion)
            short = name.rpartition("/")[2]
            if values.ndim != 1 or stamps is None:
                continue
            streams.append(Stream(name, stamps, {short: values}))
            units.append({short: unit})
        return _with_trials(table_of_streams(str(path), streams, units), file, expansion)


def nwb_settings(path: Path) -> Settings | None:
    """Return the settings of an exported session; None of any other file."""
    with _opened(path) as file:
        about = _document(path, file)
    return None if about is None else exported_settings(about, str(path))


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    import h5py

    with h5py.File(path, "r") as file:
        yield file


def _document(path: Path, file: Any) -> dict[str, Any] | None:
    place = "scratch/rigidimeter_document"
    found = _inside(file, place)
    if found is None:
        return None
    text = found[()]
    data = text if isinstance(text, bytes) else str(text).encode()
    if len(data) > DOCUMENT_BYTES:
        raise ValueError("its document is too large")
    return checked_document(parse_json(data, f"{path}: its document"), str(path))


def _exported(file: Any, about: Mapping[str, Any], expansion: Expansion) -> ExportedSession:
    places = about["nwb_series"]
    streams = []
    for name, columns in about["streams"].items():
        own = {column: f"{name}.{column}" for column in columns if f"{name}.{column}" in places}
        groups = {column: _present(file, _place(places[key])) for column, key in own.items()}
        values = {column: _values(group, expansion)[0] for column, group in groups.items()}
        if not groups:
            continue
        first = next(iter(groups))
        stamps = _stamps(groups[first], len(values[first]), expansion)
        if stamps is None:
            raise ValueError(f"{name} has no time stamps")
        streams.append(Stream(name, stamps, values))
    return ExportedSession(about, tuple(streams))


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


def _place(text: str) -> str:
    place, _, name = str(text).partition("/")
    return f"{_PLACES.get(place, f'processing/{place}')}/{name}"


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


def _values(series: Any, expansion: Expansion) -> tuple[NDArray[np.float64], str]:
    data = _present(series, "data")
    values = _read(data, expansion)
    values = values.reshape(-1) if values.ndim == 2 and 1 in values.shape else values
    factor = float(data.attrs.get("conversion", 1.0))
    shift = float(data.attrs.get("offset", 0.0))
    if factor != 1.0 or shift != 0.0:
        values = values * factor + shift
    return values, _text(data.attrs.get("unit"))


def _stamps(series: Any, count: int, expansion: Expansion) -> NDArray[np.float64] | None:
    stamps, start = _inside(series, "timestamps"), _inside(series, "starting_time")
    if stamps is not None:
        return _read(stamps, expansion)
    if start is not None:
        return float(start[()]) + np.arange(count) / float(start.attrs["rate"])
    return None


def _read(dataset: Any, expansion: Expansion) -> NDArray[np.float64]:
    if dataset.is_virtual or dataset.external:
        raise ValueError(f"the data of {dataset.name} are not in the file")
    expansion.take(dataset.name, dataset.size * 8)
    return np.asarray(dataset[()], dtype=np.float64)


def _with_trials(table: Table, file: Any, expansion: Expansion) -> Table:
    """Add labels of the trials of a file, or else its epochs: their column `epoch`, or number."""
    tables = (_inside(file, place) for place in ("intervals/trials", "intervals/epochs"))
    trials = next((table for table in tables if table is not None), None)
    if trials is None or _inside(trials, "start_time") is None:
        return table
    starts, stops = (
        _read(_present(trials, name), expansion) for name in ("start_time", "stop_time")
    )
    time_s = table.columns[TIME]
    labels = {
        name: [_text(cell) for cell in column[()]]
        for name in _LABELS
        if (column := _inside(trials, name)) is not None
    }
    labels.setdefault("epoch", [str(k + 1) for k in range(starts.size)])
    columns: dict[str, NDArray[Any]] = {}
    for name, texts in labels.items():
        column = np.full(time_s.size, "", dtype=object)
        for start_s, stop_s, text in zip(starts, stops, texts, strict=True):
            column[(time_s >= start_s) & (time_s <= stop_s)] = text
        columns[name] = column
    return Table(table.source, {**table.columns, **columns}, units=table.units)


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value or "")
