"""What is counted at the position limit, against a list of all ticks."""

import math

import numpy as np
import pytest

from rigidimeter.rig.guard import contact_state, contact_step

INTERVAL_S = 0.125


@pytest.mark.parametrize("of_ticks", [1, 2, 5])
@pytest.mark.parametrize("passed", [1, 2, 7])
def test_the_ticks_of_the_memory_are_counted(of_ticks, passed):
    rng = np.random.default_rng(of_ticks)
    state, marks = contact_state(INTERVAL_S, of_ticks * INTERVAL_S), []
    assert state.at_limit.size == of_ticks
    for at_limit in (rng.random(200) < 0.4).tolist():
        state = contact_step(state, at_limit, passed, INTERVAL_S, 0.0)
        marks += [at_limit] * passed
        assert state.ticks == sum(marks[-of_ticks:]) == state.at_limit.sum()
        assert state.touching is at_limit
        assert 0 <= state.place < of_ticks


def test_an_arrival_is_counted_where_the_last_one_is_long_enough_ago():
    # Arrivals 0, 4, 6 and 8 ticks after the first; 0.5 s, 4 ticks, must lie between.
    state, counted = contact_state(INTERVAL_S, 1.0), []
    for at_limit in map(bool, (1, 1, 0, 0, 1, 0, 1, 0, 1)):
        state = contact_step(state, at_limit, 1, INTERVAL_S, 4 * INTERVAL_S)
        counted.append(state.arrivals)
    assert counted == [1, 1, 1, 1, 2, 2, 2, 2, 3]
    assert (state.arrived_s, state.before_s, state.three_s) == (0.0, 0.5, 1.0)


def test_nothing_has_arrived_at_first():
    state = contact_step(contact_state(INTERVAL_S, 0.0), False, 3, INTERVAL_S, 1.0)
    assert state.at_limit.tolist() == [0]
    assert contact_state(0.02, 0.05).at_limit.tolist() == [0, 0, 0]
    assert state[1:] == (0, 0, False, *[math.inf] * 3, 0)
