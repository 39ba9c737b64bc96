"""The recorder's process: it records until the session is closed, whoever else is killed.

A write only gives the samples to the system. A thread has the files put on the disk, which may hold
that up for long; the recorder asks it, goes on writing, and looks later what came of it.

It beats its heart between any two writes. A disk that does not take a write is tried again and
again, and the operator told so (`FullDisk`). When the loop has ended, or is not heard of, the
session is closed with that as the reason.
"""

from __future__ import annotations

import math
import os
import sys
import threading
import time
import traceback
from contextlib import suppress

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import SessionWriter
from rigidimeter.rig.acquisition.processes.end_signals import raise_flags
from rigidimeter.rig.acquisition.processes.recorder import (
    FullDisk,
    Patience,
    Recorder,
    RecordingPlan,
)
from rigidimeter.rig.acquisition.processes.session_memory import SessionMemory
from rigidimeter.rig.acquisition.processes.shared_status import SharedStatus
from rigidimeter.rig.acquisition.processes.status_values import Flag, ProcessCondition, Role
from rigidimeter.rig.acquisition.processes.watchdog import WatchedProcess


def recorder_main(
    recording: RecordingPlan, names: tuple[str, str, str], patience: Patience, console_pid: int
) -> None:
    """Record until the session is closed; the target of the recorder's process.

    Parameters
    ----------
    recording : RecordingPlan
    names : tuple of str
        Of the sample ring, the event ring and the shared status.
    patience : Patience
    console_pid : int
        The process that started this one.
    """
    shared = SessionMemory.attach_or_end(names)
    status = shared.status
    raise_flags(status)
    status.join(Role.RECORDER)
    try:
        writer = recording.writer()
        status.show_folder(recording.folder)
        status.set_condition(Role.RECORDER, ProcessCondition.READY, "")
        ended_well = _record(writer, recording, shared, patience, console_pid)
        status.set_condition(
            Role.RECORDER, ProcessCondition.DONE if ended_well else ProcessCondition.FAILED
        )
    except UserError as error:
        status.set_condition(Role.RECORDER, ProcessCondition.FAILED, str(error))
        sys.exit(1)
    except BaseException as error:
        status.set_condition(
            Role.RECORDER,
            ProcessCondition.FAILED,
            f"the recorder failed: {type(error).__name__}: {error}",
        )
        with suppress(OSError):
            traceback.print_exc()
        sys.exit(1)
    finally:
        shared.leave()


class FsyncWorker:
    """Has files put on the disk when asked; it may hang, the asker does not.

    `busy` says that it is at work, `error` what came of the last time, empty if all went well.

    Parameters
    ----------
    descriptors : tuple of int
    status : SharedStatus
        Shows how many samples are on the disk.
    """

    def __init__(self, descriptors: tuple[int, ...], status: SharedStatus) -> None:
        # Copies, so that a file that is closed meanwhile is not mistaken for another.
        self._descriptors = tuple(os.dup(descriptor) for descriptor in descriptors)
        self._status = status
        self._asked = threading.Semaphore(0)
        self._ending = False
        self.busy = False
        self._samples = 0
        self.error = ""
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def ask(self, samples: int) -> None:
        """Have the files put on the disk, which hold so many samples; not if that is under way."""
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
                self._status.synced_samples = self._samples
                room = os.fstatvfs(self._descriptors[0])
                self._status.free_bytes = room.f_bavail * room.f_frsize
                self.error = ""
            except OSError as error:
                self.error = error.strerror or str(error)
            self.busy = False

    def close(self) -> None:
        """End the thread; one that hangs is left to the end of the process."""
        self._ending = True
        self._asked.release()
        self._thread.join(timeout=1.0)
        if not self._thread.is_alive():
            for descriptor in self._descriptors:
                os.close(descriptor)


def _record(
    writer: SessionWriter,
    recording: RecordingPlan,
    shared: SessionMemory,
    patience: Patience,
    console_pid: int,
) -> bool:
    """Record until the session is closed; return whether it is in the files."""
    status, samples = shared.status, shared.samples
    recorder = Recorder(writer, shared, recording.settings.rig.tick_rate_hz)
    fsync_worker = FsyncWorker(writer.descriptors(), status)
    disk = FullDisk(recording, shared, patience, console_pid)
    loop: WatchedProcess | None = None
    synced_s = time.monotonic()
    try:
        while True:
            status.beat(Role.RECORDER)
            if loop is None and status.pid(Role.LOOP):
                loop = WatchedProcess(status.pid(Role.LOOP))
            why = _loop_lost(status, loop, patience, console_pid)
            try:
                recorder.drain()
                if why and not recorder.closing:
                    recorder.close(why)
                    recorder.drain()
                disk.takes(recorder)
                status.set_condition(Role.RECORDER, ProcessCondition.RUNNING, fsync_worker.error)
            except OSError as error:
                disk.refuses(error)
                moved = disk.other_folder()
                if moved is not None:
                    fsync_worker.close()
                    recorder.move(moved)
                    fsync_worker = FsyncWorker(moved.descriptors(), status)
                    continue
            if recorder.ended:
                return _synced(fsync_worker, shared, patience)
            if disk.given_up(over=bool(why) or recorder.closing):
                return False
            now_s = time.monotonic()
            if recorder.epoch_ended or now_s - synced_s >= patience.sync_s:
                recorder.epoch_ended, synced_s = False, now_s
                fsync_worker.ask(samples.recorded)
            time.sleep(patience.poll_s)
    finally:
        fsync_worker.close()


def _synced(fsync_worker: FsyncWorker, shared: SessionMemory, patience: Patience) -> bool:
    """Wait until the closed files are on the disk, as long as that is reasonable."""
    status, until_s = shared.status, time.monotonic() + patience.disk_s
    asked = False
    while time.monotonic() < until_s:
        status.beat(Role.RECORDER)
        if not fsync_worker.busy:
            if asked and not fsync_worker.error:
                return True
            asked = True
            fsync_worker.ask(shared.samples.recorded)
        time.sleep(0.005)
    status.set_condition(
        Role.RECORDER,
        ProcessCondition.TROUBLE,
        f"{status.folder()}: is written, but the disk has not confirmed it",
    )
    return True


def _loop_lost(
    status: SharedStatus, loop: WatchedProcess | None, patience: Patience, console_pid: int
) -> str:
    """Return why no more samples will come; nothing while they may."""
    if loop is None:
        if os.getppid() != console_pid or status.flag(Flag.END_ASKED):
            return "the loop was never started"
        return ""
    if not loop.alive():
        return (
            "the loop's process ended without closing the session; see what it printed, and "
            "continue with `rigidimeter run --resume`"
        )
    # While it starts it may wait for devices, and nothing moves.
    limits_s = {
        ProcessCondition.RUNNING: patience.loop_lost_s,
        ProcessCondition.STOPPING: patience.stopping_s,
    }
    limit_s = limits_s.get(status.condition(Role.LOOP), math.inf)
    if status.age_s(Role.LOOP) > limit_s:
        # It must not go on one day: its record is closed, and nobody knows where the arm is then.
        loop.kill()
        return (
            f"the loop's process did not answer for {limit_s:g} s and was ended; give it a "
            "processor of its own (`--cpu N`), and continue with `rigidimeter run --resume`"
        )
    return ""
