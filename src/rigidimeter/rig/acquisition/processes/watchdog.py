"""One process watching another: whether it lives, and an end to it if it hangs."""

from __future__ import annotations

import os
import select
import signal
from contextlib import suppress


class WatchedProcess:
    """A process that was alive when it was looked up; its number can not be taken for another's.

    Parameters
    ----------
    pid : int
    """

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._gone = False
        self._fd = -1
        try:
            self._fd = os.pidfd_open(pid)
        except ProcessLookupError:
            self._gone = True
        except (AttributeError, OSError):  # an old kernel: go by the number
            pass

    def alive(self) -> bool:
        """Whether the process has not ended; one that was ended and not waited for has."""
        if self._gone:
            return False
        if self._fd >= 0:
            poll = select.poll()
            poll.register(self._fd, select.POLLIN)
            self._gone = bool(poll.poll(0))
        else:
            try:
                os.kill(self._pid, 0)
            except ProcessLookupError:
                self._gone = True
        return not self._gone

    def kill(self) -> None:
        """End the process at once, also one that was stopped."""
        if not self.alive():
            return
        with suppress(ProcessLookupError):
            if self._fd >= 0:
                signal.pidfd_send_signal(self._fd, signal.SIGKILL)
            else:
                os.kill(self._pid, signal.SIGKILL)

    def close(self) -> None:
        """Let go of the process."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd, self._gone = -1, True
