"""EMG beside the samples of a session: `emg.arrows`, on the clock of its source.

A stream of batches as that of the samples is (`sample_log`): torn or damaged, the rest is read. A
row is one sample of all muscles: its stamp on the source's own clock, the offset that brings this
clock to that of the session as it was last measured, and the raw voltages.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import RECORDING_BYTES, read_bytes
from rigidimeter.core.records import Channel
from rigidimeter.core.session.arrow_stream import find_schema, scan_stream
from rigidimeter.core.session.sample_log import SampleLog, columns_text
from rigidimeter.core.session.sample_reading import decode_batches

Array = NDArray[np.float64]

EMG = "emg.arrows"
SOURCE_TIME, OFFSET = "source_time_s", "clock_offset_s"
_FITTED = 3
"""So many measured offsets make a straight line; fewer give their mean."""


class EmgLog:
    """Append EMG to the folder of a session.

    Parameters
    ----------
    folder : Path
    channels : sequence of str
        Such as ``emg_v``, ``emg_2_v``.
    rate_hz : float
        Nominal.
    session_id : str
    """

    def __init__(
        self, folder: Path, channels: Sequence[str], rate_hz: float, session_id: str
    ) -> None:
        self._channels = tuple(channels)
        names = (SOURCE_TIME, OFFSET, *channels)
        schema = pa.schema([pa.field(name, pa.float64(), nullable=False) for name in names])
        self._log = SampleLog(folder / EMG, rate_hz, session_id, schema=schema)
        self.samples = 0

    def append(self, source_time_s: Array, clock_offset_s: float, emg_v: Array) -> None:
        """Write samples as one batch.

        Parameters
        ----------
        source_time_s : array, shape (n,)
        clock_offset_s : float
            From the source's clock to the session's, to be added.
        emg_v : array, shape (n, channels)

        Raises
        ------
        OSError
            If they do not fit on the disk; then none of them is in the file.
        """
        if not source_time_s.size:
            return
        columns: dict[str, NDArray[Any]] = {
            SOURCE_TIME: source_time_s,
            OFFSET: np.full(source_time_s.size, clock_offset_s),
        }
        columns |= {name: emg_v[:, k] for k, name in enumerate(self._channels)}
        self._log.append_columns(columns)
        self.samples += source_time_s.size

    def fileno(self) -> int:
        """Return the descriptor of the file, for whoever has it put on the disk."""
        return self._log.fileno()

    def close(self) -> None:
        """Write the end of the stream."""
        self._log.close()


@dataclass(frozen=True)
class StoredEmg:
    """What `emg.arrows` holds.

    Attributes
    ----------
    time_s : array, shape (n,)
        Of each sample on the session's clock, increasing.
    emg_v : mapping of str to array, shape (n,)
    damaged : int
        How many stretches of the file could not be read.
    stop : int
        Where the last whole batch ends.
    closed : bool
        Whether the file ends as it should.
    session_ids : tuple of str
    """

    time_s: Array
    emg_v: Mapping[str, Array]
    damaged: int
    stop: int
    closed: bool
    session_ids: tuple[str, ...]

    def between(self, start_s: float, stop_s: float) -> tuple[Channel, ...]:
        """Return the channels of a stretch, none if it has no samples."""
        first, last = np.searchsorted(self.time_s, (start_s, stop_s), side="left")
        if last - first < 2:
            return ()
        rows = slice(first, last)
        return tuple(Channel(name, self.time_s[rows], v[rows]) for name, v in self.emg_v.items())


def read_emg(folder: Path) -> StoredEmg | None:
    """Return the EMG of a session folder, None if it has none.

    The clock of the source is brought to the session's by a straight line through the offsets that
    were measured. A sample whose stamp is not after that before it is left out.

    Raises
    ------
    UserError
        If the file is not one that `EmgLog` wrote.
    """
    path = folder / EMG
    content = read_bytes(path, RECORDING_BYTES) if path.exists() else b""
    if not content:
        return None
    message = find_schema(content)
    refusal = UserError(f"{path}: its beginning is damaged, so that no EMG can be read of it")
    if message is None:
        raise refusal
    header = content[: message.stop]
    schema = pa.ipc.read_schema(pa.py_buffer(header))
    if schema.names[:2] != [SOURCE_TIME, OFFSET] or len(schema.names) < 3:
        raise refusal
    stream = scan_stream(content, message, columns_text(schema))
    stream, _, tables = decode_batches(content, header, stream, list(range(len(schema.names))))
    whole = [table for table in tables if len(table)]
    columns = {
        name: np.concatenate([np.from_dlpack(table.column(k).chunk(0)) for table in whole])
        if whole
        else np.empty(0)
        for k, name in enumerate(schema.names)
    }
    source_s, offset_s = columns.pop(SOURCE_TIME), columns.pop(OFFSET)
    time_s = source_s + _offsets_s(source_s, offset_s)
    later = np.ones(time_s.size, bool)
    later[1:] = time_s[1:] > np.maximum.accumulate(time_s)[:-1]
    ids = dict.fromkeys(str(m.facts.get("session_id", "")) for m in (message, *stream.batches))
    return StoredEmg(
        time_s[later],
        {name: values[later] for name, values in columns.items()},
        len(stream.gaps),
        stream.stop,
        stream.closed,
        tuple(ids),
    )


def _offsets_s(source_s: Array, offset_s: Array) -> Array:
    """Return the offset of each sample by what was measured now and then."""
    measured = np.flatnonzero(np.diff(offset_s, prepend=np.nan) != 0)
    if measured.size < _FITTED:
        return np.full(source_s.size, np.mean(offset_s[measured]) if measured.size else 0.0)
    centre_s = float(np.mean(source_s[measured]))
    slope, level_s = np.polyfit(source_s[measured] - centre_s, offset_s[measured], 1)
    return np.asarray(level_s + slope * (source_s - centre_s))
