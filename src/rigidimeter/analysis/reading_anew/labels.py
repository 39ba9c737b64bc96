"""Labels of rows: where they change, which columns hold them, and which of those are not used."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.columns import Columns, label_text
from rigidimeter.analysis.reading_anew.headers import read_header
from rigidimeter.analysis.reading_anew.mapping import Fault, Mapping
from rigidimeter.analysis.reading_anew.quantities import names_epochs
from rigidimeter.core.words import series

# A column whose label changes more often, on average, is no column of trials.
_ROWS_A_LABEL = 100
# Of a column that is not named as trials are: states, conditions, phases.
_MOST_LABELS = 12
_BLOCK = 2**16
_DECIMALS = re.compile(r"-?\d*[.,]\d+")


def runs(column: NDArray[Any], most: int | None = None) -> list[tuple[str, int, int]]:
    """Return label, start and stop of each run of one label; empty labels are runs too.

    Nothing is returned where the column changes more than `most` times.
    """
    starts = [0]
    for begin in range(0, column.size - 1, _BLOCK):  # most columns of numbers end it at once
        here, after = column[begin : begin + _BLOCK], column[begin + 1 : begin + 1 + _BLOCK]
        changed = np.asarray(after != here[: after.size], dtype=bool)
        if column.dtype != object:
            changed &= ~(np.isnan(after) & np.isnan(here[: after.size]))
        starts += (np.flatnonzero(changed) + begin + 1).tolist()
        if most is not None and len(starts) > most:
            return []
    found: list[tuple[str, int, int]] = []
    for start, stop in zip(starts, [*starts[1:], column.size], strict=True):
        label = label_text(column[start])
        if found and found[-1][0] == label:  # the same label, written in two ways
            found[-1] = (label, found[-1][1], stop)
        else:
            found.append((label, start, stop))
    return found


def label_columns(
    file: Columns, used: Collection[str], n_rows: int
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
    for name, one in file.columns.items():
        trials = names_epochs(name)
        header = read_header(name, one.unit)
        if name in used or one.size != n_rows or (not trials and (header.kind or header.unit)):
            continue
        stretches = runs(one.read(), n_rows // _ROWS_A_LABEL)
        labels = list(dict.fromkeys(label for label, _, _ in stretches if label))
        few = len(labels) <= _MOST_LABELS and not any(_DECIMALS.fullmatch(text) for text in labels)
        if len(stretches) > 1 and labels and (trials or few):
            alike.setdefault(tuple(start for _, start, _ in stretches), {})[name] = labels
    return alike


def unused_labels(
    file: Columns, said: Mapping, used: Collection[str], n_rows: int, lacking: Collection[str]
) -> list[Fault]:
    """Return what to say of each unused column of labels; `label_columns` says which those are.

    Parameters
    ----------
    file : Columns
    said : Mapping
    used : collection of str
        Columns that are used.
    n_rows : int
    lacking : collection of str
        Of ``epoch`` and ``condition``, those for which no column is used.
    """
    found = []
    for columns in label_columns(file, used, n_rows).values():
        name, labels = next(iter(columns.items()))
        for_labels = [
            label
            for label in ("epoch", "condition")
            if label in lacking and (label == "epoch" or not names_epochs(name))
        ]
        if not for_labels:
            continue
        shown = ", ".join(labels[:3]) + (", …" if labels[3:] else "")
        others = [repr(other) for other in columns if other != name]
        too = f", nor are {series(others)}, which change with it" if others else ""
        text = f"{file.source}: column {name!r} ({shown}) is not used{too}"
        remedies = tuple(said.saying(**{f"{label}_column": name}) for label in for_labels)
        because = f", to read its labels as {' or '.join(f'{one}s' for one in for_labels)}"
        found.append(Fault(text, "unused label", "epoch", remedies, because=because))
    return found
