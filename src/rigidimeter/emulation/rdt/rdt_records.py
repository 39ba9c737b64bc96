"""The samples of the sensor's wire peer, packed as records; no socket."""

from __future__ import annotations

import random
import struct
from collections import deque

from rigidimeter.emulation.emulated_arm import EmulatedArm
from rigidimeter.emulation.rdt.rdt_faults import STATUS, SUPPLY_LOW, Faults, fault_value

__all__ = ["RECORD", "SAMPLE_RATE_HZ", "RecordSource"]

RECORD = struct.Struct(">IIIiiiiii")
SAMPLE_RATE_HZ = 7000.0
"""At which the sensor samples, whatever the rate of its records."""


class RecordSource:
    """Sample an arm and pack what is found.

    Parameters
    ----------
    arm : EmulatedArm
    rate_hz : float
        Records per second.
    counts_per_nm : float
    noise_counts : float
        SD of the noise on the five axes that do not see the arm.
    seed : int
    """

    def __init__(
        self,
        arm: EmulatedArm,
        rate_hz: float,
        counts_per_nm: float,
        noise_counts: float,
        seed: int,
    ) -> None:
        self._arm = arm
        self._counts_per_nm = counts_per_nm
        self._samples_a_record = max(round(SAMPLE_RATE_HZ / rate_hz), 1)
        rng = random.Random(seed)
        # Drawn beforehand: at 7 kHz every microsecond counts.
        self._noise = [[round(rng.gauss(0.0, noise_counts)) for _ in range(5)] for _ in range(4096)]
        self.sent: deque[tuple[int, float]] = deque(maxlen=20000)
        self.bias_nm = 0.0
        self.restart(1)

    def restart(self, sequence: int) -> None:
        """Begin a new stream of records."""
        self.taken = 0
        self.sequence = sequence
        self._ft_sequence = 0
        self._before: tuple[int, ...] = ()
        self.last = b""

    def take(self, faults: Faults) -> bytes:
        """Take a sample; return its record."""
        torque_nm = self._arm.torque_nm() - self.bias_nm
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
            torque_nm += fault_value(faults, "bias", 1.0) or 0.0
            every = fault_value(faults, "spike", 100)
            if every is not None and self.taken % int(every) == 0:
                torque_nm += 50.0
            if "saturated" in faults:
                torque_nm = max(-1.0, min(1.0, torque_nm))
            for name in faults.keys() & STATUS.keys():
                status |= STATUS[name]
            for name in ("serious_status", "one_bad_status"):
                status |= int(fault_value(faults, name, SUPPLY_LOW) or 0)
        tz = max(-(2**31), min(2**31 - 1, round(-torque_nm * self._counts_per_nm)))
        counts: tuple[int, ...] = (*self._noise[self.taken % 4096], tz)
        if "frozen_values" in faults and self._before:
            counts = self._before
        self._before = counts
        self.last = RECORD.pack(sequence, ft_sequence & 0xFFFFFFFF, status, *counts)
        self.sent.append((sequence, torque_nm))
        return self.last
