"""The heads of text files of programs.

LabVIEW, BIOPAC AcqKnowledge, LabChart, OpenSim and Qualisys Track Manager.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from rigidimeter.analysis.reading.channels.headers import read_header
from rigidimeter.analysis.reading.formats.text_head import DELIMITERS, Head, checked_names
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import cells_of

_PER_SAMPLE = re.compile(r"([\d.,]+)\s*(msec|sec|usec|µsec|min|s|ms)/sample[s]?", re.IGNORECASE)
_SECONDS = {"msec": 1e-3, "ms": 1e-3, "sec": 1.0, "s": 1.0, "usec": 1e-6, "µsec": 1e-6, "min": 60.0}
_QUALISYS = re.compile(r"(TOT_)?NO_OF_(FRAMES|SAMPLES)\t")
_END = "***End_of_Header***"


def known_head(source: str, lines: Sequence[str]) -> Head | None:
    """Return the head of a file of one of these programs, None of any other.

    Raises
    ------
    UserError
        If such a head is not complete.
    """
    if not lines:
        return None
    if lines[0].startswith("LabVIEW Measurement"):
        return _labview(source, lines)
    ends = [index for index, line in enumerate(lines) if line.strip().lower() == "endheader"]
    if ends and ends[0] + 1 < len(lines):
        return _opensim(source, lines, ends[0])
    if _QUALISYS.match(lines[0]):
        return _qualisys(source, lines)
    if lines[0].startswith("Interval="):
        return _labchart(source, lines)
    if len(lines) > 3 and _PER_SAMPLE.fullmatch(lines[1].strip().rstrip(",;\t")):
        return _biopac(source, lines)
    return None


def _labview(source: str, lines: Sequence[str]) -> Head:
    """Read the head of an .lvm file: two blocks of keys, then the names."""
    ends = [index for index, line in enumerate(lines) if line.startswith(_END)]
    if len(ends) < 2 or ends[1] + 1 >= len(lines):
        raise UserError(f"{source}: the head of this LabVIEW file is not complete")
    said = {cells[0]: cells[1:] for line in lines[: ends[1]] if (cells := line.split("\t"))}
    delimiter = "," if said.get("Separator", [""])[0].strip() == "Comma" else "\t"
    if delimiter == ",":
        said = {cells[0]: cells[1:] for line in lines[: ends[1]] if (cells := line.split(","))}
    names = [cell.strip() for cell in cells_of(lines[ends[1] + 1], delimiter)]
    if names and names[-1] == "Comment":
        names = names[:-1]
    in_pairs = said.get("X_Columns", ["One"])[0].strip() == "Multi"
    if in_pairs:
        _one_start(source, names, said)
    units = dict(
        zip(names[1:], (unit.strip() for unit in said.get("Y_Unit_Label", [])), strict=False)
    )
    scalars: dict[str, float | str] = {}
    if names and names[0] == "X_Value":
        step = _number(said.get("Delta_X", [""])[0])
        if said.get("X_Columns", ["One"])[0].strip() == "No" and step:
            scalars["rate_hz"] = 1.0 / step
        names[0] = "X_Value (time)"
        units[names[0]] = "s" if said.get("X_Dimension", ["Time"])[0].strip() == "Time" else ""
    shown = checked_names(source, names)
    if in_pairs:
        units = {
            name: "s" if place % 2 == 0 else unit.strip()
            for place, (name, unit) in enumerate(
                zip(shown, ["", *said.get("Y_Unit_Label", [])], strict=False)
            )
        }
    return Head(delimiter, shown, ends[1] + 2, units, scalars, in_pairs)


def _one_start(source: str, names: Sequence[str], said: Mapping[str, Sequence[str]]) -> None:
    """Refuse columns that are no pairs of time and channel, and channels that start apart."""
    started = [
        {cell.strip() for cell in said.get(key, ()) if cell.strip()} for key in ("Date", "Time")
    ]
    dimensions = {cell.strip() for cell in said.get("X_Dimension", ()) if cell.strip()}
    if len(names) % 2 or set(names[::2]) != {"X_Value"} or dimensions - {"Time"}:
        raise UserError(
            f"{source}: says that each channel has a column of its time (X_Columns Multi), but its "
            f"columns are {', '.join(names)[:120]}"
        )
    if any(len(each) > 1 for each in started):
        raise UserError(
            f"{source}: its channels have a time each, from different starts "
            f"({' or '.join(sorted(started[1]))[:80]}); save them in one column of the time "
            "(X_Columns One), or each in a file and join them with --clock-offset"
        )


def without_later_heads(text: bytes) -> bytes:
    """Return an .lvm file with one head: blank lines for those of later blocks of its columns."""
    if not text.startswith(b"LabVIEW Measurement"):
        return text
    end = re.escape(_END.encode())
    found = re.search(rb"\A(?s:.*?)" + end + rb"(?s:.*?)" + end + rb"[^\n]*\n([^\n]*)\n", text)
    if found is None:
        return text
    later = rb"\n\s*\nChannels\t(?s:.*?)" + end + rb"[^\n]*\n" + re.escape(found[1]) + rb"\n"
    body = re.sub(later, lambda head: b"\n" * head[0].count(b"\n"), text[found.end() :])
    return text[: found.end()] + body


def _opensim(source: str, lines: Sequence[str], end: int) -> Head:
    """Read the head of a .sto or .mot file, which is in SI units but for angles in degrees."""
    keys: dict[str, str] = {}
    for line in lines[:end]:
        key, _, value = line.partition("=")
        keys[key.strip().lower()] = value.strip().lower()
    delimiter = "\t" if "\t" in lines[end + 1] else ""
    names = checked_names(source, cells_of(lines[end + 1], delimiter))
    degrees = keys.get("indegrees", "no") == "yes"
    by_kind = {
        "time": "s",
        "torque": "Nm",
        "angle": "deg" if degrees else "rad",
        "velocity": "deg/s" if degrees else "rad/s",
    }
    headers = {name: read_header(name) for name in names}
    units = {
        name: by_kind[header.kind]
        for name, header in headers.items()
        if not header.unit and header.kind in by_kind
    }
    return Head(delimiter, names, end + 2, units)


def _qualisys(source: str, lines: Sequence[str]) -> Head:
    """Read keys and their values, then mostly a line of names; times are in s."""
    said: dict[str, list[str]] = {}
    for line in lines:
        key, *values = (cell.strip() for cell in line.split("\t"))
        if key.casefold() in ("frame", "sample") or not re.fullmatch(r"[A-Z][A-Z_]+", key):
            break
        said[key] = values
    below = cells_of(lines[len(said)], "\t") if len(said) < len(lines) else []
    rate_hz = _number(said.get("FREQUENCY", [""])[0])
    if not below or not rate_hz > 0:
        raise UserError(f"{source}: the head of this Qualisys file is not complete")
    named = below[0].strip().casefold() in ("frame", "sample")
    names = below if named else _qualisys_names(said)
    while names and not names[-1].strip():
        names = names[:-1]
    shown = checked_names(source, names)
    units = {name: "s" for name in shown if name.casefold() == "time"}
    return Head("\t", shown, len(said) + named, units, {"rate_hz": rate_hz})


def _qualisys_names(said: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the names of the columns from the keys: of a marker there are three."""
    if "CHANNEL_NAMES" in said:
        return [*said["CHANNEL_NAMES"]]
    return [f"{name} {axis}" for name in said.get("MARKER_NAMES", ()) if name for axis in "XYZ"]


