"""Recordings in the files of instruments: written by a library, or in the layout of a program."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest


@dataclass(frozen=True)
class Signal:
    """A channel: its samples in a unit, even from a start."""

    name: str
    unit: str
    values: np.ndarray
    rate_hz: float = 200.0
    start_s: float = 0.0

    @property
    def time_s(self) -> np.ndarray:
        return self.start_s + np.arange(self.values.size) / self.rate_hz


def write_tdms(path: Path, signals: Sequence[Signal]) -> None:
    """Write waveforms, as LabVIEW's "Write To Measurement File" does."""
    from nptdms import ChannelObject, TdmsWriter

    begun = np.datetime64("2024-03-01T10:00:00", "us")
    with TdmsWriter(str(path)) as writer:
        writer.write_segment(
            [
                ChannelObject(
                    "Measurement",
                    each.name,
                    each.values,
                    {
                        "unit_string": each.unit,
                        "wf_increment": 1.0 / each.rate_hz,
                        "wf_start_offset": 0.0,
                        "wf_start_time": begun + np.timedelta64(round(1e6 * each.start_s), "us"),
                        "wf_xunit_string": "s",
                        "wf_samples": each.values.size,
                    },
                )
                for each in signals
            ]
        )


def write_tdms_columns(path: Path, signals: Sequence[Signal]) -> None:
    """Write a group for each rate with a channel of the time in ms, no waveforms."""
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(str(path)) as writer:
        for rate_hz in dict.fromkeys(each.rate_hz for each in signals):
            here = [each for each in signals if each.rate_hz == rate_hz]
            group = f"{rate_hz:g} Hz"
            time = ChannelObject(group, "Time", 1e3 * here[0].time_s, {"unit_string": "ms"})
            channels = [
                ChannelObject(group, one.name, one.values, {"unit_string": one.unit})
                for one in here
            ]
            writer.write_segment([time, *channels])


