"""From a stream of samples to columns: what is damaged is named and passed over."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import RECORDING_BYTES, read_bytes
from rigidimeter.core.session.arrow_stream import (
    END_OF_STREAM,
    ArrowStream,
    Gap,
    StreamMessage,
    find_schema,
    scan_stream,
)
from rigidimeter.core.session.sample_log import SAMPLE_SCHEMA, Sample, columns_text, sample_dtypes

_FIRST = len(Sample._fields) - len(Sample._field_defaults)
"""Columns that every recording has; later versions added the others."""
_OTHER_COLUMNS = "{source}: holds other columns than a recording of this version"
TOGETHER = 64
"""So many batches are decoded at a time. What Arrow takes for them is used again for the next: room
for the whole of a long recording takes longer to get than to fill."""
_REFUSALS = (pa.ArrowException, MemoryError, OSError, UnicodeDecodeError)
"""What Arrow raises for bytes that are no stream; a damaged length is one that asks for memory."""


@dataclass(frozen=True)
class Lost:
    """Samples that are lost because their batches are damaged.

    Attributes
    ----------
    row : int
        Of the first sample after them.
    first_batch, last_batch : int
        `last_batch` is -1 if nothing after them can be read.
    first_tick, last_tick : int
        Of the samples; -1 where nothing before or after them can be read.
    """

    row: int
    first_batch: int
    last_batch: int
    first_tick: int
    last_tick: int

    def __str__(self) -> str:
        """Return which batches, and which ticks."""
        if self.last_batch < 0:
            return f"batch {self.first_batch} and what follows it (from tick {self.first_tick} on)"
        batches = f"batch {self.first_batch}"
        if self.last_batch > self.first_batch:
            batches = f"batches {self.first_batch} to {self.last_batch}"
        if self.last_tick < 0:
            return f"{batches} (from tick {self.first_tick} on)"
        return f"{batches} (ticks {max(self.first_tick, 0)} to {self.last_tick})"


@dataclass(frozen=True)
class StoredSamples:
    """What a file of samples holds.

    Attributes
    ----------
    columns : dict of str to array
        All samples of whole batches; of the columns that were asked for.
    lost : tuple of Lost
    session_ids : tuple of str
        That the messages name; an empty text where they name none, as in version 1.
    stream : ArrowStream
    next_batch : int
        The number of the batch that would follow.
    """

    columns: dict[str, NDArray[Any]]
    lost: tuple[Lost, ...]
    session_ids: tuple[str, ...]
    stream: ArrowStream
    next_batch: int


def read_samples(path: Path) -> dict[str, NDArray[Any]]:
    """Return the columns of all whole batches; empty columns if there is none.

    Raises
    ------
    UserError
        If the stream is not one that `SampleLog` wrote.
    """
    return scan_samples(read_bytes(path, RECORDING_BYTES), path).columns


def scan_samples(
    content: bytes, source: Path, wanted: Collection[str] = Sample._fields
) -> StoredSamples:
    """Return what a file of samples holds, and what is damaged in it.

    Parameters
    ----------
    content : bytes
    source : Path
        For messages.
    wanted : collection of str
        The columns to decode, `tick` always. Half the columns take half the time.

    Raises
    ------
    UserError
        If the stream is not one that `SampleLog` wrote.
    """
    header, schema, first = _read_schema(content)
    stream = scan_stream(content, first, columns_text(schema))
    names = _recorded(schema, {"tick", *wanted}, source)
    fields = [schema.get_field_index(name) for name in names]
    stream, lengths, tables = decode_batches(content, header, stream, fields)
    columns = _to_columns(tables, names, wanted, source)
    rows = np.concatenate(([0], np.cumsum(lengths, dtype=int)))
    facts = [message.facts for message in (stream.schema, *stream.batches) if message]
    ids = dict.fromkeys(str(each.get("session_id", "")) for each in facts)
    numbers = [  # without checksums counted, damage as one
        int(batch.facts.get("batch", k + sum(gap.start < batch.start for gap in stream.gaps)))
        for k, batch in enumerate(stream.batches)
    ]
    lost = _lost(stream, numbers, rows, columns["tick"])
    return StoredSamples(columns, tuple(lost), tuple(ids), stream, max([-1, *numbers]) + 1)


def _read_schema(content: bytes) -> tuple[bytes, pa.Schema, StreamMessage | None]:
    """Return the message of the schema, and the schema; those of this version if it is damaged."""
    message = find_schema(content)
    if message is not None:
        header = content[: message.stop]
        try:
            schema = pa.ipc.read_schema(pa.py_buffer(header))
            columns_text(schema)  # names may be no text
            return header, schema, message
        except _REFUSALS:
            pass
    return SAMPLE_SCHEMA.serialize().to_pybytes(), SAMPLE_SCHEMA, None


def _recorded(schema: pa.Schema, wanted: Collection[str], source: Path) -> list[str]:
    """Return which wanted columns a file has, in its order."""
    names = [name for name in schema.names if name in Sample._fields]
    types = {name: SAMPLE_SCHEMA.field(name).type for name in names}
    if (
        not set(Sample._fields[:_FIRST]) <= set(names)
        or len(types) < len(names)
        or any(schema.field(name).type != types[name] for name in names)
    ):
        raise UserError(_OTHER_COLUMNS.format(source=source))
    return [name for name in names if name in wanted]


def decode_batches(
    content: bytes, header: bytes, stream: ArrowStream, fields: list[int]
) -> tuple[ArrowStream, list[int], list[pa.Table]]:
    """Return these fields of the batches, and how long each is; those Arrow refuses become gaps."""
    messages: list[StreamMessage] = []
    lengths: list[int] = []
    tables: list[pa.Table] = []
    gaps = list(stream.gaps)
    waiting = [stream.batches[k : k + TOGETHER] for k in range(0, len(stream.batches), TOGETHER)]
    waiting.reverse()
    while waiting:
        some = waiting.pop()
        table = _decode_together(content, header, some, fields)
        if table is not None:
            messages += some
            lengths += [len(chunk) for chunk in table.column(0).chunks]
            tables.append(table.combine_chunks())
        elif len(some) > 1:  # without checksums only Arrow can say which
            waiting += [(message,) for message in reversed(some)]
        else:
            gaps.append(Gap(some[0].start, some[0].stop))
    gaps.sort(key=lambda gap: gap.start)
    return replace(stream, batches=tuple(messages), gaps=tuple(gaps)), lengths, tables


def _decode_together(
    content: bytes, header: bytes, messages: Sequence[StreamMessage], fields: list[int]
) -> pa.Table | None:
    """Return these fields of some batches, a chunk of each; None if Arrow refuses one."""
    runs = [content[message.start : message.stop] for message in messages]
    options = pa.ipc.IpcReadOptions(use_threads=False, included_fields=fields)
    try:
        data = pa.py_buffer(b"".join([header, *runs, END_OF_STREAM]))
        table = pa.ipc.open_stream(data, options=options).read_all()
        table.validate()
    except _REFUSALS:
        return None
    return table if table.column(0).num_chunks == len(messages) else None


def _lost(
    stream: ArrowStream, numbers: Sequence[int], rows: NDArray[Any], tick: NDArray[Any]
) -> list[Lost]:
    """Return what is lost before each batch, and after the last."""
    starts = [message.start for message in stream.batches]
    damaged = {sum(start < gap.start for start in starts) for gap in stream.gaps}
    found = []
    for k in range(len(numbers) + 1):
        first, at_end = numbers[k - 1] + 1 if k else 0, k == len(numbers)
        missing = numbers[k] > first if not at_end else False
        row = int(rows[k])
        first_tick = int(tick[row - 1]) + 1 if row else -1
        last_tick = int(tick[row]) - 1 if row < len(tick) else -1
        if k in damaged and not stream.checked:  # batches have no numbers; ticks have
            missing = last_tick < 0 or last_tick >= max(first_tick, 0)
        if at_end and k in damaged:
            found.append(Lost(row, first, -1, first_tick, -1))
        elif missing:
            found.append(Lost(row, first, max(first, numbers[k] - 1), first_tick, last_tick))
    return found


def _to_columns(
    tables: Sequence[pa.Table], names: Sequence[str], wanted: Collection[str], source: Path
) -> dict[str, NDArray[Any]]:
    """Return the columns of tables by name, those that were not recorded yet with a default."""
    if any(column.null_count for table in tables for column in table.columns):
        raise UserError(_OTHER_COLUMNS.format(source=source))
    whole = [table for table in tables if len(table)]
    dtypes = sample_dtypes()
    columns = {
        # Not to_numpy, which imports pandas.
        name: np.concatenate([np.from_dlpack(table.column(k).chunk(0)) for table in whole])
        if whole
        else np.empty(0, dtypes[name])
        for k, name in enumerate(names)
    }
    count = sum(map(len, whole))
    for name, default in Sample._field_defaults.items():  # recorded before there was this column
        if name in wanted:
            columns.setdefault(name, np.full(count, default, dtypes[name]))
    return columns
