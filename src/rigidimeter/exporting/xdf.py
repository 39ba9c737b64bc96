"""Extensible Data Format: the files of Lab Streaming Layer, chunk by chunk.

    "XDF:"  then chunks: length of the length, length, tag (2 bytes), content

Numbers are little-endian. A stream has a header and a footer in XML and its samples, each with a
stamp. There is a stream for each clock, one of markers, and one with the document as a text. Stamps
are those of the session, so clock offsets are zero. Streams whose stamps are not even have no
nominal rate: readers would straighten the stamps.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from rigidimeter.documents import json_text
from rigidimeter.recording.exported_session import ExportedSession
from rigidimeter.recording.formats.clocked_table import ROUNDING_S, Stream
from rigidimeter.recording.markers import marker_of

_FILE_HEADER, _STREAM_HEADER, _SAMPLES, _CLOCK_OFFSET, _BOUNDARY, _STREAM_FOOTER = range(1, 7)
_BOUNDARY_UUID = bytes.fromhex("43a546dccbf5410fb30ed5467383cbe4")
_ROWS = 4096
_TYPES = {"torque": "Force", "motion": "MoCap", "control": "Control", "emg": "EMG"}


def write_xdf(session: ExportedSession, path: Path) -> None:
    """Write one session."""
    with path.open("wb") as file:
        file.write(b"XDF:")
        for tag, content in _chunks(session):
            length = len(content) + 2
            file.write(struct.pack("<BQH", 8, length, tag) + content)


def _chunks(session: ExportedSession) -> Iterator[tuple[int, bytes]]:
    about = session.about
    created = about["recorded"].get("created_utc", "")
    yield _FILE_HEADER, _xml({"version": "1.0", "datetime": created})
    for k, stream in enumerate(session.streams, start=1):
        yield from _numbers(struct.pack("<I", k), stream, about)
    events = [
        (float(event["time_s"]), marker_of(event))
        for event in about["recorded"].get("events", ())
        if isinstance(event.get("time_s"), int | float)
    ]
    k = len(session.streams) + 1
    markers = sorted(events, key=lambda each: each[0]) or _epoch_markers(about)
    yield from _texts(struct.pack("<I", k), "markers", "Markers", markers, about)
    first_s = min((float(s.time_s[0]) for s in session.streams if s.time_s.size), default=0.0)
    document = [(first_s, json_text(about))]
    yield from _texts(struct.pack("<I", k + 1), "document", "Metadata", document, about)
    yield _BOUNDARY, _BOUNDARY_UUID


def _epoch_markers(about: Mapping[str, Any]) -> list[tuple[float, str]]:
    """Return markers of a recording without events: where its epochs begin and end."""
    found = []
    for epoch in about["epochs"]:
        start = {"event": "epoch_started", **epoch, "task": epoch["task"] or ""}
        end = {"event": "epoch_ended", "epoch": epoch["label"], "outcome": epoch["outcome"]}
        found += [(epoch["start_s"], marker_of(start)), (epoch["stop_s"], marker_of(end))]
    return sorted(found, key=lambda each: each[0])


def _numbers(
    number: bytes, stream: Stream, about: Mapping[str, Any]
) -> Iterator[tuple[int, bytes]]:
    units = {column: str(about["units"].get(column, "1")) for column in stream.columns}
    facts = _facts(stream.name, _TYPES.get(stream.name, "Signal"), "double64", about)
    rate = f"{stream.rate_hz!r}" if _is_even(stream) else "0"
    channels = [
        ("channel", {"label": column, "unit": unit, "type": column.rpartition("_")[0] or column})
        for column, unit in units.items()
    ]
    facts |= {"channel_count": str(len(units)), "nominal_srate": rate}
    yield _STREAM_HEADER, number + _xml(facts | {"desc": [("channels", channels)]})
    row = np.dtype([("stamp_bytes", "u1"), ("stamp", "<f8"), ("values", "<f8", (len(units),))])
    rows = np.empty(stream.time_s.size, row)
    rows["stamp_bytes"], rows["stamp"] = 8, stream.time_s
    for k, values in enumerate(stream.columns.values()):
        rows["values"][:, k] = values
    yield from _zero_offsets(number, stream.time_s)
    for first in range(0, rows.size, _ROWS):
        part = rows[first : first + _ROWS]
        yield _SAMPLES, number + struct.pack("<BI", 4, part.size) + part.tobytes()
    yield _STREAM_FOOTER, number + _footer(stream.time_s)


def _texts(
    number: bytes, name: str, kind: str, texts: list[tuple[float, str]], about: Mapping[str, Any]
) -> Iterator[tuple[int, bytes]]:
    facts = _facts(name, kind, "string", about) | {"channel_count": "1", "nominal_srate": "0"}
    yield _STREAM_HEADER, number + _xml(facts)
    time_s = np.array([stamp for stamp, _ in texts])
    yield from _zero_offsets(number, time_s)
    samples = b"".join(
        struct.pack("<BdBI", 8, stamp, 4, len(text.encode())) + text.encode()
        for stamp, text in texts
    )
    yield _SAMPLES, number + struct.pack("<BI", 4, len(texts)) + samples
    yield _STREAM_FOOTER, number + _footer(time_s)


def _facts(name: str, kind: str, form: str, about: Mapping[str, Any]) -> dict[str, Any]:
    session = about["recorded"].get("session_id", "")
    simulated = "simulated" if about["virtual"] else "measured"
    return {
        "name": f"rigidimeter {name}",
        "type": kind,
        "channel_format": form,
        "source_id": f"rigidimeter-{session}-{name}".replace("--", "-"),
        "manufacturer": f"{about['software']}, {simulated}",
        "uid": f"{session or 'recording'}-{name}",
    }


def _is_even(stream: Stream) -> bool:
    if stream.time_s.size < 2:
        return False
    even_s = stream.time_s[0] + np.arange(stream.time_s.size) / stream.rate_hz
    return bool(np.max(np.abs(even_s - stream.time_s)) < ROUNDING_S / 2)


def _zero_offsets(number: bytes, time_s: NDArray[np.float64]) -> Iterator[tuple[int, bytes]]:
    for stamp in time_s[[0, -1]] if time_s.size > 1 else time_s:
        yield _CLOCK_OFFSET, number + struct.pack("<dd", stamp, 0.0)


def _footer(time_s: NDArray[np.float64]) -> bytes:
    if not time_s.size:
        return _xml({"sample_count": "0"})
    stamps = {"first_timestamp": repr(float(time_s[0])), "last_timestamp": repr(float(time_s[-1]))}
    return _xml({**stamps, "sample_count": str(time_s.size)})


def _xml(facts: Mapping[str, Any]) -> bytes:
    root = ElementTree.Element("info")
    _fill(root, facts.items())
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def _fill(parent: ElementTree.Element, facts: Iterable[tuple[str, Any]]) -> None:
    for name, value in facts:
        child = ElementTree.SubElement(parent, name)
        if isinstance(value, str):
            child.text = value
        else:
            _fill(child, value.items() if isinstance(value, Mapping) else value)
