"""The records of the emulated sensor and the list of its misbehaviours; no socket."""

from __future__ import annotations

import random
import struct
from collections import deque

from rigidimeter.testing.emulated_arm import EmulatedArm

RECORD = struct.Struct(">IIIiiiiii")
SAMPLE_RATE_HZ = 7000.0
"""The sensor's own sampling rate, whatever the rate of its records."""

COUNTS_PER_UNIT = 1e6
"""Counts for 1 N and for 1 N·m, whatever the units of the page."""

NOISE_COUNTS = 500.0
"""SD of the noise on the five axes that do not measure the arm."""

RDT_MISBEHAVIOURS = {
    "silent": "No more records are sent.",
    "deaf": "Requests to start are ignored.",
    "frozen_sequence": "The RDT sequence stays the same; the values change.",
    "frozen_ft_sequence": "The FT sequence stays the same; everything else changes.",
    "frozen_values": "The six counts stay the same; the sequences advance.",
    "frozen_record": "The same record is sent again and again.",
    "saturated": "The saturation bit is set and the torque clipped.",
    "serious_status": "The status bits `value` are set (the supply of the analog board too low).",
    "one_bad_status": "A single record has the status bits `value`.",
    "warning": "A monitored condition is latched: a warning.",
    "lose": "Every `value`-th record (10) is not sent.",
    "lose_once": "`value` records (1) are not sent, once.",
    "duplicate": "Every `value`-th record (10) is sent twice.",
    "duplicate_once": "One record is sent twice, once.",
    "reorder": "Every `value`-th record (10) is sent after the one that follows it.",
    "reorder_once": "One record is sent after the one that follows it, once.",
    "short": "Every `value`-th record (10) ends after 20 bytes.",
    "long": "Every `value`-th record (10) has 4 bytes too many.",
    "garbage": "Every `value`-th record (10) is 36 random bytes.",
    "backlog": "Records are held for `value` s (0.05), then sent all at once, repeatedly.",
    "delay": "Records arrive `value` s (1) after they were taken.",
    "lag": "Records arrive ever later: by `value` s (0.5) more each second, up to 1 s.",
    "flood": "Every record is sent `value` times (50).",
    "restart": "The sensor restarts once: both sequences start at 1 again.",
    "foreign": "Another sender sends records with wrong torques to the client.",
    "bias": "The torque has an error of `value` N·m (1), as after zeroing under load.",
    "gain": "The torque is multiplied by `value` (-1); 0 gives a constant.",
    "other_axis": "The torque is on another axis, and the measured one has only noise.",
    "toggles": "The torque is 0, and its last count toggles.",
    "axis_constant": "The torque keeps its value; the other axes have their noise.",
    "late": "The torque is that of `value` s (1) ago; sequences and stamps are of now.",
    "pauses": "No records are sent for `value` s (0.03) of every twice that.",
    "bursts": "Records are sent for 5 ms, then none for `value` s (0.095).",
    "spike": "Every `value`-th record (100) shows 50 N·m more.",
    "changed_units": "The page shows lbf-in.",
    "unknown_units": "The page shows an unknown torque unit.",
    "changed_calibration": "The page shows another transducer with twice the counts.",
    "changed_bias": "The page shows another software bias.",
    "rdt_disabled": "The page shows RDT disabled.",
    "page_rate": "The page states `value` records/s (7000).",
    "page_status": "The page shows the status bits `value` (the supply too low).",
    "http_silent": "The web server accepts requests and does not answer.",
    "http_slow": "The web server answers after `value` s (0.5).",
    "http_drip": "The web server sends the page a byte every `value` s (0.1).",
    "http_error": "The web server answers 500.",
    "http_garbage": "The web server answers with another page.",
}
"""Misbehaviours by name."""

SUPPLY_LOW = 0x80000020
STATUS = {"saturated": 0x80020000, "warning": 0x80010000}
ONCE = {"lose_once", "duplicate_once", "reorder_once", "restart", "one_bad_status"}

