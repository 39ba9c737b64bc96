"""The random streams of the virtual rig: one for each thing that is random, all from one generator.

Streams of their own keep one thing from moving another: with more jitter the noise stays the same.
Whoever draws the numbers, tick by tick or all beforehand, takes them from the same stream.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

__all__ = ["BLOCK_TICKS", "RigStreams", "rig_streams"]

BLOCK_TICKS = 5000
"""The subject's torque is drawn in blocks of this many ticks; the numbers depend on it."""


class RigStreams(NamedTuple):
    """One independent generator for each thing that is random."""

    torque_jitter: np.random.Generator
    noise: np.random.Generator
    motion_jitter: np.random.Generator
    subject: np.random.Generator
    joint: np.random.Generator


def rig_streams(rng: np.random.Generator) -> RigStreams:
    """Return the streams of a rig; a generator gives others each time it is asked."""
    return RigStreams(*rng.spawn(len(RigStreams._fields)))
