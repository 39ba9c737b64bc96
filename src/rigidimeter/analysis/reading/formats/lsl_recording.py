"""A recording of the streams that `rigidimeter run` sends: the samples of a session as received.

The samples are the columns of a session folder; the k-th marker of an epoch's start belongs to the
k-th epoch in them. So the epochs are those of the session folder.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import parse_json
from rigidimeter.core.records import Epoch, Notice, Outcome
from rigidimeter.core.session import Sample, epoch_extents, epoch_of_samples, sample_dtypes
from rigidimeter.core.settings import Settings, recorded_settings

SAMPLES_TYPE = "RobotSamples"
"""The type of the stream of samples."""


def settings_of_samples(described: Mapping[str, Any], source: str) -> Settings:
    """Return the settings that a stream of samples holds.

    Raises
    ------
    UserError
        If they are damaged or missing.
    """
    text = _fact(described, "settings")
    if not text:
        raise UserError(f"{source}: its stream of samples does not hold its settings")
    return recorded_settings(parse_json(text.encode(), f"{source}: settings"), source=source)


def epochs_of_samples(
    source: str,
    columns: Mapping[str, NDArray[np.float64]],
    markers: Sequence[tuple[float, str]],
    described: Mapping[str, Any],
) -> tuple[list[Epoch], list[Notice]]:
    """Return the epochs of a recording of the streams.

    Parameters
    ----------
    source : str
    columns : mapping of str to array, shape (n,)
        By label.
    markers : sequence of (float, str)
        Time and text.
    described : mapping
        What the stream says of itself.

    Raises
    ------
    UserError
        If a column of a session is missing.
    """
    size = max(map(len, columns.values()), default=0)
    # What a stream had not always.
    columns = {n: np.full(size, d) for n, d in Sample._field_defaults.items()} | {**columns}
    missing = [name for name in Sample._fields if name not in columns]
    if missing:
        raise UserError(f"{source}: its stream of samples has no channel {missing[0]}")
    samples = {name: columns[name].astype(kind) for name, kind in sample_dtypes().items()}
    settings = settings_of_samples(described, source)
    notices: list[Notice] = []
    virtual = _fact(described, "virtual") == "true"
    ticks_late = samples["lateness_s"] * settings.rig.tick_rate_hz
    lost = _lost(samples["tick"], ticks_late)
    if lost > 0:
        text = "ticks are not in the recording of the stream; they are in the session folder"
        notices.append(Notice("warning", f"{source}: {lost} {text}"))
    first, last = epoch_extents(samples["epoch"])
    ordered = sorted(markers, key=lambda each: each[0])
    starts = [text.split("/") for _, text in ordered if text.startswith("epoch_start/")]
    ends = {
        words[1]: words[2]
        for _, text in ordered
        if text.startswith("epoch_end/") and len(words := text.split("/")) == 3
    }
    if len(starts) != len(first):
        text = (
            f"{source}: has {len(starts)} markers of an epoch's start, but samples of "
            f"{len(first)} epochs; labels, tasks and conditions are those of the last markers"
        )
        notices.append(Notice("error", text))
        starts = starts[-len(first) :] if first else []
    epochs = []
    for words, number in zip(starts, first, strict=False):
        _, label, task, condition = (*words, "", "", "")[:4]
        outcome = ends.get(str(number), "")
        closed = Outcome()
        if outcome != "success":
            closed = Outcome("excluded", f"it ended with {outcome or 'no marker'}")
        rows = slice(first[number], last[number] + 1)
        started = {"label": label, "task": task, "condition": condition}
        epoch = epoch_of_samples(source, settings, samples, rows, started, closed, virtual=virtual)
        if _lost(samples["tick"][rows], ticks_late[rows]):
            epoch = replace(epoch, ticks=None)  # commands are missing that the drive got
        epochs.append(epoch)
    return epochs, notices


def _lost(tick: NDArray[Any], ticks_late: NDArray[np.float64]) -> int:
    """Return how many samples the recording program did not receive: missed ticks have none."""
    if not tick.size:
        return 0
    return int(tick[-1] - tick[0] + 1 - tick.size - np.sum(np.floor(ticks_late[1:])))


def _fact(described: Mapping[str, Any], name: str) -> str:
    """Return a fact of the element `rigidimeter` of a stream's description."""
    about = (described.get("rigidimeter") or [None])[0] or {}
    return str((about.get(name) or [""])[0] or "")
