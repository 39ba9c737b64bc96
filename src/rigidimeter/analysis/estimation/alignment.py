"""Bring torque and motion of a source onto one clock before anything is fitted or scored.

An amplifier's filter or a bus that stamps late shifts one channel against the other. A shift of
10 ms takes 7 % off the work of a cycle and turns stiffness into damping, so the delay is estimated
where that can be done (`closedloop.delay`), reported with its error, and taken out unless friction,
a reflex or a soft cuff explains the torque as well (`closedloop.delay_or_term`). Where the
perturbation was not recorded, the measured motion is the instrument of all of these.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rigidimeter.analysis.estimation.closedloop.delay import SCAN_STEP_S, estimate_delay
from rigidimeter.analysis.estimation.closedloop.delay_or_term import CLEAR, likeliest_term
from rigidimeter.analysis.estimation.closedloop.epoch_motion import EpochMotion
from rigidimeter.analysis.estimation.closedloop.linear_problems import (
    direct,
    instrumental,
    least_squares_start,
)
from rigidimeter.analysis.estimation.closedloop.observe import motion_of, observe, observe_motion
from rigidimeter.analysis.estimation.closedloop.recorded_perturbation import closed_loop_obstacle
from rigidimeter.analysis.estimation.closedloop.refine import LineFit
from rigidimeter.analysis.estimation.method_record import Progress
from rigidimeter.analysis.estimation.prepared import PreparedEpoch, torque_earlier
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.records import Delay, Epoch

MOST_EPOCHS = 12
"""A delay is common to its source; from this many epochs it is known well enough."""

ROUNDS = 6
"""The channels are moved and the rest is estimated again: between coarse samples the first estimate
sees the torque against motion that was not recorded."""

SETTLED_S = 1e-5

IN_VALLEY_S = 0.2 * SCAN_STEP_S
"""With less left than this the valley is known: the next search begins in it, and nowhere else."""

MOST_STRETCH = 6.0
"""A secant may go so many times as far as what is left."""

SAME_S, SAME_SHARE = 3e-4, 0.1
"""Delays from two bands that differ by less than this, or by three standard errors, are one."""

SIGNIFICANT = 3.0
"""A delay within this many standard errors of zero is not corrected."""

LEAST_S = 1e-4
"""Nor is a delay below this worth a shift: it changes B by less than 1e-4 K seconds."""


def estimate_delays(
    perturbed: Mapping[str, Sequence[PreparedEpoch]], progress: Progress = lambda _: None
) -> tuple[Delay, ...]:
    """Estimate how late the torque is in each source.

    Parameters
    ----------
    perturbed : mapping of str to sequence of PreparedEpoch
        The perturbation epochs of each source; a source without any has an empty sequence.
    progress : callable
        The work of one epoch is 1, of a source at most `MOST_EPOCHS`.

    Returns
    -------
    tuple of Delay
    """
    delays = []
    for source, epochs in perturbed.items():
        delays.append(_estimate(source, epochs))
        progress(float(min(len(epochs), MOST_EPOCHS)))
    return tuple(delays)


def aligned(epoch: Epoch, delays: Sequence[Delay]) -> Epoch:
    """Return the epoch with its torque moved by the delay of its source, if that is corrected."""
    delay_s = _corrected_s(epoch.source, delays)
    return torque_earlier(epoch, delay_s) if delay_s else epoch


def aligned_prepared(prepared: PreparedEpoch, delays: Sequence[Delay]) -> PreparedEpoch:
    """Return `aligned` of a prepared epoch; the same object where nothing is corrected."""
    delay_s = _corrected_s(prepared.epoch.source, delays)
    return prepared.moved(delay_s) if delay_s else prepared


def _corrected_s(source: str, delays: Sequence[Delay]) -> float:
    return sum(delay.delay_s for delay in delays if delay.source == source and delay.corrected)


def _estimate(source: str, epochs: Sequence[PreparedEpoch]) -> Delay:
    sound = [epoch for epoch in epochs if not epoch.obstacle]
    if not sound:
        return Delay(source, remark="no perturbation epoch tells the channels' delay")
    known = [prepared for prepared in sound if not closed_loop_obstacle(prepared.epoch)]
    used = (known or sound)[:MOST_EPOCHS]
    motions = [motion_of(one) for one in used]
    estimation = used[0].settings.estimation
    longest_s = estimation.max_delay_s
    try:
        total_s, error_s, values = _settled(used, motions, perturbed=bool(known))
        if not np.isfinite(total_s) or abs(total_s) > longest_s - SCAN_STEP_S / 2:
            return Delay(
                source,
                remark=f"no delay of the torque within ±{1e3 * longest_s:g} ms explains it "
                "(estimation.max_delay_s)",
            )
        found = Delay(source, total_s, error_s)
        if not matters(total_s, error_s):
            least_ms = f"{1e3 * LEAST_S:g} ms"
            why = f"shorter than {least_ms} or not significantly different from zero"
            return replace(found, remark=f"not corrected: {why}")
    except ValueError as error:
        return Delay(source, remark=f"the delay of the torque was not estimated: {error}")
    halves = [_in_half_the_band(one) for one in used]
    try:
        half_s, half_error_s, _ = _settled(
            halves, motions, perturbed=bool(known), near=(total_s, values)
        )
    except ValueError as error:
        return replace(found, remark=f"not corrected: of the lower half of the band, {error}")
    apart_s, allowed_s = abs(half_s - total_s), SIGNIFICANT * np.hypot(error_s, half_error_s)
    if apart_s > max(allowed_s, SAME_S + SAME_SHARE * abs(total_s)):
        return replace(
            found,
            remark=f"not corrected: in the lower half of the band it is {1e3 * half_s:.3g} ms; a "
            "delay is the same at all frequencies, a soft cuff between drive and joint is not",
        )
    moved = [one.moved(total_s) for one in used]
    rival = likeliest_term(used, moved, values)
    if rival.better_by > -CLEAR:
        than = "explains it better" if rival.better_by > CLEAR else "explains it as well"
        return replace(
            found,
            remark=f"not corrected: {rival.name} {than}, by {rival.better_by:.2g} standard "
            "deviations of what both leave of lines that were not fitted; `rigidimeter model "
            "--compare` fits such terms",
        )
    if not estimation.correct_delay:
        return replace(found, remark="not corrected: estimation.correct_delay is false")
    return replace(found, corrected=True)


def _settled(
    epochs: Sequence[PreparedEpoch],
    motions: Sequence[EpochMotion],
    *,
    perturbed: bool,
    near: tuple[float, Array] | None = None,
) -> tuple[float, float, Array]:
    """Return the delay at which none is left, its standard error, in s, and J, B and K with it.

    The zero of what is left is sought by secants: between coarse samples moving the torque by what
    is left takes only part of it away. Where the perturbation is not known, the measured motion is
    its own instrument. The error of the zero is that of what is left over its slope,
    by how much a move of the torque changes it. The search begins `near` a delay and J, B and K.

    Behind a drive whose acceleration jumps at each command and then decays, torque that is late by
    less than a tick sees the same course with another J, so there are zeros at every such delay:
    where nothing is left at the stamps themselves, none is sought.
    """
    longest_s = epochs[0].settings.estimation.max_delay_s
    jumps = any(one.driven_at is not None and one.driven_at.drive.jump for one in motions)

    def left_after(move_s: float, near: Array | None = None) -> LineFit:
        moved = [epoch.moved(move_s) if move_s else epoch for epoch in epochs]
        observations = [
            epoch.once(observe if perturbed else observe_motion, motion)
            for epoch, motion in zip(moved, motions, strict=True)
        ]
        linearise = instrumental if perturbed else direct
        start = least_squares_start(observations) if near is None else near[:-1]
        return estimate_delay(observations, start, longest_s, linearise, near)

    tried: list[tuple[float, float]] = []
    total_s, begin = (0.0, None) if near is None else (near[0], np.append(near[1], 0.0))
    for _ in range(ROUNDS):
        fit = left_after(total_s, begin)
        left_s, error_s = float(fit.values[-1]), float(fit.standard_errors[-1])
        if near is None and not ((perturbed and not jumps) or tried or matters(left_s, error_s)):
            return left_s, error_s, fit.values[:-1]  # it shows without a move
        begin = fit.values if abs(left_s) < IN_VALLEY_S else None
        stretch = 1.0
        if tried and abs(left_s) < abs(tried[-1][1]):
            stretch = _stretch((total_s, left_s), tried[-1])
        tried.append((total_s, left_s))
        total_s += stretch * left_s
        if abs(left_s) < SETTLED_S or abs(total_s) > longest_s:
            break
    if abs(total_s) > longest_s:
        return total_s, error_s, fit.values[:-1]
    if abs(left_s) > max(error_s, LEAST_S):
        raise ValueError(
            f"it did not settle in {ROUNDS} rounds: {1e3 * left_s:.2g} ms are left at "
            f"{1e3 * total_s:.3g} ms"
        )
    # Between coarse samples what is left bends, so that its slope is that on the side where it is
    # less steep, over what an interval of 95 % takes.
    root, apart_s = tried[-1], 2.0 * error_s * abs(stretch)
    stretches = []
    for move_s in (root[0] - apart_s, root[0] + apart_s):
        beside = min(tried, key=lambda one: abs(one[0] - move_s))
        if abs(beside[0] - move_s) > 0.5 * apart_s:
            beside = move_s, float(left_after(move_s, fit.values).values[-1])
        stretches.append(abs(_stretch(root, beside)))
    error_s *= max(stretches)
    return total_s, error_s, fit.values[:-1]


def matters(delay_s: float, error_s: float) -> bool:
    """Return whether a delay is significant, and long enough to be worth a shift."""
    return abs(delay_s) >= max(SIGNIFICANT * error_s, LEAST_S)


def _stretch(one: tuple[float, float], other: tuple[float, float]) -> float:
    """Return how far the torque must move for each second that is left: 1 between dense samples.

    Each argument is a move and what it left, in s.
    """
    gone_s = other[1] - one[1]
    stretch = (one[0] - other[0]) / gone_s if gone_s else 1.0
    return float(np.clip(stretch, -MOST_STRETCH, MOST_STRETCH))


def _in_half_the_band(prepared: PreparedEpoch) -> PreparedEpoch:
    estimation = prepared.settings.estimation
    high_hz = max(0.5 * estimation.band_high_closed_loop_hz, 2.0 * estimation.band_low_hz)
    narrower = estimation.model_copy(update={"band_high_closed_loop_hz": high_hz})
    return replace(prepared, settings=prepared.settings.model_copy(update={"estimation": narrower}))
