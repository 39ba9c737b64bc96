"""What the torque sees of the motion between the samples of the motion.

Torque sampled at a time δ after the ticks holds the acceleration of that time. The samples of the
velocity give another one at the line ω: their derivative, free of all that sampling folds. For
commands held from tick to tick both follow from the drive H (`DriveModel.transfer`), and so does
what a low-pass F in the torque sensor makes of them. With z = e^(jωT) and * the z-transform of
what is sampled, the torque sees beyond F times what the samples give

    [(F s H)* − F jω H*] C,   [(F H)* − F H*] C,   [(F H/s)* − F (H/s)*] C

of the command C. What moves the arm besides the command, such as friction in the drive, does not
keep step with the ticks, and its samples are taken as they are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.dynamics import EVEN, DriveModel, lowpass
from rigidimeter.estimation.closedloop.drive_motion import since_ticks
from rigidimeter.estimation.signals import Array
from rigidimeter.records import Channel

Complex = NDArray[np.complex128]


LOW = 0.01
"""In rad a tick: slow enough that what sampling does no longer depends on it."""


class TorqueFilter(NamedTuple):
    """A Butterworth low-pass between the torque and its samples."""

    cutoff_hz: float
    order: int


def behind(drive: DriveModel, torque_filter: TorqueFilter | None) -> DriveModel:
    """Return the drive as the torque sensor sees its motion."""
    return drive if torque_filter is None else drive.smoothed(*torque_filter)


def filtered(torque_filter: TorqueFilter | None, omega_rad_s: Array) -> Complex:
    """Return F at the lines, shape (m, 1)."""
    if torque_filter is None:
        return np.ones((omega_rad_s.size, 1), dtype=np.complex128)
    return lowpass(np.asarray(1j * omega_rad_s), *torque_filter)[:, None]


def seen_beyond_samples(
    drive: DriveModel,
    torque_filter: TorqueFilter | None,
    command: Channel,
    omega_rad_s: Array,
    time_s: Array,
) -> Complex:
    """Return what stands before C above, shape (m, 3).

    Parameters
    ----------
    drive : DriveModel
    torque_filter : TorqueFilter or None
    command : Channel
    omega_rad_s : array, shape (m,)
    time_s : array, shape (n,)
        When torque and motion were sampled, as long after each tick.
    """
    interval_s = 1.0 / command.mean_rate_hz
    _, after_s = since_ticks(command, time_s, 0.0)
    after = float(np.mean(after_s))
    z = np.exp(1j * omega_rad_s * interval_s)
    seen = behind(drive, torque_filter).transfer(z, interval_s, after)
    _, velocity, angle = drive.transfer(z, interval_s, after)
    sampled = np.stack([1j * omega_rad_s * velocity, velocity, angle])
    return np.asarray(seen.T - filtered(torque_filter, omega_rad_s) * sampled.T)


def acceleration_seen(drive: DriveModel, command: Channel, time_s: Array) -> float:
    """Return the acceleration at the torque's samples as a share of its mean, at low frequency."""
    interval_s = 1.0 / command.mean_rate_hz
    _, after_s = since_ticks(command, time_s, 0.0)
    omega = np.array([LOW / interval_s])
    z = np.exp(1j * omega * interval_s)
    _, velocity, _ = drive.transfer(z, interval_s)
    # Samples that do not keep step with the ticks see it at many times.
    times_s = np.quantile(after_s, np.linspace(0.05, 0.95, 10))
    seen = [drive.transfer(z, interval_s, after)[0] for after in times_s.tolist()]
    turn = np.exp(-1j * omega * np.mean(times_s))
    return float(np.mean((np.array(seen).mean(axis=0) * turn / (1j * omega * velocity)).real))


def command_at(command: Channel, time_s: Array) -> Array:
    """Return the command of the last tick at each time."""
    tick, _ = since_ticks(command, time_s, 0.0)
    return command.values[tick]


def in_step(command: Channel, time_s: Array) -> bool:
    """Return whether samples were taken once a tick, as long after each."""
    tick, after_s = since_ticks(command, time_s, 0.0)
    return bool(np.all(np.diff(tick) == 1)) and (
        float(np.ptp(after_s)) * command.mean_rate_hz < 2 * EVEN
    )
