"""Whether 95 % intervals hold the joint of a rig that shares nothing with the package."""

from __future__ import annotations

import numpy as np
import pytest
from tests.scenarios.independent_rig import Rig, simulate

from rigidimeter import identify

EPOCHS, DURATION_S = 200, 8.4
"""Short epochs have few lines: their noise is known least, and hardest to state."""

CHANCE = 2 * np.sqrt(0.95 * 0.05 / EPOCHS)
"""Two standard errors of a share of 95 %."""


@pytest.mark.slow
def test_intervals_of_single_short_epochs_hold_the_joint():
    rig = Rig()
    found = simulate(rig, EPOCHS, 143, DURATION_S)
    fits = [identify(**found.epoch(i), settings=rig.settings()) for i in range(EPOCHS)]
    assert {fit.method for fit in fits} == {"iv"}
    value, low, high, se = (
        np.array([getattr(fit, name) for fit in fits]) for name in ("value", "low", "high", "se")
    )
    held = np.mean((low <= rig.joint) & (rig.joint <= high), axis=0)
    assert np.all(held > 0.93 - CHANCE), held
    # An SD of 200 values is known within 5 %.
    ratio = np.median(se, axis=0) / np.std(value, axis=0, ddof=1)
    assert np.all((ratio > 0.9) & (ratio < 1.2)), ratio
