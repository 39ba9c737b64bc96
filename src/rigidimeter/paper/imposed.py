"""The arm under an imposed sinusoid, without the controller (Sec. 2.6, first kind of simulation).

The drive imposes θ(t) and Eq. 3 gives the torque:

    M = J θ'' + B θ' + K θ − M_sub

The epoch that results has the channels, rates and noise that a recording of it would have.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rigidimeter.dynamics import SubjectTorque
from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.experiment import sinusoid
from rigidimeter.records import Channel, Epoch, Motion
from rigidimeter.settings import Settings, SubjectSettings
from rigidimeter.units import rad_from_deg

__all__ = ["PureCycles", "imposed_epoch", "pure_cycles"]

Array = NDArray[np.float64]


class PureCycles(NamedTuple):
    """Whole cycles sampled without any filter, end point included."""

    angle_rad: Array
    torque_nm: Array
    interval_s: float


def pure_cycles(
    joint: JointDynamics,
    settings: Settings,
    rate_hz: float,
    torque_delay_s: float = 0.0,
) -> PureCycles:
    """Return the cycles that are scored as bare samples of Eq. 3.

    Parameters
    ----------
    joint : JointDynamics
    settings : Settings
        For amplitude and frequency of the sinusoid and the number of cycles.
    rate_hz : float
        Samples a second; a whole number of them a cycle.
    torque_delay_s : float
        How late the torque is against the angle.
    """
    omega = 2.0 * math.pi * settings.sinusoid.frequency_hz
    amplitude = rad_from_deg(settings.sinusoid.amplitude_deg)
    count = round(settings.scores.cycles * rate_hz / settings.sinusoid.frequency_hz)
    time_s = np.arange(count + 1) / rate_hz
    late = omega * (time_s - torque_delay_s)
    torque = joint.torque_nm(
        amplitude * np.sin(late),
        amplitude * omega * np.cos(late),
        -amplitude * omega**2 * np.sin(late),
    )
    return PureCycles(amplitude * np.sin(omega * time_s), torque, 1.0 / rate_hz)


def imposed_epoch(
    joint: JointDynamics,
    settings: Settings,
    *,
    label: str = "1",
    condition: str = "",
    subject: SubjectSettings | None = None,
    rng: np.random.Generator | None = None,
) -> Epoch:
    """Return an epoch of the sinusoid as it would be recorded.

    Parameters
    ----------
    joint : JointDynamics
    settings : Settings
        For the sinusoid, and the rates and the noise of the sensors. Their rates divide the ticks.
    label, condition : str
    subject : SubjectSettings, optional
        Whose voluntary torque and tremor are in the torque; none if not given.
    rng : numpy.random.Generator, optional
        For noise and subject; without one there is neither.
    """
    rig, tick_hz = settings.rig, settings.rig.tick_rate_hz
    angle, velocity = sinusoid(settings.sinusoid, tick_hz)
    time_s = np.arange(angle.size) / tick_hz
    acceleration = CubicSpline(time_s, velocity).derivative()(time_s)
    torque = joint.torque_nm(angle, velocity, acceleration)
    for_torque = slice(None, None, round(tick_hz / rig.torque.rate_hz))
    for_motion = slice(None, None, round(tick_hz / rig.motion.rate_hz))
    measured = torque[for_torque]
    if rng is not None:
        if subject is not None:
            voluntary = SubjectTorque(subject, tick_hz, rng).block(torque.size)
            measured = (torque - voluntary)[for_torque]
        measured = measured + rig.torque.noise_sd_nm * rng.standard_normal(measured.size)
    channels = (
        Channel("torque_nm", time_s[for_torque], measured),
        Channel("angle_rad", time_s[for_motion], angle[for_motion]),
        Channel("velocity_rad_s", time_s[for_motion], velocity[for_motion]),
    )
    sine = settings.sinusoid
    return Epoch(
        source="virtual sinusoid",
        label=label,
        channels={channel.name: channel for channel in channels},
        condition=condition,
        task="sinusoid",
        motion=Motion(sine.frequency_hz, 0.0, sine.motion_s),
        virtual=True,
    )
