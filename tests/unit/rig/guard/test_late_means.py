"""Means of ticks that came late: a gap is filled in, and is no part of what was before."""

import pytest
from tests.unit.rig.guard.many_steps import NOTHING

from rigidimeter.rig.guard import AnswerLimits, Cause, consistency_state, consistency_step


def test_a_gap_is_no_part_of_the_mean_of_what_was_before():
    """Three ticks make a mean of 3 ms; a tick 40 ms later is one of its own, filled in by five."""
    limits = NOTHING._replace(mean_of_ticks=8, answer=AnswerLimits(step_s=0.008))
    state = consistency_state(limits)
    for elapsed, angle, means in ((1, 0.0, 1), (1, 0.1, 1), (1, 0.2, 1), (1, 0.3, 1), (40, 0.9, 7)):
        state, _ = consistency_step(limits, state, 1.0, 2.0, 0.0, angle, 0.0, 0.0, 0.0, elapsed)
        assert state.means.answer.steps == means
    assert state.means.angle_rad == pytest.approx(0.9)
    assert state.readings == 0
    # The first, then the mean of three, then five on the line from there.
    assert state.means.answer.angle[0] == pytest.approx(0.9)
    # As long as a mean is, it is a part of it.
    state, _ = consistency_step(limits, state, 1.0, 2.0, 0.0, 0.2, 0.0, 0.0, 0.0, 1)
    state, _ = consistency_step(limits, state, 1.0, 2.0, 0.0, 0.4, 0.0, 0.0, 0.0, 8)
    assert state.means.angle_rad == pytest.approx(0.3)


def test_what_was_wrong_before_a_gap_is_named():
    limits = NOTHING._replace(mean_of_ticks=8, energy_j=1.0, answer=AnswerLimits(step_s=0.008))
    state = consistency_state(limits)
    state = state._replace(means=state.means._replace(angle_rad=0.0, energy_j=1.01))
    state, cause = consistency_step(limits, state, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1)
    assert cause == Cause.ENERGY_HIGH
    state = state._replace(means=state.means._replace(energy_j=1.005))
    state, cause = consistency_step(limits, state, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1)
    assert cause == Cause.NONE  # its mean has not ended
    state, cause = consistency_step(limits, state, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 40)
    assert (cause, state.means.energy_j < 1.0) == (Cause.ENERGY_HIGH, True)
