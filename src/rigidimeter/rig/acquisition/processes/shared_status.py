"""The shared status: a page of memory on which each process writes what the others may read.

Every value has one writer. Heartbeats are single numbers, nanoseconds of CLOCK_MONOTONIC, which
all processes of a machine share and which no change of the wall clock moves. Values that belong
together stand in a block with a sequence count that is odd while the block is written; a reader
that sees an odd count, or another one after its copy, reads again. A writer killed half-way leaves
it odd for good, so a reader gives up after some tries and returns nothing.

Orders of the operator go into a ring of their own, in order, none lost: the console writes, the
loop takes them one by one, and how many it has taken is its acknowledgement. What the operator
writes to be recorded is longer than an order: one at a time stands in the console's own note.
"""

from __future__ import annotations

import math
import os
import struct
import time
from collections.abc import Callable
from pathlib import Path

from rigidimeter.rig.acquisition import NOTHING, Command, Order
from rigidimeter.rig.acquisition.processes.shared_memory import Memory
from rigidimeter.rig.acquisition.processes.status_values import (
    Flag,
    LiveEstimate,
    LoopStatus,
    ProcessCondition,
    Role,
)

Nanoseconds = Callable[[], int]

_KIND = 0x424F415244
# Words, a cache line of 8 for each writer.
_HEARTS, _PIDS, _CONDITIONS, _FLAGS = 8, 48, 56, 64
_ORDERED, _TAKEN = 72, 80
_SYNCED, _FREE = 88, 89
_STATUS, _LIVE = 104, 128
_ORDERS_BYTE, _NOTES_BYTE = 2048, 4096
_NOTE_BYTES = 1024
NOTE_BYTES = _NOTE_BYTES - 16
"""So long may be what a process says, or an operator writes, in UTF-8."""
_ORDER = struct.Struct("@qqd48s")
_ORDER_SLOTS = 16
_NAME_BYTES = 48
_PATH_BYTES = 4096
_FOLDER_BYTE = _NOTES_BYTE + len(Role) * _NOTE_BYTES
_ASKED_BYTE = _FOLDER_BYTE + _PATH_BYTES
_ENVELOPE_BYTE = _ASKED_BYTE + _PATH_BYTES
_BYTES = _ENVELOPE_BYTE + _PATH_BYTES
_TRIES = 1000


class _Block:
    """Values that are read together or not at all."""

    def __init__(self, memory: Memory, word: int, format_: str) -> None:
        self._words, self._word = memory.words, word
        self._bytes, self._at = memory.bytes, 8 * (word + 1)
        self._struct = struct.Struct(format_)

    def write(self, *values: int | float | bytes) -> None:
        words, word = self._words, self._word
        count = words[word] | 1  # odd already if the writer before was killed half-way
        words[word] = count
        self._struct.pack_into(self._bytes, self._at, *values)
        words[word] = count + 1

    def read(self) -> tuple[int | float | bytes, ...] | None:
        words, word = self._words, self._word
        for _ in range(_TRIES):
            count = words[word]
            if not count & 1:
                values = self._struct.unpack_from(self._bytes, self._at)
                if words[word] == count:
                    return values
        return None


def _text(block: _Block) -> bytes:
    values = block.read()
    if values is None:
        return b""
    length, text = values
    assert isinstance(length, int)
    assert isinstance(text, bytes)
    return text[:length]


def _write_path(block: _Block, path: Path) -> None:
    text = os.fsencode(path.absolute())
    if len(text) > _PATH_BYTES - 16:
        raise ValueError(f"{path}: the path has {len(text)} bytes; {_PATH_BYTES - 16} are possible")
    block.write(len(text), text)


def _path(block: _Block) -> Path | None:
    text = _text(block)
    return Path(os.fsdecode(text)) if text else None


