"""From a table of columns to epochs: the pure core of reading other people's recordings.

The readers turn a file into a `Table`; what follows is the same for all of them. Torque is positive
when it drives the joint toward positive angle (Eq. 3). A sensor that reports the reaction of the
joint, torque = −(J θ'' + B θ' + K θ), has the other sign: `ReadOptions.reaction`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, cast, get_args

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.channels.channels_of_table import TableChannels, channels_of_table
from rigidimeter.analysis.reading.channels.choice import LABELS, MOTION
from rigidimeter.analysis.reading.formats.columns import seconds
from rigidimeter.analysis.reading.formats.cutting import (
    Stretch,
    by_label,
    by_length,
    constant_label,
    lettered,
)
from rigidimeter.analysis.reading.formats.gaps import (
    Break,
    Loss,
    Rows,
    Signal,
    about_breaks,
    about_losses,
    find_losses,
    kept_rows,
    longest_s,
    make_signal,
)
from rigidimeter.analysis.reading.formats.pauses import bridged_s
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table, nearest
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import MAGNITUDE, MAX_EPOCHS, SAMPLING_RATE_HZ
from rigidimeter.core.records import Channel, Epoch, Notice, Task

_FEWEST = 2


def epochs_from_table(table: Table, options: ReadOptions) -> tuple[list[Epoch], list[Notice]]:
    """Return the epochs of a table, and what the user should know of them.

    Raises
    ------
    UserError
        If the table cannot be read as a recording; the sentence says what would be right.
    """
    read = channels_of_table(table, options)
    names, n_rows = read.names, read.time_s.size
    clock, bridged = _clock(table.source, read)
    signals, notices = _signals(table.source, read, clock)
    _check_rate(table.source, names.get("time_s"), signals.values())
    labels = {name: _label_column(table, names[name], n_rows) for name in LABELS if name in names}
    notices += bridged
    stretches, more = _stretches(table, clock, labels.get("epoch"), options.epoch_length_s)
    notices += more
    _check_epochs(table.source, len(stretches))
    epochs: list[Epoch] = []
    spoken = {name: _spoken(name, names[name]) for name in signals}
    losses: dict[str, dict[str, list[Loss]]] = {name: {} for name in signals}
    for stretch in stretches:
        try:
            condition, task = _meaning(table, labels, stretch, options)
        except UserError as error:  # that epoch is lost, the others are not
            notices.append(Notice("error", f"{error}; the epoch was left out"))
            continue
        present, more = _present(table.source, signals, stretch)
        notices += more
        breaks: list[Break] = []
        for name, signal in present.items():
            losses[name][stretch.label], found = find_losses(
                signal, clock, stretch.start, stretch.stop
            )
            breaks += found
        pieces, more = _pieces(table.source, spoken, present, clock, stretch, breaks)
        notices += more
        _check_epochs(table.source, len(epochs) + len(pieces))
        epochs += [
            Epoch(
                table.source, label, channels, condition=condition, task=task, virtual=table.virtual
            )
            for label, channels in pieces
        ]
    for name, by_epoch in losses.items():
        notices += about_losses(table.source, spoken[name], by_epoch)
    if not epochs:
        reasons = "; ".join(notice.text for notice in notices if notice.level == "error")
        raise UserError(
            f"{table.source}: nothing is left to read"
            + (f" ({reasons.replace(f'{table.source}: ', '')})" if reasons else "")
        )
    return epochs, notices


def _clock(source: str, read: TableChannels) -> tuple[Rows, list[Notice]]:
    """Return the clock of the rows, and a warning where it pauses for less than the motion asks."""
    clock = Rows.of(read.time_s)
    shortest_s = longest_s(clock.step_s)
    pauses = np.diff(read.time_s)
    pauses = pauses[pauses > shortest_s]
    if not pauses.size:
        return clock, []
    channels = [
        (read.time_s[finite], values[finite])
        for name in ("torque_nm", *MOTION)
        if (values := read.values.get(name)) is not None
        for finite in [np.isfinite(values)]
    ]
    longest = bridged_s(channels)
    bridged = pauses[pauses <= longest]
    if not bridged.size:
        return clock, []
    text = (
        f"{source}: the clock pauses {bridged.size} times for up to {seconds(float(bridged.max()))}"
        "; torque and motion are slow enough to be interpolated there"
    )
    return Rows.of(read.time_s, longest), [Notice("warning", text)]


def _check_epochs(source: str, n_epochs: int) -> None:
    if n_epochs > MAX_EPOCHS:
        raise UserError(
            f"{source}: has more than {MAX_EPOCHS} epochs or pieces between gaps; check the epoch "
            "column and the time, or split the recording"
        )


def _check_rate(source: str, name: str | None, signals: Iterable[Signal]) -> None:
    """Refuse impossible rates of a channel; rows of different clocks may be any time apart."""
    low_hz, high_hz = SAMPLING_RATE_HZ
    step_s = min(signal.step_s for signal in signals)
    if not 1 / high_hz <= step_s <= 1 / low_hz:
        stamps = f"the stamps of {name}" if name else "the sampling rate"
        raise UserError(
            f"{source}: {stamps} give samples that are {step_s:g} s apart; a recording must "
            f"have from {low_hz:g} to {high_hz:g} Hz, so check the unit of the time stamps (s)"
        )


def _signals(
    source: str, read: TableChannels, clock: Rows
) -> tuple[dict[str, Signal], list[Notice]]:
    """Take the samples of each channel; one without a single number is left out."""
    signals: dict[str, Signal] = {}
    empty: list[str] = []
    for name, values in read.values.items():
        spoken = _spoken(name, read.names[name])
        signal = make_signal(name, clock, values)
        _check_magnitude(source, spoken, signal)
        if signal.values.size:
            signals[name] = signal
        else:
            empty.append(spoken)
    if "torque_nm" not in signals or not any(name in signals for name in MOTION):
        raise UserError(
            f"{source}: {' and '.join(empty)} has no number in any row; an estimate needs "
            "the torque and the angle or its velocity"
        )
    return signals, [
        *(
            Notice("error", f"{source}: {name} has no number in any row; it was left out")
            for name in empty
        ),
        *read.notices,
    ]


def _check_magnitude(source: str, column: str, signal: Signal) -> None:
    """Refuse values whose powers or reciprocals are no doubles."""
    least, most = MAGNITUDE
    amplitude = float(np.max(np.abs(signal.values), initial=0.0))
    if amplitude and not least <= amplitude <= most:
        raise UserError(
            f"{source}: the largest value of {column} is {amplitude:g}; it must be from {least:g} "
            f"to {most:g} in SI units, or 0 throughout"
        )


def _label_column(table: Table, name: str, n_rows: int) -> NDArray[Any]:
    """Return a column of labels; a single value stands for every row."""
    if name in table.columns:
        return table.columns[name]
    return np.full(n_rows, table.scalars[name], dtype=object)


def _stretches(
    table: Table, clock: Rows, labels: NDArray[Any] | None, length_s: float | None
) -> tuple[list[Stretch], list[Notice]]:
    if labels is not None:
        stretches, notices = by_label(table.source, clock.time_s, labels)
        if length_s is not None:
            text = f"{table.source}: epochs are those of its epoch column, not --epoch-length-s"
            notices.insert(0, Notice("warning", text))
        return stretches, notices
    if length_s is not None:
        return by_length(table.source, clock, length_s)
    return [Stretch("1", 0, clock.time_s.size)], []


def _meaning(
    table: Table, labels: Mapping[str, NDArray[Any]], stretch: Stretch, options: ReadOptions
) -> tuple[str, Task | None]:
    """Return condition and task of a stretch: what the file says, or else the options."""
    said = {
        name: constant_label(table, name, labels[name], stretch)
        for name in ("condition", "task")
        if name in labels
    }
    task = said.get("task", "").lower()
    known = get_args(Task)
    if task and task not in known:
        raise UserError(
            f"{table.source}, epoch {stretch.label}: task {said['task']} is not known; it must be "
            f"{' or '.join(known)} (the nearest is {nearest(task, known)})"
        )
    return said.get("condition") or options.condition, cast("Task", task) if task else options.task


def _present(
    source: str, signals: Mapping[str, Signal], stretch: Stretch
) -> tuple[dict[str, Signal], list[Notice]]:
    """Return the signals that have samples in a stretch; none if they make no epoch."""
    present = {
        name: signal
        for name, signal in signals.items()
        if signal.rows[signal.within(stretch.start, stretch.stop)].size
    }
    absent = [name for name in signals if name not in present]
    if not absent:
        return present, []
    enough = _enough(present)
    text = f"{source}, epoch {stretch.label}: {' and '.join(absent)} has no number in any row; " + (
        "it was left out" if enough else "the epoch was not read"
    )
    return present if enough else {}, [Notice("error", text)]


def _enough(names: Mapping[str, object]) -> bool:
    return "torque_nm" in names and any(name in names for name in MOTION)


def _pieces(
    source: str,
    spoken: Mapping[str, str],
    signals: Mapping[str, Signal],
    clock: Rows,
    stretch: Stretch,
    breaks: list[Break],
) -> tuple[list[tuple[str, dict[str, Channel]]], list[Notice]]:
    """Cut the signals of a stretch at its breaks; what is too short to be an epoch is left out."""
    if not signals:
        return [], []
    kept: list[dict[str, Channel]] = []
    notices: list[Notice] = []
    for start, stop in kept_rows(stretch.start, stretch.stop, breaks):
        channels = {
            name: Channel(name, signal.time_s[within], signal.values[within], spoken[name])
            for name, signal in signals.items()
            for within in [signal.within(start, stop)]
            if within.stop - within.start >= _FEWEST
        }
        lacking = [name for name in signals if name not in channels]
        if _enough(channels):
            kept.append(channels)
        if lacking:
            what = "they were" if len(lacking) > 1 else "it was"
            text = (
                f"{source}, epoch {stretch.label}: {' and '.join(lacking)} has fewer than "
                f"{_FEWEST} samples from {seconds(float(clock.time_s[start]))} to "
                f"{seconds(float(clock.time_s[stop - 1]))}; "
                + (f"{what} left out there" if _enough(channels) else "these rows were left out")
            )
            notices.append(Notice("warning", text))
    labels = lettered(stretch.label, len(kept))
    said = about_breaks(source, stretch.label, breaks, labels, len(signals))
    return list(zip(labels, kept, strict=True)), said + notices


def _spoken(standard: str, name: str) -> str:
    return standard if standard == name else f"{standard} (column {name})"
