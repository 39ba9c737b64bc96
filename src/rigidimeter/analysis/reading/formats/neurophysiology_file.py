"""Files of electrophysiology, read by neo: Spike2, Axon, Blackrock and Plexon.

neo's raw readers say from the headers what signals there are, at what rate, in what unit and from
when; only then are samples read. Where a recording was paused, its segments follow one another.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.clocked_table import (
    Stream,
    even_clock,
    table_of_streams,
    unique,
)
from rigidimeter.analysis.reading.formats.stored_arrays import Expansion, check_count, silent
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import RECORDING_BYTES, open_regular

_SPIKE2_HEAD, _SPIKE2_CHANNEL, _SPIKE2_BLOCK = 512, 140, 20
"""Bytes of the heads of a Spike2 file, of one of its channels and of a block of data."""

_UNSTATED = {".plx": "mV"}
"""Of values whose unit neo leaves open: the magnitudes of a Plexon file are in mV."""

SUFFIXES = (".smr", ".smrx", ".abf", ".plx", *(f".ns{k}" for k in range(1, 7)))


def read_neurophysiology(path: Path) -> Table:
    """Read the signals of a file.

    Raises
    ------
    UserError
        If it holds none, or several recordings, or is a `.smrx` file and sonpy does not work.
    ImportError
        If neo is not installed.
    Exception
        Whatever neo raises on a damaged file.
    """
    with open_regular(path, RECORDING_BYTES) as file:
        if path.suffix.lower() == ".smr":
            _check_spike2(file, path.stat().st_size)
    with silent("neo"), ExitStack() as on_end:
        raw = _reader(path)
        on_end.callback(_close, raw)
        _parse_header(path, raw)
        if raw.block_count() != 1:
            raise UserError(f"{path} holds {raw.block_count()} recordings; save one a file")
        check_count(path, len(raw.header["signal_channels"]))
        expansion = Expansion(path, path.stat().st_size)
        pairs = [
            _stream(path, raw, index, expansion)
            for index in range(len(raw.header["signal_streams"]))
        ]
    return table_of_streams(
        str(path), [stream for stream, _ in pairs], [units for _, units in pairs]
    )


def _parse_header(path: Path, raw: Any) -> None:
    try:
        raw.parse_header()
    except ImportError as error:  # sonpy has no wheel for Linux below Python 3.14
        raise UserError(
            f"{path} is a 64-bit file of Spike2, which neo reads only with CED's sonpy, and that "
            f"does not work here ({str(error)[:80]}); in Spike2 export it as a 32-bit file (.smr), "
            "or as a spreadsheet text (.txt) with names and units, which are read"
        ) from error


def _reader(path: Path) -> Any:
    from neo import rawio

    suffix = path.suffix.lower()
    name = str(path)
    if suffix == ".smr":
        return rawio.Spike2RawIO(filename=name, try_signal_grouping=False)
    if suffix == ".smrx":
        return rawio.CedRawIO(filename=name)
    if suffix == ".abf":
        return rawio.AxonRawIO(filename=name)
    if suffix == ".plx":
        return rawio.PlexonRawIO(filename=name, progress_bar=False)
    # Events lie in a file beside it, which is not read.
    return rawio.BlackrockRawIO(filename=name, nsx_to_load=int(suffix[-1]), load_nev=False)


def _stream(
    path: Path, raw: Any, index: int, expansion: Expansion
) -> tuple[Stream, Mapping[str, str]]:
    of_stream = raw.header["signal_streams"][index]["id"]
    channels = raw.header["signal_channels"]
    channels = channels[channels["stream_id"] == of_stream]
    names = unique(str(name).strip() for name in channels["name"])
    stamps: list[NDArray[np.float64]] = []
    values: list[NDArray[np.float64]] = []
    for segment in range(raw.segment_count(0)):
        count = int(raw.get_signal_size(0, segment, index))
        if path.suffix.lower() == ".plx":
            _check_plexon(raw, channels)
            count -= 1  # asked for all samples, neo 0.14 gives zeros in place of the last block
        if count < 1:
            continue
        expansion.take(names[0], 8 * count * len(names))
        start_s = float(raw.get_signal_t_start(0, segment, index))
        stamps.append(even_clock(start_s, float(channels["sampling_rate"][0]), count))
        chunk = raw.get_analogsignal_chunk(0, segment, 0, count, index)
        scaled = raw.rescale_signal_raw_to_float(chunk, dtype="float64", stream_index=index)
        values.append(np.asarray(scaled, dtype=np.float64))
    stated = [str(unit).strip(" \0") or _UNSTATED.get(path.suffix.lower(), "")
              for unit in channels["units"]]  # fmt: skip
    units = dict(zip(names, stated, strict=True))
    if not stamps:
        return Stream(str(of_stream), np.empty(0), {}), {}
    together = np.concatenate(values)
    columns = {name: together[:, k] for k, name in enumerate(names)}
    return Stream(str(of_stream), np.concatenate(stamps), columns), units


def _check_plexon(raw: Any, channels: NDArray[Any]) -> None:
    """Refuse a recording with a pause, which neo passes over: later samples would be too early."""
    ticks_hz = raw._global_ssampling_rate
    for channel in channels:
        blocks = raw._data_blocks[5][int(channel["id"])]
        since = (blocks["timestamp"] - blocks["timestamp"][0]) / ticks_hz
        late = np.abs(since - blocks["cumsum"] / channel["sampling_rate"])
        if np.max(late) > 1.0 / channel["sampling_rate"]:
            raise UserError(
                f"{raw.filename}: channel {channel['name']} was paused, which is not read; export "
                "what lies before and after the pause as a file each"
            )


def _close(raw: Any) -> None:
    """Close the files that neo leaves open."""
    for file in getattr(raw, "_nsx_fids", {}).values():
        file.close()


def _check_spike2(file: BinaryIO, file_bytes: int) -> None:
    """Refuse channels that claim more blocks than the file has room for."""
    head = file.read(_SPIKE2_HEAD)
    if len(head) < _SPIKE2_HEAD:
        raise ValueError("it breaks off in its head")
    (n_channels,) = struct.unpack_from("<h", head, 30)
    blocks = 0
    for _ in range(n_channels):
        channel = file.read(_SPIKE2_CHANNEL)
        if len(channel) < _SPIKE2_CHANNEL:
            raise ValueError("it breaks off in the heads of its channels")
        blocks += max(struct.unpack_from("<h", channel, 14)[0], 0)
    if blocks * _SPIKE2_BLOCK > file_bytes:
        raise ValueError(f"{blocks} blocks of data are not in it")
