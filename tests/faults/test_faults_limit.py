"""Faults 28 and 29: what takes a while to show, and then holds the rig."""

import numpy as np
from tests.faults.rigs import Wrong, bench
from tests.faults.trials import run

from rigidimeter.rig.guard import Cause, Reaction

OFFSET_NM = 1.1
"""The small joint balances it at 36 of 40 deg, and the perturbation brings it to its limit."""


def held(trial, cause):
    named = Cause(int(trial.samples["cause"][trial.first]))
    assert (named, named.reaction) == (cause, Reaction.HOLD)
    return named


def test_fault_28_an_offset_at_the_position_limit(tmp_path, measured):
    tables = {"prbs": {"duration_s": 15.0}, "protocol": {"rests_s": [2.5], "return_s": 0.5}}
    with bench("virtual", **tables) as made:
        wrong = Wrong("sensor", "offset", OFFSET_NM)
        trial = run(made, tmp_path / "s", wrong, at_s=0.0, task="prbs")
        held(trial, Cause.HELD_AT_LIMIT)
        assert trial.detected_s < 10.0
        assert np.degrees(np.abs(trial.trace[:, 1])).max() < 40.05
        measured(28, "virtual", f"offset {OFFSET_NM:g} N·m", trial, 10.0)


def test_fault_29_single_zeros_of_the_torque(tmp_path, measured):
    with bench("virtual", guard={"energy_limit_j": 50.0}) as made:
        trial = run(made, tmp_path / "s", Wrong("sensor", "zeros", 6.0))
        held(trial, Cause.TORQUE_WILD)
        # the third of them, one in 20 ms, and two samples more
        assert trial.detected_s <= 0.0625
        measured(29, "virtual", "1 in 20, at 6 N·m", trial, 0.0625)
