"""Files of instruments: C3D of motion capture, and Spike2, Axon, Blackrock and Plexon.

Of a C3D file the analogue channels are read. Points are left out: no joint angle is in them before
somebody has said how it follows from markers. neo's raw readers say from the headers what signals
there are, at what rate, in what unit and from when; only then are samples read. Where a recording
was paused, its segments follow one another.
"""

from __future__ import annotations

import math
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.arrays import Expansion, check_count, silent
from rigidimeter.analysis.reading_anew.columns import Array, Columns, even_clock, unique
from rigidimeter.analysis.reading_anew.streams import Stream, columns_of_streams
from rigidimeter.core.errors import UserError

# Of values whose unit neo leaves open: the magnitudes of a Plexon file are in mV.
_UNSTATED = {".plx": "mV"}


def read_c3d(path: Path) -> Columns:
    """Read the analogue channels of a file.

    Analogue channels, scaled, with their `UNITS`; no angle is computed from markers.

    Raises
    ------
    UserError
        If it holds none.
    ImportError
        If c3d is not installed.
    Exception
        Whatever c3d raises on a damaged file.
    """
    import c3d

    with path.open("rb") as file, silent("c3d"):
        reader = c3d.Reader(file)
        n_channels = reader.analog_used
        if not n_channels:
            raise UserError(
                f"{path} holds no analogue channel; torque and angle are read from those, not from "
                "markers"
            )
        check_count(path, n_channels)
        values = _analogue(reader, path.stat().st_size)
        names = unique([*_texts(reader, "LABELS"), *[""] * n_channels][:n_channels])
        units = _texts(reader, "UNITS")
        stamps = even_clock(0.0, float(reader.analog_rate), values.shape[1])
    columns = dict(zip(names, values, strict=True))
    stream = Stream("analogue", stamps, columns, dict(zip(names, units, strict=False)))
    return columns_of_streams(str(path), [stream])


def _analogue(reader: Any, file_bytes: int) -> Array:
    """Return all samples, shape (n_channels, n), if the file has the bytes that it claims."""
    ratio = float(reader.analog_rate) / float(reader.point_rate)
    if not (1 <= ratio < math.inf and abs(ratio - round(ratio)) < 1e-3):
        raise ValueError(f"{ratio:g} analogue samples a frame")
    word = 4 if reader.point_scale < 0 else 2
    frame_bytes = word * (4 * reader.point_used + reader.analog_used * reader.analog_per_frame)
    if reader.frame_count < 1 or reader.frame_count * frame_bytes > file_bytes:
        raise ValueError(f"{reader.frame_count} frames of {frame_bytes} bytes are not in it")
    pieces = [analogue for _, _, analogue in reader.read_frames(copy=False, check_nan=False)]
    return np.concatenate(pieces, axis=1).astype(np.float64)


def _texts(reader: Any, name: str) -> list[str]:
    """Return a parameter of one text a channel; what lies beyond 255 is in LABELS2 and so on."""
    found: list[str] = []
    for more in ("", "2", "3"):
        parameter = reader.get(f"ANALOG:{name}{more}")
        if parameter is not None and parameter.num_elements:
            if parameter.num_elements > len(parameter.bytes):
                raise ValueError(f"ANALOG:{name}{more} holds less than it says")
            found += [str(text).strip(" \0") for text in np.ravel(parameter.string_array)]
    return found


def read_neurophysiology(path: Path) -> Columns:
    """Read the signals of a file.

    A clock and a unit for each channel; Plexon has millivolts, so give `--scale`; `.smrx` also
    needs sonpy, which has no wheel for Linux below Python 3.14 and was not tested: save as
    `.smr`.

    Raises
    ------
    UserError
        If it holds none, or several recordings, or is a `.smrx` file and sonpy does not work.
    ImportError
        If neo is not installed.
    Exception
        Whatever neo raises on a damaged file.
    """
    with silent("neo"), ExitStack() as on_end:
        raw = _reader(path)
        on_end.callback(_close, raw)
        _parse_header(path, raw)
        if raw.block_count() != 1:
            raise UserError(f"{path} holds {raw.block_count()} recordings; save one a file")
        check_count(path, len(raw.header["signal_channels"]))
        expansion = Expansion(path, path.stat().st_size)
        streams = [
            _stream(path, raw, index, expansion)
            for index in range(len(raw.header["signal_streams"]))
        ]
    return columns_of_streams(str(path), streams)


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


def _stream(path: Path, raw: Any, index: int, expansion: Expansion) -> Stream:
    of_stream = raw.header["signal_streams"][index]["id"]
    channels = raw.header["signal_channels"]
    channels = channels[channels["stream_id"] == of_stream]
    names = unique(str(name).strip() for name in channels["name"])
    stamps: list[Array] = []
    values: list[Array] = []
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
        return Stream(str(of_stream), np.empty(0), {})
    together = np.concatenate(values)
    columns = {name: together[:, k] for k, name in enumerate(names)}
    return Stream(str(of_stream), np.concatenate(stamps), columns, units)


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
