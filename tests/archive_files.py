"""Recordings in the formats of archives and offices, by a library or to the specification."""

from __future__ import annotations

import json
import struct
import zipfile
from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from tests.instrument_files import Signal


def write_xdf(path: Path, signals: Sequence[Signal], offset_s: float = 0.0) -> None:
    """Write a stream for each signal as LabRecorder does: the second computer's clock is ahead.

    Its stamps are its own, and chunks of clock offsets every 5 s say what to add to them.
    """
    out = b"XDF:" + _chunk(1, b"<info><version>1.0</version></info>")
    for number, each in enumerate(signals, start=1):
        ahead_s = offset_s * (number - 1)
        head = (
            f"<info><name>{each.name}</name><type>MoCap</type><channel_count>1</channel_count>"
            f"<nominal_srate>{each.rate_hz:g}</nominal_srate>"
            "<channel_format>double64</channel_format><desc><channels><channel>"
            f"<label>{each.name}</label><unit>{escape(each.unit)}</unit>"
            "</channel></channels></desc></info>"
        )
        stream = struct.pack("<I", number)
        out += _chunk(2, stream + head.encode())
        stamps = 1000.0 + ahead_s + each.time_s
        for at in np.arange(1000.0, stamps[-1] + 5.0, 5.0):
            out += _chunk(4, stream + struct.pack("<dd", at + ahead_s, -ahead_s))
        samples = b"".join(
            struct.pack("<Bdd", 8, stamp, value)
            for stamp, value in zip(stamps, each.values, strict=True)
        )
        out += _chunk(3, stream + struct.pack("<BI", 4, each.values.size) + samples)
    path.write_bytes(out)


def _chunk(tag: int, content: bytes) -> bytes:
    return struct.pack("<BIH", 4, len(content) + 2, tag) + content


def write_bids_motion(folder: Path, signals: Sequence[Signal], *, latency: bool) -> None:
    """Write a data set with a tracking system for each signal, as the specification has it."""
    place = folder / "sub-01" / "motion"
    place.mkdir(parents=True)
    about = {"Name": "elbow", "BIDSVersion": "1.9.0"}
    (folder / "dataset_description.json").write_text(json.dumps(about))
    for each in signals:
        stem = f"sub-01_task-elbow_tracksys-{each.name.lower()}"
        rows = [(each.name, "n/a", "MISC", each.unit)]
        columns = [each.values]
        if latency:
            rows.append(("latency", "n/a", "LATENCY", "s"))
            columns.append(each.time_s)
        text = "name\tcomponent\ttype\tunits\n" + "".join("\t".join(row) + "\n" for row in rows)
        (place / f"{stem}_channels.tsv").write_text(text, "utf-8")
        (place / f"{stem}_motion.json").write_text(json.dumps({"SamplingFrequency": each.rate_hz}))
        np.savetxt(place / f"{stem}_motion.tsv", np.column_stack(columns), "%.12g", "\t")


def write_nwb(path: Path, signals: Sequence[Signal]) -> None:
    """Write the first signal with a rate, the others with stamps, by pynwb."""
    from datetime import UTC, datetime

    import pynwb

    file = pynwb.NWBFile("a joint", "one", datetime(2026, 3, 1, tzinfo=UTC))
    for number, each in enumerate(signals):
        clock = {"timestamps": each.time_s}
        if number == 0:
            clock = {"starting_time": each.start_s, "rate": each.rate_hz}
        series = pynwb.TimeSeries(name=each.name, data=each.values, unit=each.unit, **clock)
        file.add_acquisition(series)
    with pynwb.NWBHDF5IO(path, "w") as io:
        io.write(file)


def write_xlsx(path: Path, head: Sequence[str], columns: Sequence[np.ndarray]) -> None:
    import xlsxwriter

    dates = {"default_date_format": "dd.mm.yyyy hh:mm:ss.000"}
    with xlsxwriter.Workbook(path, dates) as book:
        sheet = book.add_worksheet("Trial 1")
        sheet.write_row(0, 0, head)
        for row, values in enumerate(zip(*columns, strict=True), start=1):
            sheet.write_row(row, 0, values)


def write_ods(path: Path, head: Sequence[str], columns: Sequence[np.ndarray]) -> None:
    """Write a sheet as LibreOffice does."""
    cell = '<table:table-cell office:value-type="{}"{}><text:p>{}</text:p></table:table-cell>'
    lines = ["".join(cell.format("string", "", escape(text)) for text in head)]
    for row in zip(*columns, strict=True):
        value = ' office:value="{0:.9g}"'
        lines.append("".join(cell.format("float", value.format(x), f"{x:.3g}") for x in row))
    rows = "".join(f"<table:table-row>{line}</table:table-row>" for line in lines)
    space = "urn:oasis:names:tc:opendocument:xmlns:"
    text = (
        f'<?xml version="1.0" encoding="UTF-8"?><office:document-content '
        f'xmlns:office="{space}office:1.0" xmlns:table="{space}table:1.0" '
        f'xmlns:text="{space}text:1.0" office:version="1.2"><office:body><office:spreadsheet>'
        f'<table:table table:name="Trial 1">{rows}</table:table>'
        "</office:spreadsheet></office:body></office:document-content>"
    )
    manifest = f'<?xml version="1.0"?><manifest:manifest xmlns:manifest="{space}manifest:1.0"/>'
    kind = "application/vnd.oasis.opendocument.spreadsheet"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("mimetype", kind, zipfile.ZIP_STORED)
        archive.writestr("META-INF/manifest.xml", manifest)
        archive.writestr("content.xml", text)


def write_mat73(path: Path, values: dict[str, np.ndarray]) -> None:
    """Write variables as MATLAB 7.3 does: HDF5 with the class of each."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, array in values.items():
            file[name] = np.atleast_2d(array)
            file[name].attrs["MATLAB_class"] = np.bytes_(b"double")
    mark_mat73(path)


def mark_mat73(path: Path) -> None:
    """Write the first bytes of a MATLAB file before those of HDF5."""
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + struct.pack("<HH", 0x0200, 0x4D49))


def write_arrow(path: Path, names: Sequence[str], columns: Sequence[np.ndarray],
                units: Sequence[str]) -> None:  # fmt: skip
    """Write Parquet, Feather or an Arrow stream, by its suffix."""
    import pyarrow as pa
    import pyarrow.parquet

    arrays = list(map(pa.array, columns))
    fields = [
        pa.field(name, column.type, metadata={"unit": unit} if unit else None)
        for name, column, unit in zip(names, arrays, units, strict=True)
    ]
    table = pa.Table.from_arrays(arrays, schema=pa.schema(fields))
    if path.suffix == ".parquet":
        pa.parquet.write_table(table, path)
        return
    new = pa.ipc.new_file if path.suffix == ".feather" else pa.ipc.new_stream
    with pa.OSFile(str(path), "wb") as file, new(file, table.schema) as writer:
        writer.write_table(table)
