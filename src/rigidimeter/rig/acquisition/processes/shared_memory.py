"""Memory that several processes see: made by one, attached by name by the others.

It is a file in /dev/shm, which is memory. Each process that has it open holds a shared lock on it.
The system lets go of a lock when its process ends, however it ends, so whoever gets the lock for
itself alone knows that no living process has the memory: that is how the last one removes it, and
how a later program tells what a killed one left. Python's resource tracker has no part in it: it
removes what it knows when its own processes are gone, also what was not written down yet.

A number of 8 bytes at a multiple of 8 is written and read in one piece on every 64-bit processor.
That the index of a row is never seen before the row itself rests on the order in which one
processor's writes become visible to another. x86-64 keeps the order of writes, and the order of
reads (total store order). ARM keeps neither, and Python has no barrier to ask for: there a reader
may see a row that is half old. `ORDERED` says which of the two this machine is.
"""

from __future__ import annotations

import fcntl
import mmap
import os
import platform
import secrets
import tempfile
from pathlib import Path

from rigidimeter.core.errors import UserError

ORDERED = platform.machine().lower() in {"x86_64", "amd64"}
"""Whether writes of one processor are seen by the others in their order."""

PREFIX = "rigidimeter-"
_SHM = Path("/dev/shm")
WHERE = _SHM if _SHM.is_dir() else Path(tempfile.gettempdir())
"""Where the memory has its names."""


def new_name() -> str:
    """Return a name that nothing has."""
    return f"{PREFIX}{secrets.token_hex(6)}"


class Memory:
    """A piece of shared memory.

    Parameters
    ----------
    name : str
    descriptor : int
        Of its file; closed with the memory.
    """

    def __init__(self, name: str, descriptor: int) -> None:
        self.name = name
        self._descriptor = descriptor
        fcntl.flock(descriptor, fcntl.LOCK_SH)
        self._map = mmap.mmap(descriptor, 0)
        self.bytes = memoryview(self._map)
        aligned = len(self.bytes) // 8 * 8
        self._part = self.bytes[:aligned]
        self.words: memoryview[int] = self._part.cast("q")
        self.closed = False

    @classmethod
    def create(cls, size: int, name: str = "") -> Memory:
        """Make a piece of zeros, under a name of its own if none is given.

        Raises
        ------
        UserError
            If there is not so much memory.
        """
        name = name or new_name()
        path = WHERE / name
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
        try:
            # All of it now: what is missing later would end the process that writes there.
            os.posix_fallocate(descriptor, 0, size)
            return cls(name, descriptor)
        except BaseException as error:  # also when interrupted: it would outlive this process
            os.close(descriptor)
            path.unlink()
            if isinstance(error, OSError):
                raise UserError(
                    f"{WHERE}: has no {size / 1e6:.1f} MB of shared memory for the session "
                    f"({error.strerror}); remove what is not needed there, or make it larger "
                    "(`df -h` shows it; of a container `--shm-size` sets it)"
                ) from None
            raise

    @classmethod
    def attach(cls, name: str) -> Memory:
        """Attach to a piece that another process made.

        Raises
        ------
        FileNotFoundError
            If there is none of that name.
        """
        descriptor = os.open(WHERE / name, os.O_RDWR | os.O_NOFOLLOW)
        try:
            return cls(name, descriptor)
        except (OSError, ValueError):  # it cannot be mapped, or is empty
            os.close(descriptor)
            raise

    def alone(self) -> bool:
        """Whether no other process has the memory; to be asked by one that will not use it again.

        Of processes that leave at the same time at least one is told so.
        """
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True

    def touch(self) -> None:
        """Have every page in this process's page table, so that no first write is slow."""
        self.bytes[::4096].tobytes()

    def close(self) -> None:
        """Let go of the memory; safe twice. It stays for the others."""
        if not self.closed:
            self.closed = True
            self.words.release()
            self._part.release()
            self.bytes.release()
            self._map.close()
            os.close(self._descriptor)

    def unlink(self) -> None:
        """Remove the name: the memory goes with the last process that has it. Safe twice."""
        (WHERE / self.name).unlink(missing_ok=True)
