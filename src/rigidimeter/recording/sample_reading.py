"""From a stream of samples to columns: what is damaged is named and passed over."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from rigidimeter.documents import read_bytes
from rigidimeter.documents.bounds import RECORDING_BYTES
from rigidimeter.errors import UserError
from rigidimeter.recording.arrow_stream import (
    END_OF_STREAM,
    Gap,
    Message,
    Stream,
    find_schema,
    scan_stream,
)
from rigidimeter.recording.sample_log import SCHEMA, Sample, columns_text, sample_dtypes

_FIRST = len(Sample._fields) - len(Sample._field_defaults)
"""Columns that every recording has; later versions added the others."""
_OTHER_COLUMNS = "{source}: holds other columns than a recording of this version"
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
class Samples:
    """What a file of samples holds.

    Attributes
    ----------
    columns : dict of str to array
        All samples of whole batches; of the columns that were asked for.
    lost : tuple of Lost
    session_ids : tuple of str
        That the messages name; an empty text where they name none, as in version 1.
    stream : Stream
    next_batch : int
        The number of the batch that would follow.
    """

    columns: dict[str, NDArray[Any]]
    lost: tuple[Lost, ...]
    session_ids: tuple[str, ...]
    stream: Stream
    next_batch: int


def read_samples(path: Path) -> dict[str, NDArray[Any]]:
    """Return the columns of all whole batches; empty columns if there is none.

    Raises
    ------
    UserError
        If the stream is not one that `SampleLog` wrote.
    """
    return scan_samples(read_bytes(path, RECORDING_BYTES), path).columns


def scan_samples(content: bytes, source: Path, wanted: Collection[str] = Sample._fields) -> Samples:
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
    batches = _decode(content, header, stream.batches, fields)
    if batches is None:  # without checksums only Arrow can say which
        stream, batches = _each_by_itself(content, header, stream, fields)
    table = pa.Table.from_batches(batches, pa.schema([schema.field(k) for k in fields]))
    columns = _to_columns(table, names, wanted, source)
    rows = np.concatenate(([0], np.cumsum([batch.num_rows for batch in batches], dtype=int)))
    facts = [message.facts for message in (stream.schema, *stream.batches) if message]
    ids = dict.fromkeys(str(said.get("session_id", "")) for said in facts)
    numbers = [_number(stream, k) for k in range(len(stream.batches))]
    lost = _lost(stream, numbers, rows, columns["tick"])
    return Samples(columns, tuple(lost), tuple(ids), stream, max([-1, *numbers]) + 1)


def _read_schema(content: bytes) -> tuple[bytes, pa.Schema, Message | None]:
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
    return SCHEMA.serialize().to_pybytes(), SCHEMA, None


def _recorded(schema: pa.Schema, wanted: Collection[str], source: Path) -> list[str]:
    """Return which wanted columns a file has, in its order."""
    names = [name for name in schema.names if name in Sample._fields]
    types = {name: SCHEMA.field(name).type for name in names}
    if (
        not set(Sample._fields[:_FIRST]) <= set(names)
        or len(types) < len(names)
        or any(schema.field(name).type != types[name] for name in names)
    ):
        raise UserError(_OTHER_COLUMNS.format(source=source))
    return [name for name in names if name in wanted]


def _decode(
    content: bytes, header: bytes, messages: Sequence[Message], fields: list[int]
) -> list[pa.RecordBatch] | None:
    """Return these fields of the batches of messages, None if Arrow refuses one."""
    runs = [content[message.start : message.stop] for message in messages]
    options = pa.ipc.IpcReadOptions(use_threads=False, included_fields=fields)
    try:
        data = pa.py_buffer(b"".join([header, *runs, END_OF_STREAM]))
        batches = list(pa.ipc.open_stream(data, options=options))
        for batch in batches:
            batch.validate()
    except _REFUSALS:
        return None
    return batches if len(batches) == len(messages) else None


def _each_by_itself(
    content: bytes, header: bytes, stream: Stream, fields: list[int]
) -> tuple[Stream, list[pa.RecordBatch]]:
    """Decode batches one by one; those that Arrow refuses become gaps."""
    messages, batches, gaps = [], [], list(stream.gaps)
    for message in stream.batches:
        decoded = _decode(content, header, [message], fields)
        if decoded:
            messages.append(message)
            batches += decoded
        else:
            gaps.append(Gap(message.start, message.stop))
    gaps.sort(key=lambda gap: gap.start)
    return replace(stream, batches=tuple(messages), gaps=tuple(gaps)), batches


def _number(stream: Stream, k: int) -> int:
    """Return the number of a whole batch; without checksums it is counted, damage as one."""
    message = stream.batches[k]
    counted = k + sum(gap.start < message.start for gap in stream.gaps)
    return int(message.facts.get("batch", counted))


def _lost(
    stream: Stream, numbers: Sequence[int], rows: NDArray[Any], tick: NDArray[Any]
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
    table: pa.Table, names: Sequence[str], wanted: Collection[str], source: Path
) -> dict[str, NDArray[Any]]:
    """Return the columns of a table by name, those that were not recorded yet with a default."""
    table = table.combine_chunks()
    if any(column.null_count for column in table.columns):
        raise UserError(_OTHER_COLUMNS.format(source=source))
    columns = {
        # Not to_numpy, which imports pandas.
        name: np.from_dlpack(column.chunk(0)) if len(table) else np.empty(0, sample_dtypes()[name])
        for name, column in zip(names, table.columns, strict=True)
    }
    for name, default in Sample._field_defaults.items():  # recorded before there was this column
        if name in wanted:
            columns.setdefault(name, np.full(len(table), default, sample_dtypes()[name]))
    return columns
