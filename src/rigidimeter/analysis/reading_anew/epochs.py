"""From signals to epochs: cut by the labels of a file or by a length, and at gaps.

Torque is positive when it drives the joint toward positive angle (Eq. 3). A sensor that reports the
reaction of the joint, torque = −(J θ″ + B θ′ + K θ), has the other sign: `Mapping.reaction`.
"""

from __future__ import annotations

from collections.abc import Mapping as Dict
from itertools import pairwise
from typing import Any, NamedTuple, cast, get_args

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.clock import restarts, seconds
from rigidimeter.analysis.reading_anew.columns import Array, Columns, label_text, nearest
from rigidimeter.analysis.reading_anew.gaps import (
    LONGEST_BRIDGED_S,
    Break,
    Loss,
    Rows,
    Track,
    about_breaks,
    about_losses,
    bridged_s,
    find_losses,
    kept_rows,
    longest_s,
    make_track,
)
from rigidimeter.analysis.reading_anew.labels import runs
from rigidimeter.analysis.reading_anew.mapping import Mapping
from rigidimeter.analysis.reading_anew.quantities import EMG, MOTION, QUANTITIES
from rigidimeter.analysis.reading_anew.repeated import (
    SLOWEST_S,
    held_rows,
    knots,
    only_at,
    repeats_text,
    turns_text,
    unwrapped,
)
from rigidimeter.analysis.reading_anew.signals import SENSORS, Signals, in_si
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import MAGNITUDE, MAX_EPOCHS, SAMPLING_RATE_HZ
from rigidimeter.core.records import Channel, Epoch, Notice, Task

LARGEST_EMG_V = 20.0
"""Amplifiers of EMG give at most ±10 V or so."""
ROUNDING_S = 1e-9
"""A file may hold a first stamp and a rate in place of even stamps."""
_COMPLETE = 0.95
_FEWEST = 2


class Stretch(NamedTuple):
    """Rows `start` to `stop` (not included), and the name of the epoch they are."""

    label: str
    start: int
    stop: int


def epochs_of(
    file: Columns, found: Signals, condition: str = ""
) -> tuple[list[Epoch], list[Notice]]:
    """Return the epochs of signals that passed the gate, and what the user should know of them.

    Parameters
    ----------
    file : Columns
    found : Signals
    condition : str
        Of a file without a column of conditions.

    Raises
    ------
    UserError
        If nothing is left to read; the sentence says what would be right.
    """
    values, notices = _channels(file, found)
    clock, bridged = _clock(file, found, values)
    spoken = {name: _spoken(name, found.chosen.columns[name]) for name in values}
    tracks, empty = _tracks(file, found, clock, values, spoken)
    notices = [*empty, *notices, *bridged]
    _check_rate(file.source, found.chosen.columns.get("time"), tracks)
    labels = _labels(file, found, clock)
    stretches, more = _stretches(file.source, clock, labels.get("epoch"), found.said)
    notices += more
    _check_epochs(file.source, len(stretches))
    epochs: list[Epoch] = []
    losses: dict[str, dict[str, list[Loss]]] = {name: {} for name in tracks}
    for stretch in stretches:
        try:
            meaning = _meaning(file, labels, stretch, found.said, condition)
        except UserError as error:  # that epoch is lost, the others are not
            notices.append(Notice("error", f"{error}; the epoch was left out"))
            continue
        present, more = _present(file.source, tracks, stretch)
        notices += more
        breaks: list[Break] = []
        for name, track in present.items():
            losses[name][stretch.label], cut = find_losses(
                track, clock, stretch.start, stretch.stop
            )
            breaks += cut
        pieces, more = _pieces(file.source, spoken, present, clock, stretch, breaks)
        notices += more
        _check_epochs(file.source, len(epochs) + len(pieces))
        epochs += [
            Epoch(
                file.source,
                label,
                channels,
                condition=meaning[0],
                task=meaning[1],
                virtual=file.virtual,
            )
            for label, channels in pieces
        ]
    for name, by_epoch in losses.items():
        notices += about_losses(file.source, spoken[name], by_epoch)
    if not epochs:
        reasons = "; ".join(notice.text for notice in notices if notice.level == "error")
        more_text = f" ({reasons.replace(f'{file.source}: ', '')})" if reasons else ""
        raise UserError(f"{file.source}: nothing is left to read{more_text}")
    return epochs, notices


