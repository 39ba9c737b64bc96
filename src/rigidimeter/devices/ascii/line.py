"""One question, one answer: a serial line of ASCII requests that nobody waits for.

The drive answers each line with one line, and takes the next one only then. A loop that looked in
once a tick would spend a tick on each answer, so a thread carries a batch of requests through, one
by one, and sleeps in the operating system meanwhile. It holds no timer and repeats nothing: a loop
that hangs or dies gives it no further batch, and the line falls silent.
"""

from __future__ import annotations

import queue
import threading
from collections import deque
from typing import NamedTuple, Protocol

from rigidimeter.devices.base import Now

__all__ = ["BITS_PER_CHARACTER", "AsciiLine", "Exchange", "Port"]

BITS_PER_CHARACTER = 10
"""One start bit, eight of data, one stop bit."""

LONGEST_REPLY = 128


class Port(Protocol):
    """What is used of `serial.Serial`."""

    baudrate: int
    timeout: float | None

    def read_until(self, expected: bytes, size: int | None) -> bytes:
        """Read up to a character, or until the time is out."""

    def write(self, data: bytes, /) -> int | None:
        """Write."""

    def reset_input_buffer(self) -> None:
        """Throw away what has arrived."""

    def send_break(self, duration: float) -> None:
        """Hold the line at zero."""

    def close(self) -> None:
        """Close."""


class Exchange(NamedTuple):
    """A request, its reply (None if none came in time) and when the reply was complete."""

    request: str
    reply: str | None
    at_s: float


class AsciiLine:
    """Batches of requests in, answers out.

    Parameters
    ----------
    port : Port
        Open, with its timeout set to the longest a reply may take.
    now : callable
        Monotonic time in s, for the stamps.
    """

    def __init__(self, port: Port, now: Now) -> None:
        self._port = port
        self._now = now
        self._requests: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._replies: deque[Exchange] = deque()
        self._answered = threading.Condition()
        self._pending = 0
        self._thread = threading.Thread(target=self._run, name="ascii-line", daemon=True)
        self._thread.start()

    @property
    def port(self) -> Port:
        """The serial port."""
        return self._port

    @property
    def busy(self) -> bool:
        """Whether a request is still without its answer."""
        return self._pending > 0

    def submit(self, *requests: str) -> None:
        """Queue requests; returns at once."""
        with self._answered:
            self._pending += len(requests)
        for request in requests:
            self._requests.put(request)

    def take(self) -> Exchange | None:
        """Return the oldest answer not yet taken, None if there is none; never waits."""
        try:
            return self._replies.popleft()
        except IndexError:
            return None

    def drop(self) -> None:
        """Forget requests not yet sent and answers not yet taken."""
        while True:
            try:
                request = self._requests.get_nowait()
            except queue.Empty:
                break
            if request is not None:
                self._done()
        self._replies.clear()

    def ask(self, request: str, timeout_s: float) -> str | None:
        """Send one request ahead of all others and wait for its answer: not for the loop."""
        self.drop()
        self.submit(request)
        if not self.wait(timeout_s):
            return None
        replies = [exchange.reply for exchange in self._replies if exchange.request == request]
        self._replies.clear()
        return replies[-1] if replies else None

    def wait(self, timeout_s: float) -> bool:
        """Wait until every request has its answer; return whether that came about."""
        with self._answered:
            return self._answered.wait_for(lambda: self._pending <= 0, timeout_s)

    def close(self) -> None:
        """End the thread, then close the port."""
        self.drop()
        self._requests.put(None)
        self._thread.join(timeout=1.0 + 2.0 * (self._port.timeout or 0.0))
        self._port.close()

    def _done(self) -> None:
        with self._answered:
            self._pending -= 1
            self._answered.notify_all()

    def _run(self) -> None:
        while (request := self._requests.get()) is not None:
            reply = self._exchange(request)
            self._replies.append(Exchange(request, reply, self._now()))
            if reply is None:
                # What was to follow was meant for a drive that answers.
                self._forget_rest()
            self._done()

    def _forget_rest(self) -> None:
        while True:
            try:
                request = self._requests.get_nowait()
            except queue.Empty:
                return
            if request is None:
                self._requests.put(None)
                return
            self._done()

    def _exchange(self, request: str) -> str | None:
        try:
            self._port.reset_input_buffer()
            self._port.write(request.encode("ascii") + b"\r")
            answer = self._port.read_until(b"\r", LONGEST_REPLY)
        except OSError:  # serial.SerialException is one; a port that is gone counts as no reply
            return None
        if not answer.endswith(b"\r"):
            return None
        return answer[:-1].decode("ascii", "replace").strip()