def _labchart(source: str, lines: Sequence[str]) -> Head:
    """Read the head of LabChart's text: a key and a cell for each channel, the time before them."""
    said: dict[str, list[str]] = {}
    for line in lines:
        key, equals, rest = line.partition("=")
        if not equals:
            break
        said[key] = [cell.strip() for cell in rest.strip().split("\t")]
    interval = re.fullmatch(r"([\d.,]+) (m?s)", said["Interval"][0])
    if interval is None or not _number(interval[1]) or "ChannelTitle" not in said:
        raise UserError(f"{source}: the head of this LabChart file is not complete")
    names = checked_names(source, ["x axis", *said["ChannelTitle"]])
    units = {
        name: unit
        for name, unit in zip(names[1:], said.get("UnitName", ()), strict=False)
        if unit and unit != "*"
    }
    rate_hz = 1.0 / (_number(interval[1]) * _SECONDS[interval[2]])
    return Head("\t", names, len(said), units, {"rate_hz": rate_hz})


def _biopac(source: str, lines: Sequence[str]) -> Head:
    """Read the head of AcqKnowledge's text: rate, channels, a name and a unit for each."""
    interval = _PER_SAMPLE.fullmatch(lines[1].strip().rstrip(",;\t"))
    count = re.match(r"(\d+) channels", lines[2].strip())
    n_channels = int(count[1]) if count is not None else 0
    if interval is None or not 1 <= n_channels <= (len(lines) - 4) // 2:
        raise UserError(f"{source}: the head of this AcqKnowledge file is not complete")
    labels = [line.strip().rstrip(",;\t").strip() for line in lines[3 : 3 + 2 * n_channels]]
    names, units = labels[::2], labels[1::2]
    at = 3 + 2 * n_channels
    delimiter = next(mark for mark in DELIMITERS if mark in lines[at])
    heading = [cell.strip() for cell in cells_of(lines[at], delimiter)]
    has_time = bool(heading) and not re.match(r"CH\s?\d", heading[0])
    # The line of counts below the heading has an empty first cell, or whole numbers alone.
    n_before = at + 2 if at + 1 < len(lines) and _counts(lines[at + 1], delimiter) else at + 1
    if has_time:  # in few decimals; the rate is exact
        names, units = ["x axis", *names], ["", *units]
    shown = checked_names(source, names)
    step_s = _number(interval[1]) * _SECONDS[interval[2].lower()]
    if not step_s:
        raise UserError(f"{source}: states {lines[1].strip()!r}, which is no sampling interval")
    stated = {name: unit for name, unit in zip(shown, units, strict=True) if unit}
    return Head(delimiter, shown, n_before, stated, {"rate_hz": 1.0 / step_s})


def _counts(line: str, delimiter: str) -> bool:
    cells = [cell.strip() for cell in cells_of(line, delimiter)]
    while cells and not cells[-1]:
        cells.pop()
    stated = {cell for cell in cells if cell}
    return len(cells) > 1 and len(stated) == 1 and stated.pop().isdigit()


def _number(text: str) -> float:
    try:
        return float(text.strip().replace(",", "."))
    except ValueError:
        return 0.0
