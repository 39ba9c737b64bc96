"""One tick: what is read, filtered, written and recorded, number by number."""

import math

import pytest
from tests.unit.rig.acquisition.exact_rig import (
    CHANGE_RAD_S,
    INTERVAL_S,
    SETTINGS,
    Desk,
    constant,
    made,
)

from rigidimeter.core.settings import LONGEST_STEP, parse_settings
from rigidimeter.model import BiquadState, admittance, biquad_step
from rigidimeter.rig.acquisition import Command, hold, run_ticks, set_admittance
from rigidimeter.rig.devices.base import Reading
from rigidimeter.rig.guard import Cause, Limited, Reaction

# What is written and recorded


def test_the_guards_output_is_written_once_a_tick_and_the_request_recorded_beside_it():
    loop, samples = made(SETTINGS)
    run_ticks(loop, 3, 10, constant(2.0))
    ramp = [CHANGE_RAD_S * (k + 1) for k in range(10)]
    assert loop.rig.of("write") == pytest.approx(ramp)
    assert [name for name, *_ in loop.rig.calls] == ["read", "write"] * 10
    assert [s.velocity_command_rad_s for s in samples] == pytest.approx(ramp)
    assert {s.velocity_request_rad_s for s in samples} == {2.0}
    assert {s.limited for s in samples} == {int(Limited.ACCELERATION)}


def test_when_a_stretch_ends_is_known_from_its_first_tick_on():
    loop, _ = made(SETTINGS)
    assert loop.until_tick == 0
    run_ticks(loop, 3, 10, constant(0.0))
    known = []
    run_ticks(loop, 3, 7, lambda r, t, k: known.append(loop.until_tick) or (0.0, 0.0, 0.0))
    assert known == [17] * 7


def test_what_the_drive_sent_is_recorded_not_what_was_allowed():
    loop, samples = made(SETTINGS)
    write = loop.rig.write
    loop.rig.write = lambda velocity_rad_s: round(write(velocity_rad_s), 1)
    run_ticks(loop, 1, 3, constant(2.0))
    assert [s.velocity_command_rad_s for s in samples] == [0.1, 0.2, 0.3]


def test_what_is_in_force_counts_for_where_the_joint_should_be():
    loop, _ = made(SETTINGS)
    loop.rig.write, write = (lambda asked: write(0.5 * asked)), loop.rig.write
    result = run_ticks(loop, 3, 1000, constant(0.5))
    assert result.cause is Cause.NONE
    assert loop.angle_rad > 2.0 * loop.limits.following_rad


def test_a_drive_that_does_not_know_what_it_sent_is_taken_to_have_sent_what_was_allowed():
    """Were NaN remembered, no ramp from it would ever end."""
    loop, samples = made(SETTINGS)
    write = loop.rig.write
    loop.rig.write = lambda asked: math.nan if len(samples) == 3 else write(asked)
    assert run_ticks(loop, 1, 6, constant(2.0)).cause is Cause.NONE
    ramp = [CHANGE_RAD_S * (k + 1) for k in range(6)]
    assert math.isnan(samples[3].velocity_command_rad_s)
    del ramp[3], samples[3]
    assert [s.velocity_command_rad_s for s in samples] == pytest.approx(ramp)


def test_each_field_of_the_record_is_the_readings_own():
    reading = Reading(0.1, 0.0001, 0.02, 0.003, 0.0002, 11, 12, 13, 14, 0, 0.4, 0.0003)
    loop, samples = made(SETTINGS, change=lambda *_: reading, late={0: 0.0005})
    run_ticks(loop, 7, 1, lambda *_: (0.01, 0.5, 0.25))
    (s,) = samples
    assert (s.tick, s.time_s, s.lateness_s, s.epoch) == (0, 0.0005, 0.0005, 7)
    assert (s.perturbation_nm, s.target_angle_rad, s.velocity_request_rad_s) == (0.5, 0.25, 0.01)
    assert (s.torque_nm, s.torque_time_s) == (0.1, 0.0001)
    assert (s.angle_rad, s.velocity_rad_s, s.motion_time_s) == (0.02, 0.003, 0.0002)
    numbers = s.torque_sequence, s.torque_status, s.motion_sequence, s.motion_status, s.cause
    assert numbers == (11, 12, 13, 14, 0)
    assert (s.drive_torque_nm, s.drive_torque_time_s) == (0.4, 0.0003)
    assert loop.tick == 1


