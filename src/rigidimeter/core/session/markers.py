"""What happened in a session as markers: short texts for the marker streams of other programs.

A marker is a list of words with `/` between them, as MNE-Python selects events:
``epoch_start/3/prbs/DBS``, ``epoch_end/3/success``, ``limit/speed``, ``stop/emergency_stop``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

_WORDS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "session_started": ("session_start", ()),
    "epoch_started": ("epoch_start", ("label", "task", "condition")),
    "epoch_ended": ("epoch_end", ("epoch", "outcome")),
    "session_ended": ("session_end", ("outcome",)),
    "order": ("order", ("command",)),
}
"""By the kind of an event: the marker's first word, and the facts that follow it."""

_LIMITS = ("none", "acceleration", "speed", "position", "latched")


def marker_of(event: Mapping[str, Any]) -> str:
    """Return an event as a marker; one of another kind is named by its kind.

    Examples
    --------
    >>> marker_of({"event": "epoch_started", "label": "3", "task": "prbs", "condition": "DBS"})
    'epoch_start/3/prbs/DBS'
    """
    kind = str(event.get("event", ""))
    first, names = _WORDS.get(kind, (kind, ()))
    words = (str(event.get(name, "")).replace("/", " ") for name in names)
    return "/".join([first, *words])


def sample_markers(
    limited: NDArray[Any], cause: NDArray[Any], before: tuple[int, int], causes: Mapping[int, str]
) -> list[tuple[int, str]]:
    """Return where the guard began to limit and why it stopped, as rows and markers.

    Parameters
    ----------
    limited, cause : array of int, shape (n,)
        Columns of the samples.
    before : (int, int)
        Both in the sample before these.
    causes : mapping of int to str
        The names of the causes.
    """
    found: list[tuple[int, str]] = []
    for column, last, kind in ((limited, before[0], "limit"), (cause, before[1], "stop")):
        changed = np.flatnonzero(np.diff(column.astype(int), prepend=last))
        for row in changed.tolist():
            value = int(column[row])
            if value:
                named = dict(enumerate(_LIMITS)) if kind == "limit" else causes
                found.append((row, f"{kind}/{named.get(value, value)}"))
    return sorted(found, key=lambda each: each[0])
