"""The live estimator's process: J, B and K from the ring to the shared status, while the arm moves.

It reads the samples as the console does: where it falls behind it misses some, begins anew, and
says how many. Nothing waits for it. It begins anew with every epoch too: the joint stands still
then, which is how the filters begin, and no condition is mixed with another. Rests are left out.
"""

from __future__ import annotations

import math
import os
import time
from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.settings import OnlineSettings
from rigidimeter.model import STATE_SIZE, online_design, online_reading, online_step, online_torque
from rigidimeter.rig.acquisition import REST
from rigidimeter.rig.acquisition.processes.end_signals import leave_to_the_others
from rigidimeter.rig.acquisition.processes.ring import ROW, SampleReader
from rigidimeter.rig.acquisition.processes.session_memory import SessionMemory
from rigidimeter.rig.acquisition.processes.status_values import LiveEstimate, ProcessCondition, Role

POLL_S = 0.1

_TAKEN = ("torque_nm", "angle_rad", "velocity_rad_s")


class Estimator:
    """The online estimate, fed with rows of the ring.

    Parameters
    ----------
    settings : OnlineSettings
    rate_hz : float
    """

    def __init__(self, settings: OnlineSettings, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._design = online_design(settings, rate_hz)
        self._state = [0.0] * STATE_SIZE
        self._missed = 0
        self._tick, self._epoch = -1, REST
        self.since_s = self._time_s = 0.0
        self._last: NDArray[np.void] = np.empty(0, ROW)
        self._steps, self._steps_nm2 = 0, 0.0

    def take(self, rows: NDArray[np.void], missed: int) -> LiveEstimate:
        """Take samples; return what is known after them."""
        deque(self.steps(rows, missed), maxlen=0)
        found = online_reading(self._design, self._state, self._rate_hz)
        return LiveEstimate(
            tick=self._tick,
            resting=int(found.resting),
            missed_samples=self._missed,
            epoch=self._epoch,
            since_s=self.since_s,
            time_s=self._time_s,
            **{name: getattr(found, name) for name in LiveEstimate._fields[6:-1]},
            step_nm=math.sqrt(self._steps_nm2 / self._steps) if self._steps else math.nan,
        )

    def steps(self, rows: NDArray[np.void], missed: int) -> Iterator[int]:
        """Take samples, and give the tick of each once it is taken.

        After a gap, and with a new epoch, filters and memory begin anew.
        """
        begins = np.flatnonzero(np.diff(rows["epoch"])) + 1
        for k, part in enumerate(np.split(rows, begins) if rows.size else ()):
            epoch, gap = int(part["epoch"][0]), missed and k == 0
            if gap:
                self._missed += missed
            if epoch == REST:
                continue
            if gap or epoch != self._epoch:
                self._epoch, self.since_s = epoch, float(part["time_s"][0])
                self._state, self._last = [0.0] * STATE_SIZE, part[:0]
                self._steps, self._steps_nm2 = 0, 0.0
            yield from self._take(part)

    def torque(self) -> tuple[float, float]:
        """Return the torque of the last sample in the band in N·m: measured, and modelled."""
        return online_torque(self._state)

    def _take(self, rows: NDArray[np.void]) -> Iterator[int]:
        """Take samples of one epoch; ticks that the loop left out lie on straight lines.

        Passed over they would make the motion shorter, and so faster, than it was.
        """
        ticks = rows["tick"]
        if self._last.size:  # of the epoch, and already taken: the first of the lines begins there
            rows, ticks = np.concatenate((self._last, rows)), np.append(self._last["tick"], ticks)
        steps_nm = np.diff(rows["torque_nm"])[np.diff(ticks) == 1]
        self._steps += steps_nm.size
        self._steps_nm2 += float(np.nansum(steps_nm * steps_nm))
        every = np.arange(ticks[0] + self._last.size, ticks[-1] + 1)
        columns = [np.interp(every, ticks, rows[name]).tolist() for name in _TAKEN]
        self._last = rows[-1:].copy()
        self._tick, self._time_s = int(ticks[-1]), float(rows["time_s"][-1])
        for tick, *sample in zip(every.tolist(), *columns, strict=True):
            online_step(self._design, self._state, *sample)
            yield tick


def estimator_main(
    settings: OnlineSettings,
    rate_hz: float,
    names: tuple[str, str, str],
    lost_s: float,
    console_pid: int,
) -> None:
    """Estimate until the loop has ended; the target of the estimator's process.

    Parameters
    ----------
    settings : OnlineSettings
    rate_hz : float
    names : tuple of str
        Of the sample ring, the event ring and the shared status.
    lost_s : float
        Recorder and loop both silent for so long have ended.
    console_pid : int
        The process that started this one; without it nobody looks at the estimate.
    """
    leave_to_the_others()
    shared = SessionMemory.attach_or_end(names)
    status = shared.status
    try:
        status.join(Role.ESTIMATOR)
        estimator = Estimator(settings, rate_hz)
        reader = SampleReader(shared.samples)
        status.set_condition(Role.ESTIMATOR, ProcessCondition.RUNNING)
        while os.getppid() == console_pid and not status.ended(Role.LOOP, lost_s):
            status.beat(Role.ESTIMATOR)
            rows, missed = reader.read()
            if rows.size:
                status.show_live(estimator.take(rows, missed))
            time.sleep(POLL_S)
        status.set_condition(Role.ESTIMATOR, ProcessCondition.DONE)
    finally:
        shared.leave()
