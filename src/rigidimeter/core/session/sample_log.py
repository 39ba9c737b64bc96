"""The raw log of samples, appended as an Arrow IPC stream.

A stream needs no footer, so what was written before the process was killed can be read: every
complete batch. One batch holds at most `BATCH_S` seconds. Schema and batches carry a checksum and
the id of the session, batches their number too: what is damaged is named and passed over.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Mapping
from math import nan
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from rigidimeter.core.files import ZEROS, append_line, with_checksum
from rigidimeter.core.session.arrow_stream import END_OF_STREAM, KEY

BATCH_S = 0.1
"""How much can be lost when the process is killed."""


class Sample(NamedTuple):
    """One tick of the loop. The units are in the names; see `SAMPLE_UNITS`.

    `epoch` is the number of the epoch, -1 during rests. `limited` is a `guard.Limited` value,
    `cause` and `reported_cause` are `guard.Cause` values. The command is what was sent after the
    guard; the request is what the controller asked for. Sequences and status words are the devices'
    own. The drive's torque is that of its motor by its own measurement, NaN where it reports
    none.
    """

    tick: int
    time_s: float
    lateness_s: float
    epoch: int
    perturbation_nm: float
    torque_nm: float
    torque_time_s: float
    angle_rad: float
    velocity_rad_s: float
    motion_time_s: float
    target_angle_rad: float
    velocity_request_rad_s: float
    velocity_command_rad_s: float
    limited: int
    torque_sequence: int = -1
    torque_status: int = 0
    motion_sequence: int = -1
    motion_status: int = 0
    cause: int = 0
    drive_torque_nm: float = nan
    drive_torque_time_s: float = nan
    reported_cause: int = 0


SAMPLE_UNITS: Mapping[str, str] = {
    "tick": "1",
    "time_s": "s since the session's start",
    "lateness_s": "s behind the tick's deadline",
    "epoch": "number, -1 in a rest",
    "perturbation_nm": "N·m",
    "torque_nm": "N·m applied to the joint",
    "torque_time_s": "s, stamp of the torque sample",
    "angle_rad": "rad",
    "velocity_rad_s": "rad/s",
    "motion_time_s": "s, stamp of the angle and velocity sample",
    "target_angle_rad": "rad, NaN where no position is commanded",
    "velocity_request_rad_s": "rad/s, asked for by the controller",
    "velocity_command_rad_s": "rad/s, sent after the guard",
    "limited": "0 not, 1 acceleration, 2 speed, 3 position, 4 latched",
    "torque_sequence": "count of the torque sensor, -1 where it has none",
    "torque_status": "status word of the torque sensor",
    "motion_sequence": "count of the drive, -1 where it has none",
    "motion_status": "status word of the drive",
    "cause": "number of the cause for which the guard latched, 0 none",
    "drive_torque_nm": "N·m of the motor at the joint, as the drive reports, NaN where it does not",
    "drive_torque_time_s": "s, stamp of the drive's torque",
    "reported_cause": "number of the cause that loop or device reported at this tick, 0 none",
}
"""The unit of every recorded column, as the manifest states them."""

_INTEGERS = {
    "tick": pa.int64(),
    "epoch": pa.int32(),
    "limited": pa.int8(),
    "torque_sequence": pa.int64(),
    "torque_status": pa.int64(),
    "motion_sequence": pa.int64(),
    "motion_status": pa.int64(),
    "cause": pa.int8(),
    "reported_cause": pa.int8(),
}
SAMPLE_SCHEMA = pa.schema(
    [pa.field(name, _INTEGERS.get(name, pa.float64()), nullable=False) for name in Sample._fields]
)
DTYPES = [np.dtype(str(kind)) for kind in SAMPLE_SCHEMA.types]


def sample_dtypes() -> dict[str, np.dtype[Any]]:
    """Return the type of every recorded column, in order."""
    return dict(zip(Sample._fields, DTYPES, strict=True))


class SampleLog:
    """Append samples to an Arrow stream, a batch at a time.

    Either all of a batch is in the file or none of it: when the disk is full, the part that was
    written is removed, and the batch can be written again.

    Parameters
    ----------
    path : Path
        Must not exist: a recording is never overwritten.
    tick_rate_hz : float
        Sets how many samples make a batch of `BATCH_S`.
    session_id : str
        Of the session that the samples belong to.
    before : bytes
        A stream without its end that is continued; empty for a new one.
    first_batch : int
        The number of the first batch that is written here.
    schema : pa.Schema
        Of the columns, where they are not those of the loop's samples.
    """

    def __init__(
        self,
        path: Path,
        tick_rate_hz: float,
        session_id: str = "",
        *,
        before: bytes = b"",
        first_batch: int = 0,
        schema: pa.Schema = SAMPLE_SCHEMA,
    ) -> None:
        self._file: BinaryIO = path.open("xb", buffering=0)
        # Threads cost more than they gain on a batch of a few kilobytes.
        options = pa.ipc.IpcWriteOptions(compression="lz4", use_threads=False)
        # Arrow does not look at how much of its bytes a file took, so it writes to memory.
        self._message = io.BytesIO()
        self._schema, self._covered = schema, columns_text(schema)
        self._dtypes = [np.dtype(str(kind)) for kind in schema.types]
        self._writer = pa.ipc.new_stream(self._message, schema, options=options)
        self._rows: list[Sample] = []
        self._batch = max(1, int(BATCH_S * tick_rate_hz))
        self._session_id = session_id
        self._number = first_batch
        # Arrow writes the schema with the first batch; here it must not be lost with one.
        self._writer.write_batch(_batch(schema, (np.empty(0, dtype) for dtype in self._dtypes)))
        self._message.seek(0)
        self._message.truncate()
        header = schema.with_metadata(_facts(session_id)).serialize().to_pybytes()
        try:
            append_line(self._file, before or with_checksum(header))
        except OSError:
            self._file.close()
            raise

    def append(self, sample: Sample) -> None:
        """Add one tick; a full batch goes to the file at once."""
        self._rows.append(sample)
        if len(self._rows) >= self._batch:
            self.flush()

    def append_columns(self, columns: Mapping[str, NDArray[Any]]) -> None:
        """Write columns of equal length as one batch, after what was waiting.

        Raises
        ------
        OSError
            If they do not fit on the disk; then none of them is in the file.
        """
        self.flush()
        self._put(
            np.ascontiguousarray(columns[name], dtype)
            for name, dtype in zip(self._schema.names, self._dtypes, strict=True)
        )

    def flush(self) -> None:
        """Write what is waiting, however little."""
        if not self._rows:
            return
        n = len(self._rows)
        self._put(
            np.fromiter(column, dtype, n)
            for column, dtype in zip(zip(*self._rows, strict=True), self._dtypes, strict=True)
        )
        self._rows.clear()

    def fileno(self) -> int:
        """Return the descriptor of the file, for whoever has it put on the disk."""
        return self._file.fileno()

    def close(self) -> None:
        """Write the rest and the end of the stream."""
        if self._file.closed:
            return
        self.flush()
        append_line(self._file, END_OF_STREAM)
        self._file.close()

    def _put(self, columns: Iterable[NDArray[Any]]) -> None:
        """Write a batch as Arrow makes it, with its checksum."""
        facts = _facts(self._session_id, batch=self._number)
        self._writer.write_batch(_batch(self._schema, columns), custom_metadata=facts)
        message = self._message.getvalue()
        self._message.seek(0)
        self._message.truncate()
        append_line(self._file, with_checksum(message, self._covered))
        self._number += 1


def _facts(session_id: str, **facts: int) -> dict[str, str]:
    return {KEY: json.dumps({"checksum": ZEROS, "session_id": session_id, **facts})}


def _batch(schema: pa.Schema, columns: Iterable[NDArray[Any]]) -> pa.RecordBatch:
    """Return the columns of a batch; `pa.array` would load pandas, half a second of a processor."""
    arrays = [
        pa.Array.from_buffers(kind, len(column), [None, pa.py_buffer(column)])
        for kind, column in zip(schema.types, columns, strict=True)
    ]
    return pa.RecordBatch.from_arrays(arrays, schema=schema)


def columns_text(schema: pa.Schema) -> bytes:
    """Return names and types, which each batch's checksum covers: they decide what it means."""
    return ",".join(f"{field.name}:{field.type}" for field in schema).encode()
