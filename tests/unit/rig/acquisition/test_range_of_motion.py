"""A session within the range of motion of a person, on the simulated rig."""

import math

import numpy as np
import pytest

from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import SimulatedClock, run_session
from rigidimeter.rig.devices import SimulatedRig

DEG = math.pi / 180.0
VALUES = {
    "prbs": {"duration_s": 2.0, "amplitude_nm": 3.0},
    "sinusoid": {"duration_s": 2.0, "motion_s": 2.0, "taper_s": 0.5, "amplitude_deg": 10.0},
    "zeroing": {"duration_s": 0.2},
    "subject": {"OFF": {"voluntary_sd_nm": 0.0}},
}
ORIGIN_RAD = 1.0


class Shifted(SimulatedRig):
    """A rig whose joint stands elsewhere on the drive's scale."""

    origin_rad = ORIGIN_RAD


class Sink:
    def __init__(self):
        self.samples, self.events, self.ended = [], [], None

    def sample(self, sample):
        self.samples.append(sample)

    def event(self, name, **facts):
        self.events.append((name, facts))

    def close(self, *ended):
        self.ended = ended


def run(range_deg, task="prbs", **more):
    """Run one epoch; return how it ended, the angles in deg and the reasons of the epochs."""
    block = {"task": task, "condition": "OFF", "epochs": 1}
    protocol = {"blocks": [block], "rests_s": [3.0], "repeat_limited": False}
    protocol |= more.pop("protocol", {})
    settings = parse_settings({**VALUES, "protocol": protocol, **more})
    rig = Shifted(settings.rig, settings.subject["OFF"], np.random.default_rng(1))
    sink = Sink()
    range_rad = None
    if range_deg is not None:
        range_rad = tuple(ORIGIN_RAD + DEG * end for end in range_deg)
    result = run_session(
        plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed),
        settings,
        rig,
        SimulatedClock(),
        sink,
        zero_first=True,
        range_rad=range_rad,
    )
    return result, np.rad2deg([s.angle_rad for s in sink.samples]), sink


def test_each_side_has_its_own_end_from_where_the_joint_stands():
    _, free, sink = run(None)
    assert free.min() < -8.0
    assert free.max() > 8.0
    assert dict(sink.events)["rig_enabled"]["range_rad"] is None
    assert dict(sink.events)["epoch_ended"]["counts"]["torque_wild"] == 0
    _, angles, sink = run((-3.0, 60.0))
    assert -3.01 < angles.min() < -2.5
    told = dict(sink.events)
    assert told["rig_enabled"]["range_rad"] == pytest.approx((-3.0 * DEG, 60.0 * DEG))
    _, angles, sink = run((-60.0, 7.5))
    assert angles.min() < -8.0
    assert 7.0 < angles.max() < 7.51
    assert dict(sink.events)["epoch_ended"]["reason"].startswith(
        "the arm came to the position limit of -40 or 7.5 deg at "
    )


def test_a_range_beyond_the_position_limit_changes_no_sample():
    _, _, before = run(None)
    _, _, after = run((-41.0, 90.0))
    assert after.samples == before.samples


def test_a_sinusoid_that_does_not_fit_is_refused_before_anything_moves():
    result, angles, _ = run((-30.0, 10.1), task="sinusoid")
    assert result.outcome == "fail"
    assert result.reason.startswith("the sinusoid reaches 10.")
    assert "toward positive angles (with the room to stop)" in result.reason
    assert result.epochs_run == 0
    assert np.ptp(angles) == 0.0 if angles.size else True
    assert run((-30.0, 12.0), task="sinusoid")[0].outcome == "success"


@pytest.mark.parametrize("range_deg", [(-0.01, 20.0), (-20.0, 0.01)])
def test_a_joint_at_the_end_of_the_range_leaves_no_way_back(range_deg):
    fast = {"return_s": 0.5, "return_speed_deg_s": 200.0}
    result, _, _ = run(range_deg, protocol=fast)
    assert result.outcome == "fail"
    assert result.reason.startswith("the way back from ")
    assert run(tuple(30.0 * end for end in range_deg), protocol=fast)[0].epochs_run == 1
    assert "the range of motion of this person ends 0.01 deg from where the joint" in result.reason
