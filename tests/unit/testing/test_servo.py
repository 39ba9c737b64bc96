from __future__ import annotations

import pytest

from rigidimeter.testing import Phase, after_control, statusword

OFF, READY, ON = Phase.SWITCH_ON_DISABLED, Phase.READY, Phase.SWITCHED_ON
RUN, STOP, FAULT = Phase.OPERATION_ENABLED, Phase.QUICK_STOP_ACTIVE, Phase.FAULT

# The transitions of CiA 402-2 that a controlword asks for, by their numbers there.
TRANSITIONS = [
    (2, OFF, 0x06, READY),
    (3, READY, 0x07, ON),
    (4, ON, 0x0F, RUN),
    (5, RUN, 0x07, ON),
    (6, ON, 0x06, READY),
    (7, READY, 0x00, OFF),
    (8, RUN, 0x06, READY),
    (9, RUN, 0x00, OFF),
    (10, ON, 0x00, OFF),
    (11, RUN, 0x02, STOP),
    (12, STOP, 0x00, OFF),
    (15, FAULT, 0x80, OFF),
    (16, STOP, 0x0F, RUN),
]


@pytest.mark.parametrize(("number", "before", "control", "after"), TRANSITIONS)
def test_a_controlword_leads_where_the_standard_says(number, before, control, after):
    assert after_control(before, control, 0) is after


def test_power_comes_only_step_by_step():
    for control in (0x07, 0x0F, 0x02, 0x80):
        assert after_control(OFF, control, 0) is OFF


def test_a_fault_is_left_by_the_edge_of_its_reset_alone():
    for control in (0x00, 0x06, 0x07, 0x0F):
        assert after_control(FAULT, control, 0) is FAULT
    assert after_control(FAULT, 0x80, 0x80) is FAULT
    assert after_control(Phase.FAULT_REACTION, 0x80, 0) is Phase.FAULT_REACTION


def test_the_statusword_codes_the_state():
    assert statusword(RUN) & 0x6F == 0x27
    assert statusword(OFF) & 0x4F == 0x40
    assert statusword(FAULT) & 0x4F == 0x08