def _channels(file: Columns, found: Signals) -> tuple[dict[str, Array], list[Notice]]:
    """Return the channels in SI by quantity, NaN where there is no sample, and what was changed."""
    texts: list[str] = []
    values: dict[str, Array] = {}
    for name, to_si in found.chosen.to_si.items():
        if name in found.raw and name != "time":
            values[name] = in_si(found.raw[name], to_si)
    for name in (one for one in EMG if one in values):
        emg = np.abs(values[name])
        largest = float(np.max(emg, initial=0.0, where=np.isfinite(emg)))
        if largest > LARGEST_EMG_V:
            reaches = f"{QUANTITIES[name].stored} reaches {largest:.4g} V"
            texts.append(f"{reaches}, which looks like microvolts: say --unit {name}=uV")
    if "angle" in values:
        values["angle"], n_turns = unwrapped(values["angle"])
        if n_turns:
            texts.append(f"column {found.chosen.columns['angle']!r} {turns_text(n_turns)}")
    for name in (one for one in (*MOTION[::-1], "torque") if one in values):
        held = rows = held_rows(values[name])
        if not rows.size and name == "angle":  # a velocity bends where the torque steps
            rows = knots(values[name])
        time_s = found.clock_s(file, name)
        if rows.size and time_s[rows[1]] - time_s[rows[0]] <= SLOWEST_S:
            moves = name in MOTION
            if moves:
                values[name] = only_at(values[name], rows)
            text = repeats_text(rows, held=bool(held.size), moves=moves)
            texts.append(f"column {found.chosen.columns[name]!r} {text}")
    if found.said.reaction:
        values["torque"] = -values["torque"]
    notices = [Notice("warning", f"{file.source}: {text}") for text in texts]
    return values, notices + [Notice("error", text) for text in found.strays]


def _clock(file: Columns, found: Signals, values: Dict[str, Array]) -> tuple[Rows, list[Notice]]:
    """Return the clock of all channels, with a warning where it pauses for less than the motion."""
    clocks: list[Array] = []
    for name in values:
        own_s = found.clock_s(file, name)
        if not any(own_s is one or np.array_equal(own_s, one) for one in clocks):
            clocks.append(own_s)
    # Sorted runs are merged in linear time.
    merged = clocks[0] if len(clocks) == 1 else np.sort(np.concatenate(clocks), kind="stable")
    if len(clocks) > 1:
        merged = merged[np.concatenate(([True], np.diff(merged) > 0))]
    clock = Rows.of(merged)
    if not clock.gaps.size:
        return clock, []
    channels = []
    for name in (one for one in SENSORS if one in values):
        finite = np.isfinite(values[name])
        channels.append((found.clock_s(file, name)[finite], values[name][finite]))
    pauses = np.diff(merged)[clock.gaps]
    longest = bridged_s(channels) if pauses.min() <= LONGEST_BRIDGED_S else 0.0
    bridged = pauses[pauses <= longest]
    if not bridged.size:
        return clock, []
    text = f"the clock pauses {bridged.size} times for up to {seconds(float(bridged.max()))}"
    text = f"{file.source}: {text}; torque and motion are slow enough to be interpolated there"
    return Rows.of(merged, longest), [Notice("warning", text)]


def _tracks(
    file: Columns, found: Signals, clock: Rows, values: Dict[str, Array], spoken: Dict[str, str]
) -> tuple[dict[str, Track], list[Notice]]:
    """Place the channels on the clock of all; one without a single number is left out."""
    tracks: dict[str, Track] = {}
    empty: list[str] = []
    for name, channel in values.items():
        track = make_track(QUANTITIES[name].stored, clock, found.clock_s(file, name), channel)
        _check_magnitude(file.source, spoken[name], track.values)
        if track.values.size:
            tracks[name] = track
        else:
            empty.append(spoken[name])
    if not _enough(tracks):
        raise UserError(
            f"{file.source}: {' and '.join(empty)} has no number in any row; an estimate needs "
            "the torque and the angle or its velocity"
        )
    texts = [f"{file.source}: {name} has no number in any row; it was left out" for name in empty]
    return tracks, [Notice("error", text) for text in texts]


