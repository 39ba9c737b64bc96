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

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.drive_motion import DrivenAt, driven
from rigidimeter.analysis.estimation.signals import Array, motion_channels
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import EstimationSettings, RigSettings
from rigidimeter.model import ON_EDGE, ArmMotion, DriveModel, lowpass

Complex = NDArray[np.complex128]


INEXACT = 0.005
"""No drive is quite linear and constant: what it tells of the motion between the samples is taken
to be this share of itself uncertain. That matters where the torque saw little of the acceleration,
and J is that little divided by a small share."""

SCATTERED = 5.0
"""Stamps keep step with the ticks if their mean direction is so many standard errors long."""

LOW = 0.01
"""In rad a tick: slow enough that what sampling does no longer depends on it."""


class TorqueFilter(NamedTuple):
    """A Butterworth low-pass between the torque and its samples."""

    cutoff_hz: float
    order: int


def torque_filter_of(settings: EstimationSettings) -> TorqueFilter | None:
    """Return the low-pass that the settings name; None for none."""
    cutoff_hz = settings.torque_lowpass_hz
    return TorqueFilter(cutoff_hz, settings.torque_lowpass_order) if cutoff_hz else None


def behind(drive: DriveModel, torque_filter: TorqueFilter | None) -> DriveModel:
    """Return the drive as the torque sensor sees its motion."""
    return drive if torque_filter is None else drive.smoothed(*torque_filter)


def filtered(torque_filter: TorqueFilter | None, omega_rad_s: Array) -> Complex:
    """Return F at the lines, shape (m, 1)."""
    if torque_filter is None:
        return np.ones((omega_rad_s.size, 1), dtype=np.complex128)
    return lowpass(np.asarray(1j * omega_rad_s), *torque_filter)[:, None]


class Beyond(NamedTuple):
    """What the torque sees beyond the samples, and the velocity's samples, for each command.

    Attributes
    ----------
    seen : complex array, shape (m, 3)
        What stands before C above.
    velocity : complex array, shape (m, 1)
        F H*.
    """

    seen: Complex
    velocity: Complex


def beyond_samples(
    drive: DriveModel,
    torque_filter: TorqueFilter | None,
    omega_rad_s: Array,
    interval_s: float,
    after_s: float,
    *,
    angle_alone: bool = False,
) -> Beyond:
    """Return what the torque sees beyond the samples; epochs of one layout share it.

    Parameters
    ----------
    drive : DriveModel
    torque_filter : TorqueFilter or None
    omega_rad_s : array, shape (m,)
        Of lines that follow each other.
    interval_s : float
        Of the ticks.
    after_s : float
        How long after each tick torque and motion were sampled.
    angle_alone : bool
        Whether acceleration and velocity are those of the angle's samples, −ω² F (H/s)* and
        jω F (H/s)*.
    """
    lines = float(omega_rad_s[0]), float(omega_rad_s[-1]), omega_rad_s.size
    interval_s, after_s = float(f"{interval_s:.9g}"), round(after_s, 9)
    return _beyond(drive, torque_filter, lines, interval_s, after_s, angle_alone)


@lru_cache(maxsize=128)
def _beyond(
    drive: DriveModel,
    torque_filter: TorqueFilter | None,
    lines: tuple[float, float, int],
    interval_s: float,
    after_s: float,
    angle_alone: bool,
) -> Beyond:
    omega_rad_s = np.linspace(*lines)
    z = np.exp(1j * omega_rad_s * interval_s)
    seen = motion = drive.transfer(z, interval_s, after_s)
    if torque_filter is not None:
        seen = behind(drive, torque_filter).transfer(z, interval_s, after_s)
    through = filtered(torque_filter, omega_rad_s)
    velocity = 1j * omega_rad_s * motion[2] if angle_alone else motion[1]
    sampled = through * np.stack([1j * omega_rad_s * velocity, velocity, motion[2]]).T
    return Beyond(seen.T - sampled, sampled[:, 1:2])


