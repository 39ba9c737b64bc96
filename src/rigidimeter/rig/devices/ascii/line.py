"""Requests and replies on a serial line, carried by a thread so that the loop never waits.

The drive answers each line with one line and accepts the next one only then. A loop that polled
once per tick would need a tick for each reply. So a thread sends a batch of requests one by one and
blocks in the operating system meanwhile. It has no timer and repeats nothing: if the loop hangs or
dies, no further batch is submitted and the line goes silent.
"""

from __future__ import annotations

import queue
import threading
from collections import deque
from typing import NamedTuple, Protocol

from rigidimeter.rig.devices.base import Now

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
        """Write characters."""

    def reset_input_buffer(self) -> None:
        """Discard received characters."""

    def send_break(self, duration: float) -> None:
        """Hold the line at zero."""

    def close(self) -> None:
        """Close the port."""


class Exchange(NamedTuple):
    """A request, its reply (None if none came in time) and the time the reply was complete."""

    request: str
    reply: str | None
    at_s: float


class AsciiLine:
    """Sends batches of requests and collects the replies.

    Parameters
    ----------
    port : Port
        Open, with its timeout set to the longest time that a reply may take.
    now : callable
        Monotonic time in s, for the time stamps.
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
        """Whether a request is waiting for its reply."""
        return self._pending > 0

    def submit(self, *requests: str) -> None:
        """Queue requests; returns at once."""
        with self._answered:
            self._pending += len(requests)
        for request in requests:
            self._requests.put(request)

    def take(self) -> Exchange | None:
        """Return the oldest reply not yet taken, None if there is none; never waits."""
        try:
            return self._replies.popleft()
        except IndexError:
            return None

    def drop(self) -> None:
        """Discard requests not yet sent and replies not yet taken."""
        self._drop_requests()
        self._replies.clear()

    def ask(self, request: str, timeout_s: float) -> str | None:
        """Send a request ahead of all others and wait for its reply; not for use in the loop."""
        self.drop()
        self.submit(request)
        if not self.wait(timeout_s):
            return None
        replies = [exchange.reply for exchange in self._replies if exchange.request == request]
        self._replies.clear()
        return replies[-1] if replies else None

    def wait(self, timeout_s: float) -> bool:
        """Wait until all requests are answered; return False on timeout."""
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
                self._drop_requests()  # the rest of the batch assumed a drive that answers
            self._done()

    def _drop_requests(self) -> None:
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
        except Exception:  # OSError or termios.error: a port that is gone counts as no reply
            return None
        if not answer.endswith(b"\r"):
            return None
        return answer[:-1].decode("ascii", "replace").strip()
