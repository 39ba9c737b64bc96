"""From the rings into the session folder: what is recorded, and how it is brought there.

The recorder's cursor in a ring moves only when what it read is in the file, so whatever happens to
it, nothing is lost that the ring can hold. It beats its heart between any two writes. What the
system has been given is put on the disk about once a second and at the end of every epoch.

A disk that takes nothing is tried on; the operator is told, and may name another folder. What is
not in the file stays in the ring, and the loop stops the arm before the ring is full. The recorder
goes on as soon as there is room. It gives up only once the session is over and the program was told
to end, or nobody is left to tell it; then the ring stays in memory until `rigidimeter recover`
finds it.
"""

from __future__ import annotations

import math
import os
import shutil
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import json_line
from rigidimeter.core.session import (
    BATCH_S,
    EVENTS,
    SAMPLES,
    SessionWriter,
    read_events,
    read_samples,
)
from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition.processes.ring import ROW, Event
from rigidimeter.rig.acquisition.processes.session_memory import SessionMemory
from rigidimeter.rig.acquisition.processes.status_values import Flag, ProcessCondition, Role

REPORT_S = 5.0
"""How often the operator is told how many samples wait."""


@dataclass(frozen=True)
class RecordingPlan:
    """What is recorded, and where: the arguments of a `SessionWriter`."""

    folder: Path
    settings: Settings
    protocol: tuple[Mapping[str, Any], ...] = ()
    seeds: Mapping[str, int] = field(default_factory=dict)
    virtual: bool = False
    continues: Mapping[str, Any] = field(default_factory=dict)
    about: Mapping[str, Any] = field(default_factory=dict)

    def writer(self) -> SessionWriter:
        """Make the session folder.

        Raises
        ------
        UserError
            If it cannot be made or holds files already.
        """
        return SessionWriter(
            self.folder,
            self.settings,
            self.protocol,
            self.seeds,
            virtual=self.virtual,
            continues=self.continues,
            about=self.about,
        )


@dataclass(frozen=True)
class Patience:
    """How long the processes wait for each other, in s.

    Attributes
    ----------
    poll_s : float
        The recorder looks into the rings so often.
    loop_lost_s : float
        A loop that runs and has not been heard of for so long has stopped answering.
    stopping_s : float
        The same for one that starts or stops, which may wait for a device.
    sync_s : float
        How often what is written is put on the disk.
    disk_s : float
        For how long a disk that takes nothing is still tried once the program was told to end; the
        session then stays in memory.
    hung_s : float
        A process that has not been heard of for so long is ended.
    """

    poll_s: float = BATCH_S
    loop_lost_s: float = 1.0
    stopping_s: float = 10.0
    sync_s: float = 1.0
    disk_s: float = 30.0
    hung_s: float = 8.0


class Recorder:
    """Moves what is in the rings into the folder.

    Parameters
    ----------
    writer : SessionWriter
    shared : SessionMemory
    tick_rate_hz : float
        Sets how many samples make a batch.
    """

    def __init__(
        self,
        writer: SessionWriter,
        shared: SessionMemory,
        tick_rate_hz: float,
    ) -> None:
        self._writer, self._status = writer, shared.status
        self._samples, self._events = shared.samples, shared.events
        self._batch = max(1, int(BATCH_S * tick_rate_hz))
        self._open_epoch: int | None = None
        self._last_time_s = 0.0
        self._own: deque[bytes] = deque()
        self._loss_reported = False
        self.closing = False
        self.ended = False
        self.epoch_ended = False

    def drain(self) -> None:
        """Write all that is there, samples before the event that follows them.

        Raises
        ------
        OSError
            If the disk does not take it; call again, nothing is lost.
        """
        # Samples are looked at first: an event before one of them is there already.
        stop = self._samples.written
        last_event = self._events.written
        while self._events.recorded < last_event and not self.closing:
            event = self._events.get(self._events.recorded)
            self._copy(event.samples_before)
            self._write(event)
        self._copy(stop)
        while self._own:
            self._writer.line(self._own[0])
            self._own.popleft()
        if self.closing and not self.ended:
            self._writer.close_files()
            self.ended = True

    def close(self, reason: str) -> None:
        """Have the next `drain` close an open epoch and the session with fail and a reason."""
        if self.closing:
            return
        self._report_loss()
        if self._open_epoch is not None:
            self._add("epoch_ended", epoch=self._open_epoch, outcome="fail", reason=reason)
        self._add("session_ended", outcome="fail", reason=reason)
        self.closing = True

    def move(self, writer: SessionWriter) -> None:
        """Go on in another folder, which holds all that is in the old one."""
        with suppress(OSError):  # an end that found no room before finds none now
            self._writer.close_files()
        self._writer = writer

    def note(self, kind: str, **facts: Any) -> None:
        """Add an event of the recorder's own."""
        if not self.closing:
            self._add(kind, **facts)

    def _add(self, kind: str, **facts: Any) -> None:
        event = {"event": kind, "time_s": self._last_time_s, **facts}
        self._own.append(json_line(event))

    def _report_loss(self) -> None:
        lost = {"samples": self._samples.refused, "events": self._events.refused}
        if any(lost.values()) and not self._loss_reported:
            self._loss_reported = True
            self._add("record_lost", **lost, reason="the ring before the recorder was full")

    def _copy(self, stop: int) -> None:
        """Write the samples up to number `stop`, a batch at a time."""
        ring = self._samples
        first = ring.recorded
        while first < stop:
            until = min(stop, first + self._batch)
            rows = ring.rows(first, until)
            self._writer.columns({name: rows[name] for name in ROW.names or ()})
            ring.recorded = first = until
            self._last_time_s = float(rows["time_s"][-1])
            self._status.beat(Role.RECORDER)

    def _write(self, event: Event) -> None:
        facts = event.facts
        kind = facts.get("event")
        if kind == "session_ended":
            self._report_loss()
            while self._own:
                self._writer.line(self._own[0])
                self._own.popleft()
        self._writer.line(event.line)
        # At once: whatever fails below, nobody may write it a second time.
        self._events.recorded += 1
        if kind == "session_ended":
            self.closing = True
        elif kind == "epoch_started":
            self._open_epoch = int(facts["epoch"])
        elif kind == "epoch_ended":
            self._open_epoch = None
            self.epoch_ended = True


