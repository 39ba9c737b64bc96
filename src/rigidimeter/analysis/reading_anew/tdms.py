"""TDMS, the files of LabVIEW and of National Instruments' programs, read by npTDMS.

A channel that is a waveform has a clock of its own: its start and its increment. Channels without
one are columns of a table, among them perhaps one of the time; of several groups of those each
needs one.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.arrays import Expansion, check_count
from rigidimeter.analysis.reading_anew.columns import Column, Columns, even_clock, unique
from rigidimeter.analysis.reading_anew.headers import read_header
from rigidimeter.analysis.reading_anew.streams import Stream, columns_of_streams
from rigidimeter.analysis.reading_anew.units import factor
from rigidimeter.core.errors import UserError

_INCREMENT, _OFFSET, _START = "wf_increment", "wf_start_offset", "wf_start_time"


class _Channel(NamedTuple):
    """A channel with numbers or texts; `clock` is start and increment in s of a waveform."""

    group: str
    name: str
    unit: str
    values: NDArray[Any]
    clock: tuple[float, float] | None


def read_tdms(path: Path) -> Columns:
    """Read the channels of a file.

    A clock for each waveform channel (`wf_increment`), units from `unit_string`.

    Raises
    ------
    UserError
        If it holds no signal, or groups without a time of their own.
    ImportError
        If npTDMS is not installed.
    Exception
        Whatever npTDMS raises on a damaged file.
    """
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    log_manager.set_level(logging.CRITICAL)  # what is wrong is said in a sentence

    with path.open("rb") as file, TdmsFile.open(file) as tdms:
        found = [channel for group in tdms.groups() for channel in group.channels()]
        check_count(path, len(found))
        expansion = Expansion(path, path.stat().st_size)
        starts = [start for each in found if (start := _started(each.properties)) is not None]
        first = min(starts, default=None)
        channels = [*_channels(found, first, expansion)]
    groups: dict[str, list[_Channel]] = {}
    for channel in channels:
        groups.setdefault(channel.group, []).append(channel)
    if any(channel.clock is not None for channel in channels):
        streams, others = _waveforms(channels)
    elif len({channel.values.size for channel in channels}) == 1 or len(groups) == 1:
        return _columns(path, channels)
    else:
        streams, others = _timed_groups(groups)
        if not streams:
            text = "its groups differ in length, and none has a channel of the time with a unit"
            raise UserError(f"{path}: {text}; write waveforms, or set unit_string of the time")
    return replace(columns_of_streams(str(path), streams), others=others)


def _channels(found: Sequence[Any], first: Any, expansion: Expansion) -> Iterator[_Channel]:
    for each in found:
        if len(each) < 2 or each.dtype.kind not in "fiubMO":
            continue
        expansion.take(each.name, 8 * len(each))
        values = np.asarray(each[:])
        unit = str(each.properties.get("unit_string", "") or "")
        if values.dtype.kind == "M":
            values, unit = (values - values[0]) / np.timedelta64(1, "s"), "s"
        elif values.dtype.kind != "O":
            values = values.astype(np.float64)
        yield _Channel(each.group_name, each.name, unit, values, _clock(each.properties, first))


def _started(properties: Mapping[str, Any]) -> Any:
    start = properties.get(_START)
    return start if isinstance(start, np.datetime64) and _clock(properties, None) else None


def _clock(properties: Mapping[str, Any], first: Any) -> tuple[float, float] | None:
    """Return start and increment of a waveform in s; None of a channel that is none."""
    increment_s = properties.get(_INCREMENT, 0.0)
    if not isinstance(increment_s, float | int) or not 0 < increment_s < math.inf:
        return None
    if str(properties.get("wf_xunit_string") or "s") != "s":  # such as a spectrum
        return None
    start_s = float(properties.get(_OFFSET, 0.0))
    start = properties.get(_START)
    if first is not None and isinstance(start, np.datetime64):
        start_s += float((start - first) / np.timedelta64(1, "s"))
    return start_s, float(increment_s)


def _waveforms(channels: Sequence[_Channel]) -> tuple[list[Stream], dict[str, str]]:
    streams: list[Stream] = []
    others: dict[str, str] = {}
    for channel in channels:
        if channel.clock is None or channel.values.dtype == object:
            others[f"{channel.group}.{channel.name}"] = "a channel that is no waveform"
            continue
        start_s, increment_s = channel.clock
        stamps = even_clock(start_s, 1.0 / increment_s, channel.values.size)
        values, unit = {channel.name: channel.values}, {channel.name: channel.unit}
        streams.append(Stream(channel.group, stamps, values, unit))
    return streams, others


def _columns(path: Path, channels: Sequence[_Channel]) -> Columns:
    given = [channel.name for channel in channels]
    names = unique(
        [
            each.name if given.count(each.name) == 1 else f"{each.group}.{each.name}"
            for each in channels
        ]
    )
    columns = {
        name: Column.of(each.values, each.unit) for name, each in zip(names, channels, strict=True)
    }
    if not columns:
        raise UserError(f"{path} holds no channel with at least 2 samples")
    return Columns(str(path), columns)


def _timed_groups(groups: Mapping[str, Sequence[_Channel]]) -> tuple[list[Stream], dict[str, str]]:
    streams: list[Stream] = []
    others: dict[str, str] = {}
    for name, channels in groups.items():
        headers = {each.name: read_header(each.name, each.unit) for each in channels}
        times = [
            each
            for each in channels
            if headers[each.name].kind == "time" and headers[each.name].unit
        ]
        if len(times) != 1:
            what = f"in a group with {len(times)} channels of the time with a unit"
            others |= {f"{name}.{each.name}": what for each in channels}
            continue
        (time,) = times
        in_s = factor(headers[time.name].unit, "time") or 1.0
        rest = [
            each
            for each in channels
            if each is not time
            and each.values.dtype != object
            and each.values.size == time.values.size
        ]
        values = {each.name: each.values for each in rest}
        units = {each.name: each.unit for each in rest}
        streams.append(Stream(name, time.values * in_s, values, units))
    return streams, others
