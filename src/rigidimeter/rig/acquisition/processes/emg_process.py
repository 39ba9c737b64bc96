"""The process of the EMG: from its source into a file of its own beside the samples.

It waits for source and disk, and nothing waits for it: not the loop, not the recorder. Where the
source gives nothing or breaks off, EMG is missing and nothing else; that is in the shared status at
once, and what is missing is named when the session has ended, and when it is read.
"""

from __future__ import annotations

import math
import os
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import EMG, EmgLog, read_manifest
from rigidimeter.core.settings import EmgSettings, Settings
from rigidimeter.model import ENVELOPE_RATE_HZ, LiveEnvelope, VirtualMuscles
from rigidimeter.rig.acquisition.processes.end_signals import leave_to_the_others
from rigidimeter.rig.acquisition.processes.ring import SampleReader
from rigidimeter.rig.acquisition.processes.session_memory import SessionMemory
from rigidimeter.rig.acquisition.processes.shared_status import SharedStatus
from rigidimeter.rig.acquisition.processes.status_values import ProcessCondition, Role
from rigidimeter.rig.devices.base import EmgSamples, EmgSource

POLL_S = 0.05
NICENESS = 5
STALLED_S = 0.5
"""EMG that is missing for longer is named; where a source sends blocks, for a block longer."""
BLOCKS = 5
"""So many blocks show how long those of a source are: the second longest of them, for one that
waited somewhere says nothing of the next."""
LAST_BLOCK_S = 1.5
"""For so long at most the last block is waited for after the session; the process must end."""
WAITING_S = 60.0
"""So much EMG waits for a disk that takes nothing."""
SYNC_S = 1.0
SHOWN_S = 1.0
"""So much of the envelope is in the shared status."""


