"""Which columns of a table are EMG: those the user names, and those with a standard name.

Active stretches are left out of the fit, so that a column that only looks like EMG is named and not
used. Where the user says a unit or a scale of EMG, each column that looks like it is one muscle, in
the order of the file. An envelope, an RMS or a share of the largest contraction is no raw EMG.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping

from rigidimeter.analysis.reading.channels.headers import Header
from rigidimeter.analysis.reading.channels.quantities import BY_STANDARD, words_of
from rigidimeter.analysis.reading.channels.unit_text import expression, factor
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.records import EMG_CHANNELS

_FIRST = EMG_CHANNELS[0]
_PROCESSED = {"rms", "envelope", "env", "rectified", "smooth", "smoothed", "integrated", "iemg",
              "mvc", "normalised", "normalized", "filtered", "filt"}  # fmt: skip


def of_every_muscle(said: Mapping[str, str]) -> Mapping[str, str]:
    """Return what is said of each quantity, of ``emg`` for every muscle without its own."""
    return said if _FIRST not in said else dict.fromkeys(EMG_CHANNELS, said[_FIRST]) | {**said}


def emg_columns(
    table: Table,
    headers: Mapping[str, Header],
    named: Mapping[str, str],
    known: frozenset[str],
    units: frozenset[str],
) -> tuple[dict[str, str], list[str]]:
    """Return the column of each muscle by standard name, and why others are not used.

    Parameters
    ----------
    table : Table
    headers : mapping of str to Header
        By column.
    named : mapping of str to str
        What the user named, by standard name.
    known : set of str
        Columns that are something else.
    units : set of str
        Standard names of which the user said a unit or a scale.
    """
    of_others = table.columns.keys() - {*named.values()}
    found = {name: named.get(name, name if name in of_others else "") for name in EMG_CHANNELS}
    found = {name: column for name, column in found.items() if column in table.columns}
    if any(name in named for name in EMG_CHANNELS):
        return found, []
    unused: list[str] = []
    looking: list[str] = []
    slots = [name for name in EMG_CHANNELS if name not in found]
    for column in table.columns:
        header = headers[column]
        if header.kind != "emg" or column in known or column in EMG_CHANNELS:
            continue
        why = ""
        if _PROCESSED.intersection(words_of(column)):
            why = "it is not the raw EMG"
        elif not slots:
            why = f"{len(EMG_CHANNELS)} muscles are read at most"
        elif slots[0] not in units and _no_voltage(header.unit):
            why = f"it is in {header.unit}, and EMG is needed in V or mV"
        if why:
            unused.append(f"{table.source}: column {column!r} is not used: {why}")
        elif units.isdisjoint(EMG_CHANNELS):
            option = shlex.quote(f"{BY_STANDARD[slots.pop(0)].name}={column}")
            looking.append(f" --column {option}")
        else:
            found[slots.pop(0)] = column
    if looking:
        text = "what looks like EMG is not used; to leave out active stretches, say"
        unused.append(f"{table.source}: {text}{''.join(looking)}")
    return found, unused


def _no_voltage(unit: str) -> bool:
    return bool(expression(unit)) and factor(unit, _FIRST) is None
