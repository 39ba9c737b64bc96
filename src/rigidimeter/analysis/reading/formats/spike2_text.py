"""Text that Spike2 exports channel by channel, each with its start and its sampling interval."""

from __future__ import annotations

import csv
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.clocked_table import Stream, table_of_streams
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import MAX_COLUMNS, printable

FIRST = b'"INFORMATION"'


def spike2_table(source: str, text: bytes) -> Table:
    """Return the waveforms of an export; events are left out.

    Raises
    ------
    UserError
        If there is no waveform, or one that cannot be read.
    """
    lines = text.decode("utf-8").split("\n")
    titles = {row[0]: row for row in _rows(lines) if len(row) > 3 and row[0].isdigit()}
    streams: list[Stream] = []
    units: list[dict[str, str]] = []
    for number, (first, last) in _channels(lines).items():
        title = titles.get(number, [number, "", f"channel {number}", ""])
        pieces = [*_pieces(source, lines, first, last)]
        if not pieces:
            continue
        name = printable(title[2].strip()) or f"channel {number}"
        time_s = np.concatenate([stamps for stamps, _ in pieces])
        values = np.concatenate([values for _, values in pieces])
        streams.append(Stream(f"channel {number}", time_s, {name: values}))
        units.append({name: title[3].strip()})
    if len(streams) > MAX_COLUMNS:
        raise UserError(f"{source}: has {len(streams)} channels; at most {MAX_COLUMNS} are read")
    return table_of_streams(source, streams, units)


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


def _pieces(
    source: str, lines: list[str], first: int, last: int
) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
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
