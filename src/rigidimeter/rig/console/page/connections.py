"""How many connections the page's server keeps: idle ones must leave room for the operator's.

A peer that opens connections and says nothing, or never ends the head of its request, would take
the file descriptors and the memory of the program that leads the session. So there is a bound;
where it is reached the oldest idle connection is closed, of the address that has most of them. What
asks for nothing within `HEAD_S`, or begins a request with too long a head, is closed in any case.
The sockets of pages are not idle.
"""

from __future__ import annotations

import asyncio
import itertools
from collections import Counter
from typing import Any

import uvicorn

MOST_CONNECTIONS = 128
"""At once, with the sockets of pages; a browser opens some eight for a page."""

HEAD_S = 10.0
"""So long a connection may last without a whole head of a request."""

LONGEST_HEAD = 262_144
"""Bytes of it; what reads them ahead is not to grow with what is sent."""

_numbers = itertools.count()


def bound_connections(config: uvicorn.Config) -> None:
    """Have the server of a configuration keep to these bounds, whatever reads its HTTP."""
    config.load()
    protocol: Any = config.http_protocol_class

    class Bounded(protocol):  # type: ignore[misc]
        """A connection that is closed where it is idle and in the way."""

        def connection_made(self, transport: asyncio.Transport) -> None:
            super().connection_made(transport)
            self.number, self.address = next(_numbers), self.client[0] if self.client else ""
            self.head_bytes, self.cycle_before = 0, None
            self.loop.call_later(HEAD_S, self.end_without_request)
            if len(self.connections) > MOST_CONNECTIONS:
                idle = [one for one in self.connections if isinstance(one, Bounded) and one.idle]
                of_each = Counter(one.address for one in idle)
                max(idle, key=lambda one: (of_each[one.address], -one.number)).end()

        def data_received(self, data: bytes) -> None:
            if self.cycle is not self.cycle_before:
                self.head_bytes, self.cycle_before = 0, self.cycle
            self.head_bytes += len(data) if self.idle else 0
            if self.head_bytes > LONGEST_HEAD:
                self.end()
            else:
                super().data_received(data)

        @property
        def idle(self) -> bool:
            """Whether no request is being answered."""
            return self.cycle is None or bool(self.cycle.response_complete)

        def end_without_request(self) -> None:
            if self.cycle is None and self in self.connections:
                self.end()

        def end(self) -> None:
            """Close it at once; it does not count from here on."""
            self.connections.discard(self)
            self.transport.abort()

    config.http_protocol_class = Bounded
