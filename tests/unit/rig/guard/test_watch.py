"""Each law at its boundary, and their order."""

import math

import numpy as np
import pytest

from rigidimeter.rig.guard import Cause, GuardLimits, energy_after, found_wrong, outside

LIMITS = GuardLimits(
    position_rad=0.75,
    speed_rad_s=3.0,
    acceleration_rad_s2=100.0,
    reaction_time_s=0.25,
    interval_s=0.125,
    tolerance_rad=0.125,
    overspeed_rad_s=4.0,
    stale_s=0.5,
    torque_nm=10.0,
    torque_stop_nm=20.0,
    power_w=16.0,
    energy_j=5.0,
    following_rad=0.03125,
    at_limit_s=1.0,
    arrivals_s=4.0,
)
WELL = {
    "requested_rad_s": 0.5,
    "torque_nm": 1.0,
    "motion_finite": True,
    "angle_rad": 0.1,
    "velocity_rad_s": 0.5,
    "age_s": 0.001,
    "torque_age_s": 0.002,
    "position_error_rad": 0.0,
    "energy_j": 0.1,
    "limited_s": 0.5,
    "three_arrivals_s": 8.0,
}

AT_THE_BOUNDARY = [
    ("angle_rad", 0.875, Cause.POSITION_LIMIT_EXCEEDED),
    ("age_s", 0.5, Cause.MOTION_STALE),
    ("torque_age_s", 0.5, Cause.TORQUE_STALE),
    ("velocity_rad_s", 4.0, Cause.OVERSPEED),
    ("position_error_rad", 0.03125, Cause.NOT_FOLLOWING),
    ("energy_j", 5.0, Cause.ENERGY_HIGH),
    ("torque_nm", 10.0, Cause.TORQUE_HIGH),
    ("limited_s", 1.0, Cause.HELD_AT_LIMIT),
]
SIGNED = {"angle_rad", "velocity_rad_s", "position_error_rad", "torque_nm"}


def found(limits=LIMITS, **values):
    return found_wrong(limits, **{**WELL, **values})


def test_nothing_is_wrong():
    assert found() == Cause.NONE
    assert type(found()) is int


@pytest.mark.parametrize(("field", "limit", "cause"), AT_THE_BOUNDARY)
def test_a_law_holds_up_to_its_limit_and_no_further(field, limit, cause):
    for sign in (1.0, -1.0) if field in SIGNED else (1.0,):
        assert found(**{field: sign * limit}) == Cause.NONE
        assert found(**{field: sign * math.nextafter(limit, math.inf)}) == cause


def test_three_arrivals_must_take_longer_than_their_time():
    assert found(three_arrivals_s=math.nextafter(4.0, 5.0)) == Cause.NONE
    assert found(three_arrivals_s=4.0) == Cause.HELD_AT_LIMIT
    assert found(three_arrivals_s=math.nan) == Cause.HELD_AT_LIMIT


@pytest.mark.parametrize(("angle_rad", "beyond"), [(-0.375, -math.inf), (0.625, math.inf)])
def test_the_range_has_a_limit_on_each_side(angle_rad, beyond):
    cut = LIMITS._replace(lowest_rad=-0.25, highest_rad=0.5)  # and a tolerance of 0.125
    assert found(cut, angle_rad=angle_rad) == Cause.NONE
    outside = math.nextafter(angle_rad, beyond)
    assert found(cut, angle_rad=outside) == Cause.POSITION_LIMIT_EXCEEDED
    assert found(angle_rad=outside) == Cause.NONE


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_far_too_much_torque_stops_rather_than_pauses(sign):
    assert found(torque_nm=sign * 20.0, velocity_rad_s=0.0) == Cause.TORQUE_HIGH
    above = math.nextafter(20.0, math.inf)
    assert found(torque_nm=sign * above, velocity_rad_s=0.0) == Cause.TORQUE_TOO_HIGH


@pytest.mark.parametrize(("torque_nm", "velocity_rad_s"), [(8.0, 2.0), (-8.0, 2.0), (8.0, -2.0)])
def test_power_counts_both_ways(torque_nm, velocity_rad_s):
    assert found(torque_nm=torque_nm, velocity_rad_s=velocity_rad_s) == Cause.NONE
    faster = velocity_rad_s * 1.001
    assert found(torque_nm=torque_nm, velocity_rad_s=faster) == Cause.POWER_HIGH


