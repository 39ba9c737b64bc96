"""How far the steps of an encoder move least squares.

An angle θ that is rounded to whole steps q holds an error e beside it. The motion of the fit is
then Φ + E, with E what filters and derivatives make of e, and least squares gives

    p̂ = (Φ'Φ + E'E)⁻¹ Φ'M        in place of        p = (Φ'Φ)⁻¹ Φ'M,

since e has nothing to do with the motion where that goes through many steps. J is too small by the
share of the acceleration's power that is none,

    (2π)⁴ f⁵ S / 5,    S = q² / (6 f_s),

for errors that are white, f the upper edge of the band and f_s the rate. The errors of slow motion
are alike from sample to sample and not white, so e is made anew: the motion that the band leaves,
rounded to the same steps elsewhere, so that it is not the rounding that made the record.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rigidimeter.analysis.estimation.signals import Array, Signals, motion_channels
from rigidimeter.analysis.estimation.stretches import sound
from rigidimeter.core.records import Channel, Epoch

LOOKED_AT = 2000
"""Samples that show whether a channel goes in steps."""

FEW = 0.5
"""Of the samples looked at may be different, or the steps are too fine to matter."""

EXACT = 0.01
"""Of a step: differences of rounded values are whole steps to this."""

ELSEWHERE = 0.5
"""Of a step, by how much the motion is shifted before it is rounded again. What the band leaves
still holds the slow part of the errors, and unshifted most samples would be rounded to where they
were. Halfway the errors come out up to half larger than they were."""


def step_of(values: Array) -> float:
    """Return the step that values are rounded to; 0 if there is none that many samples share."""
    looked_at = values[:LOOKED_AT]
    different = np.unique(looked_at)
    if different.size < 2 or different.size > FEW * looked_at.size:
        return 0.0
    rises = np.diff(different)
    step = float(np.min(rises))
    steps = rises / step
    return step if np.all(np.abs(steps - np.round(steps)) < EXACT * steps) else 0.0


def moved_by_steps(
    epoch: Epoch,
    signals: Signals,
    signals_of: Callable[[Epoch], Signals],
    smooth: Callable[[Channel], Array],
) -> Array:
    """Return how far J, B and K of least squares are from the joint's for the steps, shape (3,).

    Parameters
    ----------
    epoch : Epoch
    signals : Signals
        That J, B and K are fitted to.
    signals_of : callable
        What makes them from the channels of an epoch, a sum from a sum.
    smooth : callable
        What leaves of a channel the motion alone.
    """
    channels = motion_channels(epoch)
    steps = [step_of(one.values[sound(epoch, one.time_s)]) for one in channels]
    if not any(steps):
        return np.zeros(3)
    errors = {
        one.name: replace(one, values=_rounding(smooth(one), step))
        for one, step in zip(channels, steps, strict=True)
    }
    alone = signals_of(replace(epoch, channels={**epoch.channels, **errors})).motion
    lengths, motion = signals.solution.lengths, signals.motion
    scale = np.outer(lengths, lengths)
    of_errors = alone.T @ alone / scale
    moved = np.linalg.solve(
        motion.T @ motion / scale - of_errors, of_errors @ (signals.solution.values * lengths)
    )
    return np.asarray(np.abs(moved) / lengths)


def _rounding(motion: Array, step: float) -> Array:
    """Return what rounding to steps adds to a motion that is shifted by a part of one."""
    if not step:
        return np.zeros_like(motion)
    shifted = motion + ELSEWHERE * step
    return np.asarray(step * np.round(shifted / step) - shifted)
