"""The memory that the processes of one session share: the rings and the shared status."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from dataclasses import dataclass

from rigidimeter.rig.acquisition.processes.ring import EventRing, SampleRing
from rigidimeter.rig.acquisition.processes.shared_memory import WHERE, Memory, new_name
from rigidimeter.rig.acquisition.processes.shared_status import SharedStatus
from rigidimeter.rig.acquisition.processes.status_values import ProcessCondition, Role

PARTS = ("-samples", "-events", "-status")
"""What the names of the three end with; they begin alike."""


@dataclass(frozen=True)
class SessionMemory:
    """Rings and shared status, made by the console or attached to by the others."""

    samples: SampleRing
    events: EventRing
    status: SharedStatus

    @classmethod
    def create(cls, tick_rate_hz: float, ring_s: float) -> SessionMemory:
        """Make all three, or none: rings for `ring_s` of samples, and a shared status."""
        samples_name, events_name, status_name = map(new_name().__add__, PARTS)
        with ExitStack() as undo:
            samples = SampleRing.create(max(16, round(ring_s * tick_rate_hz)), name=samples_name)
            undo.callback(_drop, samples.memory)
            events = EventRing.create(name=events_name)
            undo.callback(_drop, events.memory)
            made = cls(samples, events, SharedStatus.create(status_name))
            undo.pop_all()
        return made

    @classmethod
    def attach(cls, names: tuple[str, str, str]) -> SessionMemory:
        """Attach to what another process made, by its names."""
        with ExitStack() as undo:
            samples = SampleRing.attach(names[0])
            undo.callback(samples.close)
            events = EventRing.attach(names[1])
            undo.callback(events.close)
            attached = cls(samples, events, SharedStatus.attach(names[2]))
            undo.pop_all()
        return attached

    @classmethod
    def attach_or_end(cls, names: tuple[str, str, str]) -> SessionMemory:
        """Attach; end this process if the session ended, and took its memory, before it began."""
        try:
            return cls.attach(names)
        except FileNotFoundError:
            sys.exit(1)

    @property
    def names(self) -> tuple[str, str, str]:
        """What the others attach by."""
        return self.samples.name, self.events.name, self.status.name

    def touch(self) -> None:
        """Have every page in this process's page table."""
        for part in (self.samples, self.events, self.status):
            part.memory.touch()

    def needed(self) -> bool:
        """Whether it holds what is in no file: samples or events of a record that is not closed."""
        if self.status.condition(Role.RECORDER) is ProcessCondition.DONE:
            return False
        return self.samples.lag() > 0 or self.events.lag() > 0

    def where(self) -> str:
        """Return where the samples are, for a person."""
        return str(WHERE / self.samples.name)

    def unlink(self) -> None:
        """Remove the names: the memory goes with the last process that has it."""
        for part in (self.samples, self.events, self.status):
            part.memory.unlink()

    def leave(self) -> None:
        """Let go of the memory; the last process removes it, unless it is still needed."""
        if not self.needed() and self.status.memory.alone():
            self.unlink()
        self.close()

    def close(self) -> None:
        """Let go of the memory."""
        for part in (self.samples, self.events, self.status):
            part.close()


def _drop(memory: Memory) -> None:
    memory.unlink()
    memory.close()
