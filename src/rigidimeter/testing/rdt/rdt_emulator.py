"""An emulated ATI Net F/T: RDT records over UDP, the XML page over HTTP.

Requests and records are those of the Net F/T manual (9620-05-NET FT). Like the real sensor, it
serves the client of the last request, numbers the records of each stream from 1, and counts its own
samples at their own rate.

The sensor is mounted on the drive with the arm on its tool side, so Tz is the torque of the arm on
the drive, the opposite of the torque from the drive on the joint: Tz = −M. The other axes contain
only noise.
"""

from __future__ import annotations

import math
import random
import socket
import struct
import threading
import time
from collections import deque
from typing import Self

from rigidimeter.testing.emulated_arm import EmulatedArm
from rigidimeter.testing.rdt.rdt_records import (
    ONCE,
    RDT_MISBEHAVIOURS,
    RECORD,
    SAMPLE_RATE_HZ,
    Faults,
    RecordSource,
    fault_value,
)
from rigidimeter.testing.rdt.rdt_web_page import (
    PageFacts,
    SensorPageServer,
    page_text,
    page_with_faults,
)

_REQUEST = struct.Struct(">HHI")
LONGEST_STALL_S = 2.0
LARGEST_LAG_S = 1.0


class RdtEmulator:
    """One sensor on an arm, with its own threads.

    Parameters
    ----------
    arm : EmulatedArm
    rate_hz : float
        Records per second, at most 7000.
    force_unit, torque_unit : str
        As spelled in the page: N, lbf; Nm, Nmm, lbf-in, lbf-ft and others.
    first_sequence : int
        The RDT sequence of a stream's first record.
    seed : int
        Of the noise.

    Attributes
    ----------
    address, port, http_port
        Where it can be reached; the ports are free ones chosen by `start`.
    sent : deque
        RDT sequence and torque in N·m of the latest records, to compare with what arrives.
    requests : deque
        The commands received.
    """

    def __init__(
        self,
        arm: EmulatedArm,
        *,
        rate_hz: float = 1000.0,
        force_unit: str = "N",
        torque_unit: str = "Nm",
        first_sequence: int = 1,
        seed: int = 1,
    ) -> None:
        if not 0.0 < rate_hz <= SAMPLE_RATE_HZ:
            raise ValueError(f"rate_hz is {rate_hz:g}; it must be above 0 and at most 7000 Hz")
        self.arm = arm
        self.address, self.port, self.http_port = "127.0.0.1", 0, 0
        self.rate_hz = rate_hz
        self.requests: deque[int] = deque(maxlen=100)
        self._page = PageFacts(force_unit, torque_unit, rate_hz)
        self._first_sequence = first_sequence
        self._records = RecordSource(arm, rate_hz, seed)
        self.sent = self._records.sent
        self._random = random.Random(seed)
        self._faults: Faults = {}
        self._lock = threading.Lock()
        self._held: list[bytes] = []
        self._on_the_way: deque[tuple[float, bytes]] = deque()
        self._lag_since_s = math.nan
        self._client: tuple[str, int] | None = None
        self._streaming = threading.Event()
        self._ending = threading.Event()
        self._new_stream = threading.Event()
        self._threads: list[threading.Thread] = []

    def start(self) -> None:
        """Open both ports and start the threads."""
        if self._threads:
            return
        self._ending.clear()
        self._wire = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._wire.bind((self.address, self.port))
        self.port = self._wire.getsockname()[1]
        self._foreign = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._http = SensorPageServer(
            (self.address, self.http_port),
            lambda: page_text(page_with_faults(self._page, self._faults)),
            self.fault,
            self._ending,
        )
        self.http_port = self._http.server_address[1]
        self._threads = [
            threading.Thread(target=target, name=f"rdt-emulator-{name}", daemon=True)
            for name, target in (
                ("listen", self._listen),
                ("stream", self._stream),
                ("http", lambda: self._http.serve_forever(poll_interval=0.02)),
            )
        ]
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Stop sending and close both ports; safe when repeated."""
        if not self._threads:
            return
        self._ending.set()
        self._http.shutdown()
        self._foreign.sendto(b"", (self.address, self.port))  # wakes the listener
        self._threads[0].join()
        self._streaming.set()  # wakes the sender; no request can pause it any more
        for thread in self._threads:
            thread.join()
        self._threads = []
        self._streaming.clear()
        self._http.server_close()
        self._foreign.close()
        self._wire.close()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def misbehave(self, name: str, value: float | None = None) -> None:
        """Start a misbehaviour in addition to those already active.

        Parameters
        ----------
        name : str
            A key of `RDT_MISBEHAVIOURS`.
        value : float, optional
            The `value` in its description.
        """
        if name not in RDT_MISBEHAVIOURS:
            raise ValueError(f"{name!r} is no misbehaviour; known: {', '.join(RDT_MISBEHAVIOURS)}")
        with self._lock:  # replaced, never changed, so readers need no lock
            self._faults = {**self._faults, name: value}

    def behave(self) -> None:
        """End all misbehaviours."""
        with self._lock:
            self._faults = {}
            self._lag_since_s = math.nan

    def fault(self, name: str, default: float) -> float | None:
        """Return the value of an active misbehaviour, None if it is not active."""
        return fault_value(self._faults, name, default)

    def _listen(self) -> None:
        while not self._ending.is_set():
            data, client = self._wire.recvfrom(64)
            if len(data) != _REQUEST.size:
                continue
            header, command, _ = _REQUEST.unpack(data)
            if header != 0x1234:
                continue
            self.requests.append(command)
            if command == 0:
                self._streaming.clear()
            elif command in (2, 3) and "deaf" not in self._faults:
                self._client = client
                self._new_stream.set()
                self._streaming.set()

    def _stream(self) -> None:
        interval_s = 1.0 / self.rate_hz
        began_s = time.monotonic()
        k = 0
        while True:
            self._streaming.wait()
            if self._ending.is_set():
                return
            late_s = time.monotonic() - began_s - k * interval_s
            # A sensor's clock never stops, so what a busy machine leaves undone is made up for.
            if late_s > LONGEST_STALL_S or self._new_stream.is_set():
                began_s, k = time.monotonic(), 0
            elif late_s < 0.0:
                time.sleep(-late_s)
            if self._new_stream.is_set():
                self._new_stream.clear()
                self._restart()
            k += 1
            self._step()

    def _restart(self) -> None:
        self._records.restart(self._first_sequence)
        self._late = b""
        self._held = []
        self._on_the_way.clear()
        self._held_since_s = time.monotonic()

    def _step(self) -> None:
        """Take one sample and send it, or apply the active misbehaviours."""
        faults = self._faults
        if not faults:
            self._send_later(b"", 0.0)
            self._flush()
            self._send(self._records.take(faults))
            return
        if ONCE & faults.keys():
            with self._lock:
                self._faults = {k: v for k, v in self._faults.items() if k not in ONCE}
        if "restart" in faults:
            self._records.restart(1)
        if self._paused(faults):
            return
        data = self._records.take(faults)
        if "silent" in faults:
            return
        if "lose_once" in faults:
            self._records.sequence += int(faults["lose_once"] or 1) - 1
            return
        if self._due(faults, "lose"):
            return
        data = self._damaged(faults, data)
        if "foreign" in faults:
            fields = list(RECORD.unpack(self._records.last))
            fields[8] += 10_000_000
            self._foreign.sendto(RECORD.pack(*fields), self._client or (self.address, self.port))
        if self._due(faults, "reorder") or "reorder_once" in faults:
            self._late = data
            return
        copies = 1
        if self._due(faults, "duplicate") or "duplicate_once" in faults:
            copies = 2
        copies = int(fault_value(faults, "flood", 50) or copies)
        hold_s = fault_value(faults, "backlog", 0.05)
        if hold_s is None:
            self._flush()
        else:
            self._held.append(data)
            if time.monotonic() - self._held_since_s >= hold_s:
                self._flush()
            return
        for _ in range(copies):
            self._send_later(data, self._delay_s(faults))

    def _damaged(self, faults: Faults, data: bytes) -> bytes:
        if self._due(faults, "short"):
            data = data[:20]
        if self._due(faults, "long"):
            data += b"\0\0\0\0"
        if self._due(faults, "garbage"):
            data = self._random.randbytes(36)
        return data

    def _delay_s(self, faults: Faults) -> float:
        """Return how late records are at present."""
        rate = fault_value(faults, "lag", 0.5)
        if rate is None:
            self._lag_since_s = math.nan
            return fault_value(faults, "delay", 1.0) or 0.0
        now_s = time.monotonic()
        if math.isnan(self._lag_since_s):
            self._lag_since_s = now_s
        return min(rate * (now_s - self._lag_since_s), LARGEST_LAG_S)

    def _send_later(self, data: bytes, delay_s: float) -> None:
        """Put a record on its way, and send those that have been on it for so long."""
        now_s = time.monotonic()
        if data:
            self._on_the_way.append((now_s, data))
        while self._on_the_way and now_s - self._on_the_way[0][0] >= delay_s:
            self._send(self._on_the_way.popleft()[1])

    def _paused(self, faults: Faults) -> bool:
        """Return whether nothing is measured now; the numbers of records go on without a gap."""
        now_s = time.monotonic()
        half_s = fault_value(faults, "pauses", 0.03)
        if half_s is not None and now_s % (2.0 * half_s) < half_s:
            return True
        pause_s = fault_value(faults, "bursts", 0.095)
        return pause_s is not None and now_s % (0.005 + pause_s) >= 0.005

    def _flush(self) -> None:
        for held in self._held:
            self._send(held)
        self._held = []
        self._held_since_s = time.monotonic()

    def _send(self, data: bytes) -> None:
        if self._client is not None:
            self._wire.sendto(data, self._client)
            if self._late:
                late, self._late = self._late, b""
                self._wire.sendto(late, self._client)

    def _due(self, faults: Faults, name: str) -> bool:
        every = fault_value(faults, name, 10)
        return every is not None and self._records.taken % max(int(every), 1) == 0
