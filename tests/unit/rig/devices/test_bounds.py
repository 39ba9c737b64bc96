"""The bounds of a drive: what they must be, and how they are written into its objects."""

from __future__ import annotations

import math

import pytest

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.devices import (
    LOST,
    MOTOR_SPEED,
    POSITION,
    SLIPPAGE,
    SPEED,
    TORQUE,
    Cia402Settings,
    DriveBounds,
    DriveSays,
    Tight,
    bound_objects,
    drive_bounds,
    wanted_bounds,
)
from rigidimeter.rig.devices.base import DeviceError

REACH, MARGIN = math.radians(40.0), math.radians(2.0)
BOUNDS = DriveBounds(REACH, MARGIN, 0.08, 20.0, 0.0045)
DRIVE = {
    "counts_per_rev": 4096.0,
    "velocity_units_per_rev_s": 60.0,
    "gear_ratio": 50.0,
    "max_velocity_rad_s": 2.0,
    "acceleration_rad_s2": 60.0,
    "deceleration_rad_s2": 100.0,
    "quick_stop_rad_s2": 120.0,
    "reflected_inertia_kg_m2": 0.5,
    "friction_nm": 3.0,
}
COUNTS_PER_DEG = 4096 * 50 / 360
SAYS = DriveSays(position_counts=0, rated_torque_mnm=400, home_offset_counts=None)


def written(bounds=BOUNDS, says=SAYS, tight=None, **changes):
    """Return the values by index and sub-index of the first objects tried, and the reasons."""
    wanted = wanted_bounds(Cia402Settings(**{**DRIVE, **changes}), bounds, says, tight)
    values = {
        (entry.index, entry.subindex): entry.value
        for bound in wanted
        if not bound.why_not
        for entry in bound.alternatives[0]
    }
    return values, {bound.name: bound.why_not for bound in wanted if bound.why_not}


def test_a_quick_stop_of_drive_and_arm_fits_below_the_bound_of_the_torque():
    """1.25 ((0.5 + 0.08) 120 + 3 + 20) = 115.75 N·m; 400 mN·m behind a gear of 50 are 20 N·m."""
    assert BOUNDS.torque_nm(0.5, 3.0, 120.0) == pytest.approx(115.75)
    assert written()[0][0x6072, 0] == math.ceil(1000 * 115.75 / 20.0)


def test_the_same_number_is_the_one_of_the_current():
    wanted = wanted_bounds(Cia402Settings(**DRIVE), BOUNDS, SAYS)
    ((torque,), (current,)) = wanted[0].alternatives
    assert (torque.index, current.index) == (0x6072, 0x6073)
    assert torque.value == current.value == 5788


def test_the_arm_of_the_settings_with_the_largest_inertia_counts():
    settings = parse_settings(
        {
            "subject": {"light": {"inertia_kg_m2": 0.01}, "heavy": {"inertia_kg_m2": 0.2}},
            "guard": {
                "torque_stop_nm": 30.0,
                "position_limit_deg": 25.0,
                "reaction_time_s": 0.05,
            },
            "rig": {"drive_bandwidth_hz": 20.0, "drive_damping_ratio": 0.7},
            "protocol": {"blocks": [{"condition": "light"}]},
        }
    )
    found = drive_bounds(settings)
    assert found.arm_inertia_kg_m2 == 0.2
    assert found.stop_torque_nm == 30.0
    assert math.degrees(found.reach_rad) == pytest.approx(25.0)
    assert math.degrees(found.margin_rad) == pytest.approx(settings.guard.following_limit_deg)
    assert found.lag_s == pytest.approx(2 * 0.7 / (2 * math.pi * 20.0))


def test_a_drive_that_follows_its_ramps_does_not_slip_by_more_than_half_the_bound():
    """Behind a ramp of a rad/s² a drive of second order is 2ζa/ω late."""
    lag = 2 * 0.7 / (2 * math.pi * 20.0)
    bounds = BOUNDS._replace(lag_s=lag)
    slip = 2 * lag * 120.0  # 2.67 rad/s, the lag of the quick stop and as much again
    units = math.ceil(slip * 60.0 * 50.0 / (2 * math.pi))
    assert written(bounds)[0][0x60F8, 0] == units


def test_speeds_count_at_the_motor():
    """2 rad/s of the joint are 955 1/min of the motor, and a quarter more may be."""
    values, _ = written()
    assert values[0x607F, 0] == math.ceil(2.0 * 60 * 50 / (2 * math.pi))
    assert values[0x6080, 0] == math.ceil(1.25 * 2.0 * 60 * 50 / (2 * math.pi))


