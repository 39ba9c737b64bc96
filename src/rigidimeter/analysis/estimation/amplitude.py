"""How far the joint moved while J, B and K were measured.

Stiffness of muscle falls with the amplitude of the motion (Rack and Westbury 1974; Kearney and
Hunter 1982), so a K is compared with another at the same amplitude only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.analysis.estimation.stretches import sound
from rigidimeter.core.records import Epoch, Fit


class Amplitude(NamedTuple):
    """How far the joint moved; NaN where that is not known.

    Attributes
    ----------
    angle_rms_rad : float
        RMS of the angle about its mean in the band of the fit; a sine of amplitude a has a/√2.
    angle_range_rad : float
        Largest less smallest measured angle, of all frequencies, in the part of the epoch that was
        fitted. NaN where the angle was not measured: an integrated velocity drifts.
    """

    angle_rms_rad: float
    angle_range_rad: float


def amplitude_of_lines(epoch: Epoch, seen: Observation) -> Amplitude:
    """Return the amplitude of an epoch that was fitted at its lines.

    The RMS is weighted by the square of the window, by Parseval's theorem.
    """
    grid, angle = seen.grid, seen.motion[:, 2]
    power = float(np.vdot(angle, angle).real)
    rms_rad = float(np.sqrt(2 * power / (grid.time_s.size * grid.energy)))
    return Amplitude(rms_rad, _range_rad(epoch, grid.time_s))


def amplitude_of_signals(epoch: Epoch, signals: Signals) -> Amplitude:
    """Return the amplitude of an epoch that was fitted in the time domain."""
    return Amplitude(float(np.std(signals.angle_rad)), _range_rad(epoch, signals.time_s))


def amplitude_together(amplitudes: Sequence[Amplitude | Fit], samples: Sequence[int]) -> Amplitude:
    """Return the amplitude of epochs, of so many samples each, that were fitted together.

    The RMS over all of their samples, each epoch about its own mean, and the largest of the ranges.
    """
    power = sum(n * one.angle_rms_rad**2 for one, n in zip(amplitudes, samples, strict=True))
    ranges_rad = [one.angle_range_rad for one in amplitudes if math.isfinite(one.angle_range_rad)]
    return Amplitude(math.sqrt(power / sum(samples)), max(ranges_rad, default=np.nan))


def _range_rad(epoch: Epoch, time_s: Array) -> float:
    angle = epoch.channels.get("angle_rad")
    if angle is None or time_s.size == 0:
        return np.nan
    first, stop = np.searchsorted(angle.time_s, (time_s[0], time_s[-1]), side="left")
    used = slice(int(first), int(stop) + 1)
    values = angle.values[used]
    if epoch.left_out:
        values = values[sound(epoch, angle.time_s[used])]
    return float(np.ptp(values)) if values.size else np.nan
