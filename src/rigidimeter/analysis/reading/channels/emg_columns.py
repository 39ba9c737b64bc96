"""Which columns of a table are EMG: each that is named so is one muscle, in the order of the file.

A column with a standard name (``emg_v``, ``emg_2_v``) is that muscle. Where the user names one, no
other is taken by what it is called. An envelope, an RMS or a share of the largest contraction is no
raw EMG.
"""

from __future__ import annotations

from collections.abc import Mapping

from rigidimeter.analysis.reading.channels.headers import Header
from rigidimeter.analysis.reading.channels.quantities import words_of
from rigidimeter.analysis.reading.channels.unit_text import expression, factor
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.records import EMG_CHANNELS

_FIRST = EMG_CHANNELS[0]
_PROCESSED = {"rms", "envelope", "env", "rectified", "smooth", "smoothed", "integrated", "iemg",
              "mvc", "normalised", "normalized"}  # fmt: skip


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
    found = {name: named.get(name, name) for name in EMG_CHANNELS}
    found = {name: column for name, column in found.items() if column in table.columns}
    if any(name in named for name in EMG_CHANNELS):
        return found, []
    unused: list[str] = []
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
        else:
            found[slots.pop(0)] = column
    return found, unused


def _no_voltage(unit: str) -> bool:
    return bool(expression(unit)) and factor(unit, _FIRST) is None
