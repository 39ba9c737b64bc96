"""The memory that the processes of one session share: the rings and the shared status."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass

from rigidimeter.acquisition.processes.ring import EventRing, SampleRing
from rigidimeter.acquisition.processes.shared_memory import Memory
from rigidimeter.acquisition.processes.shared_status import SharedStatus


@dataclass(frozen=True)
class SessionMemory:
    """Rings and shared status, made by the console or attached to by the others."""

    samples: SampleRing
    events: EventRing
    status: SharedStatus

    @classmethod
    def create(cls, tick_rate_hz: float, ring_s: float) -> SessionMemory:
        """Make all three, or none: rings for `ring_s` of samples, and a shared status."""
        with ExitStack() as undo:
            samples = SampleRing.create(max(16, round(ring_s * tick_rate_hz)))
            undo.callback(_drop, samples.memory)
            events = EventRing.create()
            undo.callback(_drop, events.memory)
            made = cls(samples, events, SharedStatus.create())
            undo.pop_all()
        return made

    @classmethod
    def attach(cls, names: tuple[str, str, str]) -> SessionMemory:
        """Attach to what another process made, by its names."""
        return cls(
            SampleRing.attach(names[0]), EventRing.attach(names[1]), SharedStatus.attach(names[2])
        )

    @property
    def names(self) -> tuple[str, str, str]:
        """What the others attach by."""
        return self.samples.name, self.events.name, self.status.name

    def touch(self) -> None:
        """Have every page in this process's page table."""
        for part in (self.samples, self.events, self.status):
            part.memory.touch()

    def unlink(self) -> None:
        """Remove the names: the memory goes with the last process that has it."""
        for part in (self.samples, self.events, self.status):
            part.memory.unlink()

    def close(self) -> None:
        """Let go of the memory."""
        for part in (self.samples, self.events, self.status):
            part.close()


def _drop(memory: Memory) -> None:
    memory.unlink()
    memory.close()
