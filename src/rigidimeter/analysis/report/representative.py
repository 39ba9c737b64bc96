"""How a figure names the epoch that it shows, and where its time begins."""

from __future__ import annotations

import re

from rigidimeter.analysis.study import StudyResult
from rigidimeter.core.records import Epoch, Fit, Score
from rigidimeter.core.words import short_names


def place(result: StudyResult, one: Fit | Score) -> str:
    """Return epoch and source, since sessions use the same labels."""
    names = short_names(epoch.source for epoch in result.epochs)
    return f"epoch {one.epoch} of {names.get(one.source, one.source)}"


def origin_s(epoch: Epoch) -> float:
    """Return when the first channel begins."""
    return min(float(channel.time_s[0]) for channel in epoch.channels.values() if len(channel))


def slug(condition: str) -> str:
    """Return a name that every file system takes; two conditions may get the same one."""
    return re.sub(r"[^A-Za-z0-9]+", "-", condition).strip("-").lower()[:40] or "unnamed"