def without_driven(epoch: Epoch, driven_at: DrivenAt) -> Epoch:
    """Return the epoch with what its motion sensors saw beyond the motion that the command causes.

    Each at its own stamps.
    """
    rest = dict(epoch.channels)
    for channel in motion_channels(epoch):
        caused = driven_at(channel.time_s)
        seen = caused.angle_rad if channel.name == "angle_rad" else caused.velocity_rad_s
        rest[channel.name] = Channel(channel.name, channel.time_s, channel.values - seen)
    return replace(epoch, channels=rest)


def driven_behind(
    driven_at: DrivenAt, torque_filter: TorqueFilter | None, torque: Channel
) -> ArmMotion:
    """Return the motion that the command causes, as the torque sensor sees it at its stamps."""
    if torque_filter is None:
        return driven_at(torque.time_s)
    return driven(behind(driven_at.drive, torque_filter), driven_at.command, torque.time_s)


def acceleration_seen(drive: DriveModel, interval_s: float, times_s: Array) -> float:
    """Return the acceleration at the torque's samples as a share of its mean, at low frequency.

    Parameters
    ----------
    drive : DriveModel
    interval_s : float
        Of the ticks.
    times_s : array
        After the ticks, at which the torque was sampled; the mean over them is returned.
    """
    omega = np.array([LOW / interval_s])
    z = np.exp(1j * omega * interval_s)
    turn = np.exp(-1j * omega * np.mean(times_s))
    velocity = drive.transfer(z, interval_s)[1]
    seen = np.mean([drive.transfer(z, interval_s, s)[0] for s in times_s.tolist()], axis=0)
    return float((seen * turn / (1j * omega * velocity)).real.item())


def assumed_ticks_hz(rig: RigSettings, torque: Channel) -> float:
    """Return how often commands are taken to be sent where no command was recorded.

    As the settings state; where they do not, not more often than the torque was sampled.
    """
    stated = "tick_rate_hz" in rig.model_fields_set
    return rig.tick_rate_hz if stated else min(rig.tick_rate_hz, torque.rate_hz)


def acceleration_beyond_slope(
    rig: RigSettings, ticks_hz: float, torque_filter: TorqueFilter | None, omega_rad_s: Array
) -> Complex:
    """Return A/V − jω for the drive of the settings and commands at a rate, shape (m,).

    That is what the torque at the ticks holds of the acceleration beyond the slope of the velocity
    at the ticks, for each unit of the velocity.
    """
    drive = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    beyond = beyond_samples(drive, torque_filter, omega_rad_s, 1.0 / ticks_hz, 0.0)
    return np.asarray(beyond.seen[:, 0] / beyond.velocity[:, 0])


def phases_s(after_s: Array, interval_s: float) -> Array:
    """Return one time after a tick, or ten, that stand for those of all samples (`since_ticks`).

    Samples that do not keep step with the ticks see the acceleration at many times.
    """
    if np.ptp(after_s) < 2 * ON_EDGE * interval_s:
        return np.asarray(np.mean(after_s, keepdims=True))
    return np.quantile(after_s, np.linspace(0.05, 0.95, 10))


def step_kept_s(after_s: Array, interval_s: float) -> float | None:
    """Return the time after the ticks that stamps scatter about; None if they do not scatter so.

    Then it is not known whether the samples came unevenly, or evenly and the stamps do not say so.
    """
    if np.ptp(after_s) < ON_EDGE * interval_s:
        return None
    turns = np.exp(2j * np.pi * after_s / interval_s)
    mean = complex(np.mean(turns))
    if abs(mean) > 1.0 - ON_EDGE**2 or abs(mean) < SCATTERED / np.sqrt(after_s.size):
        return None
    return float(np.angle(mean) / (2 * np.pi) % 1.0) * interval_s


def in_step(tick: NDArray[np.intp], after_s: Array, interval_s: float) -> bool:
    """Return whether samples (`since_ticks`) were taken once a tick, as long after each."""
    return bool(np.all(np.diff(tick) == 1)) and float(np.ptp(after_s)) < 2 * ON_EDGE * interval_s