class SharedStatus:
    """The shared status as one process sees it.

    Parameters
    ----------
    memory : Memory
    now_ns : callable
        CLOCK_MONOTONIC in nanoseconds.
    """

    def __init__(self, memory: Memory, now_ns: Nanoseconds = time.monotonic_ns) -> None:
        self.memory = memory
        self._words = memory.words
        self._bytes = memory.bytes
        self._now_ns = now_ns
        self._noted = 0
        self._loop = _Block(memory, _STATUS, "@7q8d2q")
        self._live = _Block(memory, _LIVE, "@4q10d")
        note = f"@q{NOTE_BYTES}s"
        self._notes = [
            _Block(memory, (_NOTES_BYTE + role * _NOTE_BYTES) // 8, note) for role in Role
        ]
        path = f"@q{_PATH_BYTES - 16}s"
        self._folder = _Block(memory, _FOLDER_BYTE // 8, path)
        self._asked = _Block(memory, _ASKED_BYTE // 8, path)
        self._envelope = _Block(memory, _ENVELOPE_BYTE // 8, path)

    @classmethod
    def create(cls, name: str = "") -> SharedStatus:
        """Make a page for one session."""
        memory = Memory.create(_BYTES, name)
        memory.words[0] = _KIND
        status = cls(memory)
        status.show_loop(LoopStatus())
        status.show_live(LiveEstimate())
        return status

    @classmethod
    def attach(cls, name: str) -> SharedStatus:
        """Attach to a page by its name."""
        memory = Memory.attach(name)
        if memory.words[0] != _KIND:
            memory.close()
            raise ValueError(f"shared memory {name} holds something else than a SharedStatus")
        return cls(memory)

    @property
    def name(self) -> str:
        """What another process attaches by."""
        return self.memory.name

    def close(self) -> None:
        """Let go of the memory."""
        self.memory.close()

    # Heartbeats, conditions and notes: each process writes its own.

    def beat(self, role: Role, at_ns: int | None = None) -> None:
        """Say that a process is alive, now or at a time of CLOCK_MONOTONIC in nanoseconds."""
        self._words[_HEARTS + 8 * role] = self._now_ns() if at_ns is None else at_ns

    def age_s(self, role: Role) -> float:
        """Return how long ago a process last said so, infinity if it never did."""
        beat = self._words[_HEARTS + 8 * role]
        return 1e-9 * (self._now_ns() - beat) if beat else math.inf

    def join(self, role: Role) -> None:
        """Come in as one of the processes."""
        self._words[_PIDS + role] = os.getpid()
        self.beat(role)
        self.set_condition(role, ProcessCondition.STARTING)

    def pid(self, role: Role) -> int:
        """Return the id of a process, 0 if it never came in."""
        return self._words[_PIDS + role]

    def set_condition(
        self, role: Role, condition: ProcessCondition, note: str | None = None
    ) -> None:
        """Say how a process is, with a sentence for the operator where there is one."""
        if note is not None:
            text = note.encode()[:NOTE_BYTES]
            self._notes[role].write(len(text), text)
        self._words[_CONDITIONS + role] = condition

    def condition(self, role: Role) -> ProcessCondition:
        """Return how a process last said it is."""
        return ProcessCondition(self._words[_CONDITIONS + role])

    def ended(self, role: Role, lost_s: float) -> bool:
        """Whether a process is done, or loop and recorder were both silent for `lost_s`."""
        if self.condition(role) in (ProcessCondition.DONE, ProcessCondition.FAILED):
            return True
        return min(self.age_s(Role.LOOP), self.age_s(Role.RECORDER)) > lost_s

    def note(self, role: Role) -> str:
        """Return the last sentence of a process."""
        return _text(self._notes[role]).decode(errors="replace")

    # Folders

    def show_folder(self, folder: Path) -> None:
        """Say into which folder is recorded; only the recorder may."""
        _write_path(self._folder, folder)

    def folder(self) -> Path | None:
        """Return into which folder is recorded; None before that is known."""
        return _path(self._folder)

    def ask_folder(self, folder: Path) -> None:
        """Ask the recorder for another folder; only the console may.

        Raises
        ------
        ValueError
            If the path is too long.
        """
        _write_path(self._asked, folder)

    def asked_folder(self) -> Path | None:
        """Return the folder that was last asked for, if any."""
        return _path(self._asked)

    # Flags

    def raise_flag(self, flag: Flag, up: bool = True) -> None:
        """Raise a flag, or take it down."""
        self._words[_FLAGS + flag] = int(up)

    def flag(self, flag: Flag) -> bool:
        """Whether a flag is up."""
        return self._words[_FLAGS + flag] != 0

    @staticmethod
    def places() -> tuple[int, int, int, int, int, int]:
        """Return where in `memory.words` stands what the loop touches every tick.

        The flags for an emergency stop, for the end and for an abort, the heartbeats of console,
        recorder and the loop itself.
        """
        return (
            _FLAGS + Flag.EMERGENCY_STOP,
            _FLAGS + Flag.END_ASKED,
            _FLAGS + Flag.ABORT_ASKED,
            _HEARTS + 8 * Role.CONSOLE,
            _HEARTS + 8 * Role.RECORDER,
            _HEARTS + 8 * Role.LOOP,
        )

    # Orders

    def post(self, order: Order) -> int:
        """Give an order to the loop; return its number, counted from 1.

        Raises
        ------
        ValueError
            If the name is too long, or so many orders wait that the loop cannot be alive.
        """
        name = order.name.encode()
        if len(name) > _NAME_BYTES:
            raise ValueError(
                f"{order.name}: the name of a parameter is at most {_NAME_BYTES} bytes"
            )
        number = self._words[_ORDERED]
        if number - self._words[_TAKEN] >= _ORDER_SLOTS:
            raise ValueError(f"{_ORDER_SLOTS} orders wait already; the loop does not take them")
        at = _ORDERS_BYTE + number % _ORDER_SLOTS * _ORDER.size
        _ORDER.pack_into(self._bytes, at, int(order.command), len(name), order.value, name)
        self._words[_ORDERED] = number + 1
        return number + 1

    def post_note(self, text: str) -> int | None:
        """Give the loop a JSON object to record; None while it has not taken the one before.

        Raises
        ------
        ValueError
            If it is longer than `NOTE_BYTES`, or so many orders wait that the loop cannot be alive.
        """
        if self._words[_TAKEN] < self._noted:
            return None
        line = text.encode()
        if len(line) > NOTE_BYTES:
            raise ValueError(f"a note takes {len(line)} bytes; {NOTE_BYTES} are possible")
        self._notes[Role.CONSOLE].write(len(line), line)
        self._noted = self.post(Order(Command.NOTE))
        return self._noted

    def take(self) -> Order:
        """Return the next order, `NOTHING` if there is none; only the loop may."""
        words = self._words
        taken = words[_TAKEN]
        if taken == words[_ORDERED]:
            return NOTHING
        at = _ORDERS_BYTE + taken % _ORDER_SLOTS * _ORDER.size
        command, length, value, name = _ORDER.unpack_from(self._bytes, at)
        noted = command == Command.NOTE
        text = self.note(Role.CONSOLE) if noted else name[:length].decode()
        words[_TAKEN] = taken + 1  # from now on the console may write the next note
        return Order(Command(command), text, value)

    @property
    def taken(self) -> int:
        """The number of the last order that the loop took."""
        return self._words[_TAKEN]

    # What is shown

    def show_loop(self, status: LoopStatus) -> None:
        """Show the loop; only the loop may."""
        self._loop.write(*status)

    def loop(self) -> LoopStatus | None:
        """Return what the loop shows; None if it was killed while it wrote."""
        values = self._loop.read()
        return None if values is None else LoopStatus(*values)  # type: ignore[arg-type]

    def show_live(self, estimate: LiveEstimate) -> None:
        """Show the live estimate; only the estimator may."""
        self._live.write(*estimate)

    def live(self) -> LiveEstimate | None:
        """Return the live estimate; None if its process was killed while it wrote."""
        values = self._live.read()
        return None if values is None else LiveEstimate(*values)  # type: ignore[arg-type]

    def show_envelope(self, points: bytes) -> None:
        """Show the newest points of the EMG's envelope; only its process may."""
        self._envelope.write(len(points), points)

    def envelope(self) -> bytes:
        """Return the newest points of the EMG's envelope, as they were shown."""
        return _text(self._envelope)

    @property
    def synced_samples(self) -> int:
        """How many samples the disk itself has, as far as the system says."""
        return self._words[_SYNCED]

    @synced_samples.setter
    def synced_samples(self, count: int) -> None:
        self._words[_SYNCED] = count

    @property
    def free_bytes(self) -> int | None:
        """How much room there is where is recorded; None before that is known."""
        return self._words[_FREE] - 1 if self._words[_FREE] else None

    @free_bytes.setter
    def free_bytes(self, count: int) -> None:
        self._words[_FREE] = count + 1
