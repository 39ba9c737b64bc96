"""A thread that has the recorder's files put on the disk: a write only gives them to the system.

A disk may hold `fsync` up for long. The thread waits for it, and the recorder goes on writing; it
asks, and looks later whether that is done and what came of it.
"""

from __future__ import annotations

import os
import threading

from rigidimeter.acquisition.processes.shared_status import SharedStatus

__all__ = ["FsyncWorker"]


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
