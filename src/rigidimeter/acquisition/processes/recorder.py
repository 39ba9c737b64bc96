"""The recorder's process: from the rings into the session folder.

Its cursor in a ring moves only when what it read is in the file, so whatever happens to it, nothing
is lost that the ring can hold. It beats its heart between any two writes. What the system has been
given is put on the disk about once a second and at the end of every epoch, by a thread of its own:
a slow disk may hold that up for long.

A disk that does not take a write is tried again and again, and the operator told so. When the loop
has ended, or is not heard of, the session is closed with that as the reason.
"""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rigidimeter.acquisition.processes.board import Board, Condition, Flag, Role
from rigidimeter.acquisition.processes.ring import ROW, Event, EventRing, SampleRing
from rigidimeter.acquisition.processes.watched import Watched, leave_signals_to_the_console
from rigidimeter.errors import UserError
from rigidimeter.recording.folder import SessionWriter
from rigidimeter.recording.log import BATCH_S
from rigidimeter.settings import Settings

__all__ = ["Patience", "Recorder", "Recording", "recorder_main"]


@dataclass(frozen=True)
class Recording:
    """What is recorded, and where: the arguments of a `SessionWriter`."""

    folder: Path
    settings: Settings
    protocol: tuple[Mapping[str, Any], ...] = ()
    seeds: Mapping[str, int] = field(default_factory=dict)
    virtual: bool = False
    continues: Mapping[str, Any] = field(default_factory=dict)

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
        For how long a disk that takes nothing is tried after the loop has ended.
    hung_s : float
        A process that has not been heard of for so long is ended.
    console_lost_s, recorder_lost_s : float
        After how long the loop stops because of them.
    """

    look_s: float = BATCH_S
    loop_lost_s: float = 1.0
    stopping_s: float = 10.0
    sync_s: float = 1.0
    disk_s: float = 60.0
    hung_s: float = 8.0
    console_lost_s: float = 1.0
    recorder_lost_s: float = 5.0


class _Syncing:
    """A thread that has files put on the disk when asked; it may hang, the asker does not."""

    def __init__(self, descriptors: tuple[int, ...], board: Board) -> None:
        # Copies, so that a file that is closed meanwhile is not mistaken for another.
        self._descriptors = tuple(os.dup(descriptor) for descriptor in descriptors)
        self._board = board
        self._asked = threading.Semaphore(0)
        self._ending = False
        self.busy = False
        self._samples = 0
        self.error = ""
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def ask(self, samples: int) -> None:
        if not self.busy:
            self.busy = True
            self._samples = samples
            self._asked.release()

    def _run(self) -> None:
        while True:
            self._asked.acquire()
            if self._ending:
                return
            try:
                for descriptor in self._descriptors:
                    os.fsync(descriptor)
                self._board.synced_samples = self._samples
                self.error = ""
            except OSError as error:
                self.error = error.strerror or str(error)
            self.busy = False

    def close(self) -> None:
        self._ending = True
        self._asked.release()
        self._thread.join(timeout=1.0)
        if not self._thread.is_alive():
            for descriptor in self._descriptors:
                os.close(descriptor)


class Recorder:
    """Moves what is in the rings into the folder.

    Parameters
    ----------
    writer : SessionWriter
    samples : SampleRing
    events : EventRing
    board : Board
    tick_rate_hz : float
        Sets how many samples make a batch.
    """

    def __init__(
        self,
        writer: SessionWriter,
        samples: SampleRing,
        events: EventRing,
        board: Board,
        tick_rate_hz: float,
    ) -> None:
        self._writer, self._samples, self._events, self._board = writer, samples, events, board
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

    def note(self, kind: str, **facts: Any) -> None:
        """Add an event of the recorder's own."""
        if not self.closing:
            self._tell(kind, **facts)

    def _tell(self, kind: str, **facts: Any) -> None:
        event = {"event": kind, "time_s": self._last_time_s, **facts}
        self._own.append(json.dumps(event, ensure_ascii=False, allow_nan=False).encode() + b"\n")

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
            self._board.beat(Role.RECORDER)

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


