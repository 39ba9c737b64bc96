"""What happened in a session as markers: short texts for the marker streams of other programs.

A marker is a list of words with `/` between them, as MNE-Python selects events:
``epoch_start/3/prbs/DBS``, ``epoch_end/3/success``, ``session_end/success``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_WORDS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "session_started": ("session_start", ()),
    "epoch_started": ("epoch_start", ("label", "task", "condition")),
    "epoch_ended": ("epoch_end", ("epoch", "outcome")),
    "session_ended": ("session_end", ("outcome",)),
    "order": ("order", ("command",)),
}
"""By the kind of an event: the marker's first word, and the facts that follow it."""


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