def test_the_commands_that_the_guard_changed_are_counted_anew_in_each_stretch():
    loop, _ = made(SETTINGS)
    assert run_ticks(loop, 1, 10, constant(3.5 * CHANGE_RAD_S)).limited_ticks == 3
    assert run_ticks(loop, 1, 10, constant(3.5 * CHANGE_RAD_S)).limited_ticks == 0


def test_the_time_at_which_the_position_limit_first_held_is_told():
    """Both ways: 1 deg is soon reached, and the arm stands before it."""
    values = {"guard": {"position_limit_deg": 1.0}, "sinusoid": {"amplitude_deg": 0.5}}
    settings = parse_settings(values)
    for sign in (1.0, -1.0):
        loop, samples = made(settings)
        ended = run_ticks(loop, 1, 100, constant(sign))
        first = next(s for s in samples if s.limited == Limited.POSITION)
        assert ended.limit_time_s == first.time_s > 0.0
        assert abs(samples[-1].angle_rad) <= math.radians(1.0)
        assert samples[-1].limited == Limited.POSITION
        assert math.isnan(run_ticks(loop, 1, 5, constant(-sign)).limit_time_s)


# Readings


def test_the_controller_gets_the_filtered_torque():
    loop, _ = made(SETTINGS, change=lambda _, r: r._replace(torque_nm=1.0))
    heard = []
    run_ticks(loop, 1, 5, lambda r, torque_nm, k: heard.append(torque_nm) or (0.0, 0.0, 0.0))
    state, expected = BiquadState(), []
    for _ in range(5):
        state, out = biquad_step(loop.lowpass, state, 1.0)
        expected.append(out)
    assert heard == expected
    assert 0.0 < heard[0] < heard[-1] < 1.0


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_torque_that_is_no_number_does_not_stay_in_the_filter(bad):
    torques = [1.0, 2.0, bad, 1.5, 1.0]
    loop, _ = made(SETTINGS, change=lambda k, r: r._replace(torque_nm=torques[k]))
    heard = []

    def command(_, torque_nm, __):
        heard.append(torque_nm)
        return 0.0, 0.0, 0.0

    run_ticks(loop, 1, 3, command)  # it stops at the bad one
    run_ticks(loop, 1, 2, command, latched=True)
    state, expected = BiquadState(), []
    for value in (1.0, 2.0, 1.5, 1.0):
        state, out = biquad_step(loop.lowpass, state, value)
        expected.append(out)
    assert [*heard[:2], *heard[3:]] == expected
    assert loop.cause is Cause.TORQUE_NOT_FINITE


@pytest.mark.parametrize(
    ("field", "cause"),
    [("torque_time_s", Cause.TORQUE_STALE), ("motion_time_s", Cause.MOTION_STALE)],
)
def test_the_age_of_a_reading_is_its_own(field, cause):
    """Only one stands still, from tick 5 on: it is named when it is older than the limit."""
    settings = parse_settings({"guard": {"stale_s": 0.02}})
    loop, _ = made(
        settings, change=lambda k, r: r._replace(**{field: min(k, 5) * INTERVAL_S - 1e-6})
    )
    ended = run_ticks(loop, 1, 100, constant(0.0))
    assert ended.cause is cause
    assert loop.tick == 5 + 20 + 1


