"""Texts with sections that have a clock each: exports of Spike2 and of Vicon Nexus.

Spike2 writes channel by channel, each with its start and its sampling interval. Nexus writes
sections such as Devices and Model Outputs, each with its rate; a row has the number of a frame,
from 1, and of a sample within it, so the sections share one clock.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence

import numpy as np

from rigidimeter.analysis.reading_anew.columns import Array, Columns, unique
from rigidimeter.analysis.reading_anew.streams import Stream, columns_of_streams
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import MAX_COLUMNS, cells_of, printable

SPIKE2_BEGINS = b'"INFORMATION"'
_HEAD = re.compile(
    rb"[^\n,;\t]*[^\W\d][^\n,;\t]*[,;\t]*\n\s*[\d.,]+[,;\t]*\n[^\n]*\nFrame([,;\t])Sub Frame"
)
_LINES_OF_HEAD = 5
_SAME = 1e-6


def spike2_columns(source: str, text: bytes) -> Columns:
    """Return the waveforms of an export; events are left out.

    Raises
    ------
    UserError
        If there is no waveform, or one that cannot be read.
    """
    lines = text.decode("utf-8").split("\n")
    titles = {row[0]: row for row in _rows(lines) if len(row) > 3 and row[0].isdigit()}
    streams: list[Stream] = []
    for number, (first, last) in _channels(lines).items():
        title = titles.get(number, [number, "", f"channel {number}", ""])
        pieces = [*_pieces(source, lines, first, last)]
        if not pieces:
            continue
        name = printable(title[2].strip()) or f"channel {number}"
        time_s = np.concatenate([stamps for stamps, _ in pieces])
        values = np.concatenate([values for _, values in pieces])
        unit = {name: title[3].strip()}
        streams.append(Stream(f"channel {number}", time_s, {name: values}, unit))
    if len(streams) > MAX_COLUMNS:
        raise UserError(f"{source}: has {len(streams)} channels; at most {MAX_COLUMNS} are read")
    return columns_of_streams(source, streams)


def _rows(lines: list[str]) -> Iterator[list[str]]:
    """Yield the cells of the lines between "SUMMARY" and the first "CHANNEL"."""
    inside = False
    for line in lines:
        if line.startswith('"CHANNEL"'):
            return
        inside |= line.startswith('"SUMMARY"')
        if inside and line:
            yield next(csv.reader([line], delimiter="\t"), [])


def _channels(lines: list[str]) -> dict[str, tuple[int, int]]:
    """Return the first and last line of each channel, by its number."""
    starts = [index for index, line in enumerate(lines) if line.startswith('"CHANNEL"')]
    found: dict[str, tuple[int, int]] = {}
    for start, stop in zip(starts, [*starts[1:], len(lines)], strict=False):
        cells = lines[start].split("\t")
        found[cells[1].strip().strip('"') if len(cells) > 1 else str(start)] = (start + 1, stop)
    return found


def _pieces(source: str, lines: list[str], first: int, last: int) -> Iterator[tuple[Array, Array]]:
    """Yield stamps and values of each stretch between gaps."""
    starts = [k for k in range(first, last) if lines[k].startswith('"START"')]
    for start, stop in zip(starts, [*starts[1:], last], strict=False):
        try:
            cells = [cell.replace(",", ".") for cell in lines[start].split("\t")]
            begin_s, step_s = float(cells[1]), float(cells[2])
            texts = [line.strip().replace(",", ".") for line in lines[start + 1 : stop]]
            values = np.array([text for text in texts if text], dtype=np.float64)
        except (ValueError, IndexError) as error:
            raise UserError(
                f"{source}, line {start + 1}: the channel that starts here cannot be read "
                f"({printable(str(error)[:80])})"
            ) from None
        if not 0 < step_s < np.inf:
            raise UserError(f"{source}, line {start + 1}: the sampling interval is {step_s:g} s")
        yield begin_s + step_s * np.arange(values.size, dtype=np.float64), values


def is_vicon(text: bytes) -> bool:
    """Whether a text begins with a section of Nexus."""
    return _HEAD.match(text) is not None


def vicon_columns(source: str, text: bytes) -> Columns:
    """Return the sections of an export, each by its own rate.

    Raises
    ------
    UserError
        If a section cannot be read, or their frames have different rates.
    """
    head = _HEAD.match(text)
    delimiter = "," if head is None else head[1].decode()
    streams: list[Stream] = []
    frame_hz: dict[str, float] = {}
    for line, lines in _sections(text.decode("utf-8").split("\n"), delimiter):
        name = lines[0].strip(delimiter + " ")
        try:
            stream, per_s = _section(name, lines, delimiter)
        except (ValueError, IndexError) as error:
            raise UserError(
                f"{source}, line {line}: the section {printable(name)[:40]} that begins here "
                f"cannot be read ({printable(str(error).splitlines()[0][:100])})"
            ) from None
        streams.append(stream)
        frame_hz[name] = per_s
    if max(frame_hz.values()) - min(frame_hz.values()) > _SAME * max(frame_hz.values()):
        shown = ", ".join(f"{name} {rate:g}" for name, rate in frame_hz.items())
        raise UserError(
            f"{source}: its sections have different frames/s ({shown}), so their frames are no "
            "clock; export each section to a file of its own and join them with --join"
        )
    return columns_of_streams(source, streams)


def _sections(lines: Sequence[str], delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the sections, between blank lines, with the number of their first line."""
    found: list[str] = []
    for number, line in enumerate([*lines, ""], start=1):
        if line.strip(delimiter + " "):
            found.append(line)
        elif found:
            yield number - len(found), found
            found = []


def _section(name: str, lines: Sequence[str], delimiter: str) -> tuple[Stream, float]:
    """Return a section as a stream, and its frames/s."""
    import pandas as pd

    rate_hz = float(lines[1].strip(delimiter + " ").replace(",", "."))
    above, below, stated = ([cell.strip() for cell in cells_of(line, delimiter)]
                            for line in lines[2:_LINES_OF_HEAD])  # fmt: skip
    while below and not below[-1]:
        below.pop()
    if not 2 < len(below) <= MAX_COLUMNS:
        raise ValueError(f"it names {len(below)} columns")
    columns, owner = [], ""
    for place, own in enumerate(below[2:], start=2):
        owner = (above[place] if place < len(above) else "") or owner
        columns.append(f"{owner} {own}".strip())
    names = unique(columns)
    rows = "\n".join(lines[_LINES_OF_HEAD:])
    comma = delimiter != "," and re.search(r"\d,\d", rows) is not None
    frame = pd.read_csv(io.StringIO(rows), sep=delimiter, header=None, usecols=range(len(below)),
                        dtype=np.float64, skipinitialspace=True,
                        decimal="," if comma else ".")  # fmt: skip
    values = frame.to_numpy()
    samples = float(np.max(values[:, 1])) + 1.0  # in a frame
    if not (0 < rate_hz < np.inf and np.all(np.isfinite(values[:, :2]))):
        raise ValueError(f"a rate of {rate_hz:g} samples/s, or a frame without a number")
    time_s: Array = ((values[:, 0] - 1.0) * samples + values[:, 1]) / rate_hz
    units = {
        column: stated[place]
        for place, column in enumerate(names, start=2)
        if place < len(stated) and stated[place]
    }
    held = dict(zip(names, values[:, 2:].T, strict=True))
    return Stream(name, time_s, held, units), rate_hz / samples
