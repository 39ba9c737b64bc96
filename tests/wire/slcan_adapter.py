"""A serial CAN adapter (slcan) on a pseudo-terminal, in front of a virtual bus.

It acknowledges every line, as LAWICEL's protocol has it, and holds frames in queues that the
computer does not see: behind a slow line, until a burst, or each for itself, so that others
overtake it.
"""

from __future__ import annotations

import heapq
import itertools
import os
import pty
import random
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from types import SimpleNamespace

import can
from can.interfaces import slcan


@dataclass(frozen=True)
class Manners:
    """How an adapter treats what it passes on, in both directions.

    Every `late_every`th frame is late, by a time between `late_s`; every `loses_every`th is lost.
    """

    acknowledges: bool = True
    bytes_per_s: float = 1e6
    burst_s: float = 0.0
    late_every: int = 0
    late_s: tuple[float, float] = (0.0, 0.0)
    loses_every: int = 0


class Queue:
    """Passes on one piece after the other; a late one is overtaken."""

    def __init__(self, manners: Manners, passes_on: Callable[[bytes], None], seed: int) -> None:
        self.manners, self._passes_on = manners, passes_on
        self._random = random.Random(seed)
        self._frames = 0
        self._pieces: list[tuple[float, int, bytes]] = []
        self._count = itertools.count()
        self._changed = threading.Condition()
        self._ended = False
        self._thread = threading.Thread(target=self._passing)
        self._thread.start()

    def put(self, piece: bytes) -> None:
        due_s, manners = time.monotonic(), self.manners
        if piece[:1] == b"t":
            self._frames += 1
            if manners.loses_every and self._frames % manners.loses_every == 0:
                return
            if manners.late_every and self._frames % manners.late_every == 0:
                due_s += self._random.uniform(*manners.late_s)
        if manners.burst_s:
            due_s = (due_s // manners.burst_s + 1) * manners.burst_s
        with self._changed:
            heapq.heappush(self._pieces, (due_s, next(self._count), piece))
            self._changed.notify()

    def end(self) -> None:
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join()

    def _passing(self) -> None:
        while True:
            with self._changed:
                while not self._ended and (wait_s := self._wait_s()) != 0.0:
                    self._changed.wait(wait_s)
                if self._ended:
                    return
                piece = heapq.heappop(self._pieces)[2]
            self._passes_on(piece)
            if self.manners.bytes_per_s < 1e6:
                time.sleep(len(piece) / self.manners.bytes_per_s)

    def _wait_s(self) -> float | None:
        return max(self._pieces[0][0] - time.monotonic(), 0.0) if self._pieces else None


class SlcanAdapter:
    """Between a pseudo-terminal, `port`, and a virtual bus."""

    def __init__(self, channel: str, manners: Manners) -> None:
        self._manners = manners
        self._host, self._terminal = pty.openpty()
        tty.setraw(self._terminal)
        self.port = os.ttyname(self._terminal)
        self._bus = can.Bus(interface="virtual", channel=channel)
        self._to_host = Queue(manners, self._write, 1)
        self._to_bus = Queue(manners, self._send, 2)
        self._notifier = can.Notifier(self._bus, [self._from_bus], 0.02)
        self._ended = False
        self._thread = threading.Thread(target=self._reading)
        self._thread.start()

    def behave(self, manners: Manners) -> None:
        self._manners = self._to_host.manners = self._to_bus.manners = manners

    def close(self) -> None:
        self._ended = True
        self._notifier.stop()
        os.close(self._terminal)  # the last end, once the driver has closed its own: reading fails
        self._thread.join()
        self._to_host.end()
        self._to_bus.end()
        os.close(self._host)
        self._bus.shutdown()

    def _reading(self) -> None:
        heard = b""
        with suppress(OSError):
            while not self._ended:
                heard += os.read(self._host, 4096)
                *lines, heard = heard.split(b"\r")
                for line in lines:
                    self._to_bus.put(line)
                    if self._manners.acknowledges:
                        self._to_host.put(b"z\r" if line[:1] == b"t" else b"\r")

    def _send(self, line: bytes) -> None:
        if line[:1] != b"t":
            return
        data = bytes.fromhex(line[5:].decode())
        identifier = int(line[1:4], 16)
        self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def _from_bus(self, message: can.Message) -> None:
        line = f"t{message.arbitration_id:03X}{message.dlc}{message.data.hex().upper()}\r"
        self._to_host.put(line.encode())

    def _write(self, piece: bytes) -> None:
        with suppress(OSError):
            os.write(self._host, piece)


@contextmanager
def adapter(channel: str, manners: Manners) -> Iterator[SlcanAdapter]:
    """Give an adapter that is ready at once, where python-can would wait for 2 s."""
    made = SlcanAdapter(channel, manners)
    before = slcan.time
    slcan.time = SimpleNamespace(sleep=lambda _: None, time=time.time)
    try:
        yield made
    finally:
        slcan.time = before
        made.close()
