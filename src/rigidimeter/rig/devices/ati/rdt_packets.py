"""The packets of the ATI Net F/T's RDT protocol, and the checks on a stream of them; no socket.

A request is 8 bytes: 0x1234, a command, a number of samples (0: until stopped). A record is 36
bytes, all big-endian:

    RDT sequence  u32   number of the record in this stream
    FT sequence   u32   number of the sensor's own sample
    status        u32   0 if there is no error
    Fx Fy Fz Tx Ty Tz   i32 each, counts; divided by the counts per unit they are forces and torques

References
----------
ATI Industrial Automation, Net F/T manual (9620-05-NET FT), chapters on RDT and on the status code.
"""

from __future__ import annotations

import math
import struct
from collections import deque

from rigidimeter.rig.devices.ati.sample_clock import SampleClock
from rigidimeter.rig.guard import Cause

STOP = 0x0000
START_REALTIME = 0x0002

RECORD = struct.Struct("!III24s")
"""One record; its six counts are unpacked only when needed."""

COUNTS = struct.Struct("!6i")

_REQUEST = struct.Struct("!HHI")
_HEADER = 0x1234
_U32 = 0xFFFFFFFF

_ERROR = 1 << 31
_SATURATED = 1 << 17
_MONITOR = 1 << 16

_SERIOUS = _U32 & ~(_ERROR | _SATURATED | _MONITOR)
"""Bits that make every value of the sensor invalid, including the reserved bits.

Excluded are the summary bit (it accompanies every other), saturation (it has its own cause) and a
monitored condition (a threshold that the user set in the sensor: a warning).
"""

_STATUS_WORDS = {
    31: "an error (summary)",
    30: "processor or memory error",
    29: "digital board error",
    28: "analog board error",
    27: "serial link to the analog board is faulty",
    26: "program memory does not verify",
    25: "halted by configuration errors",
    24: "settings do not validate",
    23: "configuration does not fit the calibration",
    22: "network failure",
    21: "CAN error",
    20: "RDT error",
    19: "EtherNet/IP failure",
    18: "DeviceNet failure",
    17: "transducer saturated or A/D error",
    16: "monitored condition latched",
    14: "watchdog timeout",
    13: "stack check failed",
    12: "serial EEPROM failure",
    11: "serial flash failure",
    10: "analog board watchdog timeout",
    9: "strain gage excitation current too high",
    8: "strain gage excitation current too low",
    7: "artificial analog ground out of range",
    6: "analog board supply too high",
    5: "analog board supply too low",
    4: "no data on the serial link",
    3: "reference voltage or power out of range",
    2: "internal temperature out of range",
    1: "HTTP failure",
}


def request(command: int, samples: int = 0) -> bytes:
    """Return the packet of a request."""
    return _REQUEST.pack(_HEADER, command, samples)


def status_words(status: int) -> tuple[str, ...]:
    """Return the names of the bits that are set, the most severe (highest) first.

    >>> status_words(0x80020000)
    ('an error (summary)', 'transducer saturated or A/D error')
    """
    return tuple(
        _STATUS_WORDS.get(bit, f"reserved bit {bit}")
        for bit in range(31, -1, -1)
        if status >> bit & 1
    )


def status_cause(status: int) -> int:
    """Return why samples with these status bits must not be used, `Cause.NONE` if they may."""
    if status & _SATURATED:
        return int(Cause.TORQUE_SATURATED)
    # The summary bit alone is an error too.
    if status & _SERIOUS or status == _ERROR:
        return int(Cause.TORQUE_STATUS)
    return int(Cause.NONE)


NAMES = ("received", "lost", "repeated", "reordered", "damaged", "short", "foreign", "warnings")
"""Names of the counts. Short packets also count as damaged; a late one was counted as lost."""

FARTHEST_JUMP = 50_000
"""More records than a sensor sends in 7 s: such a jump is damage or another stream."""


