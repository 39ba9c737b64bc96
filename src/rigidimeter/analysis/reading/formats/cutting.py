"""Where epochs begin and end in a table: by its labels, or by a length.

Rows are counted from 0; a stretch ends before its `stop`.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Collection
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.channels.headers import read_header
from rigidimeter.analysis.reading.channels.quantities import names_epochs
from rigidimeter.analysis.reading.formats.columns import seconds
from rigidimeter.analysis.reading.formats.gaps import Rows, longest_s
from rigidimeter.analysis.reading.formats.table import Table, label_text
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import MAX_EPOCHS
from rigidimeter.core.records import Notice
from rigidimeter.core.words import series

ROWS_A_LABEL = 100
"""A column whose label changes more often, on average, is no column of trials."""
MOST_LABELS = 12
"""Of a column that is not named as trials are: states, conditions, phases."""
_COMPLETE = 0.95
_DECIMALS = re.compile(r"-?\d*[.,]\d+")


@dataclass(frozen=True)
class Stretch:
    """Rows `start` to `stop` (not included) of a table, and the name of the epoch they are."""

    label: str
    start: int
    stop: int


def by_label(
    source: str, time_s: NDArray[np.float64], column: NDArray[Any]
) -> tuple[list[Stretch], list[Notice]]:
    """Cut where the label changes; rows without a label are rest and belong to no stretch.

    A label that returns after something else is another epoch: the second run of `1` is named
    `1 (2)`, and a notice says so.
    """
    runs = _runs(column, 2 * MAX_EPOCHS)
    if not runs:
        raise UserError(
            f"{source}: the epoch column changes more than {2 * MAX_EPOCHS} times; name the column "
            "of the epochs with --column epoch=NAME"
        )
    stretches: list[Stretch] = []
    notices: list[Notice] = []
    times_seen: dict[str, int] = {}
    for label, start, stop in runs:
        if not label:
            continue
        times_seen[label] = times_seen.get(label, 0) + 1
        name = label
        if times_seen[label] > 1:
            name = f"{label} ({times_seen[label]})"
            text = (
                f"{source}: epoch {label} occurs again at {seconds(float(time_s[start]))} after "
                f"other rows; this run is read as epoch {name}"
            )
            notices.append(Notice("warning", text))
        stretches.append(Stretch(name, start, stop))
    if not stretches:
        raise UserError(
            f"{source}: the epoch column is empty in every row, which means rest; label the rows "
            "of each epoch"
        )
    return stretches, notices


def by_length(source: str, clock: Rows, length_s: float) -> tuple[list[Stretch], list[Notice]]:
    """Cut into consecutive stretches of one length by the clock, named `1`, `2` and so on.

    The last one may be up to 5 % short; what is shorter is left out, and a notice says how much.
    """
    time_s, step_s = clock.time_s, clock.step_s
    elapsed = time_s - time_s[0]
    if not elapsed[-1] + step_s <= MAX_EPOCHS * length_s:
        raise UserError(
            f"{source} lasts {seconds(float(elapsed[-1]))}, which is more than {MAX_EPOCHS} epochs "
            f"of --epoch-length-s {length_s:g}; give a longer one"
        )
    # A quarter of an interval keeps a stamp that rounding put just before its boundary.
    index = np.floor((elapsed + 0.25 * step_s) / length_s).astype(np.int64)
    starts = np.flatnonzero(np.diff(index, prepend=-1))
    stops = np.append(starts[1:], time_s.size)
    stretches = [
        Stretch(str(index[start] + 1), int(start), int(stop))
        for start, stop in zip(starts, stops, strict=True)
    ]
    notices = _gaps_between(source, time_s, stretches, step_s)
    last = stretches[-1]
    # The file ends one interval after its last stamp.
    left_s = float(elapsed[-1]) + step_s - int(index[-1]) * length_s
    if left_s < _COMPLETE * length_s:
        text = (
            f"{source}: the last {seconds(left_s)}, from {seconds(float(time_s[last.start]))} on, "
            f"are shorter than an epoch of {length_s:g} s and were left out"
        )
        notices.append(Notice("warning", text))
        stretches = stretches[:-1]
    if not stretches:
        raise UserError(
            f"{source} lasts {seconds(left_s)}, which is shorter than one epoch of "
            f"--epoch-length-s {length_s:g}"
        )
    return stretches, notices


def label_columns(
    table: Table, used: Collection[str], n_rows: int
) -> dict[tuple[int, ...], dict[str, list[str]]]:
    """Return the labels of each unused column whose few values last long, as labels of rows do.

    A column that is named as trials are may have many. One of a measured quantity has a unit, a
    name that says so, or values between whole numbers.

    Returns
    -------
    dict
        By the rows at which labels change, so that columns that change together are together.
    """
    alike: dict[tuple[int, ...], dict[str, list[str]]] = {}
    for name in (one for one in table.columns if one not in used):
        trials = names_epochs(name)
        header = read_header(name, table.units.get(name, ""))
        column = table.columns[name]
        if column.size != n_rows or (not trials and (header.kind or header.unit)):
            continue
        runs = _runs(column, n_rows // ROWS_A_LABEL)
        labels = list(dict.fromkeys(label for label, _, _ in runs if label))
        few = len(labels) <= MOST_LABELS and not any(_DECIMALS.fullmatch(one) for one in labels)
        if len(runs) > 1 and labels and (trials or few):
            alike.setdefault(tuple(start for _, start, _ in runs), {})[name] = labels
    return alike


def unused_labels(
    table: Table, used: Collection[str], n_rows: int, lacking: Collection[str]
) -> list[Notice]:
    """Return a warning for each unused column of labels; `label_columns` says which those are.

    Columns whose labels change at the same rows have one warning.

    Parameters
    ----------
    table : Table
    used : collection of str
        Columns that are used.
    n_rows : int
    lacking : collection of str
        Of ``epoch`` and ``condition``, those for which no column is used.
    """
    notices = []
    for columns in label_columns(table, used, n_rows).values():
        name, labels = next(iter(columns.items()))
        options = [
            f"--column {shlex.quote(f'{label}={name}')} {what}"
            for label, what in (
                ("epoch", "reads each of its labels as an epoch"),
                ("condition", "takes its labels for conditions"),
            )
            if label in lacking and (label == "epoch" or not names_epochs(name))
        ]
        if not options:
            continue
        shown = ", ".join(labels[:3]) + (", …" if labels[3:] else "")
        others = [repr(other) for other in columns if other != name]
        too = f", nor are {series(others)}, which change with it" if others else ""
        text = f"{table.source}: column {name!r} ({shown}) is not used{too}; {series(options)}"
        notices.append(Notice("warning", text))
    return notices


def constant_label(table: Table, standard: str, column: NDArray[Any], stretch: Stretch) -> str:
    """Return the one label that a column has within a stretch, or nothing if it has none.

    Raises
    ------
    UserError
        If the label changes within the stretch.
    """
    seen = ""
    for label, start, _ in _runs(column[stretch.start : stretch.stop]):
        if seen and label and label != seen:
            raise UserError(
                f"{table.where(stretch.start + start)}: {standard} changes from {seen} to {label} "
                f"within epoch {stretch.label}; it must stay the same throughout an epoch"
            )
        seen = seen or label
    return seen


def lettered(label: str, pieces: int) -> list[str]:
    """Name the pieces of an epoch: `3a`, `3b` and so on, or `3` if there is only one."""
    return [label] if pieces == 1 else [label + _letters(index) for index in range(pieces)]


def _letters(index: int) -> str:
    rest, last = divmod(index, 26)
    return (_letters(rest - 1) if rest else "") + chr(ord("a") + last)


def _runs(column: NDArray[Any], most: int | None = None) -> list[tuple[str, int, int]]:
    """Return label, start and stop of each run of one label; empty labels are runs too.

    Nothing is returned where the column changes more than `most` times.
    """
    changed = np.asarray(column[1:] != column[:-1], dtype=bool)
    if column.dtype != object:
        changed &= ~(np.isnan(column[1:]) & np.isnan(column[:-1]))
    starts = [0, *(np.flatnonzero(changed) + 1).tolist()]
    runs: list[tuple[str, int, int]] = []
    if most is not None and len(starts) > most:
        return runs
    for start, stop in zip(starts, [*starts[1:], column.size], strict=True):
        label = label_text(column[start])
        if runs and runs[-1][0] == label:  # the same label, written in two ways
            runs[-1] = (label, runs[-1][1], stop)
        else:
            runs.append((label, start, stop))
    return runs


def _gaps_between(
    source: str, time_s: NDArray[np.float64], stretches: list[Stretch], step_s: float
) -> list[Notice]:
    """Report gaps that fall on a boundary, where no epoch is cut because of them."""
    notices = []
    for before, after in pairwise(stretches):
        start_s, stop_s = float(time_s[before.stop - 1]), float(time_s[after.start])
        if stop_s - start_s > longest_s(step_s):
            text = (
                f"{source}: a gap of {seconds(stop_s - start_s)} from {seconds(start_s)} on lies "
                f"between epochs {before.label} and {after.label}"
            )
            notices.append(Notice("warning", text))
    return notices
