"""What is heard of a session, and when: each stop and each caution once."""

from dataclasses import replace

import pytest
from tests.unit.rig.console.test_facts import PLAN, QUIET, RUNNING, WELL, shown
from tests.unit.rig.console.test_session_progress import told

from rigidimeter.rig.acquisition import State
from rigidimeter.rig.console import Alarm, Alarms, facts
from rigidimeter.rig.guard import Cause

NONE, CAUTION, STOP = Alarm
WELL_NOW = shown(told())
HELD = shown(told(), RUNNING._replace(state=State.PAUSED, cause=int(Cause.TORQUE_HIGH)))
STOPPED = shown(told(), RUNNING._replace(state=State.FAULTED, cause=int(Cause.TORQUE_TOO_HIGH)))
NEAR = facts(PLAN, told(), RUNNING, recent=QUIET._replace(largest_power_w=19.0), recorder=WELL)


class Heard:
    def __init__(self):
        self.now_s = 100.0
        self.alarms = Alarms(lambda: self.now_s)

    def __call__(self, *shown, outcome="", cautions=(), every_s=0.1):
        found = []
        for one in shown:
            self.now_s += every_s
            found.append(self.alarms.heard(one, outcome, cautions))
        return found


@pytest.fixture
def heard():
    return Heard()


def test_a_hold_and_a_stop_are_heard_as_they_begin(heard):
    assert heard(WELL_NOW, HELD, HELD, WELL_NOW, HELD) == [NONE, STOP, NONE, NONE, STOP]
    assert heard(STOPPED, STOPPED) == [STOP, NONE]  # a hold that became a stop
    assert heard.alarms.stopped


def test_why_it_stands_may_come_later_than_that_it_does(heard):
    """The sentence with value and limit is an event; the cause is there before."""
    why = replace(STOPPED, stop_words="stopped: the torque was 21 N·m, limit 20 N·m")
    assert heard(STOPPED, why) == [STOP, NONE]


@pytest.mark.parametrize("outcome", ["fail", "abort"])
def test_an_end_without_success_is_a_stop_once(heard, outcome):
    ended = replace(WELL_NOW, stop_words="the operator aborted")
    assert heard(WELL_NOW) == [NONE]
    assert heard(ended, ended, outcome=outcome) == [STOP, NONE]


def test_a_session_that_ends_with_success_is_not_heard(heard):
    ended = replace(WELL_NOW, stop_words="all epochs were run")
    assert heard(ended, outcome="success") == [NONE]


def test_an_indicator_that_gets_worse_is_a_caution_and_not_more_than_every_10_s(heard):
    assert heard(WELL_NOW, NEAR, NEAR, WELL_NOW, NEAR) == [NONE, CAUTION, NONE, NONE, NONE]
    heard.now_s += 10.0
    assert heard(WELL_NOW, NEAR) == [NONE, CAUTION]


def test_a_torque_that_does_not_fit_is_a_caution_for_each_epoch(heard):
    assert heard(WELL_NOW, WELL_NOW, cautions=("epoch 1: J is small",)) == [CAUTION, NONE]
    both = ("epoch 1: J is small", "epoch 2: J is small")
    assert heard(WELL_NOW, WELL_NOW, cautions=both) == [CAUTION, NONE]


def test_what_stops_the_rig_is_heard_as_a_stop_alone(heard):
    assert heard(WELL_NOW, STOPPED, replace(STOPPED, indicators=NEAR.indicators)) == [
        *(NONE, STOP, NONE),
    ]