def write_c3d(path: Path, signals: Sequence[Signal]) -> None:
    """Write analogue channels beside one marker, by ezc3d."""
    import ezc3d

    file = ezc3d.c3d()
    point, analogue = file["parameters"]["POINT"], file["parameters"]["ANALOG"]
    point["RATE"]["value"] = [signals[0].rate_hz / 2]
    point["LABELS"]["value"] = ["ELB"]
    point["UNITS"]["value"] = ["mm"]
    analogue["RATE"]["value"] = [signals[0].rate_hz]
    analogue["LABELS"]["value"] = [each.name for each in signals]
    analogue["UNITS"]["value"] = [each.unit for each in signals]
    analogue["SCALE"]["value"] = [1.0] * len(signals)
    analogue["OFFSET"]["value"] = [0] * len(signals)
    file["data"]["points"] = np.zeros((4, 1, signals[0].values.size // 2))
    file["data"]["analogs"] = np.stack([each.values for each in signals])[None]
    file.write(str(path))


def write_acq(path: Path, signals: Sequence[Signal], *, compressed: bool = False) -> None:
    """Write a file of AcqKnowledge 3.8.1: rates are whole parts of the first one."""
    why = "needs bioread: pip install 'rigidimeter[biopac]'"
    headers = pytest.importorskip("bioread.headers", reason=why)

    def packed(kind: type, **fields: object) -> bytes:
        head = kind.for_revision(headers.V_381, "<", "latin1")._struct_class()
        for name, value in fields.items():
            setattr(head, name, value)
        return bytes(head)

    def length(kind: type) -> int:
        return len(packed(kind))

    dividers = [round(signals[0].rate_hz / each.rate_hz) for each in signals]
    out = packed(
        headers.GraphHeader, lVersion=headers.V_381, lExtItemHeaderLen=length(headers.GraphHeader),
        nChannels=len(signals), dSampleTime=1e3 / signals[0].rate_hz, bCompressed=int(compressed),
    )  # fmt: skip
    for number, (each, divider) in enumerate(zip(signals, dividers, strict=True)):
        out += packed(
            headers.ChannelHeader, lChanHeaderLen=length(headers.ChannelHeader), nNum=number,
            szCommentText=each.name.encode(), szUnitsText=each.unit.encode("latin1"),
            lBufLength=each.values.size, dAmplScale=1.0, nVarSampleDivider=divider,
        )  # fmt: skip
    out += packed(headers.ForeignHeader, nLength=length(headers.ForeignHeader))
    out += packed(headers.ChannelDTypeHeader, nSize=8, nType=0) * len(signals)
    if not compressed:
        turns = max(each.values.size * k for each, k in zip(signals, dividers, strict=True))
        rows = [[] for _ in range(turns)]
        for each, divider in zip(signals, dividers, strict=True):
            for row, value in zip(rows[::divider], each.values, strict=False):
                row.append(value)
        out += np.array([value for row in rows for value in row], "<f8").tobytes()
    out += struct.pack("<ii", 0, 0)  # no markers
    out += packed(headers.JournalHeader, tag=(0x44, 0x33, 0x22, 0x11))
    if compressed:
        pieces = [zlib.compress(each.values.astype("<f8").tobytes()) for each in signals]
        out += packed(headers.MainCompressionHeader)
        at = len(out) + len(signals) * length(headers.ChannelCompressionHeader)
        at += sum(len(each.name) + len(each.unit) for each in signals)
        for each, piece in zip(signals, pieces, strict=True):
            out += packed(
                headers.ChannelCompressionHeader, lChannelLabelLen=len(each.name),
                lUnitLabelLen=len(each.unit), lUncompressedLen=each.values.size * 8,
                lCompressedLen=len(piece),
            ) + each.name.encode() + each.unit.encode() + piece  # fmt: skip
    path.write_bytes(out)


def write_abf(path: Path, signals: Sequence[Signal]) -> None:
    """Write floats of pCLAMP 6 (ABF 1.8) in one gap-free sweep, with one rate for all channels."""
    head = bytearray(6144)
    count = len(signals)
    data = np.stack([each.values for each in signals], axis=1).astype("<f4").tobytes()
    step_us = 1e6 / (signals[0].rate_hz * count)
    fields = [
        (0, "<4sf", (b"ABF ", 1.83)), (8, "<hi", (3, count * signals[0].values.size)),
        (20, "<i", (20240301,)), (40, "<i", (12,)), (100, "<h", (1,)),
        (120, "<hf", (count, step_us)),
        (244, "<f", (10.0,)), (252, "<i", (32768,)),
        (410, "<16h", (*range(count), *[-1] * (16 - count))),
    ]  # fmt: skip
    for number, each in enumerate(signals):
        fields.append((442 + 10 * number, "<10s", (each.name.ljust(10).encode(),)))
        fields.append((602 + 8 * number, "<8s", (each.unit.ljust(8).encode("latin1"),)))
    for at, form, values in fields:
        struct.pack_into(form, head, at, *values)
    path.write_bytes(bytes(head) + data)


def write_smr(path: Path, signals: Sequence[Signal]) -> None:
    """Write a file of Spike2 (system 9) in blocks of 4000 floats, a clock for each channel."""
    tick_s, per_block = 1e-6, 4000
    head = bytearray(512 + 140 * len(signals))
    struct.pack_into("<h10s8shhhihhhhhid", head, 0, 9, b"(C) CED 87", b"\x04test", 1, 1, 0, 0,
                     len(signals), 140, 0, 32000, 0, 0, tick_s)  # fmt: skip
    blocks: list[bytes] = []
    at = -(-len(head) // 512)
    for number, each in enumerate(signals):
        ticks = round(1.0 / (each.rate_hz * tick_s))
        pieces = np.split(each.values.astype("<f4"), range(per_block, each.values.size, per_block))
        places: list[int] = []
        for piece in pieces:
            places.append(at)
            at += -(-(20 + 4 * piece.size) // 512)
        for k, piece in enumerate(pieces):
            start = round(each.start_s / tick_s) + k * per_block * ticks
            after = places[k + 1] if k + 1 < len(places) else -1
            before, stop = places[k - 1] if k else -1, start + (piece.size - 1) * ticks
            block = struct.pack("<iiiihh", before, after, start, stop, number + 1, piece.size)
            block += piece.tobytes()
            blocks.append(block + bytes(-len(block) % 512))
        title, unit = each.name.encode(), each.unit.encode("latin1")
        struct.pack_into(
            "<hiiihhhhhh72siih10sfBbff6sh", head, 512 + 140 * number,
            0, -1, places[0], places[-1], len(places), 0, 0, 0, 0, 16000, b"", 0, ticks, number,
            bytes([len(title)]) + title, each.rate_hz, 9, 0, -5.0, 5.0, bytes([len(unit)]) + unit,
            0,
        )  # fmt: skip
    path.write_bytes(bytes(head) + bytes(-len(head) % 512) + b"".join(blocks))


def write_ns2(path: Path, signals: Sequence[Signal]) -> None:
    """Write a file of Blackrock's Central (NEURALCD 2.3) with 16-bit samples at 1000 Hz."""
    count = len(signals)
    out = struct.pack("<8sBBI16s256sII8HI", b"NEURALCD", 2, 3, 314 + 66 * count, b"1 kS/s", b"",
                      round(30_000 / signals[0].rate_hz), 30_000, 2024, 3, 5, 1, 10, 0, 0, 0,
                      count)  # fmt: skip
    columns = []
    for number, each in enumerate(signals):
        top = int(np.ceil(np.max(np.abs(each.values))))
        out += struct.pack("<2sH16sBBhhhh16sIIHIIH", b"CC", 129 + number, each.name.encode(), 0, 0,
                           -32000, 32000, -top, top, each.unit.encode(), 0, 0, 0, 0, 0,
                           0)  # fmt: skip
        columns.append(np.round(each.values / top * 32000).astype("<i2"))
    out += struct.pack("<BII", 1, 0, signals[0].values.size)
    path.write_bytes(out + np.stack(columns, axis=1).tobytes())


def write_plx(path: Path, signals: Sequence[Signal]) -> None:
    """Write a file of Plexon (version 106) with 16-bit samples of ±5000 mV in blocks of 1000."""
    head = struct.pack("<Ii128s14id4BHHH18s18s10s", 0x58454C50, 106, b"", 40_000, 0, 0,
                       len(signals), 0, 0, 2024, 3, 1, 10, 0, 0, 0, 0, 0.0, 1, 1, 12, 16, 3000,
                       5000, 1, b"", b"", b"")  # fmt: skip
    out = head + bytes(4 * (650 + 650 + 512))
    for number, each in enumerate(signals):
        out += struct.pack("<32s6i128sBBH27i", each.name.encode(), number, round(each.rate_hz), 1,
                           1, 1, 0, b"", 1, 0, number, *[0] * 27)  # fmt: skip
    for number, each in enumerate(signals):
        counts = np.round(each.values / 5000.0 * 2048).astype("<i2")
        for first in range(0, counts.size, 1000):
            piece = counts[first : first + 1000]
            stamp = round(40_000 * (each.start_s + first / each.rate_hz))
            out += struct.pack("<HHIHHHH", 5, 0, stamp, number, 0, 1, piece.size) + piece.tobytes()
    path.write_bytes(out)


WRITERS: Mapping[str, Callable[[Path, Sequence[Signal]], None]] = {
    ".tdms": write_tdms,
    ".c3d": write_c3d,
    ".acq": write_acq,
    ".abf": write_abf,
    ".smr": write_smr,
    ".ns2": write_ns2,
    ".plx": write_plx,
}