class _Events:
    """What the process needs of the events: when the clock began, and which epoch is what."""

    def __init__(self, shared: SessionMemory) -> None:
        self._ring, self._next = shared.events, 0
        self.origin_s: float | None = None
        self.conditions: dict[int, str] = {}

    def follow(self) -> None:
        """Take the events since the last call, those that are still in the ring."""
        written = self._ring.written
        for number in range(max(self._next, written - self._ring.capacity // 2), written):
            facts = self._ring.get(number).facts
            if facts.get("event") == "clock_started":
                self.origin_s = float(facts["monotonic_s"])
            elif facts.get("event") == "epoch_started":
                self.conditions[int(facts["epoch"])] = str(facts["condition"])
        self._next = written


class _Virtual:
    """The EMG of the virtual subject: that of the ticks in the ring."""

    def __init__(self, settings: Settings, shared: SessionMemory, events: _Events) -> None:
        first = settings.subject[settings.protocol.blocks[0].condition]
        self._muscles = VirtualMuscles(settings, first.relaxed)
        self._reader, self._events = SampleReader(shared.samples), events
        self.rate_hz, self._count = settings.emg.rate_hz, 0

    def read(self) -> EmgSamples:
        rows, _ = self._reader.read()
        self._events.follow()  # an epoch's beginning is written before its first tick
        emg_v = self._muscles.take(rows["tick"], rows["epoch"], self._events.conditions)
        source_s = (self._count + np.arange(len(emg_v))) / self.rate_hz
        self._count += len(emg_v)
        return EmgSamples(source_s, self._events.origin_s or 0.0, emg_v)

    def close(self) -> None:
        """Do nothing: there is no connection."""


class _Arrivals:
    """When samples came, and whether the source is silent for longer than between its blocks."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._blocks_s: deque[float] = deque(maxlen=BLOCKS)
        self._arrived_s = time.monotonic()

    def note(self, samples: int, *, expected: bool) -> None:
        """Note what was read; before anything is expected there is no silence."""
        if samples:
            self._blocks_s.append(samples / self._rate_hz)
        if samples or not expected:
            self._arrived_s = time.monotonic()

    @property
    def block_s(self) -> float:
        """How long the blocks of the source are."""
        longest = sorted(self._blocks_s)[-2:]
        return longest[0] if longest else 0.0

    @property
    def stalled(self) -> bool:
        return time.monotonic() - self._arrived_s > STALLED_S + self.block_s


class _Envelope:
    """The newest points of the envelope in the shared status: time in s, and µV of each muscle."""

    def __init__(self, source: EmgSource, muscles: int, status: SharedStatus) -> None:
        self._live, self._status = LiveEnvelope(source.rate_hz, muscles), status
        self._points = np.empty((0, 1 + muscles))

    def show(self, time_s: NDArray[np.float64], emg_v: NDArray[np.float64]) -> None:
        points = np.vstack([self._points, self._live.block(time_s, 1e6 * emg_v)])
        self._points = points[-round(SHOWN_S * ENVELOPE_RATE_HZ) :]
        self._status.show_envelope(self._points.tobytes())


class _Written:
    """The file, and what waits for it; a disk that refuses is tried again."""

    def __init__(self, settings: Settings, folder: Path) -> None:
        self.folder, emg = folder, settings.emg
        session_id = str(read_manifest(folder).get("session_id", ""))
        self._log = EmgLog(folder, emg.channels, emg.rate_hz, session_id)
        self._waiting: deque[EmgSamples] = deque()
        self._most = WAITING_S * emg.rate_hz
        self._synced_s = time.monotonic()
        self.lost = 0

    def append(self, samples: EmgSamples) -> None:
        self._waiting.append(samples)
        while sum(len(each.emg_v) for each in self._waiting) > self._most:
            self.lost += len(self._waiting.popleft().emg_v)
        with suppress(OSError):
            while self._waiting:
                self._log.append(*self._waiting[0])
                self._waiting.popleft()
            if time.monotonic() - self._synced_s > SYNC_S:
                self._synced_s = time.monotonic()
                os.fsync(self._log.fileno())

    def close(self) -> None:
        self.lost += sum(len(each.emg_v) for each in self._waiting)
        with suppress(OSError):
            self._log.close()


OpenEmg = Callable[[EmgSettings], EmgSource]
"""Connects to a source. It must be picklable: a function of a module."""


def emg_main(
    settings: Settings,
    open_emg: OpenEmg | None,
    names: tuple[str, str, str],
    lost_s: float,
    console_pid: int,
    remarks: Connection,
) -> None:
    """Record EMG until the session has ended; the target of its process.

    Parameters
    ----------
    settings : Settings
    open_emg : callable or None
        None for the virtual subject's.
    names : tuple of str
        Of the sample ring, the event ring and the shared status.
    lost_s : float
        Recorder and loop both silent for so long have ended.
    console_pid : int
        The process that started this one.
    remarks : Connection
        Takes an empty list once the source is connected, and one of sentences at the end: what is
        missing.
    """
    leave_to_the_others()
    os.nice(NICENESS)
    shared = SessionMemory.attach_or_end(names)
    shared.status.join(Role.EMG)
    found: list[str] = []
    try:
        events = _Events(shared)
        LiveEnvelope(settings.emg.rate_hz, 1)  # loads what takes a second, before the source sends
        source = open_emg(settings.emg) if open_emg else _Virtual(settings, shared, events)
        written = _Written(settings, _folder(shared))
        envelope = _Envelope(source, len(settings.emg.channels), shared.status)
        remarks.send([])
        found = _record(source, written, envelope, events, shared, lost_s, console_pid)
    except Exception as error:  # of the source's package too: else an end without a word
        found = [f"EMG was not recorded: {error or type(error).__name__}"]
        shared.status.set_condition(Role.EMG, ProcessCondition.FAILED, found[0])
    finally:
        with suppress(OSError):
            remarks.send(found)
        shared.leave()


def _folder(shared: SessionMemory) -> Path:
    folder = shared.status.folder()
    if folder is None:
        raise UserError("the session has no folder")
    return folder


def _record(
    source: EmgSource,
    written: _Written,
    envelope: _Envelope,
    events: _Events,
    shared: SessionMemory,
    lost_s: float,
    console_pid: int,
) -> list[str]:
    """Record; return what is missing, as sentences."""
    status = shared.status
    missing: list[str] = []
    over, last_s, arrivals, until_s = False, 0.0, _Arrivals(source.rate_hz), math.inf
    status.set_condition(Role.EMG, ProcessCondition.RUNNING)
    try:
        while not over:
            # A loop that was killed did not say that it ended; the recorder does.
            ended = any(status.ended(role, lost_s) for role in (Role.LOOP, Role.RECORDER))
            if ended and math.isinf(until_s):
                until_s = time.monotonic() + _last_block_s(arrivals.block_s)
            whole = ended and last_s >= _length_s(status)
            over = whole or time.monotonic() >= until_s or os.getppid() != console_pid
            events.follow()
            source_s, offset_s, emg_v = source.read()
            status.beat(Role.EMG)
            arrivals.note(source_s.size, expected=events.origin_s is not None)
            _show(status, last_s, stalled=arrivals.stalled)
            if events.origin_s is not None:
                time_s = source_s + (offset_s - events.origin_s)
                since = time_s >= 0.0  # the session's clock began
                if since.any():
                    first_s = float(time_s[since][0])
                    missing += _gap(last_s, first_s)
                    last_s = float(time_s[-1])
                    envelope.show(time_s[since], emg_v[since])
                written.append(
                    EmgSamples(source_s[since], offset_s - events.origin_s, emg_v[since])
                )
            if not over:
                time.sleep(POLL_S)
    except Exception as error:  # of the source's package too
        note = f"ended at {last_s:.1f} s: {error or type(error).__name__}"
        status.set_condition(Role.EMG, ProcessCondition.FAILED, note)
        missing.append(f"EMG {note}")
    else:
        status.set_condition(Role.EMG, ProcessCondition.DONE)
        missing += _gap(last_s, _length_s(status))
    finally:
        source.close()
        written.close()
    if written.lost:
        missing.append(f"{written.lost} samples of EMG found no room on the disk")
    if status.folder() != written.folder:
        missing.append(f"EMG is in {written.folder / EMG}, not with the samples; copy it to them")
    return missing


def _last_block_s(block_s: float) -> float:
    """Return for how long a block may be on its way when the session has ended."""
    return min(block_s + STALLED_S, LAST_BLOCK_S) if block_s > STALLED_S else 0.0


def _length_s(status: SharedStatus) -> float:
    """Return how long the session is, 0 where the loop never ran."""
    loop = status.loop()
    return loop.time_s if loop is not None else 0.0


def _show(status: SharedStatus, last_s: float, *, stalled: bool) -> None:
    """Show whether EMG comes, or since when it is missing."""
    if not stalled:
        status.set_condition(Role.EMG, ProcessCondition.RUNNING)
    elif status.condition(Role.EMG) is not ProcessCondition.TROUBLE:
        note = f"missing since {last_s:.1f} s"
        status.set_condition(Role.EMG, ProcessCondition.TROUBLE, note)


def _gap(last_s: float, next_s: float) -> list[str]:
    """Return a sentence where EMG was missing."""
    if not next_s - last_s > STALLED_S or math.isinf(next_s):
        return []
    return [f"EMG is missing from {last_s:.1f} to {next_s:.1f} s"]
