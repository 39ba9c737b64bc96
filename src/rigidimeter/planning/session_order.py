"""The order of a session: blocks of epochs, each epoch followed by a rest drawn at random.

The paper rests 10 or 20 s between perturbations, chosen at random so that the subject cannot tell
when the next one starts, while the arm returns to where it began (Sec. 2.3 and 2.4.3).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidimeter.core.records import Task
from rigidimeter.core.session import PlannedEpoch, Protocol
from rigidimeter.core.settings import PrbsSettings, ProtocolSettings, SinusoidSettings

_REST_STREAM = 0x7265_7374
"""Sets the rests' random stream apart from others that start at the same recorded seed."""


def rest_generator(seed: int) -> np.random.Generator:
    """Return the generator of the rests of a session with this seed.

    Raises
    ------
    ValueError
        If the seed is negative.
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_REST_STREAM,)))


def draw_rests_s(
    rests_s: Sequence[float], count: int, generator: np.random.Generator
) -> tuple[float, ...]:
    """Return `count` rests drawn from `rests_s`, each with the same chance, in s."""
    return tuple(float(rests_s[index]) for index in generator.integers(len(rests_s), size=count))


def plan(
    protocol: ProtocolSettings, prbs: PrbsSettings, sinusoid: SinusoidSettings, seed: int
) -> Protocol:
    """Return the epochs of a session, block after block.

    Parameters
    ----------
    protocol : ProtocolSettings
        Blocks in order, and the rests to draw from.
    prbs, sinusoid : PrbsSettings, SinusoidSettings
        For the duration of their epochs.
    seed : int
        Recorded with the session; the same seed and settings give the same session.

    Raises
    ------
    ValueError
        If the seed is negative.
    """
    duration_s: dict[Task, float] = {"prbs": prbs.duration_s, "sinusoid": sinusoid.duration_s}
    in_order = [block for block in protocol.blocks for _ in range(block.epochs)]
    rests_s = draw_rests_s(protocol.rests_s, len(in_order), rest_generator(seed))
    epochs = tuple(
        PlannedEpoch(number, str(number), block.task, block.condition, duration_s[block.task], rest)
        for number, (block, rest) in enumerate(zip(in_order, rests_s, strict=True), start=1)
    )
    return Protocol(seed, epochs)