def recorder_main(
    recording: Recording, names: tuple[str, str, str], patience: Patience, console_pid: int
) -> None:
    """Record until the session is closed; the target of the recorder's process.

    Parameters
    ----------
    recording : Recording
    names : tuple of str
        Of the sample ring, the event ring and the board.
    patience : Patience
    console_pid : int
        The process that started this one.
    """
    leave_signals_to_the_console()
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # it ends with the session, not before
    samples, events = SampleRing.attach(names[0]), EventRing.attach(names[1])
    board = Board.attach(names[2])
    board.join(Role.RECORDER)
    try:
        writer = recording.writer()
        board.set_condition(Role.RECORDER, Condition.READY, "")
        rate_hz = recording.settings.rig.tick_rate_hz
        recorder = Recorder(writer, samples, events, board, rate_hz)
        ended_well = _record(recorder, writer, board, samples, patience, recording, console_pid)
        board.set_condition(Role.RECORDER, Condition.DONE if ended_well else Condition.FAILED)
    except UserError as error:
        board.set_condition(Role.RECORDER, Condition.FAILED, str(error))
        sys.exit(1)
    except BaseException as error:
        board.set_condition(
            Role.RECORDER, Condition.FAILED, f"the recorder failed: {type(error).__name__}: {error}"
        )
        traceback.print_exc()
        sys.exit(1)
    finally:
        if os.getppid() != console_pid and not _loop_lives(board):
            for memory in (samples.memory, events.memory, board.memory):
                memory.unlink()
        for part in (samples, events, board):
            part.close()


def _loop_lives(board: Board) -> bool:
    pid = board.pid(Role.LOOP)
    return bool(pid) and Watched(pid).alive()


def _record(
    recorder: Recorder,
    writer: SessionWriter,
    board: Board,
    samples: SampleRing,
    patience: Patience,
    recording: Recording,
    console_pid: int,
) -> bool:
    """Record until the session is closed; return whether it is in the files."""
    syncing = _Syncing(writer.descriptors(), board)
    loop: Watched | None = None
    since_s: float | None = None  # the disk has taken nothing since then
    over_s: float | None = None  # the loop has ended since then
    synced_s = time.monotonic()
    try:
        while True:
            board.beat(Role.RECORDER)
            if loop is None and board.pid(Role.LOOP):
                loop = Watched(board.pid(Role.LOOP))
            why = _loop_lost(board, loop, patience, console_pid)
            now_s = time.monotonic()
            try:
                recorder.drain()
                if why and not recorder.closing:
                    recorder.close(why)
                    recorder.drain()
                if since_s is not None:
                    recorder.note("recording_resumed", after_s=round(now_s - since_s, 3))
                    since_s = None
                board.set_condition(Role.RECORDER, Condition.RUNNING, syncing.error)
            except OSError as error:
                since_s = since_s or now_s
                board.set_condition(
                    Role.RECORDER,
                    Condition.TROUBLE,
                    f"{recording.folder}: nothing can be written there "
                    f"({error.strerror or error}); {samples.lag()} samples wait: make room",
                )
            if recorder.ended:
                return _synced(syncing, board, samples, patience, recording)
            over_s = over_s or (now_s if why or recorder.closing else None)
            if since_s is not None and over_s is not None and now_s - over_s > patience.disk_s:
                return False
            if recorder.epoch_ended or now_s - synced_s >= patience.sync_s:
                recorder.epoch_ended, synced_s = False, now_s
                syncing.ask(samples.recorded)
            time.sleep(patience.look_s)
    finally:
        syncing.close()


def _synced(
    syncing: _Syncing, board: Board, samples: SampleRing, patience: Patience, recording: Recording
) -> bool:
    """Wait until the closed files are on the disk, as long as that is reasonable."""
    until_s = time.monotonic() + patience.disk_s
    asked = False
    while time.monotonic() < until_s:
        board.beat(Role.RECORDER)
        if not syncing.busy:
            if asked and not syncing.error:
                return True
            asked = True
            syncing.ask(samples.recorded)
        time.sleep(0.005)
    board.set_condition(
        Role.RECORDER,
        Condition.TROUBLE,
        f"{recording.folder}: is written, but the disk has not confirmed it",
    )
    return True


def _loop_lost(board: Board, loop: Watched | None, patience: Patience, console_pid: int) -> str:
    """Return why no more samples will come; nothing while they may."""
    if loop is None:
        if os.getppid() != console_pid or board.flag(Flag.END_ASKED):
            return "the loop was never started"
        return ""
    if not loop.alive():
        return "the loop's process ended without closing the session"
    # While it starts it may wait for devices, and nothing moves.
    limits_s = {
        Condition.RUNNING: patience.loop_lost_s,
        Condition.STOPPING: patience.stopping_s,
    }
    limit_s = limits_s.get(board.condition(Role.LOOP), math.inf)
    if board.age_s(Role.LOOP) > limit_s:
        return f"the loop's process did not answer for {limit_s:g} s"
    return ""
