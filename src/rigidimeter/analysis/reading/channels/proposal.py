"""How a table should be read: what its numbers decide, and what only a person can say.

The numbers decide a unit where every other usual one is impossible, the torque among several
columns where one alone belongs to the motion, and its sign. The unit of a torque, a lever arm and a
calibration they never decide, nor whether 0, 1, 2 are milliseconds or sample numbers, and 0, 5, 10
milliseconds or ticks of another clock: each has a rate and a joint that are possible.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rigidimeter.analysis.reading.channels.channels_of_table import (
    channels_of_table,
    may_be_ticks,
    numbers_rows,
)
from rigidimeter.analysis.reading.channels.choice import MOTION, Choice, Taken, choose
from rigidimeter.analysis.reading.channels.headers import SCALED, read_header
from rigidimeter.analysis.reading.channels.lever_arm import lever_arm
from rigidimeter.analysis.reading.channels.looks import Array, Look
from rigidimeter.analysis.reading.channels.quantities import BY_STANDARD, names_epochs
from rigidimeter.analysis.reading.channels.readings import (
    BELIEVED_SPEED_RAD_S,
    doubts,
    look_at,
    usual_units,
)
from rigidimeter.analysis.reading.formats.columns import numbers, own_rate, own_rates, restarts
from rigidimeter.analysis.reading.formats.cutting import label_columns
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError

_MOST_PAIRS = 36
_BELONGS, _DOES_NOT = 0.8, 0.5
"""Of the share of a torque that the motion explains."""


@dataclass(frozen=True)
class Proposal:
    """What to say of a table so that it is read.

    Parameters
    ----------
    options : ReadOptions
    reasons : tuple of str
        Why, for what was added to the options that were given.
    unsaid : tuple of str
        What is still wrong then, and only a person can know; empty where it is read.
    choice : Choice
        The columns that are taken then.
    seen : Look or None
        How the recording looks then.
    notices : tuple of str
        What is not used or was changed then.
    """

    options: ReadOptions
    reasons: tuple[str, ...]
    unsaid: tuple[str, ...]
    choice: Choice
    seen: Look | None
    notices: tuple[str, ...]


def propose(table: Table, options: ReadOptions) -> Proposal:
    """Return how a table should be read, with the options that are given already."""
    reasons: list[str] = []
    options = _pair_of_several(table, options, reasons)
    for standard in ("torque_nm", *MOTION):
        options = _one_of_several(table, standard, options, reasons)
    options = _of_lever_arm(table, options)
    options = _trials(table, options, reasons)
    options = _units(table, options, reasons)
    choice = _chosen(table, options)
    raw, rate_hz = _raw(table, choice, options)
    seen = _seen(choice.taken, raw, rate_hz, {})
    fit = None if seen is None or options.reaction else seen.fit
    if fit is not None and np.all(fit.significant < 0):
        options = replace(options, reaction=True)
        reasons.append("J, B and K are negative without --reaction")
        seen = _seen(choice.taken, raw | {"torque_nm": -raw["torque_nm"]}, rate_hz, {})
    unsaid: tuple[str, ...] = ()
    try:
        notices = tuple(notice.text for notice in channels_of_table(table, options).notices)
    except UserError as error:
        unsaid, notices = error.lines, tuple(choice.unused)
    return Proposal(options, tuple(reasons), unsaid, choice, seen, notices)


def _pair_of_several(table: Table, options: ReadOptions, reasons: list[str]) -> ReadOptions:
    """Choose the torque and the motion that alone belong together, of several of each."""
    choice = _chosen(table, options)
    motions = [name for name in MOTION if name in choice.several]
    taken = any(name in choice.taken for name in MOTION)
    if "torque_nm" not in choice.several or len(motions) != 1 or taken:
        return options
    torques, moved = choice.several["torque_nm"], choice.several[motions[0]]
    name = BY_STANDARD[motions[0]].name
    if len(torques) * len(moved) > _MOST_PAIRS:
        return options
    explained = {}
    for torque, motion in itertools.product(torques, moved):
        columns = {**options.columns, "torque": torque, name: motion}
        explained[torque, motion] = _explained(table, replace(options, columns=columns))
    best, second = sorted(explained, key=lambda pair: -explained[pair])[:2]
    if explained[best] < _BELONGS or explained[second] > _DOES_NOT:
        return options
    reasons.append(
        f"the share of the torque that the motion explains is {explained[best]:.2f} with "
        f"{best[0]!r} and {best[1]!r}, and at most {explained[second]:.2f} with any other two"
    )
    return replace(options, columns={**options.columns, "torque": best[0], name: best[1]})


def _explained(table: Table, options: ReadOptions) -> float:
    """Return the share of the torque that the motion explains, 0 where that is not known."""
    choice = _chosen(table, options)
    seen = _seen(choice.taken, *_raw(table, choice, options), {})
    return 0.0 if seen is None or seen.fit is None else seen.fit.r_squared


def _one_of_several(
    table: Table, standard: str, options: ReadOptions, reasons: list[str]
) -> ReadOptions:
    """Choose the torque, or the motion, that alone belongs to the other."""
    name = BY_STANDARD[standard].name
    candidates = _chosen(table, options).several.get(standard, [])
    explained: dict[str, float] = {}
    for column in candidates:
        tried = replace(options, columns={**options.columns, name: column})
        if share := _explained(table, tried):
            explained[column] = share
    ranked = sorted(explained, key=lambda column: -explained[column])
    if len(ranked) < 2 or explained[ranked[0]] < _BELONGS or explained[ranked[1]] > _DOES_NOT:
        return options
    shown = ", ".join(f"{explained[column]:.2f} with {column!r}" for column in ranked[:4])
    reasons.append(f"the share of the torque that the motion explains is {shown} as the {name}")
    return replace(options, columns={**options.columns, name: ranked[0]})


def _of_lever_arm(table: Table, options: ReadOptions) -> ReadOptions:
    """Multiply a force by the lever arm that the file states."""
    arm = lever_arm(table.scalars)
    if not arm or "torque_nm" in _chosen(table, options).taken:
        return options
    tried = replace(options, scales={**options.scales, "torque": arm})
    return tried if "torque_nm" in _chosen(table, tried).taken else options


def _trials(table: Table, options: ReadOptions, reasons: list[str]) -> ReadOptions:
    """Take for the epochs the column of trials: by where the time starts anew, or by its name.

    Of several that are named so, the one that changes wherever another does: trials within blocks.
    """
    choice = _chosen(table, options)
    raw, _ = _raw(table, choice, options)
    if "epoch" in choice.taken or not raw:
        return options
    used = {taken.column for taken in choice.taken.values()}
    n_rows = next(iter(raw.values())).size
    starts = restarts(raw["time_s"]) if "time_s" in raw else np.empty(0)
    name = reason = ""
    if starts.size and 2 * starts.size <= n_rows:
        changing = (
            name
            for name, column in table.columns.items()
            if column.size == n_rows
            and np.array_equal(np.flatnonzero(column[1:] != column[:-1]) + 1, starts)
        )
        name = next(changing, "")
        reason = f"the time starts anew where {name!r} changes"
    elif options.epoch_length_s is None:
        named = {
            frozenset(rows): [name for name in columns if names_epochs(name)]
            for rows, columns in label_columns(table, used, n_rows).items()
        }
        named = {rows: names for rows, names in named.items() if names}
        finest = max(named, key=len, default=frozenset())
        if all(rows <= finest for rows in named):
            name = named[finest][0] if named else ""
        reason = f"the rows of each label of {name!r} follow one another, as an epoch's do"
    if not name:
        return options
    reasons.append(reason)
    return replace(options, columns={**options.columns, "epoch": name})


def _units(table: Table, options: ReadOptions, reasons: list[str]) -> ReadOptions:
    """Add the units that are the only possible ones, of time and motion."""
    choice = _chosen(table, options)
    raw, rate_hz = _raw(table, choice, options)
    vary = [one.standard for one in choice.unstated if one.standard in ("time_s", *MOTION)]
    seen = _seen(choice.taken, raw, rate_hz, {})
    if not vary and seen is not None:
        vary = [
            doubt.standard
            for doubt in doubts(seen)
            if (taken := choice.taken.get(doubt.standard)) is not None and not taken.of_user
        ]
    vary = [
        name
        for name in vary
        if name != "torque_nm" and not _unknown_unit(choice.taken[name].column)
    ]
    if "time_s" in vary and may_be_ticks(raw):
        return options
    if not vary:
        return options
    possible, speeds_rad_s = [], []
    usual = {name: usual_units(name, choice.taken, raw) for name in vary}
    for units in itertools.product(*usual.values()):
        as_units = dict(zip(vary, units, strict=True))
        looked = _seen(choice.taken, raw, rate_hz, as_units)
        if looked is not None and not doubts(looked):
            possible.append(as_units)
            speeds_rad_s.append(looked.speed_rad_s)
    low, high = BELIEVED_SPEED_RAD_S
    if not all(low <= speed <= high for speed in speeds_rad_s):
        return options  # the unit may be none of the usual ones: ticks, mrad, tenths of a degree
    for name in vary:
        units_left = {as_units[name] for as_units in possible}
        if len(units_left) == 1:
            (unit,) = units_left
            spoken = BY_STANDARD[name].name
            reasons.append(f"{spoken} can only be in {unit} (of {', '.join(usual[name])})")
            options = replace(options, units={**options.units, spoken: unit})
    return options


def _unknown_unit(column: str) -> bool:
    """Whether a name states what is no unit, in brackets or as a factor, as in `0.1 deg`."""
    states = re.search(r"[\[(]", column) or SCALED.search(column)
    return bool(states) and not read_header(column).unit


def _chosen(table: Table, options: ReadOptions) -> Choice:
    has_rate = options.rate_hz is not None or bool(own_rates(table))
    return choose(table, options.said, has_rate)


def _raw(
    table: Table, choice: Choice, options: ReadOptions
) -> tuple[dict[str, Array], float | None]:
    """Return the columns as they are, of those that hold numbers, and the sampling rate."""
    raw: dict[str, Array] = {}
    rate_hz = options.rate_hz
    for standard, taken in choice.taken.items():
        if standard in BY_STANDARD:
            try:
                raw[standard] = numbers(table, standard, taken.column, [])
            except UserError:
                continue
    if rate_hz is None and "time_s" not in choice.taken:
        try:
            rate_hz = own_rate(table)
        except UserError:
            rate_hz = None
    if rate_hz is not None and numbers_rows(choice.taken, raw):
        del raw["time_s"]
    sizes = {values.size for values in raw.values()}
    if options.reaction and "torque_nm" in raw:
        raw["torque_nm"] = -raw["torque_nm"]
    return (raw, rate_hz) if len(sizes) == 1 else ({}, rate_hz)


def _seen(
    taken: Mapping[str, Taken],
    raw: Mapping[str, Array],
    rate_hz: float | None,
    as_units: Mapping[str, str],
) -> Look | None:
    if rate_hz is None and "time_s" not in raw:
        return None
    return look_at(taken, raw, rate_hz, as_units)
