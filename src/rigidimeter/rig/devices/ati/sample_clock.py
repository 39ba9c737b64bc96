"""When a sample was taken, by the sensor's own counter on the computer's clock.

Packet n of a stream was taken at n/f on the sensor's clock and arrives at t. What it took longer
than the fastest packet so far is

    age = (t − n/f) − m,      m = min(t − n/f, m before + d · (time since the packet before))

so a packet that lay anywhere on its way, in the sensor, the network or the computer, is as old as
it is, however it arrives. The two clocks need not agree: m may rise by the drift d (s/s), which
hides a delay that grows more slowly than that, and follows a packet that is faster at once. But no
packet is faster than the first by more than the first may have been late. A counter that gains more
than that on the clock has another rate than f: its samples then bear times still to come. A delay
that is the same from the first packet on cannot be seen here: the age is that beyond it.
"""

from __future__ import annotations

import math

LONGEST_DELAY_S = 0.1
"""From a request to the first sample: a sensor answers in some ms, and samples may be so old."""


class SampleClock:
    """The time of each sample of a stream.

    Parameters
    ----------
    drift : float
        Largest rate at which the clocks of sensor and computer may part, in s/s.
    """

    def __init__(self, drift: float) -> None:
        self._drift = drift
        self.restart(math.nan)

    def restart(self, rate_hz: float) -> None:
        """Begin with the next sample; NaN if the rate is unknown, samples then have no age."""
        self._interval_s = 1.0 / rate_hz
        self._count = 0
        self._offset_s, self._min_s = math.inf, -math.inf
        self._arrived_s = -math.inf

    def taken_s(self, arrived_s: float, steps: int) -> float:
        """Return when a sample was taken.

        Parameters
        ----------
        arrived_s : float
            When it arrived, on the computer's clock.
        steps : int
            By how many its counter is ahead of the sample before.

        Examples
        --------
        At 10 samples/s the second comes when it should, the third 0.3 s late.

        >>> clock = SampleClock(drift=0.0)
        >>> clock.restart(10.0)
        >>> [round(clock.taken_s(t, 1), 3) for t in (5.0, 5.1, 5.5)]
        [5.0, 5.1, 5.2]
        """
        if math.isnan(self._interval_s):
            return arrived_s
        self._count += steps
        counted_s = self._count * self._interval_s
        if math.isinf(self._offset_s):
            self._offset_s = arrived_s - counted_s
            self._min_s, self._arrived_s = self._offset_s - LONGEST_DELAY_S, arrived_s
        drift_s = self._drift * max(arrived_s - self._arrived_s, 0.0)
        self._min_s -= drift_s
        self._offset_s = min(arrived_s - counted_s, self._offset_s + drift_s)
        self._offset_s = max(self._offset_s, self._min_s)
        self._arrived_s = arrived_s
        return self._offset_s + counted_s
