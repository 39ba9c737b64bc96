"""From the rings into the session folder: what is recorded, and how it is brought there.

The recorder's cursor in a ring moves only when what it read is in the file, so whatever happens to
it, nothing is lost that the ring can hold. It beats its heart between any two writes. What the
system has been given is put on the disk about once a second and at the end of every epoch.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rigidimeter.core.files import json_line
from rigidimeter.core.session import BATCH_S, SessionWriter
from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition.processes.ring import ROW, Event
from rigidimeter.rig.acquisition.processes.session_memory import SessionMemory
from rigidimeter.rig.acquisition.processes.status_values import Role


@dataclass(frozen=True)
class Recording:
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
    look_s : float
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

    look_s: float = BATCH_S
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
        self._loss_told = False
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
            self._events.recorded += 1
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
        self._tell_loss()
        if self._open_epoch is not None:
            self._tell("epoch_ended", epoch=self._open_epoch, outcome="fail", reason=reason)
        self._tell("session_ended", outcome="fail", reason=reason)
        self.closing = True

    def move(self, writer: SessionWriter) -> None:
        """Go on in another folder, which holds all that is in the old one."""
        with suppress(OSError):  # an end that found no room before finds none now
            self._writer.close_files()
        self._writer = writer

    def note(self, kind: str, **facts: Any) -> None:
        """Add an event of the recorder's own."""
        if not self.closing:
            self._tell(kind, **facts)

    def _tell(self, kind: str, **facts: Any) -> None:
        event = {"event": kind, "time_s": self._last_time_s, **facts}
        self._own.append(json_line(event))

    def _tell_loss(self) -> None:
        lost = {"samples": self._samples.refused, "events": self._events.refused}
        if any(lost.values()) and not self._loss_told:
            self._loss_told = True
            self._tell("record_lost", **lost, reason="the ring before the recorder was full")

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
            self._tell_loss()
            while self._own:
                self._writer.line(self._own[0])
                self._own.popleft()
        self._writer.line(event.line)
        if kind == "session_ended":
            self.closing = True
        elif kind == "epoch_started":
            self._open_epoch = int(facts["epoch"])
        elif kind == "epoch_ended":
            self._open_epoch = None
            self.epoch_ended = True