class RdtStream:
    """Check packets one by one: which is newest, which are missing or repeated.

    A packet is fresh if both its sequences advanced and its counts changed, since a real sensor has
    noise. If packets arrive that are not fresh, the sensor is frozen.

    Parameters
    ----------
    tolerated : int
        How many lost, repeated, reordered or damaged packets are tolerated within the window.
    window_s : float
        The window.
    frozen_s : float
        Longest time without a fresh packet while packets arrive.
    drift : float
        Of the sensor's clock against the computer's, see `SampleClock`.

    Attributes
    ----------
    counts : dict
        By the names in `NAMES`.
    status : int
        The status bits since `begin`, of all plausible packets.
    packed : bytes
        The six counts of the newest packet; empty before the first.
    sequence : int
        Its RDT sequence, -1 before the first.
    sampled_s : float
        When the sensor's newest sample was taken, by its RDT sequence; unchanged while the FT
        sequence is. It never goes back.
    """

    def __init__(self, tolerated: int, window_s: float, frozen_s: float, drift: float) -> None:
        self.counts = dict.fromkeys(NAMES, 0)
        self._window_s, self._frozen_s = window_s, frozen_s
        self._worst = tolerated + 1
        self._clock = SampleClock(drift)
        self.restart()

    def restart(self, rate_hz: float = math.nan) -> None:
        """Reset the stream but not the counts: the sensor starts a new one, of this many records/s.

        While the rate is unknown, a sample is taken to be as old as its arrival.
        """
        self._clock.restart(rate_hz)
        # Times of the last bad packets; too many if it is full within the window.
        self._bad_s: deque[float] = deque(maxlen=self._worst)
        self._ft_sequence = -1
        self._stuck_since_s = math.nan
        self._arrived_s = -math.inf
        self.status = 0
        self.packed = b""
        self.sequence = -1
        self.sampled_s = -math.inf

    def begin(self) -> None:
        """Start to collect the status bits of the next batch of packets."""
        self.status = 0

    def take(self, size: int, buffer: bytearray, now_s: float) -> None:
        """Check one packet from the sensor.

        Parameters
        ----------
        size : int
            Its length.
        buffer : bytearray
            Contains it from its first byte.
        now_s : float
        """
        counts = self.counts
        counts["received"] += 1
        if size != RECORD.size:
            counts["short"] += 1
            self.damaged(now_s)
            return
        sequence, ft_sequence, status, packed = RECORD.unpack_from(buffer)
        if self.sequence < 0:
            self._accept(sequence, ft_sequence, status, packed, now_s)
            self.sampled_s = self._clock.taken_s(now_s, 0)
            return
        # Differences modulo 2^32, so that the wrap-around counts as one step.
        ahead = (sequence - self.sequence) & _U32
        ft_ahead = (ft_sequence - self._ft_sequence) & _U32
        if 0 < ahead <= FARTHEST_JUMP:
            if ft_ahead > _U32 >> 1:  # the sensor's own count went back
                self.damaged(now_s)
                return
            if ahead > 1:
                counts["lost"] += ahead - 1
                self._bad_s.extend((now_s,) * min(ahead - 1, self._worst))
            if ft_ahead and packed != self.packed:
                self._stuck_since_s = math.nan
            elif math.isnan(self._stuck_since_s):
                self._stuck_since_s = now_s
            taken_s = self._clock.taken_s(now_s, ahead)
            if ft_ahead:
                self.sampled_s = max(self.sampled_s, taken_s)
            self._accept(sequence, ft_sequence, status, packed, now_s)
        elif ahead == 0:
            counts["repeated"] += 1
            # A single copy comes from the network. A series of them means a frozen sensor, which is
            # detected by its duration and not counted as many bad packets.
            if math.isnan(self._stuck_since_s):
                self._bad_s.append(now_s)
                self._stuck_since_s = now_s
            self._arrived_s = now_s
            self._note(status)
        elif _U32 + 1 - ahead <= FARTHEST_JUMP:
            counts["reordered"] += 1
            self._bad_s.append(now_s)
            self._note(status)
        else:
            self.damaged(now_s)

    def damaged(self, now_s: float) -> None:
        """Count a packet that cannot be trusted."""
        self.counts["damaged"] += 1
        self._bad_s.append(now_s)

    def cause(self, now_s: float) -> int:
        """Return why the newest packet must not be used; the most severe reason first."""
        if self.status:
            cause = status_cause(self.status)
            if cause:
                return cause
        # A NaN compares as false. Only packets that arrive can show a frozen sensor.
        if self._arrived_s - self._stuck_since_s >= self._frozen_s:
            return int(Cause.TORQUE_FROZEN)
        bad = self._bad_s
        if len(bad) == self._worst and now_s - bad[0] <= self._window_s:
            return int(Cause.TORQUE_PACKETS)
        return int(Cause.NONE)

    def _accept(
        self, sequence: int, ft_sequence: int, status: int, packed: bytes, now_s: float
    ) -> None:
        self.sequence, self._ft_sequence, self.packed = sequence, ft_sequence, packed
        self._arrived_s = now_s
        if status:
            self._note(status)

    def _note(self, status: int) -> None:
        if status:
            self.status |= status
            if not status_cause(status):
                self.counts["warnings"] += 1
