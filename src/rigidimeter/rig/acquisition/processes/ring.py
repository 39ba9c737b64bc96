"""Rings between the loop and everybody else: samples in fixed rows, events in fixed slots.

One process writes, the loop. It never waits: where there is no room it says so and counts. Room is
what the recorder has put into the file: its cursor moves only then, so what is not in the file is
still in the ring, whoever is killed. Other readers, as many as there are, know for themselves how
far they have read, which the writer does not look at; they may fall behind, and then learn how many
they missed.

    written   how many rows there ever were; stored after the row itself
    recorded  how many of them are in the file; stored by the recorder

Row k stands at k modulo the capacity. The writer fills row `written` while a reader may still copy
row `written - capacity` from the same place, so a reader that may be overtaken looks at `written`
again after the copy and gives up what was no longer safe. What this rests on is in `shared`.

An event is one line of JSON with the number of samples written before it, so that samples and
events can be put back in order.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.files import json_line
from rigidimeter.core.session import Sample, sample_dtypes
from rigidimeter.rig.acquisition.processes.shared_memory import Memory

ROW: np.dtype[np.void] = np.dtype(
    [(name, "=i8" if kind.kind in "iu" else "=f8") for name, kind in sample_dtypes().items()]
)
"""A row of samples: integers and floats of eight bytes each, in the order of `Sample`."""

_ROW_FORMAT = struct.Struct(
    "@" + "".join("q" if kind.kind in "iu" else "d" for kind in sample_dtypes().values())
)
_HEADER_BYTES = 512
# Words of the header; what different processes write is at least a cache line apart.
_KIND, _CAPACITY, _SLOT_BYTES = 0, 1, 2
_WRITTEN, _REFUSED = 8, 9
_RECORDED = 16


class _Ring:
    """Slots of equal size behind a header."""

    _kind: int

    def __init__(self, memory: Memory, capacity: int, slot_bytes: int) -> None:
        self.memory = memory
        self.capacity = capacity
        self._slot_bytes = slot_bytes
        self._words = memory.words
        self._bytes = memory.bytes

    @classmethod
    def _make(cls, capacity: int, slot_bytes: int, name: str) -> Memory:
        memory = Memory.create(_HEADER_BYTES + capacity * slot_bytes, name)
        memory.words[_CAPACITY], memory.words[_SLOT_BYTES] = capacity, slot_bytes
        memory.words[_KIND] = cls._kind
        return memory

    @classmethod
    def _found(cls, name: str) -> tuple[Memory, int, int]:
        memory = Memory.attach(name)
        kind, capacity, slot = (int(memory.words[k]) for k in (_KIND, _CAPACITY, _SLOT_BYTES))
        if kind != cls._kind:
            memory.close()
            raise ValueError(f"shared memory {name} holds something else than a {cls.__name__}")
        return memory, capacity, slot

    @property
    def name(self) -> str:
        """What another process attaches by."""
        return self.memory.name

    @property
    def written(self) -> int:
        """How many were written."""
        return self._words[_WRITTEN]

    @property
    def refused(self) -> int:
        """How many found no room."""
        return self._words[_REFUSED]

    @property
    def recorded(self) -> int:
        """How many are in the file."""
        return self._words[_RECORDED]

    @recorded.setter
    def recorded(self, count: int) -> None:
        self._words[_RECORDED] = count

    def lag(self) -> int:
        """Return how many wait for the recorder."""
        return self._words[_WRITTEN] - self._words[_RECORDED]

    def close(self) -> None:
        """Let go of the memory."""
        self.memory.close()


class SampleRing(_Ring):
    """Samples, one row each."""

    _kind = 0x53414D504C45

    @classmethod
    def create(cls, capacity: int, name: str = "") -> SampleRing:
        """Make a ring for `capacity` samples."""
        return cls(cls._make(capacity, ROW.itemsize, name), capacity, ROW.itemsize)

    @classmethod
    def attach(cls, name: str) -> SampleRing:
        """Attach to a ring by its name.

        Raises
        ------
        ValueError
            If its rows are not those of this version.
        """
        memory, capacity, row_bytes = cls._found(name)
        if row_bytes != ROW.itemsize:
            memory.close()
            raise ValueError(
                f"ring {name} has rows of {row_bytes} bytes; those of this version have "
                f"{ROW.itemsize}"
            )
        return cls(memory, capacity, row_bytes)

    def push(self, sample: Sample) -> bool:
        """Write a row; return False, having counted it, where there is no room."""
        words = self._words
        written = words[_WRITTEN]
        if written - words[_RECORDED] >= self.capacity:
            words[_REFUSED] += 1
            return False
        _ROW_FORMAT.pack_into(
            self._bytes, _HEADER_BYTES + written % self.capacity * self._slot_bytes, *sample
        )
        words[_WRITTEN] = written + 1
        return True

    def rows(self, first: int, stop: int) -> NDArray[np.void]:
        """Return a copy of rows `first` to `stop`, which must lie within the ring."""
        count = max(0, stop - first)
        rows = np.empty(count, ROW)
        start = first % self.capacity
        before_wrap = min(count, self.capacity - start)
        for into, at, n in ((0, start, before_wrap), (before_wrap, 0, count - before_wrap)):
            if n:
                offset = _HEADER_BYTES + at * self._slot_bytes
                rows[into : into + n] = np.frombuffer(self._bytes, ROW, n, offset)
        return rows

    def held_rows(self) -> NDArray[np.void]:
        """Return every row that is still there, once the writer has ended; the newest is last."""
        return self.rows(max(0, self.written - self.capacity), self.written)


class SampleReader:
    """A reader that may fall behind: the console, the live estimate.

    Parameters
    ----------
    ring : SampleRing
    next_row : int
        The first row to read.
    """

    def __init__(self, ring: SampleRing, next_row: int = 0) -> None:
        self._ring = ring
        self._next = next_row

    def read(
        self, max_rows: int | None = None, *, recorded: bool = False
    ) -> tuple[NDArray[np.void], int]:
        """Return the rows since the last call, and how many before them were missed.

        Parameters
        ----------
        max_rows : int or None
            Skip to the newest `max_rows` rows; those skipped count as missed.
        recorded : bool
            Of those alone that are in the file.
        """
        ring, before = self._ring, self._next
        written = ring.recorded if recorded else ring.written
        first = min(max(before, ring.written - ring.capacity + 1), written)
        if max_rows is not None:
            first = max(first, written - max_rows)
        rows = ring.rows(first, written)
        # What the writer has reached meanwhile, or is writing now, may be torn.
        safe = ring.written - ring.capacity + 1
        if safe > first:
            rows = rows[safe - first :]
            first = min(safe, written)
        self._next = written
        return rows, first - before


class Event(NamedTuple):
    """One line of JSON, and how many samples were written before it."""

    samples_before: int
    line: bytes

    @property
    def facts(self) -> dict[str, Any]:
        """What the line says."""
        return dict(json.loads(self.line))


class EventRing(_Ring):
    """Events, one slot each."""

    _kind = 0x4556454E54
    _head = struct.Struct("@qq")

    @classmethod
    def create(cls, capacity: int = 512, slot_bytes: int = 8192, name: str = "") -> EventRing:
        """Make a ring for `capacity` events of up to `slot_bytes` less 16."""
        return cls(cls._make(capacity, slot_bytes, name), capacity, slot_bytes)

    @classmethod
    def attach(cls, name: str) -> EventRing:
        """Attach to a ring by its name."""
        return cls(*cls._found(name))

    def push(self, samples_before: int, event: Mapping[str, Any]) -> bool:
        """Write an event; return False, having counted it, where there is no room.

        Raises
        ------
        ValueError
            If the event is too long for a slot, or not what JSON can say.
        """
        line = json_line(event)
        room = self._slot_bytes - self._head.size
        if len(line) > room:
            raise ValueError(
                f"event {event.get('event')} takes {len(line)} bytes; a slot of the ring holds "
                f"{room}: leave out its longest facts, or make the slots larger"
            )
        words = self._words
        written = words[_WRITTEN]
        if written - words[_RECORDED] >= self.capacity:
            words[_REFUSED] += 1
            return False
        at = _HEADER_BYTES + written % self.capacity * self._slot_bytes
        self._head.pack_into(self._bytes, at, samples_before, len(line))
        at += self._head.size
        self._bytes[at : at + len(line)] = line
        words[_WRITTEN] = written + 1
        return True

    def get(self, number: int) -> Event:
        """Return event `number`, which must lie between `recorded` and `written`."""
        at = _HEADER_BYTES + number % self.capacity * self._slot_bytes
        samples_before, length = self._head.unpack_from(self._bytes, at)
        at += self._head.size
        return Event(samples_before, bytes(self._bytes[at : at + length]))
