"""Whether the torque was measured on a joint at all.

A torque that somebody computed from the angle, to compensate gravity for example, is a function of
the angle: samples at nearly the same angle then have nearly the same torque, whichever way and
however fast the joint passes it. Sorted by the angle, with differences d from one sample to the
next,

    share = Σ d² / (2 Σ (M − mean M)²)

is 1 for a torque that has nothing to do with the angle (von Neumann 1941), and 0 for a function of
it. What inertia and damping add to the torque of a joint is in this share.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import uniform_filter1d

from rigidimeter.estimation.diagnostics.check_record import Case, Check, Look, at_least
from rigidimeter.estimation.signals import Array, Signals
from rigidimeter.records import Channel, Epoch
from rigidimeter.settings import DiagnosticsSettings


def static_torque(epoch: Epoch, signals: Signals, settings: DiagnosticsSettings) -> Look:
    """Return which share of the torque's variance a function of the angle cannot give, in %."""
    time_s = signals.time_s
    # Noise above the band is nobody's torque. A filter without overshoot keeps the function.
    length = max(round(signals.rate_hz / (2.0 * signals.band_hz[1])), 1)
    angle, torque = (
        uniform_filter1d(_at(epoch.channels[name], time_s), length)
        for name in ("angle_rad", "torque_nm")
    )
    steps = np.diff(torque[np.argsort(angle, kind="stable")])
    variance = float(np.var(torque))
    value = 100.0 * float(np.mean(steps**2)) / (2.0 * variance) if variance > 0 else math.nan
    least = settings.static_torque_least_percent
    return at_least(
        value,
        least,
        f"{value:.2g} % of the torque's variance is not a function of the angle (at least "
        f"{least:g} %)",
    )


def _at(channel: Channel, time_s: Array) -> Array:
    return np.interp(time_s, channel.time_s, channel.values)


def _static_torque(case: Case) -> Look:
    return static_torque(case.epoch, case.signals, case.settings)


TORQUE_CHECKS = (
    Check(
        "static_torque",
        ("angle_rad",),
        _static_torque,
        "the torque was computed from the angle, as to compensate gravity, or the joint moved so "
        "slowly that neither inertia nor damping is in it",
        "record what the torque sensor measured; use a faster perturbation",
        of_fit=False,
    ),
)
