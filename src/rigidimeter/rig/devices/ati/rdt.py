"""An ATI Net F/T force/torque sensor: calibration over HTTP, samples over UDP (RDT).

The torque about the joint is a weighted sum of what the sensor measures,

    M = sign · (w1 Fx + w2 Fy + w3 Fz + w4 Tx + w5 Ty + w6 Tz),

with w1 … w3 the lever arms in m. A sensor measures the load on its tool side. Mounted on the drive
with the arm on its tool side it measures what the arm applies to the drive, the opposite of what
the drive applies to the joint, so `sign` is −1 by default. Mounted the other way round it is +1.
With a wrong sign the loop moves against the subject instead of giving way: check the sign by hand,
without power, before the first run.

The sensor serves one client, the last that sent a request. Its packets have only UDP's checksum and
are identified only by their address, so give it a network of its own.
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

from rigidimeter.rig.devices.ati.rdt_packets import (
    COUNTS,
    START_REALTIME,
    STOP,
    RdtStream,
    request,
    status_words,
)
from rigidimeter.rig.devices.ati.rdt_setup import (
    AtiRdtSettings,
    SensorPage,
    fetch_page,
    page_changes,
    refuse_unexpected,
)
from rigidimeter.rig.devices.ati.sample_clock import LONGEST_DELAY_S
from rigidimeter.rig.devices.base import DeviceError, DeviceFacts, Now, TorqueSample
from rigidimeter.rig.guard import Cause

MAX_PACKETS_A_READ = 256
"""Limit of one read, well below a tick; further packets are left for the next read."""

RECEIVE_BUFFER = (socket.SOL_SOCKET, socket.SO_RCVBUF)
RECEIVE_BUFFER_BYTES = 1 << 20
"""Space for packets that arrive while the loop is held up; a full buffer drops the newest."""

SO_TIMESTAMPNS = 35
"""Linux: the kernel stamps each packet on arrival. Python has no name for this option."""
TIMESPEC = struct.Struct("@qq")
NOTE_BYTES = socket.CMSG_SPACE(TIMESPEC.size)
LONGEST_WAIT_S = 0.2
COUNTED_S, GIVE_UP_S, RATE_TOLERANCE = 0.1, 1.0, 0.1
"""The records are counted for at least so long, until they come at the stated rate to this share,
or for longer than a busy computer may hold them up."""


class AtiRdt:
    """A `TorqueSensor`.

    An instance remembers the sensor it configured: after another `connect`, `configure` refuses one
    with other units, calibration, tool transformation, bias or filter.

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
        self._buffer = bytearray(64)  # longer than a record, to detect longer packets
        self._stream = RdtStream(
            settings.tolerated_packets,
            settings.packet_window_s,
            settings.frozen_s,
            1e-6 * settings.clock_drift_ppm,
        )
        self._sample = TorqueSample(math.nan, -math.inf)

    def connect(self) -> None:
        """Open the socket; nothing is sent to the sensor yet.

        Raises
        ------
        DeviceError
            If the address cannot be resolved.
        """
        self.close()
        settings = self._settings
        try:
            # The source of a packet is compared with the numeric address.
            self._sensor = (socket.gethostbyname(settings.address), settings.port)
        except (OSError, UnicodeError) as error:  # a name may be malformed, too
            raise DeviceError(
                f"{self._device}: the address cannot be found ({error}); "
                "it must be the sensor's, such as 192.168.1.1"
            ) from error
        self._open(math.nan)

    def configure(self) -> DeviceFacts:
        """Read the calibration, compare it, start sampling and wait for the first sample.

        Raises
        ------
        DeviceError
            If the sensor does not answer, reports an error, or differs from what is expected.
        """
        if self._socket is None:
            raise DeviceError(f"{self._device}: it is not connected; connect before configuring")
        self._configured = False
        settings = self._settings
        page = fetch_page(
            self._sensor[0], settings.http_port, settings.timeout_s, self._device, self._now
        )
        refuse_unexpected(settings, page, self._device)
        changed = page_changes(self._page, page) if self._page is not None else ""
        if changed:
            raise DeviceError(
                f"{self._device}: it came back changed ({changed}); set it back, or check it and "
                "begin a new session"
            )
        force = settings.sign * page.newton_per_count
        torque = settings.sign * page.newton_metre_per_count
        scales = (force, force, force, torque, torque, torque)
        self._gains = [
            weight * scale for weight, scale in zip(settings.weights, scales, strict=True)
        ]
        self._start(page)
        self._count(page.sample_rate_hz)
        self._page, self._configured = page, True
        values = asdict(page)
        del values["internal_rate_hz"]  # no more is known of the torque for it
        values |= {"sign": settings.sign, "weights": " ".join(f"{w:g}" for w in settings.weights)}
        values["receive_buffer_bytes"] = self._socket.getsockopt(*RECEIVE_BUFFER)
        return DeviceFacts(page.model, page.serial, page.rate_hz, None, values)

    def read(self) -> TorqueSample:
        """Return the newest sample without waiting; the previous one if there is no new one.

        `status` holds all bits since the previous read, so that none is missed between two ticks.
        """
        wire = self._socket
        if wire is None:
            return self._sample
        # Taken before the packets: one may seem to have arrived earlier than it did, never later.
        now_s, wall_ns = self._now(), time.time_ns()
        stream, buffers, sensor = self._stream, (self._buffer,), self._sensor
        buffer = self._buffer
        stream.begin()
        touched = backlog = False
        before_s = stream.sampled_s
        try:
            for _ in range(MAX_PACKETS_A_READ):
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
            # For example, the interface went down. The sample ages, and the guard acts on that.
            touched = True
            stream.damaged(now_s)
        if not touched:
            return self._sample
        if backlog:
            stream.sampled_s = before_s  # newer ones wait: this one is not fresh
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
        """Restart the stream: samples that piled up meanwhile must not count as lost.

        Raises
        ------
        DeviceError
            If no sample arrives, or the sensor was not configured since it was connected.
        """
        if not self._configured or self._page is None:
            raise DeviceError(f"{self._device}: it is not configured; configure it first")
        self._start(self._page)

    def close(self) -> None:
        """Stop sampling and close the socket. Safe at any time and when repeated."""
        wire, self._socket = self._socket, None
        self._configured = False
        if wire is None:
            return
        try:
            for _ in range(2):  # it is not confirmed, and a packet may be lost
                wire.sendto(request(STOP), self._sensor)
        except OSError:
            self._stream.damaged(self._now())  # the sensor cannot be reached any more
        finally:
            wire.close()

    def _open(self, rate_hz: float) -> None:
        wire = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        wire.setsockopt(*RECEIVE_BUFFER, RECEIVE_BUFFER_BYTES)
        if sys.platform.startswith("linux"):
            wire.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        wire.setblocking(False)
        self._socket = wire
        self._stream.restart(rate_hz)
        self._sample = TorqueSample(math.nan, -math.inf)

    def _start(self, page: SensorPage) -> None:
        """Request samples until the first one arrives, soon after a request.

        A delay that all packets have alike shows in nothing but the answer to a request.
        """
        tries, answer = 4, "no sample"
        for _ in range(tries):  # a request may be lost
            if self._socket is not None:
                self._socket.close()  # packets still on their way go to the old port
            self._open(page.sample_rate_hz)
            asked_s = self._now()
            self._send(START_REALTIME)
            sample = self._first_sample(asked_s + self._settings.timeout_s / tries)
            if sample is None:
                continue
            if sample.cause:
                raise DeviceError(
                    f"{self._device}: {Cause(sample.cause).sentence} "
                    f"(status {sample.status:#010x}: "
                    f"{', '.join(status_words(sample.status)) or 'none'}); "
                    "the first sample must be good"
                )
            waited_s = sample.time_s - asked_s
            if waited_s <= LONGEST_DELAY_S:
                return
            answer = f"the first sample came {waited_s:.2f} s after each request, not"
        host, port = self._sensor
        limit_s = LONGEST_DELAY_S if answer != "no sample" else self._settings.timeout_s
        raise DeviceError(
            f"{self._device}: {answer} from {host}:{port} within {limit_s:g} s, "
            f"packets counted: {self.counts}; check firewall, port and that RDT is enabled"
        )

    def _count(self, stated_hz: float) -> None:
        """Refuse a stream of another rate than the page states: its stamps would be wrong.

        It is counted anew after `COUNTED_S`, so that one stall of this computer is no other rate.
        """
        until_s = self._now() + GIVE_UP_S
        began_s, first = self._now(), self._stream.sequence
        passed_s = rate_hz = 0.0
        while passed_s < COUNTED_S or abs(rate_hz / stated_hz - 1.0) > RATE_TOLERANCE:
            if passed_s >= COUNTED_S:
                began_s, first = self._now(), self._stream.sequence
            if not self._wait(until_s):
                raise DeviceError(
                    f"{self._device}: its page states {stated_hz:.4g} records/s and it sends "
                    f"{rate_hz:.4g}; set the RDT output rate on the sensor's Communications page, "
                    "and power the sensor off and on"
                )
            self.read()
            passed_s = self._now() - began_s
            rate_hz = (self._stream.sequence - first) % 2**32 / passed_s

    def _first_sample(self, until_s: float) -> TorqueSample | None:
        while self._wait(until_s):
            sample = self.read()
            if sample.sequence >= 0:
                return sample
        return None

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
        """Wait for a packet; return False on timeout. Not for use in the loop."""
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
    """Return how long a packet waited in the kernel, in s; 0 if unknown.

    The kernel stamps arrivals by the wall clock, so only the difference to the present wall clock
    is used, and only if it is plausible: the clock may have been set in between.
    """
    for level, kind, data in notes:
        if level == socket.SOL_SOCKET and kind == SO_TIMESTAMPNS:
            seconds, nanoseconds = TIMESPEC.unpack_from(data)
            waited_s = 1e-9 * (wall_ns - (1_000_000_000 * seconds + nanoseconds))
            return waited_s if 0.0 < waited_s < LONGEST_WAIT_S else 0.0
    return 0.0
