"""The heads of text files of programs: a row of a table each.

Such a head is lines of a key and its values, to a line that ends it or as far as there are keys.
The columns are named by a key or in the line below. AcqKnowledge, whose head has no keys, is read
by a function of its own.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from rigidimeter.analysis.reading_anew.columns import unique
from rigidimeter.analysis.reading_anew.headers import read_header
from rigidimeter.analysis.reading_anew.text.heads import DELIMITERS, Head
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import cells_of, checked_names

Keys = Mapping[str, Sequence[str]]
"""The values of each key of a head."""

_PER_SAMPLE = re.compile(r"([\d.,]+)\s*(msec|sec|usec|µsec|min|s|ms)/sample[s]?", re.IGNORECASE)
_INTERVAL = re.compile(r"([\d.,]+) (m?s)")
_SECONDS = {"msec": 1e-3, "ms": 1e-3, "sec": 1.0, "s": 1.0, "usec": 1e-6, "µsec": 1e-6, "min": 60.0}
LABVIEW_END = "***End_of_Header***"
LABCHART_BEGINS = "Interval="


class Dialect(NamedTuple):
    """How one program writes the head of a text.

    Attributes
    ----------
    program : str
    begins : pattern or None
        The first line; None where the line that ends the head is what tells the program.
    key : pattern
        A key and what follows it.
    ends : str
        The line that ends the head, as it begins, in lower case; nothing: the first without a key.
    n_ends : int
        How often such a line comes before the rows.
    mark : str
        Between values, and between the cells of the rows; nothing for tabs or else blanks.
    names : tuple of str
        The keys of which the first one that there is has the names; without them, or where the line
        below begins as `heading` says, they are in that line.
    heading : pattern
        A line of names below the keys.
    before : tuple of str
        Columns before those that the key names.
    after : str
        A last column that is no channel.
    units : str
        The key of units, one for each column but `before` or the first.
    times : tuple of str
        The names, in lower case, of columns of the time in s.
    rate : callable
        The sampling rate in Hz that the keys state, 0 where they do not.
    by_kind : callable
        The units of quantities that the keys imply.
    must : str
        A key without which the head is not complete.
    in_pairs : callable
        Whether every channel has a column of its time before it.
    """

    program: str
    begins: re.Pattern[str] | None
    key: re.Pattern[str]
    ends: str = ""
    n_ends: int = 1
    mark: str = "\t"
    names: tuple[str, ...] = ()
    heading: re.Pattern[str] = re.compile("$^")
    before: tuple[str, ...] = ()
    after: str = ""
    units: str = ""
    times: tuple[str, ...] = ()
    rate: Callable[[Keys], float] = lambda _: 0.0
    by_kind: Callable[[Keys], Mapping[str, str]] = lambda _: {}
    must: str = ""
    in_pairs: Callable[[Keys], bool] = lambda _: False


def _first(keys: Keys, key: str) -> str:
    return next(iter(keys.get(key, ())), "").strip()


def _number(text: str) -> float:
    try:
        return float(text.strip().replace(",", "."))
    except ValueError:
        return 0.0


def _labview_rate(keys: Keys) -> float:
    step_s = _number(_first(keys, "Delta_X"))
    return 1.0 / step_s if _first(keys, "X_Columns") == "No" and step_s else 0.0


def _labchart_rate(keys: Keys) -> float:
    found = _INTERVAL.fullmatch(_first(keys, "Interval"))
    step_s = _number(found[1]) * _SECONDS[found[2]] if found is not None else 0.0
    return 1.0 / step_s if step_s else 0.0


def _opensim_units(keys: Keys) -> Mapping[str, str]:
    degrees = _first(keys, "inDegrees").lower() == "yes"
    angle = "deg" if degrees else "rad"
    return {"time": "s", "torque": "Nm", "angle": angle, "velocity": f"{angle}/s"}


DIALECTS: tuple[Dialect, ...] = (
    Dialect(
        "LabVIEW",
        re.compile("LabVIEW Measurement"),
        re.compile(r"([^\t,]+)[\t,](.*)"),
        ends=LABVIEW_END.lower(),
        n_ends=2,
        after="Comment",
        units="Y_Unit_Label",
        times=("x_value",),
        rate=_labview_rate,
        in_pairs=lambda keys: _first(keys, "X_Columns") == "Multi",
    ),
    Dialect(
        "OpenSim",
        None,
        re.compile(r"([^=]+)=(.*)"),
        ends="endheader",
        mark="",
        by_kind=_opensim_units,
    ),
    Dialect(
        "Qualisys",
        re.compile(r"(TOT_)?NO_OF_(FRAMES|SAMPLES)\t"),
        re.compile(r"([A-Z][A-Z_]+)(?:\t(.*)|$)"),
        names=("CHANNEL_NAMES", "MARKER_NAMES"),
        heading=re.compile(r"(?i)(frame|sample)\s*(\t|$)"),
        times=("time",),
        rate=lambda keys: _number(_first(keys, "FREQUENCY")),
        must="FREQUENCY",
    ),
    Dialect(
        "LabChart",
        re.compile(LABCHART_BEGINS),
        re.compile(r"([^=]+)=\s*(.*)"),
        names=("ChannelTitle",),
        before=("x axis",),
        units="UnitName",
        rate=_labchart_rate,
        must="ChannelTitle",
    ),
)


def known_head(source: str, lines: Sequence[str]) -> Head | None:
    """Return the head of a file of one of these programs, None of any other.

    Raises
    ------
    UserError
        If such a head is not complete.
    """
    for dialect in DIALECTS:
        if dialect.begins is None:
            is_its = any(line.strip().lower() == dialect.ends for line in lines)
        else:
            is_its = bool(lines) and dialect.begins.match(lines[0]) is not None
        if is_its:
            return _head(source, lines, dialect)
    if len(lines) > 3 and _PER_SAMPLE.fullmatch(lines[1].strip().rstrip(",;\t")):
        return _acqknowledge(source, lines)
    return None


def _head(source: str, lines: Sequence[str], dialect: Dialect) -> Head:
    n_head = _length(lines, dialect)
    keys = _keys(lines[:n_head], dialect)
    below = lines[n_head] if 0 < n_head < len(lines) else ""
    rate_hz = dialect.rate(keys)
    if not below or (dialect.must and not (rate_hz and dialect.must in keys)):
        raise UserError(f"{source}: the head of this {dialect.program} file is not complete")
    mark = dialect.mark or ("\t" if "\t" in below else "")
    if _first(keys, "Separator") == "Comma":
        mark = ","
    key = next((one for one in dialect.names if one in keys), "")
    in_line = not key or dialect.heading.match(below) is not None
    names = [name.strip() for name in cells_of(below, mark)] if in_line else _named(keys, key)
    while names and not names[-1]:
        names.pop()
    if dialect.after and names and names[-1] == dialect.after:
        names.pop()
    names = [*dialect.before, *names] if not in_line else names
    in_pairs = dialect.in_pairs(keys)
    if in_pairs:
        _check_pairs(source, names, keys)
    shown = unique(checked_names(source, names))
    facts: dict[str, float | str] = {"rate_hz": rate_hz} if rate_hz else {}
    units = _units(shown, keys, dialect, in_pairs=in_pairs)
    if shown[0] == "X_Value" and not in_pairs:  # a name that says no quantity
        units[f"{shown[0]} (time)"] = units.pop(shown[0], "")
        shown[0] += " (time)"
    return Head(mark, shown, n_head + in_line, units, facts, in_pairs)


def _length(lines: Sequence[str], dialect: Dialect) -> int:
    """Return the number of lines of a head, 0 where it does not end."""
    if not dialect.ends:
        ends = (k for k, line in enumerate(lines) if not dialect.key.match(line)
                or dialect.heading.match(line))  # fmt: skip
        return next(ends, 0)
    ends = (k for k, line in enumerate(lines) if line.strip().lower().startswith(dialect.ends))
    return next((k + 1 for n, k in enumerate(ends, start=1) if n == dialect.n_ends), 0)


def _keys(lines: Sequence[str], dialect: Dialect) -> dict[str, list[str]]:
    keys: dict[str, list[str]] = {}
    for line in lines:
        if (found := dialect.key.match(line)) is not None:
            mark = "," if "," in line and "\t" not in line else "\t"
            keys[found[1].strip()] = [cell.strip() for cell in (found[2] or "").split(mark)]
    return keys


def _named(keys: Keys, key: str) -> list[str]:
    """Return the names that a key has: of a marker there are three columns."""
    if key.startswith("MARKER"):
        return [f"{name} {axis}" for name in keys[key] if name for axis in "XYZ"]
    return [*keys[key]]


def _units(names: Sequence[str], keys: Keys, dialect: Dialect, *, in_pairs: bool) -> dict[str, str]:
    by_kind = dialect.by_kind(keys)
    units = {
        name: by_kind[header.kind]
        for name in names
        if not (header := read_header(name)).unit and header.kind in by_kind
    }
    stated = zip(names[1:], keys.get(dialect.units, ()), strict=False)
    units |= {name: unit for name, unit in stated if unit and unit != "*"}
    in_time = _first(keys, "X_Dimension") in ("", "Time")
    if in_pairs:
        units |= dict.fromkeys(names[::2], "s")
    elif in_time:
        units |= {name: "s" for name in names if name.lower() in dialect.times}
    return units


def _check_pairs(source: str, names: Sequence[str], keys: Keys) -> None:
    """Refuse columns that are no pairs of time and channel, and channels that start apart."""
    started = [{cell for cell in keys.get(key, ()) if cell} for key in ("Date", "Time")]
    dimensions = {cell for cell in keys.get("X_Dimension", ()) if cell}
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


def _acqknowledge(source: str, lines: Sequence[str]) -> Head:
    """Read the head of AcqKnowledge's text: rate, channels, a name and a unit for each."""
    interval = _PER_SAMPLE.fullmatch(lines[1].strip().rstrip(",;\t"))
    count = re.match(r"(\d+) channels", lines[2].strip())
    n_channels = int(count[1]) if count is not None else 0
    if interval is None or not 1 <= n_channels <= (len(lines) - 4) // 2:
        raise UserError(f"{source}: the head of this AcqKnowledge file is not complete")
    at = 3 + 2 * n_channels
    labels = [line.strip().rstrip(",;\t").strip() for line in lines[3:at]]
    names, units = labels[::2], labels[1::2]
    mark = next(mark for mark in DELIMITERS if mark in lines[at])
    heading = [cell.strip() for cell in cells_of(lines[at], mark)]
    # The line of counts below the heading has an empty first cell, or whole numbers alone.
    n_before = at + 2 if at + 1 < len(lines) and _are_counts(lines[at + 1], mark) else at + 1
    if heading and not re.match(r"CH\s?\d", heading[0]):
        # A time in few decimals; the rate is exact.
        names, units = ["x axis", *names], ["", *units]
    shown = checked_names(source, names)
    step_s = _number(interval[1]) * _SECONDS[interval[2].lower()]
    if not step_s:
        raise UserError(f"{source}: states {lines[1].strip()!r}, which is no sampling interval")
    stated = {name: unit for name, unit in zip(shown, units, strict=True) if unit}
    return Head(mark, shown, n_before, stated, {"rate_hz": 1.0 / step_s})


def _are_counts(line: str, mark: str) -> bool:
    cells = [cell.strip() for cell in cells_of(line, mark)]
    while cells and not cells[-1]:
        cells.pop()
    stated = {cell for cell in cells if cell}
    return len(cells) > 1 and len(stated) == 1 and stated.pop().isdigit()
