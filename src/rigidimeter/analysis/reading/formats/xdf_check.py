"""The chunks of an XDF file, looked at before pyxdf makes room for what they say they hold."""

from __future__ import annotations

import struct
from typing import BinaryIO
from xml.etree import ElementTree

BOUNDARY = bytes.fromhex("43a546dccbf5410fb30ed5467383cbe4")
"""What a chunk between others holds, so that a reader finds its place again."""

_HEADER, _SAMPLES = 2, 3
_VALUE_BYTES = {
    "int8": 1,
    "int16": 2,
    "int32": 4,
    "int64": 8,
    "float32": 4,
    "double64": 8,
    "string": 1,
}
_MOST_HEADER_BYTES = 16 * 1024 * 1024
_LENGTHS = {1: "<B", 4: "<I", 8: "<Q"}


def check_xdf(file: BinaryIO, file_bytes: int) -> None:
    """Refuse a file whose chunks say that they hold more than they have bytes.

    A last chunk that breaks off, as of a recording that was killed, is passed over.

    Raises
    ------
    ValueError
        If it is no XDF file, or damaged.
    """
    if file.read(4) != b"XDF:":
        raise ValueError("it does not begin with XDF:")
    least_bytes: dict[int, int] = {}
    while (length := _number(file)) is not None:
        end = file.tell() + length
        if length < 2 or end > file_bytes:
            if BOUNDARY in file.read(file_bytes - file.tell()):
                raise ValueError("a chunk within it has a damaged length")
            return  # nothing is taken from this chunk
        (tag,) = struct.unpack("<H", file.read(2))
        if tag == _HEADER:
            stream, least = _header(file, end)
            least_bytes[stream] = least
        elif tag == _SAMPLES:
            (stream,) = struct.unpack("<I", file.read(4))
            count = _number(file)
            if stream not in least_bytes:
                raise ValueError(f"samples of stream {stream} come before its header")
            if count is None or count * least_bytes[stream] > length:
                raise ValueError(f"a chunk of {length} bytes says that it holds {count} samples")
        file.seek(end)


def _header(file: BinaryIO, end: int) -> tuple[int, int]:
    """Return the number of a stream, and the fewest bytes of a sample."""
    (stream,) = struct.unpack("<I", file.read(4))
    length = end - file.tell()
    if length > _MOST_HEADER_BYTES:
        raise ValueError(f"the header of stream {stream} has {length} bytes")
    text = file.read(length)
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise ValueError(f"the header of stream {stream} defines entities")
    info = ElementTree.fromstring(text)
    channels = int(info.findtext("channel_count") or "0")
    kind = info.findtext("channel_format") or ""
    if kind not in _VALUE_BYTES or channels < 1:
        raise ValueError(f"stream {stream} has {channels} channels of type {kind!r}")
    return stream, 1 + channels * _VALUE_BYTES[kind]


def _number(file: BinaryIO) -> int | None:
    """Return a number after the count of its bytes; None at the end of the file."""
    size = file.read(1)
    if not size:
        return None
    form = _LENGTHS.get(size[0])
    if form is None:
        raise ValueError(f"a length of {size[0]} bytes")
    data = file.read(size[0])
    return int(struct.unpack(form, data)[0]) if len(data) == size[0] else None
