"""Bring torque and motion of a source onto one clock before anything is fitted or scored.

An amplifier's filter or a bus that stamps late shifts one channel against the other. A shift of
10 ms takes 7 % off the work of a cycle and turns stiffness into damping, so the delay is estimated
where that can be done (`closedloop.delay`), reported with its error, and taken out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rigidimeter.estimation.bandlimited import band_hz
from rigidimeter.estimation.closedloop.delay import SCAN_STEP_S, direct, estimate_delay
from rigidimeter.estimation.closedloop.drive import DriveModel
from rigidimeter.estimation.closedloop.estimate import (
    closed_loop_obstacle,
    drives,
    least_squares_start,
    observe,
)
from rigidimeter.estimation.closedloop.instruments import instrumental
from rigidimeter.estimation.closedloop.lines import epoch_grid, epoch_lines
from rigidimeter.estimation.closedloop.loop import loop_model
from rigidimeter.estimation.closedloop.refine import Linearise, Observation
from rigidimeter.estimation.screening import before_fit
from rigidimeter.records import Channel, Delay, Epoch
from rigidimeter.settings import Settings

__all__ = ["aligned", "estimate_delays"]

MOST_EPOCHS = 12
"""A delay is common to its source; from this many epochs it is known well enough."""

ROUNDS = 6
"""The channels are moved and the rest is estimated again: between coarse samples the first estimate
sees the torque against motion that was not recorded."""

SETTLED_S = 5e-5
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
    total_s, error_s = 0.0, float("nan")
    try:
        drive = drives(used, settings).get(source)
        for _ in range(ROUNDS if known else 1):
            observations = [
                _observe(_moved(epoch, total_s), settings, drive, bool(known)) for epoch in used
            ]
            start = least_squares_start(observations)
            longest_s = settings.estimation.longest_delay_s
            fit = estimate_delay(observations, start, longest_s, linearise)
            step_s, error_s = float(fit.values[-1]), float(fit.standard_errors[-1])
            total_s += step_s
            if abs(step_s) < SETTLED_S or abs(total_s) > longest_s:
                break
    except ValueError as error:
        return Delay(source, remark=f"not estimated: {error}")
    found = Delay(source, total_s, error_s)
    longest_s = settings.estimation.longest_delay_s
    if not np.isfinite(total_s) or abs(total_s) > longest_s - SCAN_STEP_S / 2:
        return Delay(
            source,
            remark=f"no delay within ±{1e3 * longest_s:g} ms explains the torque "
            "(estimation.longest_delay_s)",
        )
    if not known:
        return replace(
            found,
            remark="not corrected: without the recorded perturbation a reflex, or a subject who "
            "pushes, looks like a delay",
        )
    if abs(total_s) < max(SIGNIFICANT * error_s, LEAST_S):
        return replace(found, remark="not corrected: not told from zero")
    if not settings.estimation.correct_delay:
        return replace(found, remark="not corrected: estimation.correct_delay is false")
    return replace(found, corrected=True)


def _observe(
    epoch: Epoch, settings: Settings, drive: DriveModel | None, perturbed: bool
) -> Observation:
    if perturbed:
        return observe(epoch, settings, "iv", drive)
    torque = epoch.channels["torque_nm"]
    rig = settings.rig
    grid = epoch_grid(epoch, band_hz(epoch, settings.estimation), settings.estimation.trim_s)
    loop = loop_model(
        settings, torque.rate_hz, DriveModel(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    )
    everywhere = np.ones(grid.line.size, dtype=np.bool_)
    return Observation(epoch_lines(epoch, grid, None), torque, loop, everywhere, None)
