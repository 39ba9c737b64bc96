"""One loop: what is predicted from the settings, and what the estimation simulates."""

from __future__ import annotations

import numpy as np
import pytest

from rigidimeter.dynamics import DriveModel, JointDynamics, closed_loop_motion
from rigidimeter.estimation.closedloop.drive_fit import loop_of
from rigidimeter.experiment import prbs_nm
from rigidimeter.settings import Settings, parse_settings


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
    perturbation = prbs_nm(settings.prbs, rig.tick_rate_hz)
    planned = closed_loop_motion(perturbation, settings, JointDynamics(0.0045, 0.1368, 1.751))
    drive = DriveModel(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    loop = loop_of(settings, rig.torque.rate_hz, drive)
    taken = loop.response(perturbation, rig.tick_rate_hz, (0.0045, 0.1368, 1.751))
    for name in ("angle_rad", "velocity_rad_s", "acceleration_rad_s2"):
        theirs, ours = getattr(planned, name), getattr(taken, name)
        np.testing.assert_allclose(ours, theirs, atol=1e-6 * np.abs(theirs).max())