def test_the_last_angle_that_was_a_number_is_kept():
    loop, _ = made(SETTINGS, change=lambda k, r: r._replace(angle_rad=0.001 if k < 2 else math.nan))
    run_ticks(loop, 1, 3, constant(0.0))
    assert (loop.angle_rad, loop.cause) == (0.001, Cause.MOTION_NOT_FINITE)


# Causes


def test_a_cut_takes_the_power_away_in_its_tick_before_anything_is_written():
    loop, samples = made(SETTINGS, desk=Desk({5: Cause.EMERGENCY_STOP}))
    ended = run_ticks(loop, 1, 10, constant(2.0))
    assert loop.rig.calls[-3:] == [("read", 1), ("disable",), ("write", 0.0)]
    assert (ended.cause, loop.reaction, len(samples)) == (Cause.EMERGENCY_STOP, Reaction.CUT, 6)
    hold(loop, 0.003)
    assert loop.rig.calls.count(("disable",)) == 1


def test_after_a_stop_no_stretch_of_motion_goes_on():
    """Whoever asks for one gets a tick, in which nothing is asked of the drive."""
    loop, samples = made(SETTINGS, desk=Desk({2: Cause.DRIVE_FAULT}))
    run_ticks(loop, 1, 10, constant(0.1))
    for ticks in (4, 5):
        ended = run_ticks(loop, 1, 10, constant(0.1))
        assert (ended.cause, len(samples)) == (Cause.DRIVE_FAULT, ticks)
        assert samples[-1].velocity_command_rad_s == 0.0


DEVICE, OUTSIDE = Cause.TORQUE_PACKETS, Cause.SIGNAL


@pytest.mark.parametrize(
    ("late_s", "device", "outside", "named"),
    [
        (0.0, DEVICE, 0, DEVICE),
        (0.0, 0, OUTSIDE, OUTSIDE),
        (0.0, DEVICE, OUTSIDE, DEVICE),
        (0.0, DEVICE, Cause.EMERGENCY_STOP, Cause.EMERGENCY_STOP),
        (0.0, Cause.EMERGENCY_STOP, OUTSIDE, Cause.EMERGENCY_STOP),
        (0.0, Cause.TORQUE_HIGH, OUTSIDE, OUTSIDE),
        (0.05, 0, 0, Cause.STALLED),
        (0.05, DEVICE, OUTSIDE, Cause.STALLED),
        (0.05, 0, Cause.EMERGENCY_STOP, Cause.EMERGENCY_STOP),
    ],
)
def test_of_the_causes_of_one_tick_the_graver_is_named_then_the_one_before(
    late_s, device, outside, named
):
    loop, samples = made(
        SETTINGS,
        change=lambda k, r: r._replace(cause=int(device)) if k >= 2 else r,
        late={2: late_s} if late_s else {},
        desk=Desk({2: outside}),
    )
    ended = run_ticks(loop, 1, 100, constant(0.1))
    assert (ended.cause, samples[-1].cause, len(samples)) == (named, named, 3)


def test_a_joint_that_moves_though_nothing_was_sent_is_stopped():
    """What `rig.guard.consistency` finds reaches the guard."""
    loop, _ = made(
        SETTINGS,
        change=lambda k, r: r._replace(angle_rad=math.radians(0.02 * k), velocity_rad_s=0.35),
    )
    ended = run_ticks(loop, 1, 200, constant(0.0))
    assert ended.cause is Cause.MOVED_AT_REST


def test_supervision_is_asked_with_the_time_it_is():
    desk = Desk()
    loop, _ = made(SETTINGS, desk=desk, late={1: 0.0004})
    run_ticks(loop, 1, 3, constant(0.0))
    assert desk.times_s == pytest.approx([0.0, 0.0014, 0.002])


# Orders, progress


