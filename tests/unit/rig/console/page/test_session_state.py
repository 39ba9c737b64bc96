"""What the page is sent of a session: text, signs, and numbers to draw."""

import math
from dataclasses import replace

import numpy as np
from tests.unit.rig.console.test_facts import PLAN, QUIET, RUNNING, shown
from tests.unit.rig.console.test_session_progress import ended, started, told

from rigidimeter.rig.acquisition.processes import ProcessCondition
from rigidimeter.rig.console import AT_ONCE, TRACES, EmgState, Level, LiveValue, Traces, facts
from rigidimeter.rig.console.page import LEVELS, points, session_state
from rigidimeter.rig.guard import Cause

KNOWN = tuple(LiveValue(symbol, "", 1.0, 0.1, True, "") for symbol in "JBK")


def test_lamps_and_limits_have_the_signs_of_the_terminal():
    progress = told(started(1, "1"))
    state = session_state(shown(progress), progress)
    signs = {LEVELS[level]: level.sign for level in Level}
    assert {lamp["sign"] == signs[lamp["level"]] for lamp in state["lamps"]} == {True}
    assert {limit["sign"] for limit in state["limits"]} == {Level.GOOD.sign}
    near = facts(PLAN, progress, RUNNING, recent=QUIET._replace(largest_torque_nm=9.5))
    torque = next(one for one in session_state(near, progress)["limits"] if one["name"] == "torque")
    assert torque["sign"] == Level.WATCH.sign


def test_emg_that_is_missing_is_in_the_banner_beside_what_stopped_the_rig():
    progress = told(started(1, "1"))
    emg = EmgState(ProcessCondition.TROUBLE, "missing since 3.0 s", 0.1)
    state = session_state(shown(progress, emg=emg), progress)
    assert state["alert"] == "EMG: missing since 3.0 s"
    assert state["lamps"][-1]["text"] == "EMG: missing since 3.0 s"
    held = shown(progress, RUNNING._replace(cause=int(Cause.STALLED)), emg=emg)
    stop, missing = session_state(held, progress)["alert"].split("\n")
    assert Cause.STALLED.sentence in stop
    assert missing == "EMG: missing since 3.0 s"
    assert session_state(shown(progress), progress)["alert"] == ""


def test_the_panes_are_those_of_the_epoch_that_runs_or_ran_last():
    for events, task in (
        ((), "prbs"),
        ((started(1, "1"),), "prbs"),
        ((started(1, "1"), ended(1)), "prbs"),
        ((started(1, "1"), ended(1), started(2, "2")), "sinusoid"),
    ):
        progress = told(*events)
        assert session_state(shown(progress), progress)["task"] == task


def test_the_modelled_torque_is_shown_when_all_of_j_b_k_are():
    progress = told(started(1, "1"))
    found = shown(progress)
    assert session_state(found, progress)["modelled"] is False
    assert session_state(replace(found, live=KNOWN), progress)["modelled"] is True
    one_not = (*KNOWN[:2], replace(KNOWN[2], settled=False))
    assert session_state(replace(found, live=one_not), progress)["modelled"] is False


def test_a_piece_of_time_is_fifteen_numbers_with_angles_in_degrees():
    def values(names, first):
        return {name: np.array([first + k]) for k, name in enumerate(names)}

    traces = Traces(
        np.array([7.0]),
        values(TRACES, 1.0),
        values(TRACES, 11.0),
        np.array([0]),
        0,
        values(AT_ONCE, 21.0),
    )
    expected = [7, 1, math.degrees(2), math.degrees(3), 4, 5]
    expected += [11, math.degrees(12), math.degrees(13), 14, 15, math.degrees(21), 22, 23, 24]
    sent = np.frombuffer(points(traces, modelled=True), "<f8")
    np.testing.assert_allclose(sent, expected)
    hidden = np.frombuffer(points(traces, modelled=False), "<f8")
    np.testing.assert_allclose(hidden[:-1], expected[:-1])
    assert math.isnan(hidden[-1])
