"""The columns that are chosen, as numbers in SI with the time of each sample.

Numbers are converted here and never judged, but for what is no number at all: the gate does that.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from rigidimeter.analysis.reading_anew.choose import Chosen, choose, unstated_fault
from rigidimeter.analysis.reading_anew.clock import (
    Refused,
    by_number,
    check_agreeing,
    check_increasing,
    counts_samples,
    one_after_another,
    restarts,
    stated_rate,
)
from rigidimeter.analysis.reading_anew.codes import Code, missing_codes
from rigidimeter.analysis.reading_anew.columns import Array, Columns, numbers
from rigidimeter.analysis.reading_anew.mapping import Fault, Mapping
from rigidimeter.analysis.reading_anew.quantities import MOTION, QUANTITIES
from rigidimeter.analysis.reading_anew.repeated import unwrapped
from rigidimeter.analysis.reading_anew.units import Conversion
from rigidimeter.core.errors import UserError

SENSORS = ("torque", *MOTION)
_NONE = np.empty(0)


@dataclass
class Signals:
    """What is read of a file under one mapping.

    Parameters
    ----------
    said : Mapping
    chosen : Chosen
    raw : mapping of str to array, shape (n,)
        By quantity, as the file has them, NaN for what is missing.
    rows_s : array, shape (n,)
        The time of the rows of a table; empty where it is not known.
    rate_hz : float or None
        Where there is no column of the time.
    faults : list of Fault
    notices : list of str
        What was made of the columns.
    strays : list of str
        Entries that are no numbers.
    """

    said: Mapping
    chosen: Chosen
    raw: dict[str, Array] = field(default_factory=dict)
    rows_s: Array = field(default_factory=lambda: _NONE)
    rate_hz: float | None = None
    faults: list[Fault] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)
    strays: list[str] = field(default_factory=list)

    @property
    def are_enough(self) -> bool:
        """Whether torque and motion, and a time if there is a column of it, are numbers."""
        lacks_time = "time" in self.chosen.columns and "time" not in self.raw
        return "torque" in self.raw and not lacks_time and any(m in self.raw for m in MOTION)

    @property
    def numbers_rows(self) -> bool:
        """Whether the column of the time may be sample numbers: the user did not say its unit."""
        pick = self.chosen.mapping.time
        return (
            "time" not in self.chosen.of_user
            and pick.unit in ("", "s")
            and "time" in self.raw
            and counts_samples(self.raw["time"])
        )

    def clock_s(self, file: Columns, quantity: str) -> Array:
        """Return the time of each sample of a quantity, in s."""
        clock = file.columns[self.chosen.columns[quantity]].clock
        return file.clocks[clock] if clock else self.rows_s


def signals(file: Columns, said: Mapping, read: dict[str, Array] | None = None) -> Signals:
    """Return what is read of a file under a mapping, and what is wrong with it.

    Parameters
    ----------
    file : Columns
    said : Mapping
    read : dict of str to array, optional
        Columns that were read as numbers before, by name; those that are read here are added.
    """
    chosen = choose(file, said)
    found = Signals(said, chosen, faults=list(chosen.faults))
    columns = chosen.columns
    if "torque" not in columns or not any(name in columns for name in MOTION):
        return found
    if unequal := _lengths(file, [*columns.values(), *chosen.labels.values()]):
        found.faults += unequal
        return found
    for name, column in columns.items():
        strays = None if name == "time" else found.strays
        try:
            known = {} if read is None else read
            if column not in known:
                known[column] = numbers(file, column, QUANTITIES[name].stored, strays)
            found.raw[name] = known[column]
        except UserError as error:
            found.faults.append(Fault(str(error), "numbers", name))
    if found.faults:
        return found
    found.notices += _without_codes(file, found)
    found.rate_hz = said.rate_hz
    if found.rate_hz is not None and found.numbers_rows:
        _drop_time(found)
    try:
        found.rows_s = _rows_s(file, found)
    except Refused as refused:
        found.faults.append(refused.fault)
    if chosen.unstated:
        found.faults.append(unstated_fault(file, chosen, said))
    return found


def _drop_time(found: Signals) -> None:
    del found.raw["time"]
    found.chosen.mapping = found.chosen.mapping.saying(time={"column": ""})
    found.chosen.to_si.pop("time", None)


def _lengths(file: Columns, used: Iterable[str]) -> list[Fault]:
    """Refuse columns of one clock of different lengths, or of fewer than two samples."""
    first: dict[str, str] = {}
    for name in (one for one in used if one in file.columns):
        column = file.columns[name]
        of_clock = first.setdefault(column.clock, name)
        if column.size != file.columns[of_clock].size:
            text = (
                f"{file.source}: column {name} has {column.size} values and column {of_clock} has "
                f"{file.columns[of_clock].size}; all columns must have the same length"
            )
            return [Fault(text, "length")]
        if column.size < 2:
            text = (
                f"{file.source} holds {column.size} sample{'' if column.size == 1 else 's'}; a "
                "recording needs at least 2, and an estimate some seconds"
            )
            return [Fault(text, "length")]
    return []


def _without_codes(file: Columns, found: Signals) -> list[str]:
    """Replace codes of lost samples by NaN, those that the user stated or else that are found."""
    texts = []
    stated = found.said.codes
    for name in (one for one in SENSORS if one in found.raw):
        values = found.raw[name]
        if stated is None:
            codes = missing_codes(values)
        else:
            codes = [Code(one, np.flatnonzero(values == one)) for one in stated]
        for code in codes:
            if not code.rows.size:
                continue
            found.raw[name] = found.raw[name].copy()
            found.raw[name][code.rows] = np.nan
            text = (
                f"{file.source}: column {found.chosen.columns[name]!r} holds {code.value:.6g} in "
                f"{code.rows.size} of {values.size} rows, which are taken for lost samples"
            )
            if stated is None:
                text += (
                    ": it recurs alone and far from the values beside it; if they are samples, say "
                    "--missing none"
                )
            texts.append(text)
    return texts


def _rows_s(file: Columns, found: Signals) -> Array:
    """Return the time of the rows of a table.

    Raises
    ------
    Refused
        If it is not known, or not that of samples one after another.
    """
    in_rows = [one for one in found.chosen.columns.values() if not file.columns[one].clock]
    if not in_rows:
        return _NONE
    column = found.chosen.columns.get("time")
    if column is None:
        of_user = found.rate_hz is not None
        if found.rate_hz is None:
            found.rate_hz = stated_rate(file)
        size = file.columns[in_rows[0]].size
        return by_number(file, size, found.rate_hz, of_rows=of_user)
    if "time" not in found.chosen.to_si:
        return _NONE
    values = found.raw["time"]
    time_s = in_si(values, found.chosen.to_si["time"])
    if _starts_anew_with_epochs(file, found, values):
        values = time_s = one_after_another(time_s)
    try:
        check_increasing(file, column, values)
    except Refused as refused:
        raise Refused(_with_runs(refused.fault, found, values, column)) from None
    if found.rate_hz is not None:
        check_agreeing(file, column, time_s, found.rate_hz)
    return time_s


def _starts_anew_with_epochs(file: Columns, found: Signals, time: Array) -> bool:
    """Whether the time goes back, and only where the label of the epochs changes."""
    label = found.chosen.labels.get("epoch", "")
    starts = restarts(time)
    if label not in file.columns or not starts.size or file.columns[label].size != time.size:
        return False
    labels = file.columns[label].read()
    by_itself = label == found.chosen.columns["time"]
    return by_itself or bool(np.all(labels[starts] != labels[starts - 1]))


def _with_runs(fault: Fault, found: Signals, time: Array, column: str) -> Fault:
    """Offer the runs of a time that starts anew as epochs."""
    starts = restarts(time)
    runs = np.diff(starts, prepend=0, append=time.size)
    anew = time[starts] <= time[0]
    if not starts.size or not np.all(anew) or np.min(runs) < 2:
        return fault
    text = fault.text.partition("; if it starts anew")[0]
    text += f"; it starts anew {starts.size} times, and each run may be an epoch"
    remedy = found.said.saying(epoch_column=column)
    return Fault(text, "starts anew", "time", (remedy,))


def in_si(values: Array, to_si: Conversion) -> Array:
    """Return values in SI; the same array where they are in SI already."""
    with np.errstate(invalid="ignore", over="ignore"):  # what is not finite counts as missing
        if to_si.offset:
            values = values - to_si.offset
        return values if to_si.size == 1.0 else values * to_si.size


def for_gate(
    file: Columns, found: Signals, to_si: dict[str, Conversion]
) -> dict[str, tuple[Array, Array]] | None:
    """Return torque and motion in SI as the gate looks at them; None if they are too few.

    Parameters
    ----------
    file : Columns
    found : Signals
    to_si : mapping of str to Conversion
        By quantity, the units to look with; of a quantity without one the numbers are as they are.

    Returns
    -------
    dict or None
        By quantity, time in s and values: finite, in the order of time.
    """
    seen: dict[str, tuple[Array, Array]] = {}
    rows_s: Array | None = None
    for name in (one for one in SENSORS if one in found.raw):
        values = in_si(found.raw[name], to_si.get(name, Conversion()))
        if name == "angle":
            values, _ = unwrapped(values)
        if name == "torque" and found.said.reaction:
            values = -values
        clock = file.columns[found.chosen.columns[name]].clock
        if clock:
            time_s = file.clocks[clock]
        else:
            if rows_s is None:
                rows_s = _rows_for_gate(found, values.size, to_si)
            if rows_s is None:
                return None
            time_s = rows_s
        finite = np.isfinite(values) & np.isfinite(time_s)
        if np.all(finite):
            seen[name] = time_s, values
        elif np.count_nonzero(finite) >= 2:
            seen[name] = time_s[finite], values[finite]
    if "torque" not in seen or not any(name in seen for name in MOTION):
        return None
    return seen


def _rows_for_gate(found: Signals, size: int, to_si: dict[str, Conversion]) -> Array | None:
    if "time" in found.raw:
        return one_after_another(in_si(found.raw["time"], to_si.get("time", Conversion())))
    if found.rate_hz is None:
        return None
    return np.arange(size) / found.rate_hz
