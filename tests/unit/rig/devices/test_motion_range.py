"""The range of motion of a person: what is one, and what it is compared with."""

import math

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.rig.devices import (
    LED,
    STOP_HIGH,
    STOP_LOW,
    MotionRange,
    range_of,
    require_within,
)
from rigidimeter.rig.devices.base import DeviceError

STOPS = {STOP_LOW: -45.0, STOP_HIGH: 90.0}


def test_it_is_kept_in_degrees_and_used_in_radians():
    found = MotionRange(-30.0, 60.0, LED, "S01")
    assert found.range_rad == pytest.approx((-math.pi / 6.0, math.pi / 3.0))
    assert found.words == (
        "range of motion of S01: -30 to 60 deg on the drive's scale, led by hand"
    )
    assert range_of(found.facts(), "a session") == found
    assert range_of(None, "a session") is None


@pytest.mark.parametrize("ends", [(60.0, -30.0), (10.0, 10.5), (math.nan, 1.0), (-30.0, math.inf)])
def test_what_is_no_range_is_refused(ends):
    with pytest.raises(UserError, match=r"the range of motion .* must"):
        MotionRange(*ends)
    low_deg, high_deg = ends
    stored = {"low_deg": low_deg, "high_deg": high_deg, "how": LED, "subject": ""}
    with pytest.raises(UserError, match="a session: the range of motion in its manifest"):
        range_of(stored, "a session")


@pytest.mark.parametrize("stored", [[], "x", {}, {"low_deg": "a"}, 5])
def test_a_manifest_that_keeps_something_else_is_refused(stored):
    with pytest.raises(UserError, match="a session: the range of motion in its manifest"):
        range_of(stored, "a session")


@pytest.mark.parametrize(("low_deg", "high_deg"), [(-42.0, 87.0), (-41.0, 0.0)])
def test_inside_the_stops_by_the_margin_it_is_taken(low_deg, high_deg):
    MotionRange(low_deg, high_deg).require_inside(STOPS, "rig.commissioned.json")


@pytest.mark.parametrize(("low_deg", "high_deg"), [(-42.1, 60.0), (-30.0, 87.1)])
def test_at_the_stops_it_is_refused(low_deg, high_deg):
    with pytest.raises(UserError) as caught:
        MotionRange(low_deg, high_deg).require_inside(STOPS, "rig.commissioned.json")
    assert "must be inside -42 to 87 deg: the mechanical stops are at -45 and 90 deg" in str(
        caught.value
    )


def test_a_record_without_the_stops_is_refused():
    with pytest.raises(UserError, match=r"rig\.commissioned\.json: has no angles of the mech"):
        MotionRange(0.0, 10.0).require_inside({STOP_LOW: 1.0}, "rig.commissioned.json")


@pytest.mark.parametrize("angle_rad", [-0.2, 0.5, -0.3, 0.6, math.nan, 2.0 * math.pi])
def test_a_joint_outside_or_at_an_end_is_not_enabled(angle_rad):
    require_within((-0.2, 0.5), 0.0)
    with pytest.raises(DeviceError, match="outside of the range of motion of this person"):
        require_within((-0.2, 0.5), angle_rad)
