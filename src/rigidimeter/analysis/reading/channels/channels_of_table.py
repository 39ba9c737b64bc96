"""The channels of a table in SI: chosen, converted, and held against what a joint can do.

All that is wrong with a file is said at once, a line each, with what would put it right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.channels.choice import MOTION, Choice, Taken, choose
from rigidimeter.analysis.reading.channels.headers import read_header
from rigidimeter.analysis.reading.channels.held_values import (
    SLOWEST_S,
    held_rows,
    knots,
    only_at,
    sample_numbers,
    slower_text,
)
from rigidimeter.analysis.reading.channels.missing_codes import Code, missing_codes
from rigidimeter.analysis.reading.channels.quantities import BY_STANDARD
from rigidimeter.analysis.reading.channels.readings import (
    confusions,
    doubts,
    look_at,
    matching_text,
    options_text,
    readings,
    sign_fault,
    usual_units,
)
from rigidimeter.analysis.reading.channels.wrapping import unwrapped, wrapping_text
from rigidimeter.analysis.reading.formats.columns import (
    counts_samples,
    numbers,
    own_rate,
    own_rates,
    same_length,
    time_stamps,
)
from rigidimeter.analysis.reading.formats.cutting import unused_labels
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import EMG_CHANNELS, Notice

Array = NDArray[np.float64]

LARGEST_EMG_V = 20.0
"""Amplifiers of EMG give at most ±10 V or so."""

_WHOLE = 1e-6
_MS_IN_2001 = 1e12
"""Milliseconds since 1970, in September 2001."""


@dataclass(frozen=True)
class TableChannels:
    """What is used of a table.

    Parameters
    ----------
    names : mapping of str to str
        Standard name to the file's, of channels, time and labels.
    time_s : array, shape (n,)
        Of the rows.
    values : mapping of str to array, shape (n,)
        In SI, by standard name, NaN where there is no number.
    notices : tuple of Notice
    """

    names: Mapping[str, str]
    time_s: Array
    values: Mapping[str, Array]
    notices: tuple[Notice, ...]


def channels_of_table(table: Table, options: ReadOptions) -> TableChannels:
    """Return the channels of a table.

    Raises
    ------
    UserError
        If it cannot be read as a recording: every fault in a line of its own.
    """
    has_rate = options.rate_hz is not None or bool(own_rates(table))
    choice = choose(table, options.said, has_rate)
    faults, strays = list(choice.faults), list[str]()
    names = {standard: taken.column for standard, taken in choice.taken.items()}
    if "torque_nm" not in names or not any(name in names for name in MOTION):
        raise UserError(*faults)
    same_length(table, names)
    raw: dict[str, Array] = {}
    for standard in (name for name in names if name in BY_STANDARD):
        try:
            exact = standard == "time_s"
            raw[standard] = numbers(table, standard, names[standard], None if exact else strays)
        except UserError as error:
            faults.append(str(error))
    lost = _without_codes(table, names, raw, options.missing_values)
    time_s, rate_hz = np.empty(0), options.rate_hz
    if rate_hz is not None and numbers_rows(choice.taken, raw):
        del names["time_s"], raw["time_s"], choice.taken["time_s"]
    try:
        if "time_s" not in names and rate_hz is None:
            rate_hz = own_rate(table)
        time_s = _time(table, choice, raw, rate_hz, of_user=options.rate_hz is not None)
    except UserError as error:
        faults.append(str(error))
    usable = (
        "torque_nm" in raw
        and any(name in raw for name in MOTION)
        and "time_s" not in (set(names) - set(raw))
    )
    if choice.unstated:
        faults += _unstated(table, choice, raw, rate_hz, usable=usable)
    notices = [Notice("warning", text) for text in (*choice.unused, *lost)]
    lacking = [label for label in ("epoch", "condition") if label not in names]
    n_rows = table.columns[names["torque_nm"]].size
    notices += unused_labels(table, names.values(), n_rows, lacking)
    if not faults and usable:
        found, warned = _doubtful(table, choice.taken, raw, options, rate_hz)
        faults += found
        notices += [Notice("warning", text) for text in warned]
    if faults:
        raise UserError(*dict.fromkeys(faults))
    values = {
        standard: to_si(raw[standard])
        for standard, taken in choice.taken.items()
        if standard in raw and standard != "time_s" and (to_si := taken.to_si) is not None
    }
    notices += _about_emg(table, values)
    if "angle_rad" in values:
        values["angle_rad"], n_turns = unwrapped(values["angle_rad"])
        if n_turns:
            text = f"{table.source}: column {names['angle_rad']!r} {wrapping_text(n_turns)}"
            notices.append(Notice("warning", text))
    for standard in (name for name in (*MOTION, "torque_nm") if name in values):
        held = rows = held_rows(values[standard])
        if not rows.size and standard == "angle_rad":  # a velocity bends where the torque steps
            rows = knots(values[standard])
        if rows.size and time_s[rows[1]] - time_s[rows[0]] <= SLOWEST_S:
            moves = standard in MOTION
            if moves:
                values[standard] = only_at(values[standard], rows)
            text = slower_text(rows, held=bool(held.size), moves=moves)
            text = f"{table.source}: column {names[standard]!r} {text}"
            notices.append(Notice("warning", text))
    if options.reaction:
        values["torque_nm"] = -values["torque_nm"]
    notices += [Notice("error", text) for text in strays]
    return TableChannels(names, time_s, values, tuple(notices))


def _without_codes(
    table: Table,
    names: Mapping[str, str],
    raw: dict[str, Array],
    stated: tuple[float, ...] | None,
) -> list[str]:
    """Replace codes of lost samples by NaN, those that the user stated or else that are found."""
    texts = []
    for standard in (name for name in ("torque_nm", *MOTION) if name in raw):
        values = raw[standard]
        if stated is None:
            found = missing_codes(values)
        else:
            found = [Code(one, np.flatnonzero(values == one)) for one in stated]
        for code in found:
            if code.rows.size:
                raw[standard] = raw[standard].copy()
                raw[standard][code.rows] = np.nan
                text = (
                    f"{table.source}: column {names[standard]!r} holds {code.value:.6g} in "
                    f"{code.rows.size} of {values.size} rows, which are taken for lost samples"
                )
                if stated is None:
                    text += (
                        ": it recurs alone and far from the values beside it; if they are samples, "
                        "say --missing none"
                    )
                texts.append(text)
    return texts


def numbers_rows(taken: Mapping[str, Taken], raw: Mapping[str, Array]) -> bool:
    """Whether the column of the time may be sample numbers: the user did not say its unit."""
    time = taken.get("time_s")
    return (
        time is not None
        and not time.of_user
        and (time.to_si is None or time.unit == "s")
        and "time_s" in raw
        and counts_samples(raw["time_s"])
    )


def may_be_ticks(raw: Mapping[str, Array]) -> bool:
    """Whether the times are whole numbers, as those of a clock of any rate are.

    Milliseconds since 1970 are told from them: a clock with some ticks a millisecond, which could
    be taken for them, would have run for years.
    """
    time = raw.get("time_s", np.empty(0))
    time = time[np.isfinite(time)]
    whole = bool(np.all(np.abs(time - np.round(time)) < _WHOLE))
    return bool(time.size) and whole and float(np.min(time)) < _MS_IN_2001


def _about_emg(table: Table, values: Mapping[str, Array]) -> list[Notice]:
    notices = []
    for standard in (name for name in EMG_CHANNELS if name in values):
        emg = np.abs(values[standard])
        largest = float(np.max(emg, initial=0.0, where=np.isfinite(emg)))
        if largest > LARGEST_EMG_V:
            text = (
                f"{table.source}: {standard} reaches {largest:.4g} V, which looks like microvolts: "
                f"say --unit {BY_STANDARD[standard].name}=uV"
            )
            notices.append(Notice("warning", text))
    return notices


def _time(
    table: Table, choice: Choice, raw: Mapping[str, Array], rate_hz: float | None, *, of_user: bool
) -> Array:
    taken = choice.taken.get("time_s")
    if taken is None:
        first = choice.taken["torque_nm"].column
        numbers = sample_numbers(table, table.columns[first].size, of_rows=of_user)
        return numbers / (rate_hz or 1.0)
    if taken.to_si is None or "time_s" not in raw:
        return np.empty(0)
    label = choice.taken.get("epoch")
    labels = None if label is None else table.columns.get(label.column)
    if labels is not None and labels.size != raw["time_s"].size:
        labels = None
    return time_stamps(table, taken.column, raw["time_s"], taken.to_si, rate_hz, labels)


def _unstated(
    table: Table,
    choice: Choice,
    raw: Mapping[str, Array],
    rate_hz: float | None,
    *,
    usable: bool,
) -> list[str]:
    vary = {
        taken.standard: usual_units(taken.standard, choice.taken, raw) if usable else ()
        for taken in choice.unstated
    }
    columns = ", ".join(repr(taken.column) for taken in choice.unstated)
    text = (
        f"{table.source}: the unit of {columns} is stated nowhere, so nothing is estimated; say "
        f"{options_text(vary)}"
    )
    for taken in choice.unstated:
        if unknown := read_header(taken.column, table.units.get(taken.column, "")).in_brackets:
            text += f" ({unknown!r} in {taken.column!r} is no unit that is known)"
    if "torque_nm" in vary:
        text += "; or --scale 'torque=0.001 Nm', if its values are counts of that size"
    if numbers_rows(choice.taken, raw):
        text += f"; or --rate-hz, if {choice.taken['time_s'].column!r} numbers the samples"
    elif "time_s" in vary and may_be_ticks(raw):
        text += "; or --scale 'time=0.0001 s', if it counts ticks of that length"
    return [text, *(readings(choice.taken, raw, rate_hz, vary) if usable else [])]


def _doubtful(
    table: Table,
    taken: Mapping[str, Taken],
    raw: Mapping[str, Array],
    options: ReadOptions,
    rate_hz: float | None,
) -> tuple[list[str], list[str]]:
    """Return faults and warnings about units and signs that the numbers contradict."""
    signed = dict(raw)
    if options.reaction:
        signed["torque_nm"] = -raw["torque_nm"]
    seen = look_at(taken, signed, rate_hz, {})
    if seen is None:
        return [], []
    motion = next(name for name in reversed(MOTION) if name in taken)
    columns = {"torque": taken["torque_nm"].column, BY_STANDARD[motion].name: taken[motion].column}
    if wrong := sign_fault(seen, columns, reaction=options.reaction):
        return [f"{table.source}: {wrong}"], []
    faults: list[str] = []
    warnings: list[str] = []
    of_file = {
        name: one.to_si.factor
        for name, one in taken.items()
        if name in ("torque_nm", *MOTION) and one.to_si is not None and not one.of_user
    }
    for doubt in doubts(seen) or confusions(seen, of_file):
        one = taken.get(doubt.standard)
        if one is None:
            option = "check --rate-hz" if options.rate_hz is not None else "say --rate-hz"
            text = f"{table.source}: {doubt.text} at the sampling rate of {rate_hz:g} Hz; {option}"
            (faults if options.rate_hz is None else warnings).append(text)
            continue
        if one.of_user and doubt.beside:
            one = taken[doubt.beside]
        text = f"{table.source}: column {one.column!r} is in {one.unit}, but {doubt.text}"
        if one.of_user:
            warnings.append(f"{text}; it is read as the unit that was given says")
            continue
        vary = {doubt.standard: doubt.units}
        if doubt.beside:
            faults.append(f"{text}; {matching_text(taken, signed, rate_hz)}")
            continue
        text += f"; say {options_text(vary)}"
        if one.standard == "time_s" and numbers_rows(taken, raw):
            text += ", or --rate-hz if it numbers the samples"
        elif one.standard == "time_s" and may_be_ticks(raw):
            text += ", or --scale 'time=0.0001 s' if it counts ticks of that length"
        faults += [text, *readings(taken, signed, rate_hz, vary)]
    return faults, warnings
