"""An ATI Net F/T force/torque sensor: calibration over HTTP, samples over UDP (RDT).

The torque about the joint is a weighted sum of what the sensor measures,

    M = sign · (w1 Fx + w2 Fy + w3 Fz + w4 Tx + w5 Ty + w6 Tz),

with w1 … w3 the lever arms in m. A sensor reads the load on its tool side. Mounted on the drive
with the arm on its tool side it reads what the arm does to the drive, the opposite of what the
drive applies to the joint, so `sign` is −1 by default. Turned about, it is +1. A wrong sign makes
the loop run away from the subject instead of giving way: check it by hand, without power, before
the first run.

The sensor serves one client, the last that asked. Its packets carry no checksum beyond UDP's and
no sender but an address; keep it on a wire of its own.
"""

from __future__ import annotations

import math
import socket
import struct
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict
from typing import ClassVar

from rigidimeter.devices.ati.rdt_packets import (
    COUNTS,
    START_REALTIME,
    STOP,
    RdtStream,
    request,
    status_words,
)
from rigidimeter.devices.ati.rdt_setup import (
    AtiRdtSettings,
    SensorPage,
    changes,
    fetch_page,
    refuse_unexpected,
)
from rigidimeter.devices.base import DeviceError, DeviceFacts, Now, TorqueSample
from rigidimeter.guard import Cause

__all__ = ["AtiRdt", "AtiRdtSettings"]

MOST_PACKETS_A_READ = 256
"""A read ends here, well under a tick, whatever arrives; the rest is for the next one."""

RECEIVE_BUFFER = (socket.SOL_SOCKET, socket.SO_RCVBUF)
RECEIVE_BUFFER_BYTES = 1 << 20
"""Room for what arrives while the loop is held up; when it is full the newest would be lost."""

SO_TIMESTAMPNS = 35
"""Linux: the kernel notes with each packet when it arrived. Python has no name for it."""
TIMESPEC = struct.Struct("@qq")
NOTE_BYTES = socket.CMSG_SPACE(TIMESPEC.size)
LONGEST_WAIT_S = 0.2


