"""One loop: what is predicted from the settings, and what the estimation takes."""

from __future__ import annotations

import numpy as np
import pytest

from rigidimeter.analysis.estimation.closedloop.controller_used import loop_of
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import DriveModel, Loop


@pytest.mark.parametrize(
    "settings",
    [
        Settings(),
        parse_settings({"rig": {"drive_bandwidth_hz": 25.0, "torque": {"latency_s": 0.004}},
                        "guard": {"reaction_time_s": 0.04}}),
        parse_settings({"rig": {"torque": {"latency_s": 0.0034}}}),
        parse_settings({"rig": {"torque": {"rate_hz": 100.0}}}),
    ],
    ids=["default", "slow drive", "part of a tick", "slow sensor"],
)  # fmt: skip
def test_what_is_planned_is_what_the_estimation_takes_for_its_instrument(
    settings: Settings,
) -> None:
    rig = settings.rig
    drive = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    planned = Loop(settings.controller, rig)
    taken = loop_of(settings, rig.torque.rate_hz, drive)
    frequency_hz = np.geomspace(0.01, rig.tick_rate_hz / 2.0, 200)
    ours, theirs = (loop.at_frequency(frequency_hz) for loop in (taken, planned))
    for joint in ((0.0045, 0.1368, 1.751), (0.02, 0.0, 0.0)):
        motion = theirs.command(joint) * theirs.motion
        np.testing.assert_allclose(ours.command(joint) * ours.motion, motion, rtol=1e-6)