class FullDisk:
    """What the recorder knows of a disk that takes nothing.

    Parameters
    ----------
    recording : RecordingPlan
    shared : SessionMemory
    patience : Patience
    console_pid : int
        The process that started this one.
    """

    def __init__(
        self, recording: RecordingPlan, shared: SessionMemory, patience: Patience, console_pid: int
    ) -> None:
        self._recording, self._shared, self._patience = recording, shared, patience
        self._console_pid = console_pid
        self._since_s: float | None = None
        self._over_s: float | None = None
        self._reported_s = -math.inf
        self._asked: Path | None = None
        self._refusal = ""

    def takes(self, recorder: Recorder) -> None:
        """Note that a write succeeded."""
        if self._since_s is not None:
            recorder.note("recording_resumed", after_s=round(time.monotonic() - self._since_s, 3))
            self._since_s, self._reported_s, self._refusal = None, -math.inf, ""

    def refuses(self, error: OSError) -> None:
        """Note that a write failed, and tell the operator now and then."""
        now_s = time.monotonic()
        self._since_s = self._since_s or now_s
        if now_s - self._reported_s < REPORT_S:
            return
        self._reported_s = now_s
        folder = self._recording.folder
        free = ""
        with suppress(OSError):
            free = f"{shutil.disk_usage(folder).free / 1e6:.1f} MB are free, "
        note = (
            f"{folder}: nothing can be written there ({error.strerror or error}); "
            f"{free}{self._shared.samples.lag()} samples wait in memory: make room, order "
            f"`save to FOLDER`{self._refusal}, or end with Ctrl-C, and they stay in memory"
        )
        self._shared.status.set_condition(Role.RECORDER, ProcessCondition.TROUBLE, note)

    def other_folder(self) -> SessionWriter | None:
        """Return a writer to the folder that was asked for, with all that is in the old one.

        None if none was asked for since the last call, or that one is refused too.
        """
        asked = self._shared.status.asked_folder()
        if asked is None or asked == self._asked:
            return None
        self._asked, self._reported_s = asked, -math.inf
        old, new = self._recording.folder, replace(self._recording, folder=asked)
        try:
            writer = new.writer()
            # First: the old record may hold the end of the session, and nothing follows that.
            writer.line(json_line({"event": "recording_moved", "from": str(old)}))
            copy_record(old, writer, new, lambda: self._shared.status.beat(Role.RECORDER))
        except (UserError, OSError) as error:
            self._refusal = f" (not {asked}: {error})"
            return None
        self._recording = new
        self._shared.status.show_folder(asked)
        return writer

    def given_up(self, *, over: bool) -> bool:
        """Whether to end although the disk took nothing.

        Parameters
        ----------
        over : bool
            Whether no more samples will come, as far as the record says. A loop that has closed
            the session, of which nothing is in the file, says so itself.
        """
        if self._since_s is None:
            self._over_s = None
            return False
        status, patience = self._shared.status, self._patience
        alone = os.getppid() != self._console_pid
        over = over or status.condition(Role.LOOP) in (
            ProcessCondition.DONE,
            ProcessCondition.FAILED,
        )
        asked = alone or status.flag(Flag.END_ASKED) or status.flag(Flag.ABORT_ASKED)
        if not (over and asked):
            return False
        self._over_s = self._over_s or time.monotonic()
        limit_s = self._recording.settings.loop.console_lost_s if alone else patience.disk_s
        return time.monotonic() - self._over_s > limit_s


def copy_record(
    folder: Path, writer: SessionWriter, recording: RecordingPlan, beat: Callable[[], object]
) -> None:
    """Write the samples and events of a folder to another that has none yet.

    Raises
    ------
    UserError
        If the folder cannot be read.
    OSError
        If the new one takes not all of it.
    """
    samples = read_samples(folder / SAMPLES)
    batch = max(1, int(BATCH_S * recording.settings.rig.tick_rate_hz))
    for first in range(0, samples["tick"].size, batch):
        beat()
        writer.columns({name: column[first : first + batch] for name, column in samples.items()})
    events, _ = read_events(folder / EVENTS)
    for event in events:
        beat()
        writer.line(json_line(event))
