"""How a session ends, whatever ends it: the ramp to rest, the power off, the record closed."""

from __future__ import annotations

import math

from rigidimeter.core.units import deg_from_rad
from rigidimeter.rig.acquisition.control_modes import hold, ramp_to_rest
from rigidimeter.rig.acquisition.controller_run import ControllerRun
from rigidimeter.rig.acquisition.run_states import Phase
from rigidimeter.rig.acquisition.supervision import Sink
from rigidimeter.rig.acquisition.tick import ControlLoop
from rigidimeter.rig.devices.base import Rig
from rigidimeter.rig.guard import Cause

BRAKE_S = 0.1
"""For so long a drive that left its state brakes by its own ramp before its power goes."""

WATCHED_S = 1.0
"""For so long the joint is watched once its power is off."""


def end_session(run: ControllerRun, rig: Rig, sink: Sink) -> None:
    """Stop, disable, close: every step is tried even when one before it fails."""
    run.begin(Phase.HOLD)
    try:
        ramp_to_rest(run.loop)
    finally:
        run.come_to_end()
        try:
            _brake_and_disable(run.loop, rig)
            if why := _after_power(run.loop, rig):
                run.reason = f"{run.reason}; {why}" if run.reason else why
                run.outcome = "fail" if run.outcome == "success" else run.outcome
        finally:
            time_s = run.loop.time_s
            if run.open_epoch is not None:
                ending = {"outcome": run.outcome, "reason": run.reason}
                sink.event("epoch_ended", epoch=run.open_epoch, time_s=time_s, **ending)
            sink.close(time_s, run.outcome, run.reason)


def _brake_and_disable(loop: ControlLoop, rig: Rig) -> None:
    """Take the power away; a drive that no longer obeys brakes by its own ramp first."""
    try:
        if loop.cause in (Cause.DRIVE_LOST, Cause.DRIVE_STATE):
            rig.stop()
        if loop.cause is Cause.DRIVE_STATE:  # it answers: let it come to rest
            hold(loop, BRAKE_S)
    finally:
        rig.disable()


def _after_power(loop: ControlLoop, rig: Rig) -> str:
    """Watch the joint once its power is off; return in a clause what keeps hands off it.

    Its weight, or whoever takes the arm out, may move it: they do work on the drive. Where the
    drive moves the joint, W = ∫ M dθ is above zero.
    """
    settle_s, limit_rad = loop.agreement.settle_s, loop.agreement.hold_rad
    work_j = moved_rad = 0.0
    began_rad = before_rad = math.nan
    for k in range(1, round(WATCHED_S * loop.rate_hz) + 1):
        loop.clock.wait_until((loop.tick + k) / loop.rate_hz)
        reading = rig.read()
        rig.write(0.0)  # a drive may speak only when it is spoken to
        angle_rad = reading.angle_rad
        if k < settle_s * loop.rate_hz or not math.isfinite(angle_rad + reading.torque_nm):
            continue
        if math.isnan(began_rad):
            began_rad = before_rad = angle_rad
        work_j += reading.torque_nm * (angle_rad - before_rad)
        moved_rad, before_rad = max(moved_rad, abs(angle_rad - began_rad)), angle_rad
    if rig.powered:
        why = f"the drive has not reported within {WATCHED_S:g} s that its power is off"
    elif moved_rad > limit_rad and work_j > 0.0:
        why = f"the drive moved the joint by {deg_from_rad(moved_rad):.1f} deg with its power off"
    else:
        return ""
    return f"{why}: keep hands off the joint, press the emergency stop, and check its wiring"
