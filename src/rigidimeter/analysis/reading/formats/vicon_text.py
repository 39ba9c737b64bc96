"""Text that Vicon Nexus exports: sections such as Devices and Model Outputs, each with its rate.

A row has the number of a frame, from 1, and of a sample within it; so the sections share one clock.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.clocked_table import Stream, table_of_streams, unique
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import MAX_COLUMNS, cells_of, printable

_HEAD = re.compile(
    rb"[^\n,;\t]*[^\W\d][^\n,;\t]*[,;\t]*\n\s*[\d.,]+[,;\t]*\n[^\n]*\nFrame([,;\t])Sub Frame"
)
_LINES_OF_HEAD = 5
_SAME = 1e-6


def is_vicon(text: bytes) -> bool:
    """Whether a text begins with a section of Nexus."""
    return _HEAD.match(text) is not None


def vicon_table(source: str, text: bytes) -> Table:
    """Return the sections of an export, each by its own rate.

    Raises
    ------
    UserError
        If a section cannot be read, or their frames have different rates.
    """
    head = _HEAD.match(text)
    delimiter = "," if head is None else head[1].decode()
    streams: list[Stream] = []
    units: list[dict[str, str]] = []
    frame_hz: dict[str, float] = {}
    for line, lines in _sections(text.decode("utf-8").split("\n"), delimiter):
        name = lines[0].strip(delimiter + " ")
        try:
            stream, stated, per_s = _section(name, lines, delimiter)
        except (ValueError, IndexError) as error:
            raise UserError(
                f"{source}, line {line}: the section {printable(name)[:40]} that begins here "
                f"cannot be read ({printable(str(error).splitlines()[0][:100])})"
            ) from None
        streams.append(stream)
        units.append(stated)
        frame_hz[name] = per_s
    if max(frame_hz.values()) - min(frame_hz.values()) > _SAME * max(frame_hz.values()):
        shown = ", ".join(f"{name} {rate:g}" for name, rate in frame_hz.items())
        raise UserError(
            f"{source}: its sections have different frames/s ({shown}), so their frames are no "
            "clock; export each section to a file of its own and join them with --join"
        )
    return table_of_streams(source, streams, units)


def _sections(lines: Sequence[str], delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the sections, between blank lines, with the number of their first line."""
    found: list[str] = []
    for number, line in enumerate([*lines, ""], start=1):
        if line.strip(delimiter + " "):
            found.append(line)
        elif found:
            yield number - len(found), found
            found = []


def _section(
    name: str, lines: Sequence[str], delimiter: str
) -> tuple[Stream, dict[str, str], float]:
    """Return a section as a stream, the units of its columns, and its frames/s."""
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
    names = unique(columns, but=())
    rows = "\n".join(lines[_LINES_OF_HEAD:])
    comma = delimiter != "," and re.search(r"\d,\d", rows) is not None
    frame = pd.read_csv(io.StringIO(rows), sep=delimiter, header=None, usecols=range(len(below)),
                        dtype=np.float64, skipinitialspace=True,
                        decimal="," if comma else ".")  # fmt: skip
    values = frame.to_numpy()
    samples = float(np.max(values[:, 1])) + 1.0  # in a frame
    if not (0 < rate_hz < np.inf and np.all(np.isfinite(values[:, :2]))):
        raise ValueError(f"a rate of {rate_hz:g} samples/s, or a frame without a number")
    time_s: NDArray[np.float64] = ((values[:, 0] - 1.0) * samples + values[:, 1]) / rate_hz
    units = {
        column: stated[place]
        for place, column in enumerate(names, start=2)
        if place < len(stated) and stated[place]
    }
    held = dict(zip(names, values[:, 2:].T, strict=True))
    return Stream(name, time_s, held), units, rate_hz / samples