def _check_epochs(source: str, n_epochs: int) -> None:
    if n_epochs > MAX_EPOCHS:
        raise UserError(
            f"{source}: has more than {MAX_EPOCHS} epochs or pieces between gaps; check the epoch "
            "column and the time, or split the recording"
        )


def _check_rate(source: str, name: str | None, tracks: Dict[str, Track]) -> None:
    """Refuse impossible rates of a channel; rows of different clocks may be any time apart."""
    low_hz, high_hz = SAMPLING_RATE_HZ
    step_s = min(track.step_s for track in tracks.values())
    if not 1 / high_hz <= step_s <= 1 / low_hz:
        stamps = f"the stamps of {name}" if name else "the sampling rate"
        raise UserError(
            f"{source}: {stamps} give samples that are {step_s:g} s apart; a recording must "
            f"have from {low_hz:g} to {high_hz:g} Hz, so check the unit of the time stamps (s)"
        )


def _check_magnitude(source: str, column: str, values: Array) -> None:
    """Refuse values whose powers or reciprocals are no doubles."""
    least, most = MAGNITUDE
    amplitude = max(float(np.max(values, initial=0.0)), -float(np.min(values, initial=0.0)))
    if amplitude and not least <= amplitude <= most:
        raise UserError(
            f"{source}: the largest value of {column} is {amplitude:g}; it must be from {least:g} "
            f"to {most:g} in SI units, or 0 throughout"
        )


def _labels(file: Columns, found: Signals, clock: Rows) -> dict[str, NDArray[Any]]:
    """Return the labels of every row, by what they label."""
    labels: dict[str, NDArray[Any]] = {}
    n_rows = clock.time_s.size
    for label, name in found.chosen.labels.items():
        if name not in file.columns:
            labels[label] = np.full(n_rows, file.facts[name], dtype=object)
            continue
        column = file.columns[name]
        own_s = file.clocks[column.clock] if column.clock else found.rows_s
        values = column.read()
        if name == found.chosen.columns.get("time"):
            values = _runs_of_time(values)
        if own_s.size != n_rows:  # a label holds until the next row of its clock
            before = np.searchsorted(own_s, clock.time_s, side="right") - 1
            values = values[np.clip(before, 0, None)]
        labels[label] = values
    for label in dict.fromkeys(key for one in file.intervals for key in one.labels):
        if label not in labels:
            labels[label] = _painted(file, label, clock.time_s)
    return labels


def _runs_of_time(time: Array) -> Array:
    """Return the number of the run in which each row is, of a time that starts anew."""
    starts = restarts(time)
    return np.repeat(np.arange(1.0, starts.size + 2), np.diff(starts, prepend=0, append=time.size))


def _painted(file: Columns, label: str, time_s: Array) -> NDArray[Any]:
    """Return the labels of intervals on a clock; outside all of them there is none."""
    column = np.full(time_s.size, "", dtype=object)
    for one in file.intervals:
        span = (one.start_s - ROUNDING_S, one.stop_s + ROUNDING_S)
        # A rest may share its first sample with the epoch before it.
        if text := label_text(one.labels.get(label, "")):
            column[slice(*np.searchsorted(time_s, span))] = text
    return column


def _stretches(
    source: str, clock: Rows, labels: NDArray[Any] | None, said: Mapping
) -> tuple[list[Stretch], list[Notice]]:
    if labels is not None:
        stretches, notices = _by_label(source, clock.time_s, labels)
        if said.epoch_length_s is not None:
            text = f"{source}: epochs are those of its epoch column, not --epoch-length-s"
            notices.insert(0, Notice("warning", text))
        return stretches, notices
    if said.epoch_length_s is not None:
        return _by_length(source, clock, said.epoch_length_s)
    return [Stretch("1", 0, clock.time_s.size)], []