@pytest.mark.parametrize("start_deg", [0.0, 30.0, -75.0])
def test_the_position_is_bounded_about_where_the_joint_stands(start_deg):
    says = SAYS._replace(position_counts=round(start_deg * COUNTS_PER_DEG))
    values, _ = written(says=says)
    low, high = (values[0x607D, k] / COUNTS_PER_DEG for k in (1, 2))
    assert low == pytest.approx(start_deg - 42.0, abs=0.01)
    assert high == pytest.approx(start_deg + 42.0, abs=0.01)


@pytest.mark.parametrize("zero_counts", [0, 100_000])
def test_a_persons_range_cuts_it_and_a_negative_sign_swaps_its_ends(zero_counts):
    """-10 to 25 deg of the joint, and the margin of 2 deg: with sign -1 that is -27 to 12."""
    bounds = BOUNDS._replace(range_rad=(math.radians(-10.0), math.radians(25.0)))
    says = SAYS._replace(position_counts=zero_counts)
    for sign, ends in ((1, (-12.0, 27.0)), (-1, (-27.0, 12.0))):
        values, _ = written(bounds, says, sign=sign, zero_counts=zero_counts)
        found = [(values[0x607D, k] - zero_counts) / COUNTS_PER_DEG for k in (1, 2)]
        assert found == pytest.approx(ends, abs=0.01)


def test_a_joint_outside_of_the_persons_range_is_refused():
    bounds = BOUNDS._replace(range_rad=(math.radians(-10.0), math.radians(25.0)))
    says = SAYS._replace(position_counts=round(28.0 * COUNTS_PER_DEG))
    with pytest.raises(DeviceError, match=r"stands at 28\.0 deg.*outside of -12\.0 to 27\.0 deg"):
        written(bounds, says)


@pytest.mark.parametrize(
    ("says", "changes", "name", "why"),
    [
        ({}, {"reflected_inertia_kg_m2": 0.0}, TORQUE, "does not name reflected_inertia_kg_m2"),
        ({"rated_torque_mnm": None}, {}, TORQUE, "does not say its rated torque"),
        ({"rated_torque_mnm": 1}, {}, TORQUE, "more than 65535"),
        ({"home_offset_counts": 5}, {}, POSITION, "home offset of 5"),
        ({"position_counts": 2**31 - 100}, {}, POSITION, "do not fit into 32 bits"),
        ({}, {"axis_subindex": 2}, POSITION, "sub-indices of 0x607D, which are those of axes"),
    ],
)
def test_a_bound_that_cannot_be_computed_is_not_written_and_says_why(says, changes, name, why):
    values, reasons = written(says=SAYS._replace(**says), **changes)
    assert list(reasons) == [name]
    assert why in reasons[name]
    assert not {index for index, _ in values} & {TORQUE: {0x6072}, POSITION: {0x607D}}[name]


def test_a_bound_of_the_rig_file_is_taken_if_a_stop_fits_below_it():
    assert written(torque_bound_nm=100.0)[0][0x6072, 0] == 5000
    with pytest.raises(DeviceError, match=r"torque_bound_nm = 90 N·m.*takes, 92\.6 N·m"):
        written(torque_bound_nm=90.0)


@pytest.mark.parametrize(
    ("name", "address", "value"),
    [
        (TORQUE, (0x6072, 0), 0),
        (SPEED, (0x607F, 0), math.ceil(0.1 * 60 * 50 / (2 * math.pi))),
        (MOTOR_SPEED, (0x6080, 0), math.ceil(0.1 * 60 * 50 / (2 * math.pi))),
        (SLIPPAGE, (0x60F8, 0), 1),
        (POSITION, (0x607D, 2), math.ceil(0.05 * COUNTS_PER_DEG * 180 / math.pi)),
    ],
)
def test_a_bound_is_tightened_to_half_of_a_move_and_no_other_with_it(name, address, value):
    usual, _ = written()
    tight, _ = written(tight=Tight(name, reach_rad=0.1, speed_rad_s=0.2))
    assert tight[address] == value
    assert {index for index, _ in usual if usual[index, _] != tight[index, _]} == {address[0]}


def test_every_bound_says_what_is_lost_without_it():
    entries = bound_objects(Cia402Settings(), BOUNDS)
    assert {o.index for o in entries} == {0x6072, 0x6073, 0x607D, 0x607F, 0x6080, 0x60F8}
    assert all(entry.optional for entry in entries)
    assert all(any(entry.lost.startswith(lost) for lost in LOST.values()) for entry in entries)


def test_the_window_of_the_following_error_is_not_written():
    """By CiA 402, 0x6065 acts in the position modes; this drive runs in profile velocity mode."""
    assert 0x6065 not in {o.index for o in bound_objects(Cia402Settings(), BOUNDS)}
