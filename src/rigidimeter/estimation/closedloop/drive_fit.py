"""The drive between command and motion, identified from the recording itself.

Command and velocity are known almost without noise, so bandwidth, damping and delay of the drive
(`rigidimeter.dynamics.velocity_drive`) follow from them closely. They matter for what sampling
hides: a drive that is told a staircase ripples between the ticks, and a torque sampled at the tick
sees the ripple at its edge, an acceleration smaller by (ω Δt)²/12 than the samples of the velocity
suggest: 0.8 % for 50 Hz at 1 kHz, and all of that would be taken from J.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import least_squares

from rigidimeter.dynamics import ArmMotion, DriveModel, Loop
from rigidimeter.estimation.signals import Array
from rigidimeter.records import Channel, Epoch
from rigidimeter.settings import Settings

LARGEST_MISFIT = 0.005
"""Above this share of the velocity's standard deviation the drive is not of second order."""

LARGEST_RATIO = 0.08
"""Ticks per period of the drive's bandwidth beyond which a command in a foreign file is rather one
that was logged more slowly than it was sent: its stairs would then be too long."""

EVEN = 0.01
"""A stamp this share of an interval away from a tick is that tick."""


def driven(drive: DriveModel, command: Channel, time_s: Array) -> ArmMotion:
    """Return the motion under a recorded command, from rest, at any times; exact between ticks."""
    # From the first tick on: on a clock that counts from 1970 a delay is below the rounding.
    origin_s = command.time_s[0]
    ticks_s, sent = command.time_s - origin_s, command.values
    interval_s = 1.0 / command.mean_rate_hz
    motion = drive.held(sent, interval_s)
    then_s = (time_s - origin_s) - drive.delay_s
    # A stamp that is a rounding error early belongs to the tick it names.
    k = np.searchsorted(ticks_s, then_s + EVEN * interval_s, side="right") - 1
    k = np.clip(k, 0, sent.size - 1)
    elapsed_s = np.maximum(then_s - ticks_s[k], 0.0)
    elapsed_s[elapsed_s < EVEN * interval_s] = 0.0
    at_ticks = ArmMotion(*(part[k] for part in motion))
    return drive.after(elapsed_s, at_ticks, sent[k]) if np.any(elapsed_s) else at_ticks


def fit_drive(epoch: Epoch, start: DriveModel) -> DriveModel | None:
    """Identify the drive from command and velocity; None where it does not explain the velocity.

    Parameters
    ----------
    epoch : Epoch
    start : DriveModel
        Where the search starts.

    Returns
    -------
    DriveModel or None
        None if command or velocity was not recorded, if what the fit leaves exceeds 0.5 % of the
        velocity's standard deviation, or if the command seems to have been logged more slowly than
        it was sent: then nothing is known of what happens between the ticks.
    """
    command = epoch.channels.get("velocity_command_rad_s")
    velocity = epoch.channels.get("velocity_rad_s")
    if command is None or velocity is None or len(command) < 100:
        return None
    tick_s = 1.0 / command.mean_rate_hz
    if np.ptp(np.diff(command.time_s)) > 0.5 * tick_s:
        return None  # ticks that were missed would be taken for a slower drive
    fastest_hz = 0.45 / tick_s
    if not 0.5 < start.bandwidth_hz < fastest_hz:
        return None
    inside = (velocity.time_s >= command.time_s[0]) & (velocity.time_s <= command.time_s[-1])
    time_s, measured = velocity.time_s[inside], velocity.values[inside]
    scale = float(np.std(measured))
    if time_s.size < 50 or scale == 0.0:
        return None

    def model(x: Array) -> DriveModel:
        return DriveModel(math.exp(x[0]), float(x[1]), float(x[2]))

    def misfit(x: Array) -> Array:
        left = driven(model(x), command, time_s).velocity_rad_s - measured
        return np.asarray(left / scale, dtype=np.float64)

    # From between two ticks, where a stamp that is nearly a tick's is not yet taken for it.
    delay_s = max(start.delay_s, 0.5 * tick_s)
    found = least_squares(
        misfit,
        [math.log(start.bandwidth_hz), start.damping_ratio, delay_s],
        bounds=([math.log(0.5), 0.05, 0.0], [math.log(fastest_hz), 0.999, 0.1]),
        x_scale=[0.1, 0.1, tick_s],
    )
    fitted = model(found.x)
    at_bound = fitted.damping_ratio > 0.99 or fitted.bandwidth_hz > 0.98 * fastest_hz
    if at_bound or float(np.sqrt(np.mean(found.fun**2))) > LARGEST_MISFIT:
        return None
    # A session records what was sent at every tick; of another file that is not known.
    if epoch.excitation_hz is None and fitted.bandwidth_hz * tick_s > LARGEST_RATIO:
        return None
    return fitted


def loop_of(settings: Settings, torque_rate_hz: float, drive: DriveModel) -> Loop:
    """Return the loop that settings describe, with a drive that was fitted or assumed.

    Instruments made from a wrong loop are weaker, not wrong: whatever they are, they follow from
    the perturbation alone.
    """
    rig = settings.rig
    # To the digits that stamps are good for, so that epochs of one rig have equal loops.
    torque = rig.torque.model_copy(update={"rate_hz": float(f"{torque_rate_hz:.4g}")})
    measured = {
        "torque": torque,
        "drive_bandwidth_hz": drive.bandwidth_hz,
        "drive_damping_ratio": drive.damping_ratio,
    }
    return Loop(settings.controller, rig.model_copy(update=measured), drive.delay_s)
