"""K of a limb whose weight pulls: with its slope, and by the note without it."""

from __future__ import annotations

import numpy as np
import pytest
from tests.scenarios.catalogue import SCENARIOS

from rigidimeter.analysis.recording import estimate
from rigidimeter.core.settings import changed_settings


def test_the_note_gives_the_stiffness_without_the_slope_of_the_weight():
    scenario = SCENARIOS["gravity 0.5 N·m at 45°"]
    epochs, truth = scenario.simulated(0, 1)
    known = {"diagnostics": {"gravity_nm": 0.5, "gravity_angle_deg": 45.0}}
    settings = changed_settings(scenario.analysed_with(), known)
    fit = estimate(epochs, "bandlimited", settings=settings).fits[0]
    (note,) = (one for one in fit.findings if one.name == "gravity")
    assert note.level == "note"
    slope = 0.5 * np.cos(np.pi / 4)
    assert fit.value[2] == pytest.approx(truth[0, 2] + slope, rel=0.01)
    assert note.value == pytest.approx(truth[0, 2], rel=0.01)
    assert fit.outcome.included
