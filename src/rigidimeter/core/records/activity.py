"""When muscles were active in an epoch, found in their EMG."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple


class ActiveStretch(NamedTuple):
    """A burst of EMG, on the clock of the epoch's channels.

    Attributes
    ----------
    start_s, stop_s : float
    channel : str
        Of the muscle, such as ``emg_v``.
    locked : bool
        Whether the muscle's bursts follow the motion, as a reflex does.
    """

    start_s: float
    stop_s: float
    channel: str
    locked: bool = False


class Activity(NamedTuple):
    """What the EMG of an epoch shows.

    Attributes
    ----------
    stretches : tuple of ActiveStretch
        In the order of time.
    active_percent : float
        Share of the epoch in which a muscle was active.
    left_out_percent : float
        Share of the epoch that is left out for it.
    cocontraction_percent : float
        Mean of the smaller over the larger envelope of the first two muscles, each in units of its
        largest in the recording; NaN with one muscle.
    kept : str
        Why stretches that were to be left out stay in; empty where none does.
    """

    stretches: tuple[ActiveStretch, ...]
    active_percent: float
    left_out_percent: float
    cocontraction_percent: float = math.nan
    kept: str = ""

    def row(self) -> dict[str, Any]:
        """Return names and numbers, as files and tables have them; the stretches as one text."""
        return {
            "active_percent": self.active_percent,
            "active_left_out_percent": self.left_out_percent,
            "cocontraction_percent": self.cocontraction_percent,
            "active_stretches": " / ".join(map(_in_words, self.stretches)),
            "active_kept": self.kept,
        }

    def document(self) -> dict[str, Any]:
        """Return the same as documents have it: each stretch with its numbers."""
        return self.row() | {"active_stretches": [one._asdict() for one in self.stretches]}


def activity_from(row: Mapping[str, Any]) -> Activity | None:
    """Return the activity of a document's row; None where there was no EMG."""
    if "active_stretches" not in row:
        return None
    names = ("active_percent", "active_left_out_percent", "cocontraction_percent")
    found: list[Any] = [math.nan if row[name] is None else float(row[name]) for name in names]
    found.append(row.get("active_kept", ""))
    return Activity(tuple(ActiveStretch(**one) for one in row["active_stretches"]), *found)


def _in_words(one: ActiveStretch) -> str:
    locked = ", with the motion" if one.locked else ""
    return f"{one.start_s:.4g} to {one.stop_s:.4g} s {one.channel}{locked}"
