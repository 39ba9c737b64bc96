"""Memory that several processes see: made by one, attached by name by the others.

Python's resource tracker removes a segment when a process that registered it ends. That is right
for the process that made the memory: if it is killed, the tracker removes the segment after the
last of its children has ended. It is wrong for a process that only attaches: its own tracker would
remove a segment the others still use. Before Python 3.13 attaching registers too, so here it is
prevented.

A number of 8 bytes at a multiple of 8 is written and read in one piece on every 64-bit processor.
That the index of a row is never seen before the row itself rests on the order in which one
processor's writes become visible to another. x86-64 keeps the order of writes, and the order of
reads (total store order). ARM keeps neither, and Python has no barrier to ask for: there a reader
may see a row that is half old. `ORDERED` says which of the two this machine is.
"""

from __future__ import annotations

import platform
import secrets
import sys
from multiprocessing import resource_tracker
from multiprocessing.shared_memory import SharedMemory
from typing import cast

ORDERED = platform.machine().lower() in {"x86_64", "amd64"}
"""Whether writes of one processor are seen by the others in their order."""


class Memory:
    """A segment of shared memory.

    Parameters
    ----------
    segment : SharedMemory
    mine : bool
        Whether this process made it.
    """

    def __init__(self, segment: SharedMemory, mine: bool) -> None:
        self._segment = segment
        self._mine = mine
        self.bytes = memoryview(cast(memoryview, segment.buf))
        whole = len(self.bytes) // 8 * 8
        self._part = self.bytes[:whole]
        self.words: memoryview[int] = self._part.cast("q")
        self.closed = False

    @classmethod
    def create(cls, size: int) -> Memory:
        """Make a segment of zeros under a name of its own."""
        name = f"rigidimeter-{secrets.token_hex(6)}"
        return cls(SharedMemory(name=name, create=True, size=size), mine=True)

    @classmethod
    def attach(cls, name: str) -> Memory:
        """Attach to a segment that another process made.

        Raises
        ------
        FileNotFoundError
            If there is no such segment.
        """
        if sys.version_info >= (3, 13):
            return cls(SharedMemory(name=name, track=False), mine=False)
        register = resource_tracker.register
        resource_tracker.register = lambda *_: None
        try:
            return cls(SharedMemory(name=name), mine=False)
        finally:
            resource_tracker.register = register

    @property
    def name(self) -> str:
        """What the others attach by."""
        return self._segment.name

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
            self._segment.close()

    def unlink(self) -> None:
        """Remove the name: the memory goes with the last process that has it. Safe twice.

        A child may do it in place of a parent that was killed; they share one tracker.
        """
        try:
            self._segment.unlink()
        except FileNotFoundError:
            return
        if sys.version_info >= (3, 13) and not self._mine:
            # An untracked segment does not tell the tracker that it is gone.
            resource_tracker.unregister(f"/{self.name}", "shared_memory")
