"""The messages of an Arrow stream: where each begins and ends, which are damaged, where it goes on.

A message is ``FF FF FF FF``, the length of its metadata (int32), the metadata (a flatbuffer), and
the body, whose length stands in the metadata. The stream ends with ``FF FF FF FF 00 00 00 00``.
Source: Apache Arrow, "Encapsulated message format".

In a stream with checksums each message has its own in its metadata, under the key `KEY`. It covers
the whole message, lengths included, and is looked at before Arrow sees the message; where it does
not hold, the next message for which it holds is searched for. Without checksums (sessions of
version 1) a message counts as whole if its lengths are possible; changed values are not noticed.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import Any

from rigidimeter.core.files import FIELD, checksum_holds, covered_values

MARKER = b"\xff\xff\xff\xff"
END_OF_STREAM = MARKER + bytes(4)
KEY = "rigidimeter"
"""Of the metadata in which schema and batches say what they are."""

_SCHEMA, _BATCH = 1, 3
"""Types of messages in Arrow's flatbuffers."""
_MAX_METADATA_BYTES = 1 << 20
"""Those of 19 columns take less than 2,000."""


@dataclass(frozen=True)
class StreamMessage:
    """One whole message: its place in the bytes, and what it says of itself, if anything."""

    start: int
    stop: int
    facts: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Gap:
    """Bytes that are no whole message, with something whole or the mark of the end after them."""

    start: int
    stop: int


@dataclass(frozen=True)
class ArrowStream:
    """What a stream holds.

    Attributes
    ----------
    schema : StreamMessage or None
    batches : tuple of StreamMessage
        Those that are whole, in order.
    gaps : tuple of Gap
    stop : int
        Where the last whole message ends; what follows, but for the mark of the end, is torn.
    closed : bool
        Whether the stream ends with its mark.
    checked : bool
        Whether its messages have checksums.
    """

    schema: StreamMessage | None
    batches: tuple[StreamMessage, ...]
    gaps: tuple[Gap, ...]
    stop: int
    closed: bool
    checked: bool


def find_schema(content: bytes) -> StreamMessage | None:
    """Return the message with which a stream begins, None if it is damaged."""
    return _message(content, 0, _SCHEMA, FIELD in content, b"")


def scan_stream(content: bytes, schema: StreamMessage | None, context: bytes) -> ArrowStream:
    """Find the messages of a stream.

    Parameters
    ----------
    content : bytes
    schema : StreamMessage or None
        What `find_schema` found.
    context : bytes
        What the checksum of a batch covers besides the batch: its columns.
    """
    checked = FIELD in content
    batches: list[StreamMessage] = []
    gaps: list[Gap] = []
    at = schema.stop if schema else 0
    stop = at
    while at < len(content) and content[at : at + 9] != END_OF_STREAM:
        batch = _message(content, at, _BATCH, checked, context)
        if batch is None:
            batch = _next(content, at + 1, checked, context)
            if batch is None:
                break
            gaps.append(Gap(at, batch.start))
        batches.append(batch)
        at = stop = batch.stop
    closed = content.endswith(END_OF_STREAM) and len(content) >= stop + len(END_OF_STREAM)
    if closed and stop + len(END_OF_STREAM) < len(content):
        gaps.append(Gap(stop, len(content) - len(END_OF_STREAM)))
        stop = gaps[-1].stop
    return ArrowStream(schema, tuple(batches), tuple(gaps), stop, closed, checked)


def _next(content: bytes, start: int, checked: bool, context: bytes) -> StreamMessage | None:
    """Return the first whole batch that begins at `start` or later."""
    at = content.find(MARKER, start)
    while at >= 0:
        batch = _message(content, at, _BATCH, checked, context)
        if batch is not None:
            return batch
        at = content.find(MARKER, at + 1)
    return None


def _message(
    content: bytes, at: int, kind: int, checked: bool, context: bytes
) -> StreamMessage | None:
    """Return the message that begins at a place, None if none of this kind is whole there."""
    try:
        if content[at : at + 4] != MARKER:
            return None
        (size,) = struct.unpack_from("<i", content, at + 4)
        metadata = at + 8
        if not 0 < size <= min(_MAX_METADATA_BYTES, len(content) - metadata):
            return None
        head = content[metadata : metadata + size]
        stop = metadata + size + _body_length(head, kind)
    except (struct.error, ValueError):
        return None
    if stop > len(content):
        return None
    if not checked:
        return StreamMessage(at, stop)
    # A checksum is looked for in the metadata alone: the body may hold anything.
    if FIELD not in head:
        return None
    if not checksum_holds(content[at:stop], context):
        return None
    return StreamMessage(at, stop, covered_values(head))


def _body_length(metadata: bytes, kind: int) -> int:
    """Return the length of the body from the flatbuffer of a message's metadata.

    The table `Message` has the fields version, header type, header and body length, in this order.

    Raises
    ------
    struct.error, ValueError
        If this is no message of that kind.
    """
    (root,) = struct.unpack_from("<I", metadata)
    (back,) = struct.unpack_from("<i", metadata, root)
    table = root - back
    if table < 0:
        raise ValueError("a table before the first byte")
    size, _, _, type_at, _, length_at = struct.unpack_from("<6H", metadata, table)
    if size < 12:  # no field of a length: a schema has no body
        length_at = 0
    if not type_at or metadata[root + type_at : root + type_at + 1] != bytes([kind]):
        raise ValueError("another kind of message")
    length = struct.unpack_from("<q", metadata, root + length_at)[0] if length_at else 0
    if length < 0:
        raise ValueError("a negative length")
    return int(length)