def _by_label(
    source: str, time_s: Array, column: NDArray[Any]
) -> tuple[list[Stretch], list[Notice]]:
    """Cut where the label changes; rows without a label are rest and belong to no stretch.

    A label that returns after something else is another epoch: the second run of `1` is named
    `1 (2)`, and a notice says so.
    """
    found = runs(column, 2 * MAX_EPOCHS)
    if not found:
        raise UserError(
            f"{source}: the epoch column changes more than {2 * MAX_EPOCHS} times; name the column "
            "of the epochs with --column epoch=NAME"
        )
    stretches: list[Stretch] = []
    notices: list[Notice] = []
    times_seen: dict[str, int] = {}
    for label, start, stop in found:
        if not label:
            continue
        times_seen[label] = times_seen.get(label, 0) + 1
        name = label
        if times_seen[label] > 1:
            name = f"{label} ({times_seen[label]})"
            text = (
                f"{source}: epoch {label} occurs again at {seconds(float(time_s[start]))} after "
                f"other rows; this run is read as epoch {name}"
            )
            notices.append(Notice("warning", text))
        stretches.append(Stretch(name, start, stop))
    if not stretches:
        raise UserError(
            f"{source}: the epoch column is empty in every row, which means rest; label the rows "
            "of each epoch"
        )
    return stretches, notices


def _by_length(source: str, clock: Rows, length_s: float) -> tuple[list[Stretch], list[Notice]]:
    """Cut into consecutive stretches of one length by the clock, named `1`, `2` and so on.

    The last one may be up to 5 % short; what is shorter is left out, and a notice says how much.
    """
    time_s, step_s = clock.time_s, clock.step_s
    elapsed = time_s - time_s[0]
    if not elapsed[-1] + step_s <= MAX_EPOCHS * length_s:
        lasts = f"{source} lasts {seconds(float(elapsed[-1]))}, more than {MAX_EPOCHS} epochs"
        raise UserError(f"{lasts} of --epoch-length-s {length_s:g}; give a longer one")
    # A quarter of an interval keeps a stamp that rounding put just before its boundary.
    index = np.floor((elapsed + 0.25 * step_s) / length_s).astype(np.int64)
    starts = np.flatnonzero(np.diff(index, prepend=-1))
    stops = np.append(starts[1:], time_s.size)
    stretches = [
        Stretch(str(index[start] + 1), int(start), int(stop))
        for start, stop in zip(starts, stops, strict=True)
    ]
    notices = _gaps_between(source, time_s, stretches, step_s)
    last = stretches[-1]
    # The file ends one interval after its last stamp.
    left_s = float(elapsed[-1]) + step_s - int(index[-1]) * length_s
    if left_s < _COMPLETE * length_s:
        text = f"{source}: the last {seconds(left_s)}, from {seconds(float(time_s[last.start]))} on"
        text += f", are shorter than an epoch of {length_s:g} s and were left out"
        notices.append(Notice("warning", text))
        stretches = stretches[:-1]
    if not stretches:
        lasts = f"{source} lasts {seconds(left_s)}, less than one epoch"
        raise UserError(f"{lasts} of --epoch-length-s {length_s:g}")
    return stretches, notices


def _gaps_between(
    source: str, time_s: Array, stretches: list[Stretch], step_s: float
) -> list[Notice]:
    """Report gaps that fall on a boundary, where no epoch is cut because of them."""
    notices = []
    for before, after in pairwise(stretches):
        start_s, stop_s = float(time_s[before.stop - 1]), float(time_s[after.start])
        if stop_s - start_s > longest_s(step_s):
            gap = f"{source}: a gap of {seconds(stop_s - start_s)} from {seconds(start_s)} on"
            text = f"{gap} lies between epochs {before.label} and {after.label}"
            notices.append(Notice("warning", text))
    return notices


