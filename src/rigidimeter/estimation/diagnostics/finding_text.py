"""How a check states what it found: value, threshold and meaning in words, and a remedy if wrong.

A check is a pure function that returns one `Finding`. One that passes is a note without a remedy;
one that fails has the level that the settings give to its name.
"""

from __future__ import annotations

from rigidimeter.records import Finding
from rigidimeter.settings import DiagnosticsSettings

__all__ = ["judged"]


def judged(
    name: str,
    value: float,
    threshold: float,
    settings: DiagnosticsSettings,
    *,
    failed: bool,
    fact: str,
    meaning: str,
    remedy: str,
) -> Finding:
    """Return the finding of one check.

    Parameters
    ----------
    name : str
        A key of `[diagnostics.levels]`.
    value, threshold : float
        In the unit that `fact` states.
    settings : DiagnosticsSettings
        For the level.
    failed : bool
        Whether the value is on the wrong side; a value that is not a number has failed.
    fact : str
        Value and threshold in words.
    meaning : str
        What it means if it failed.
    remedy : str
        What to do if it failed.
    """
    if not failed:
        return Finding(name, "note", value, threshold, fact, "")
    return Finding(
        name, getattr(settings.levels, name), value, threshold, f"{fact}: {meaning}", remedy
    )