Faults = dict[str, float | None]
"""Active misbehaviours and their values; None means the default in the description."""


def fault_value(faults: Faults, name: str, default: float) -> float | None:
    """Return the value of an active misbehaviour, None if it is not active."""
    if name not in faults:
        return None
    value = faults[name]
    return default if value is None else value


class RecordSource:
    """Samples of an arm, packed as records.

    Parameters
    ----------
    arm : EmulatedArm
    rate_hz : float
        Records per second.
    seed : int
    """

    def __init__(self, arm: EmulatedArm, rate_hz: float, seed: int) -> None:
        self._arm = arm
        self._rate_hz = rate_hz
        self._samples_a_record = max(round(SAMPLE_RATE_HZ / rate_hz), 1)
        rng = random.Random(seed)
        # Drawn in advance to save time at 7 kHz.
        self._noise = [[round(rng.gauss(0.0, NOISE_COUNTS)) for _ in range(5)] for _ in range(4096)]
        self.sent: deque[tuple[int, float]] = deque(maxlen=20000)
        self.restart(1)

    def restart(self, sequence: int) -> None:
        """Start a new stream of records."""
        self.taken = 0
        self.sequence = sequence
        self._ft_sequence = 0
        self._before: tuple[int, ...] = ()
        self._past_nm: deque[float] = deque()
        self.last = b""

    def take(self, faults: Faults) -> bytes:
        """Take a sample; return its record."""
        torque_nm = self._arm.torque_nm()
        status = 0
        self.taken += 1
        sequence = self.sequence & 0xFFFFFFFF
        self.sequence += 1
        self._ft_sequence += self._samples_a_record
        ft_sequence = self._ft_sequence
        if faults:
            if "frozen_sequence" in faults:
                self.sequence -= 1
            if "frozen_ft_sequence" in faults:
                self._ft_sequence -= self._samples_a_record
            if "frozen_record" in faults and self.last:
                return self.last
            torque_nm = self._untrue(faults, torque_nm)
            torque_nm += fault_value(faults, "bias", 1.0) or 0.0
            gain = fault_value(faults, "gain", -1.0)
            torque_nm *= 1.0 if gain is None else gain
            every = fault_value(faults, "spike", 100)
            if every is not None and self.taken % int(every) == 0:
                torque_nm += 50.0
            if "saturated" in faults:
                torque_nm = max(-1.0, min(1.0, torque_nm))
            for name in faults.keys() & STATUS.keys():
                status |= STATUS[name]
            for name in ("serious_status", "one_bad_status"):
                status |= int(fault_value(faults, name, SUPPLY_LOW) or 0)
        tz = max(-(2**31), min(2**31 - 1, round(-torque_nm * COUNTS_PER_UNIT)))
        counts: tuple[int, ...] = (*self._noise[self.taken % 4096], tz)
        if "other_axis" in faults:
            counts = (*counts[:4], tz, counts[4])
        if "frozen_values" in faults and self._before:
            counts = self._before
        self._before = counts
        self.last = RECORD.pack(sequence, ft_sequence & 0xFFFFFFFF, status, *counts)
        self.sent.append((sequence, torque_nm))
        return self.last

    def _untrue(self, faults: Faults, torque_nm: float) -> float:
        """Return the torque of a sensor that measures something else than the torque of now."""
        late_s = fault_value(faults, "late", 1.0)
        if late_s is not None:
            self._past_nm.append(torque_nm)
            ready = len(self._past_nm) > late_s * self._rate_hz
            torque_nm = self._past_nm.popleft() if ready else self._past_nm[0]
        if "toggles" in faults:
            torque_nm = (self.taken % 2) / COUNTS_PER_UNIT
        if "axis_constant" in faults and self._before:
            torque_nm = -self._before[-1] / COUNTS_PER_UNIT
        return torque_nm
