"""The ramp to rest: the velocity becomes zero within the acceleration limit, whatever fails."""

from __future__ import annotations

import math

from rigidimeter.rig.acquisition.tick import REST, ControlLoop, run_tick, ticks_late
from rigidimeter.rig.devices.base import Reading

SPARE_TICKS = 10
"""A ramp to rest may take so many ticks more than the speed and the acceleration limit say."""


def ramp_to_rest(loop: ControlLoop) -> None:
    """Ramp the velocity to zero within the acceleration limit, however long that takes.

    A tick that fails, say because its sample cannot be recorded, does not end the ramp. It goes
    on without reading and recording, and the failure is raised after it.
    """
    try:
        # The guard takes as much off at every tick; some more for how floats are rounded.
        ticks = math.ceil(abs(loop.guard.velocity_rad_s) / _brake_rad_s(loop))
        for _ in range(ticks + SPARE_TICKS):
            if loop.guard.velocity_rad_s == 0.0:
                return
            run_tick(loop, REST, 0, _no_motion)
    except BaseException:  # also when interrupted: the arm still moves
        _ramp_unrecorded(loop)
        raise


def _no_motion(_: Reading, __: float, ___: int) -> tuple[float, float, float]:
    return 0.0, 0.0, math.nan


def _brake_rad_s(loop: ControlLoop) -> float:
    return loop.limits.acceleration_rad_s2 * loop.interval_s


def _ramp_unrecorded(loop: ControlLoop) -> None:
    """Only write: what else a tick does has failed."""
    # The ramp takes its time, however late the failure made it.
    loop.tick += max(ticks_late(loop), 0)
    while (velocity := loop.guard.velocity_rad_s) != 0.0:
        velocity = math.copysign(max(abs(velocity) - _brake_rad_s(loop), 0.0), velocity)
        loop.guard = loop.guard._replace(velocity_rad_s=velocity)
        loop.clock.wait_until(loop.time_s)
        loop.rig.write(velocity)
        loop.tick += 1