def test_an_order_that_ends_the_stretch_is_told_and_none_taken_for_nothing():
    taken = []
    desk = Desk(orders={2: Command.PAUSE, 4: Command.ABORT})
    loop, _ = made(
        SETTINGS,
        desk=desk,
        take_order=lambda order: taken.append(order.command) or order.command is Command.ABORT,
    )
    ended = run_ticks(loop, 1, 10, constant(0.0))
    assert taken == [Command.PAUSE, Command.ABORT]
    assert (ended.interrupted, loop.tick) == (True, 5)
    assert run_ticks(loop, 1, 2, constant(0.0)).interrupted is False


def test_an_order_that_nobody_takes_ends_nothing():
    loop, _ = made(SETTINGS, desk=Desk(orders={2: Command.ABORT}))
    assert run_ticks(loop, 1, 10, constant(0.0)).interrupted is False
    assert loop.tick == 10


def test_progress_is_told_each_second_of_the_session():
    told = []
    settings = parse_settings(
        {"rig": {"tick_rate_hz": 100.0, "torque": {"rate_hz": 100.0}, "motion": {"rate_hz": 100.0}}}
    )
    loop, _ = made(settings, progress=told.append)
    run_ticks(loop, 1, 250, constant(0.0))
    assert told == [1.0, 2.0]


# The admittance


def test_the_admittance_is_made_for_one_tick_and_for_as_many_as_may_be_missed():
    loop, _ = made(SETTINGS)
    set_admittance(loop, 0.05, 2.0)
    assert (loop.inertia_kg_m2, loop.damping_nm_s_rad) == (0.05, 2.0)
    expected = [admittance(0.05, 2.0, n * INTERVAL_S) for n in range(1, LONGEST_STEP + 1)]
    assert loop.admittances == expected


@pytest.mark.parametrize(
    ("slow", "cause"), [("torque", Cause.NONE), ("motion", Cause.SELDOM_FRESH)]
)
def test_each_reading_is_as_old_as_its_own_sensor_may_make_it(slow, cause):
    """Torque 50 times and motion 1000 times a second: 13 to 19 ms are old for the motion alone."""
    settings = parse_settings({"rig": {"torque": {"rate_hz": 50.0}}})
    stamp = f"{slow}_time_s"
    loop, _ = made(settings, change=lambda k, r: r._replace(**{stamp: k // 20 * 20 * INTERVAL_S}))
    assert run_ticks(loop, 1, 1500, constant(0.0)).cause is cause


def test_the_joint_is_still_once_zero_was_commanded_for_longer_than_ramp_and_settling():
    """After twice the reaction time, 0.04 s; the ramp from 200 deg/s at 6000 deg/s² is 0.033 s."""
    loop, _ = made(SETTINGS)
    assert not loop.still
    run_ticks(loop, 1, 20, constant(0.5))
    still = []
    for _ in range(60):
        run_ticks(loop, 1, 1, constant(0.0))
        still.append(loop.still)
    ramp = math.ceil(0.5 / CHANGE_RAD_S)
    first = still.index(True)
    assert first == pytest.approx(ramp + 40, abs=1)
    assert all(still[first:])
    run_ticks(loop, 1, 1, constant(0.01))
    assert not loop.still


def test_the_ramp_counts_where_it_takes_longer_than_the_drive():
    values = {"guard": {"acceleration_limit_deg_s2": 1000.0}}  # 0.2 s from 200 deg/s
    loop, _ = made(parse_settings(values))
    run_ticks(loop, 1, 150, constant(0.0))
    assert not loop.still
    run_ticks(loop, 1, 60, constant(0.0))
    assert loop.still


@pytest.mark.parametrize(("moved_deg", "still"), [(0.9, True), (-0.9, True), (1.1, False)])
def test_a_joint_that_was_moved_away_while_zero_is_commanded_is_not_still(moved_deg, still):
    moved = math.radians(moved_deg)
    loop, _ = made(SETTINGS, change=lambda k, r: r._replace(angle_rad=moved if k >= 100 else 0.0))
    run_ticks(loop, 1, 100, constant(0.0))
    assert loop.still
    run_ticks(loop, 1, 5, constant(0.0))
    assert loop.still is still