class AtiRdt:
    """A `TorqueSensor`.

    Once configured, an instance knows its sensor: after another `connect`, `configure` refuses one
    with other units, calibration, tool transformation, bias or filter. A new one begins afresh.

    Parameters
    ----------
    settings : AtiRdtSettings
    now : callable
        The loop's clock.
    """

    Settings: ClassVar[type[AtiRdtSettings]] = AtiRdtSettings

    def __init__(self, settings: AtiRdtSettings, now: Now) -> None:
        self._settings = settings
        self._now = now
        self._device = f"torque sensor at {settings.address}"
        self._socket: socket.socket | None = None
        self._configured = False
        self._sensor = ("", 0)
        self._page: SensorPage | None = None
        self._gains = [math.nan] * 6
        self._buffer = bytearray(64)  # longer than a record: a longer packet shows
        self._stream = RdtStream(
            settings.tolerated_packets, settings.packet_window_s, settings.frozen_s
        )
        self._sample = TorqueSample(math.nan, -math.inf)

    def connect(self) -> None:
        """Open the wire; the sensor hears nothing of it yet.

        Raises
        ------
        DeviceError
            If the address means nothing.
        """
        self.close()
        settings = self._settings
        try:
            # Packets are compared with the number, not with the name.
            self._sensor = (socket.gethostbyname(settings.address), settings.port)
        except (OSError, UnicodeError) as error:  # a name may be malformed, too
            raise DeviceError(
                f"{self._device}: the address cannot be found ({error}); "
                "it must be the sensor's, such as 192.168.1.1"
            ) from error
        self._open()

    def configure(self) -> DeviceFacts:
        """Read the calibration back, compare it, start the samples and wait for the first.

        Raises
        ------
        DeviceError
            If it does not answer, reports an error, or is not what is expected or what it was.
        """
        if self._socket is None:
            raise DeviceError(f"{self._device}: it is not connected; connect before configuring")
        self._configured = False
        settings, page = self._settings, self._fetch()
        self._check(page)
        force = settings.sign * page.newton_per_count
        torque = settings.sign * page.newton_metre_per_count
        scales = (force, force, force, torque, torque, torque)
        self._gains = [
            weight * scale for weight, scale in zip(settings.weights, scales, strict=True)
        ]
        self._start()
        self._page, self._configured = page, True
        values = asdict(page)
        values |= {"sign": settings.sign, "weights": " ".join(f"{w:g}" for w in settings.weights)}
        values["receive_buffer_bytes"] = self._socket.getsockopt(*RECEIVE_BUFFER)
        return DeviceFacts(page.model, page.serial, page.rate_hz, None, values)

    def read(self) -> TorqueSample:
        """Return the newest sample without waiting; the one before again if there is none.

        `status` holds every bit since the read before, so that none is missed between two ticks.
        """
        wire = self._socket
        if wire is None:
            return self._sample
        # Before the packets: a sample may look older than it is, never newer.
        now_s, wall_ns = self._now(), time.time_ns()
        stream, buffers, sensor = self._stream, (self._buffer,), self._sensor
        buffer = self._buffer
        stream.begin()
        touched = backlog = False
        before_s = stream.sampled_s
        try:
            for _ in range(MOST_PACKETS_A_READ):
                size, notes, _, source = wire.recvmsg_into(buffers, NOTE_BYTES)
                if source == sensor:
                    touched = True
                    stream.take(size, buffer, now_s - _waited_s(notes, wall_ns))
                else:
                    stream.counts["foreign"] += 1
            backlog = True
        except BlockingIOError:
            pass  # drained: the end of every ordinary read
        except OSError:
            # The interface went away, say. The sample ages and the guard acts on it.
            touched = True
            stream.damaged(now_s)
        if not touched:
            return self._sample
        if backlog:
            stream.sampled_s = before_s  # how old what was read is, nobody knows
        raw: tuple[int, ...] = ()
        torque_nm = math.nan
        if stream.packed:
            raw = COUNTS.unpack(stream.packed)
            fx, fy, fz, tx, ty, tz = raw
            a, b, c, d, e, f = self._gains
            torque_nm = a * fx + b * fy + c * fz + d * tx + e * ty + f * tz
        self._sample = TorqueSample(
            torque_nm,
            stream.sampled_s,
            stream.sequence,
            raw,
            stream.status,
            stream.cause(now_s),
        )
        return self._sample

    @property
    def counts(self) -> Mapping[str, int]:
        """Packets received, lost, repeated, reordered, damaged, short, foreign, and warnings."""
        return dict(self._stream.counts)

    def restart(self) -> None:
        """Ask for the samples anew: those that piled up while nobody read are not lost ones.

        Raises
        ------
        DeviceError
            If none comes, or the sensor was not configured since it was connected.
        """
        if not self._configured:
            raise DeviceError(f"{self._device}: it is not configured; configure it first")
        self._start()

    def close(self) -> None:
        """Stop the samples and close the wire. Safe to call at any time, and twice."""
        wire, self._socket = self._socket, None
        self._configured = False
        if wire is None:
            return
        try:
            for _ in range(2):  # nothing confirms it, and a packet may be lost
                wire.sendto(request(STOP), self._sensor)
        except OSError:
            self._stream.damaged(self._now())  # the wire is gone: nothing can be told to the sensor
        finally:
            wire.close()

    def _open(self) -> None:
        wire = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        wire.setsockopt(*RECEIVE_BUFFER, RECEIVE_BUFFER_BYTES)
        if sys.platform.startswith("linux"):
            wire.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        wire.setblocking(False)
        self._socket = wire
        self._stream.restart()
        self._sample = TorqueSample(math.nan, -math.inf)

    def _fetch(self) -> SensorPage:
        settings = self._settings
        return fetch_page(
            self._sensor[0], settings.http_port, settings.timeout_s, self._device, self._now
        )

    def _check(self, page: SensorPage) -> None:
        refuse_unexpected(self._settings, page, self._device)
        changed = changes(self._page, page) if self._page is not None else ""
        if changed:
            raise DeviceError(
                f"{self._device}: it came back changed ({changed}); set it back, or check it and "
                "begin a new session"
            )

    def _start(self) -> None:
        """Ask for samples until the first arrives."""
        if self._socket is not None:
            self._socket.close()  # what is still under way goes to the old port
        self._open()
        tries = 4
        for _ in range(tries):  # a request may be lost
            self._send(START_REALTIME)
            until_s = self._now() + self._settings.timeout_s / tries
            while self._wait(until_s):
                sample = self.read()
                if sample.sequence >= 0:
                    if sample.cause:
                        raise DeviceError(
                            f"{self._device}: {Cause(sample.cause).sentence} "
                            f"(status {sample.status:#010x}: "
                            f"{', '.join(status_words(sample.status)) or 'none'}); "
                            "the first sample must be good"
                        )
                    return
        host, port = self._sensor
        raise DeviceError(
            f"{self._device}: no sample from {host}:{port} within {self._settings.timeout_s:g} s, "
            f"packets counted: {self.counts}; check firewall, port and that RDT is enabled"
        )

    def _send(self, command: int) -> None:
        if self._socket is None:
            raise DeviceError(f"{self._device}: it is not connected; connect before asking it")
        try:
            self._socket.sendto(request(command), self._sensor)
        except OSError as error:
            raise DeviceError(
                f"{self._device}: a request cannot be sent ({error}); check the network"
            ) from error

    def _wait(self, until_s: float) -> bool:
        """Wait for a packet; False when it is too late. Not for the loop."""
        wire, left_s = self._socket, until_s - self._now()
        if wire is None or left_s <= 0.0:
            return False
        wire.settimeout(left_s)
        try:
            wire.recv_into(self._buffer, 0, socket.MSG_PEEK)
        except TimeoutError:
            return False
        finally:
            wire.setblocking(False)
        return True


def _waited_s(notes: list[tuple[int, int, bytes]], wall_ns: int) -> float:
    """Return how long a packet had lain in the kernel, 0 where that is not known.

    The kernel stamps arrivals by the wall clock, so only the difference to the wall clock of this
    moment is used, and only one that can be: a clock that was set in between tells nothing.
    """
    for level, kind, data in notes:
        if level == socket.SOL_SOCKET and kind == SO_TIMESTAMPNS:
            seconds, nanoseconds = TIMESPEC.unpack_from(data)
            waited_s = 1e-9 * (wall_ns - (1_000_000_000 * seconds + nanoseconds))
            return waited_s if 0.0 < waited_s < LONGEST_WAIT_S else 0.0
    return 0.0