def _meaning(
    file: Columns, labels: Dict[str, NDArray[Any]], stretch: Stretch, said: Mapping, condition: str
) -> tuple[str, Task | None]:
    """Return condition and task of a stretch: what the file says, or else the user."""
    stated = {
        name: _constant(file, name, labels[name], stretch)
        for name in ("condition", "task")
        if name in labels
    }
    task = stated.get("task", "").lower()
    known = get_args(Task)
    if task and task not in known:
        raise UserError(
            f"{file.source}, epoch {stretch.label}: task {stated['task']} is not known; it must be "
            f"{' or '.join(known)} (the nearest is {nearest(task, known)})"
        )
    return stated.get("condition") or condition, cast("Task", task) if task else said.task


def _constant(file: Columns, name: str, column: NDArray[Any], stretch: Stretch) -> str:
    """Return the one label that a column has within a stretch, or nothing if it has none.

    Raises
    ------
    UserError
        If the label changes within the stretch.
    """
    seen = ""
    for label, start, _ in runs(column[stretch.start : stretch.stop]):
        if seen and label and label != seen:
            raise UserError(
                f"{file.where(stretch.start + start)}: {name} changes from {seen} to {label} "
                f"within epoch {stretch.label}; it must stay the same throughout an epoch"
            )
        seen = seen or label
    return seen


def _present(
    source: str, tracks: Dict[str, Track], stretch: Stretch
) -> tuple[dict[str, Track], list[Notice]]:
    """Return the channels that have samples in a stretch; none if they make no epoch."""
    present = {
        name: track
        for name, track in tracks.items()
        if track.values[track.within(stretch.start, stretch.stop)].size
    }
    absent = [QUANTITIES[name].stored for name in tracks if name not in present]
    if not absent:
        return present, []
    text = f"{source}, epoch {stretch.label}: {' and '.join(absent)} has no number in any row; " + (
        "it was left out" if _enough(present) else "the epoch was not read"
    )
    return present if _enough(present) else {}, [Notice("error", text)]


def _enough(names: Dict[str, object]) -> bool:
    return "torque" in names and any(name in names for name in MOTION)


def _pieces(
    source: str,
    spoken: Dict[str, str],
    tracks: Dict[str, Track],
    clock: Rows,
    stretch: Stretch,
    breaks: list[Break],
) -> tuple[list[tuple[str, dict[str, Channel]]], list[Notice]]:
    """Cut the channels of a stretch at its breaks; what is too short to be an epoch is left out."""
    if not tracks:
        return [], []
    pieces: list[dict[str, Channel]] = []
    notices: list[Notice] = []
    for start, stop in kept_rows(stretch.start, stretch.stop, breaks):
        within = {name: track.within(start, stop) for name, track in tracks.items()}
        channels = {
            name: Channel(
                QUANTITIES[name].stored,
                track.time_s[within[name]],
                track.values[within[name]],
                spoken[name],
            )
            for name, track in tracks.items()
            if within[name].stop - within[name].start >= _FEWEST
        }
        lacking = [QUANTITIES[name].stored for name in tracks if name not in channels]
        enough = _enough(channels)
        if enough:
            pieces.append({channel.name: channel for channel in channels.values()})
        if lacking:
            what = "they were" if len(lacking) > 1 else "it was"
            left = f"{what} left out there" if enough else "these rows were left out"
            span = (float(clock.time_s[start]), float(clock.time_s[stop - 1]))
            text = (
                f"{source}, epoch {stretch.label}: {' and '.join(lacking)} has fewer than "
                f"{_FEWEST} samples from {seconds(span[0])} to {seconds(span[1])}; {left}"
            )
            notices.append(Notice("warning", text))
    labels = _lettered(stretch.label, len(pieces))
    said = about_breaks(source, stretch.label, breaks, labels, len(tracks))
    return list(zip(labels, pieces, strict=True)), said + notices


def _lettered(label: str, pieces: int) -> list[str]:
    """Name the pieces of an epoch: `3a`, `3b` and so on, or `3` if there is only one."""
    return [label] if pieces == 1 else [label + _letters(index) for index in range(pieces)]


def _letters(index: int) -> str:
    rest, last = divmod(index, 26)
    return (_letters(rest - 1) if rest else "") + chr(ord("a") + last)


def _spoken(name: str, column: str) -> str:
    stored = QUANTITIES[name].stored
    return stored if stored == column else f"{stored} (column {column})"
