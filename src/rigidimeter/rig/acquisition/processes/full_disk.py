"""When the disk takes nothing: the recorder tries on, says so, and may be given another folder.

Nothing is lost meanwhile. What is not in the file stays in the ring, and the loop stops the arm
before the ring is full. The recorder goes on as soon as there is room. It gives up only once the
session is over and the program was told to end, or nobody is left to tell it; then the ring stays
in memory until `rigidimeter recover` finds it.
"""

from __future__ import annotations

import math
import os
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

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
from rigidimeter.rig.acquisition.processes.recorder import Patience, Recorder, Recording
from rigidimeter.rig.acquisition.processes.session_memory import SessionMemory
from rigidimeter.rig.acquisition.processes.status_values import Condition, Flag, Role

SAID_S = 5.0
"""How often the operator is told how many samples wait."""


class FullDisk:
    """What the recorder knows of a disk that takes nothing.

    Parameters
    ----------
    recording : Recording
    shared : SessionMemory
    patience : Patience
    console_pid : int
        The process that started this one.
    """

    def __init__(
        self, recording: Recording, shared: SessionMemory, patience: Patience, console_pid: int
    ) -> None:
        self._recording, self._shared, self._patience = recording, shared, patience
        self._console_pid = console_pid
        self._since_s: float | None = None
        self._over_s: float | None = None
        self._said_s = -math.inf
        self._asked: Path | None = None
        self._refusal = ""

    def takes(self, recorder: Recorder) -> None:
        """Note that a write succeeded."""
        if self._since_s is not None:
            recorder.note("recording_resumed", after_s=round(time.monotonic() - self._since_s, 3))
            self._since_s, self._said_s, self._refusal = None, -math.inf, ""

    def refuses(self, error: OSError) -> None:
        """Note that a write failed, and tell the operator now and then."""
        now_s = time.monotonic()
        self._since_s = self._since_s or now_s
        if now_s - self._said_s < SAID_S:
            return
        self._said_s = now_s
        folder = self._recording.folder
        free = ""
        with suppress(OSError):
            free = f"{shutil.disk_usage(folder).free / 1e6:.1f} MB are free, "
        note = (
            f"{folder}: nothing can be written there ({error.strerror or error}); "
            f"{free}{self._shared.samples.lag()} samples wait in memory: make room, order "
            f"`save to FOLDER`{self._refusal}, or end with Ctrl-C, and they stay in memory"
        )
        self._shared.status.set_condition(Role.RECORDER, Condition.TROUBLE, note)

    def other_folder(self) -> SessionWriter | None:
        """Return a writer to the folder that was asked for, with all that is in the old one.

        None if none was asked for since the last call, or that one is refused too.
        """
        asked = self._shared.status.asked_folder()
        if asked is None or asked == self._asked:
            return None
        self._asked, self._said_s = asked, -math.inf
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
        over = over or status.condition(Role.LOOP) in (Condition.DONE, Condition.FAILED)
        told = alone or status.flag(Flag.END_ASKED) or status.flag(Flag.ABORT_ASKED)
        if not (over and told):
            return False
        self._over_s = self._over_s or time.monotonic()
        limit_s = self._recording.settings.loop.console_lost_s if alone else patience.disk_s
        return time.monotonic() - self._over_s > limit_s


def copy_record(
    folder: Path, writer: SessionWriter, recording: Recording, beat: Callable[[], object]
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
