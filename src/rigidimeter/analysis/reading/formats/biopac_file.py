"""The files of BIOPAC AcqKnowledge, read by bioread: a clock and a unit for each channel."""

from __future__ import annotations

import math
import zlib
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from rigidimeter.analysis.reading.formats.clocked_table import Stream, even_clock, table_of_streams
from rigidimeter.analysis.reading.formats.stored_arrays import Expansion, check_count, silent
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.files import RECORDING_BYTES, open_regular

_PATTERN = 1_000_000
"""Of the samples after which the order of the channels repeats; bioread makes an array of it."""


def read_biopac(path: Path) -> Table:
    """Read the channels of a file.

    Raises
    ------
    UserError
        If it holds no signal.
    ImportError
        If bioread is not installed.
    Exception
        Whatever bioread raises on a damaged file.
    """
    from bioread.reader import Reader

    with open_regular(path, RECORDING_BYTES) as file, silent("bioread"):
        reader = Reader.read_headers(file)
        if reader.datafile is None:
            raise ValueError("its headers are damaged")
        channels = reader.datafile.channels
        check_count(path, len(channels))
        if reader.is_compressed:
            _read_compressed(path, file, reader)
        else:
            _check(channels, path.stat().st_size - reader.data_start_offset)
            reader._read_data(None)
    streams = []
    for channel in channels:
        values = np.asarray(channel.data, dtype=np.float64)
        stamps = even_clock(0.0, float(channel.samples_per_second), values.size)
        streams.append(Stream("acq", stamps, {channel.name.strip(): values}))
    units = [{channel.name.strip(): channel.units.strip()} for channel in channels]
    return table_of_streams(str(path), streams, units)


def _check(channels: list[Any], data_bytes: int) -> None:
    """Refuse channels that claim what the file has not."""
    counts = [channel.point_count for channel in channels]
    dividers = [channel.frequency_divider for channel in channels]
    if min(counts) < 0 or sum(channel.data_length for channel in channels) > data_bytes:
        raise ValueError(f"channels of {max(counts)} samples are not in it")
    if min(dividers) < 1 or math.lcm(*dividers) * len(channels) > _PATTERN:
        raise ValueError("its channels have rates that do not belong together")


def _read_compressed(path: Path, file: BinaryIO, reader: Any) -> None:
    channels, headers = reader.datafile.channels, reader.channel_compression_headers
    if len(headers) != len(channels):
        raise ValueError("the headers of its compressed channels are damaged")
    expansion = Expansion(path, path.stat().st_size)
    for channel, header in zip(channels, headers, strict=True):
        expansion.take(channel.name, channel.point_count * 8)
        file.seek(header.compressed_data_offset)
        packed = file.read(max(header.compressed_data_len, 0))
        size = max(channel.data_length, 1)
        data = zlib.decompressobj().decompress(packed, size)  # no more, whatever is in it
        if len(data) != channel.data_length:
            raise ValueError(f"channel {channel.name[:40]} is shorter than it says")
        channel.raw_data = np.frombuffer(data, dtype=channel.dtype)
