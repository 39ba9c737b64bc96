"""Bring torque and motion of a source onto one clock before anything is fitted or scored.

An amplifier's filter or a bus that stamps late shifts one channel against the other. A shift of
10 ms takes 7 % off the work of a cycle and turns stiffness into damping, so the delay is estimated
where that can be done (`closedloop.delay`), reported with its error, and taken out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rigidimeter.dynamics import DriveModel
from rigidimeter.estimation.bandlimited import band_hz
from rigidimeter.estimation.closedloop.closed_loop_fit import (
    closed_loop_obstacle,
    drives,
    least_squares_start,
    observe,
)
from rigidimeter.estimation.closedloop.delay import SCAN_STEP_S, direct, estimate_delay
from rigidimeter.estimation.closedloop.drive_fit import loop_of
from rigidimeter.estimation.closedloop.instruments import instrumental
from rigidimeter.estimation.closedloop.refine import Linearise, Observation
from rigidimeter.estimation.closedloop.spectral_lines import epoch_grid, epoch_lines
from rigidimeter.estimation.screening import before_fit
from rigidimeter.records import Channel, Delay, Epoch
from rigidimeter.settings import Settings

__all__ = ["aligned", "estimate_delays"]

MOST_EPOCHS = 12
"""A delay is common to its source; from this many epochs it is known well enough."""

ROUNDS = 6
"""The channels are moved and the rest is estimated again: between coarse samples the first estimate
sees the torque against motion that was not recorded."""

SETTLED_S = 1e-5
MOST_STRETCH = 6.0
"""A secant may go so many times as far as what is left."""

SAME_S, SAME_SHARE = 3e-4, 0.1
"""Delays from two bands that differ by less than this, or by three standard errors, are one."""

SIGNIFICANT = 3.0
"""A delay within this many standard errors of zero is not told from none."""

LEAST_S = 1e-4
"""Nor is a delay below this worth a shift: it changes B by less than 1e-4 K seconds."""


def estimate_delays(
    perturbed: Mapping[str, Sequence[Epoch]], settings: Settings
) -> tuple[Delay, ...]:
    """Estimate how late the torque is in each source.

    Parameters
    ----------
    perturbed : mapping of str to sequence of Epoch
        The perturbation epochs of each source; a source without any has an empty sequence.
    settings : Settings

    Returns
    -------
    tuple of Delay
    """
    return tuple(_estimate(source, epochs, settings) for source, epochs in perturbed.items())


def aligned(epoch: Epoch, delays: Sequence[Delay]) -> Epoch:
    """Return the epoch with its torque moved by the delay of its source, if that is corrected."""
    for delay in delays:
        if delay.source == epoch.source and delay.corrected:
            return _moved(epoch, delay.delay_s)
    return epoch


def _moved(epoch: Epoch, delay_s: float) -> Epoch:
    torque = epoch.channels.get("torque_nm")
    if torque is None:
        return epoch
    earlier = Channel(torque.name, torque.time_s - delay_s, torque.values)
    return replace(epoch, channels={**epoch.channels, torque.name: earlier})


def _estimate(source: str, epochs: Sequence[Epoch], settings: Settings) -> Delay:
    sound = [epoch for epoch in epochs if not before_fit(epoch, settings.estimation)]
    if not sound:
        return Delay(source, remark="no perturbation epoch tells the channels' delay")
    known = [epoch for epoch in sound if not closed_loop_obstacle(epoch)]
    linearise: Linearise = instrumental if known else direct
    used = (known or sound)[:MOST_EPOCHS]
    estimation = settings.estimation
    longest_s = estimation.longest_delay_s
    try:
        drive = drives(used, settings).get(source)
        total_s, error_s = _settled(used, settings, drive, linearise)
        half = _settled(used, _half_the_band(settings), drive, linearise) if known else None
    except ValueError as error:
        return Delay(source, remark=f"the delay of the torque was not estimated: {error}")
    if not np.isfinite(total_s) or abs(total_s) > longest_s - SCAN_STEP_S / 2:
        return Delay(
            source,
            remark=f"no delay of the torque within ±{1e3 * longest_s:g} ms explains it "
            "(estimation.longest_delay_s)",
        )
    found = Delay(source, total_s, error_s)
    if half is None:
        return replace(
            found,
            remark="not corrected: without the recorded perturbation a reflex, or a subject who "
            "pushes, looks like a delay",
        )
    if abs(total_s) < max(SIGNIFICANT * error_s, LEAST_S):
        return replace(found, remark="not corrected: not told from zero")
    apart_s, allowed_s = abs(half[0] - total_s), SIGNIFICANT * np.hypot(error_s, half[1])
    if apart_s > max(allowed_s, SAME_S + SAME_SHARE * abs(total_s)):
        return replace(
            found,
            remark=f"not corrected: in the lower half of the band it is {1e3 * half[0]:.3g} ms; a "
            "delay is the same at all frequencies, a soft cuff between drive and joint is not",
        )
    if not estimation.correct_delay:
        return replace(found, remark="not corrected: estimation.correct_delay is false")
    return replace(found, corrected=True)


def _settled(
    epochs: Sequence[Epoch],
    settings: Settings,
    drive: DriveModel | None,
    linearise: Linearise,
) -> tuple[float, float]:
    """Return the delay at which none is left, and its standard error, in s.

    The zero of what is left is sought by secants: between coarse samples moving the torque by what
    is left takes only part of it away.
    """
    known = linearise is instrumental
    before: tuple[float, float] | None = None
    total_s, error_s = 0.0, float("nan")
    for _ in range(ROUNDS if known else 1):
        observations = [
            _observe(_moved(epoch, total_s), settings, drive, known) for epoch in epochs
        ]
        start = least_squares_start(observations)
        fit = estimate_delay(observations, start, settings.estimation.longest_delay_s, linearise)
        left_s, error_s = float(fit.values[-1]), float(fit.standard_errors[-1])
        step_s = left_s
        if before is not None and abs(left_s) < abs(before[1]) and left_s != before[1]:
            step_s = -left_s * (total_s - before[0]) / (left_s - before[1])
            step_s = float(np.clip(step_s, -MOST_STRETCH * abs(left_s), MOST_STRETCH * abs(left_s)))
        before = total_s, left_s
        total_s += step_s
        if abs(left_s) < SETTLED_S or abs(total_s) > settings.estimation.longest_delay_s:
            break
    return total_s, error_s


def _half_the_band(settings: Settings) -> Settings:
    estimation = settings.estimation
    high_hz = max(0.5 * estimation.band_high_closed_loop_hz, 2.0 * estimation.band_low_hz)
    narrower = estimation.model_copy(update={"band_high_closed_loop_hz": high_hz})
    return settings.model_copy(update={"estimation": narrower})


def _observe(
    epoch: Epoch, settings: Settings, drive: DriveModel | None, perturbed: bool
) -> Observation:
    if perturbed:
        return observe(epoch, settings, "iv", drive)
    torque = epoch.channels["torque_nm"]
    rig = settings.rig
    grid = epoch_grid(epoch, band_hz(epoch, settings.estimation), settings.estimation.trim_s)
    loop = loop_of(
        settings, torque.rate_hz, DriveModel(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    )
    everywhere = np.ones(grid.line.size, dtype=np.bool_)
    return Observation(epoch_lines(epoch, grid, None), torque, loop, everywhere, None)