@pytest.mark.parametrize("field", ["age_s", "torque_age_s"])
def test_a_stamp_may_lie_ahead_by_the_reaction_time_and_a_tick(field):
    assert found(**{field: -0.375}) == Cause.NONE
    assert found(**{field: math.nextafter(-0.375, -1.0)}) == Cause.STAMP_AHEAD
    assert found(**{field: -math.inf}) == Cause.STAMP_AHEAD


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_named_first(bad):
    assert found(torque_nm=bad, energy_j=bad) == Cause.TORQUE_NOT_FINITE
    assert found(requested_rad_s=bad, energy_j=9.0) == Cause.COMMAND_NOT_FINITE
    assert found(motion_finite=False, requested_rad_s=bad) == Cause.MOTION_NOT_FINITE


@pytest.mark.parametrize(
    ("field", "cause"),
    [
        ("angle_rad", Cause.POSITION_LIMIT_EXCEEDED),
        ("age_s", Cause.MOTION_STALE),
        ("torque_age_s", Cause.TORQUE_STALE),
        ("velocity_rad_s", Cause.OVERSPEED),
        ("position_error_rad", Cause.NOT_FOLLOWING),
        ("energy_j", Cause.ENERGY_HIGH),
    ],
)
def test_no_law_is_passed_by_what_is_no_number(field, cause):
    assert found(**{field: math.nan}) == cause
    assert found(**{field: math.inf}) == cause


def test_the_order_is_from_worthless_numbers_to_what_asks_for_a_pause():
    wrong = {
        "torque_nm": math.nan,
        "motion_finite": False,
        "requested_rad_s": math.nan,
        "angle_rad": 9.0,
        "age_s": 9.0,
        "torque_age_s": 9.0,
        "velocity_rad_s": 9.0,
        "position_error_rad": 9.0,
        "energy_j": 9.0,
    }
    mended = {**WELL, "torque_nm": 99.0}
    order = []
    for field in wrong:
        order.append(found(**wrong))
        wrong[field] = mended[field]
        if field == "torque_age_s":
            order.append(found(**{**wrong, "age_s": -9.0}))
    assert order == [
        *(Cause.TORQUE_NOT_FINITE, Cause.MOTION_NOT_FINITE, Cause.COMMAND_NOT_FINITE),
        *(Cause.POSITION_LIMIT_EXCEEDED, Cause.MOTION_STALE, Cause.TORQUE_STALE),
        *(Cause.STAMP_AHEAD, Cause.OVERSPEED, Cause.NOT_FOLLOWING, Cause.TORQUE_TOO_HIGH),
    ]
    assert found(torque_nm=11.0, velocity_rad_s=3.0, energy_j=6.0) == Cause.ENERGY_HIGH
    assert found(torque_nm=11.0, velocity_rad_s=3.0) == Cause.TORQUE_HIGH


def test_energy_fades_within_a_second_and_grows_with_power_of_either_sign():
    assert energy_after(4.0, 0.0, 0.25) == 3.0
    assert energy_after(0.0, 8.0, 0.25) == 2.0
    assert energy_after(0.0, -8.0, 0.25) == 2.0
    energy = 0.0
    for _ in range(1000):
        energy = energy_after(energy, 3.0, 0.001)
    assert energy == pytest.approx(3.0 * (1.0 - math.exp(-1.0)), rel=1e-3)


def test_a_stall_leaves_nothing_of_the_energy_before():
    assert energy_after(4.0, 0.0, 1.0) == 0.0
    assert energy_after(4.0, 2.0, 3600.0) == 2.0


# Sums 0, 1, 2, ... were written at places 0, 1, ...; then the ring began anew at place 0.
RING = np.array([8.0, 9.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])


@pytest.mark.parametrize(
    ("moved", "first", "last", "expected"),
    [
        (9.0, 0, 0, 0.0),
        (9.5, 0, 0, 0.5),
        (8.5, 0, 0, -0.5),
        (9.5, 1, 3, 1.5),
        (8.0, 1, 3, 0.0),
        (6.0, 1, 3, 0.0),
        (5.5, 1, 3, -0.5),
        (5.5, 1, 4, 0.0),
        (2.0, 1, 7, 0.0),
        (1.0, 1, 7, -1.0),
    ],
)
def test_outside_is_the_distance_to_the_stretch(moved, first, last, expected):
    assert outside(RING, 1, first, last, moved) == expected


def test_outside_looks_at_both_turns_within_the_stretch():
    swung = np.array([0.0, 3.0, 1.0, -2.0, 0.5])
    assert outside(swung, 4, 0, 4, 3.5) == 0.5
    assert outside(swung, 4, 0, 4, -2.25) == -0.25
    assert outside(swung, 4, 0, 4, 2.0) == 0.0
    assert outside(swung, 4, 0, 1, 2.0) == 1.5
