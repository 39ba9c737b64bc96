"""One tick: what is read, filtered, written and recorded, number by number."""

import math
from itertools import pairwise

import pytest
from tests.unit.acquisition.exact_rig import INTERVAL_S, Desk, constant, made

from rigidimeter.acquisition import hold, ramp_to_rest
from rigidimeter.acquisition.run_states import Command
from rigidimeter.acquisition.tick import (
    LONGEST_STEP,
    REST,
    run_ticks,
    set_admittance,
    skip_passed_ticks,
)
from rigidimeter.control import BiquadState, admittance, biquad_step
from rigidimeter.devices import Reading
from rigidimeter.guard import Cause, Limited, Reaction
from rigidimeter.settings import parse_settings

SETTINGS = parse_settings({})
CHANGE_RAD_S = math.radians(SETTINGS.guard.acceleration_limit_deg_s2) * INTERVAL_S
"""What the acceleration limit allows in one tick: 6000 deg/s² in 1 ms, 0.105 rad/s."""

HAND_KG_M2 = 0.0045


def written(loop):
    return loop.rig.of("write")


def steps(values):
    return [after - before for before, after in pairwise(values)]


def assert_ramps(velocities, ticks):
    """Assert a ramp to zero from so many ticks' worth; one tick more is for how floats round."""
    expected = [CHANGE_RAD_S * k for k in range(ticks, -1, -1)]
    assert velocities[: ticks + 1] == pytest.approx(expected, abs=1e-12)
    assert velocities[ticks:] == pytest.approx([0.0] * (len(velocities) - ticks), abs=1e-12)
    assert velocities[-1] == 0.0
    assert len(velocities) <= ticks + 2


# What is written and recorded


def test_the_guards_output_is_written_once_a_tick_and_the_request_recorded_beside_it():
    loop, samples = made(SETTINGS)
    run_ticks(loop, 3, 10, constant(2.0))
    ramp = [CHANGE_RAD_S * (k + 1) for k in range(10)]
    assert written(loop) == pytest.approx(ramp)
    assert [name for name, *_ in loop.rig.calls] == ["read", "write"] * 10
    assert [s.velocity_command_rad_s for s in samples] == pytest.approx(ramp)
    assert {s.velocity_request_rad_s for s in samples} == {2.0}
    assert {s.limited for s in samples} == {int(Limited.ACCELERATION)}


def test_what_the_drive_sent_is_recorded_not_what_was_allowed():
    loop, samples = made(SETTINGS)
    write = loop.rig.write
    loop.rig.write = lambda velocity_rad_s: round(write(velocity_rad_s), 1)
    run_ticks(loop, 1, 3, constant(2.0))
    assert [s.velocity_command_rad_s for s in samples] == [0.1, 0.2, 0.3]


def test_a_ramp_ends_when_zero_is_in_force_not_when_it_was_asked_for():
    loop, samples = made(SETTINGS)
    run_ticks(loop, 3, 10, constant(CHANGE_RAD_S))
    write, busy = loop.rig.write, iter([True, True, True, False])

    def write_on_busy_line(velocity_rad_s):
        return loop.rig.velocity_rad_s if next(busy) else write(velocity_rad_s)

    loop.rig.write = write_on_busy_line
    ramp_to_rest(loop)
    assert loop.rig.velocity_rad_s == 0.0
    assert [s.velocity_command_rad_s for s in samples[10:]] == [CHANGE_RAD_S] * 3 + [0.0]


def test_what_is_in_force_counts_for_where_the_joint_should_be():
    loop, _ = made(SETTINGS)
    loop.rig.write, write = (lambda asked: write(0.5 * asked)), loop.rig.write
    result = run_ticks(loop, 3, 1000, constant(0.5))
    assert result.cause is Cause.NONE
    assert loop.angle_rad > 2.0 * loop.limits.following_rad


def test_each_field_of_the_record_is_the_readings_own():
    reading = Reading(0.1, 0.0001, 0.02, 0.003, 0.0002, 11, 12, 13, 14)
    loop, samples = made(SETTINGS, change=lambda *_: reading, late={0: 0.0005})
    run_ticks(loop, 7, 1, lambda *_: (0.01, 0.5, 0.25))
    (s,) = samples
    assert (s.tick, s.time_s, s.lateness_s, s.epoch) == (0, 0.0005, 0.0005, 7)
    assert (s.perturbation_nm, s.target_angle_rad, s.velocity_request_rad_s) == (0.5, 0.25, 0.01)
    assert (s.torque_nm, s.torque_time_s) == (0.1, 0.0001)
    assert (s.angle_rad, s.velocity_rad_s, s.motion_time_s) == (0.02, 0.003, 0.0002)
    numbers = s.torque_sequence, s.torque_status, s.motion_sequence, s.motion_status, s.cause
    assert numbers == (11, 12, 13, 14, 0)
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


def test_a_cut_while_ramping_takes_the_power_away_and_the_first_cause_stays():
    desk = Desk({5: Cause.DRIVE_FAULT, 7: Cause.EMERGENCY_STOP})
    loop, samples = made(SETTINGS, desk=desk)
    run_ticks(loop, 1, 10, constant(2.0))
    ramp_to_rest(loop)
    assert loop.rig.calls[-3:] == [("read", 1), ("disable",), ("write", 0.0)]
    causes = [s.cause for s in samples]
    assert causes == [0] * 5 + [int(Cause.DRIVE_FAULT)] * 3


@pytest.mark.parametrize("cause", [Cause.TORQUE_HIGH, Cause.DRIVE_FAULT])
def test_a_hold_and_a_stop_leave_the_power_on_for_the_ramp(cause):
    loop, _ = made(SETTINGS, desk=Desk({5: cause}))
    run_ticks(loop, 1, 10, constant(2.0))
    assert loop.tick == 6  # the stretch has ended
    ramp_to_rest(loop)
    assert ("disable",) not in loop.rig.calls
    assert_ramps(written(loop)[4:], 5)


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
    """What `guard.consistency` finds reaches the guard."""
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


# Time


def test_a_late_tick_is_not_made_up_for_and_everybody_is_told():
    loop, samples = made(SETTINGS, late={3: 0.0025})
    asked = []
    ended = run_ticks(loop, 1, 10, lambda r, t, k: asked.append(k) or (0.0, 0.0, 0.0))
    assert [s.tick for s in samples] == [0, 1, 2, 5, 6, 7, 8, 9]
    assert asked == [0, 1, 2, 5, 6, 7, 8, 9]
    assert loop.rig.of("read") == [1, 1, 1, 3, 1, 1, 1, 1]
    # Waited for once each: the deadlines that have passed are not asked for.
    assert [round(t / INTERVAL_S) for t in loop.clock.deadlines_s] == [0, 1, 2, 3, 6, 7, 8, 9]
    assert samples[3].lateness_s == pytest.approx(0.0025)
    assert samples[3].time_s == pytest.approx(0.0055)
    assert (ended.missed_ticks, ended.cause) == (2, Cause.NONE)
    assert run_ticks(loop, 1, 3, constant(0.0)).missed_ticks == 0


def test_a_tick_late_by_less_than_its_length_misses_none_by_its_length_one():
    for late_s, missed in ((0.00099, 0), (0.001, 1)):
        loop, _ = made(SETTINGS, late={0: late_s})
        assert run_ticks(loop, 1, 5, constant(0.0)).missed_ticks == missed


def test_a_tick_late_beyond_the_end_of_its_stretch_is_its_last():
    loop, _ = made(SETTINGS, late={3: 0.0045})
    asked = []
    run_ticks(loop, 1, 5, lambda r, t, k: asked.append(k) or (0.0, 0.0, 0.0))
    assert asked == [0, 1, 2, 4]
    assert loop.tick == 8


def test_a_ramp_goes_on_in_real_time_through_a_late_tick():
    """The guard hears of the missed ticks: three ticks' worth of braking in one step."""
    loop, _ = made(SETTINGS, desk=Desk({10: Cause.DRIVE_FAULT}), late={13: 0.0025})
    run_ticks(loop, 1, 20, constant(2.0))
    ramp_to_rest(loop)
    down = [-step / CHANGE_RAD_S for step in steps(written(loop)[9:])]
    assert down[:8] == pytest.approx([1, 1, 1, 3, 1, 1, 1, 1])


def test_where_the_commands_led_is_counted_through_a_late_tick():
    """A wrong count of a constant 2 rad/s over 30 ms would be 3.4 deg astray."""
    loop, _ = made(SETTINGS, late={40: 0.030}, inertia_kg_m2=HAND_KG_M2)
    ended = run_ticks(loop, 1, 100, constant(2.0))
    assert (ended.cause, ended.missed_ticks) == (Cause.NONE, 30)


def test_the_time_at_rest_is_counted_through_a_late_tick():
    """From then on a joint that moves is one that nobody told to."""
    loop, _ = made(SETTINGS, late={3: 0.0025})
    run_ticks(loop, 1, 10, constant(0.0))
    assert loop.consistency.still_s == pytest.approx(10 * INTERVAL_S)


def test_missed_deadlines_stop_only_in_a_row():
    settings = parse_settings({"loop": {"missed_in_a_row": 3}})
    late = {0: 0.001, 2: 0.001, 5: 0.001, 7: 0.001}
    loop, _ = made(settings, late=late)
    assert run_ticks(loop, 1, 20, constant(0.0)).cause is Cause.NONE
    loop, samples = made(settings, late={0: 0.001, 2: 0.001, 4: 0.001})
    assert run_ticks(loop, 1, 20, constant(0.0)).cause is Cause.DEADLINES_MISSED
    assert [s.tick for s in samples] == [1, 3, 5]


@pytest.mark.parametrize(("late_s", "stalled"), [(0.0399, False), (0.0401, True)])
def test_a_loop_that_stood_still_sets_nothing_going_again(late_s, stalled):
    """From 40 ms on the drive's own watchdog has stopped it."""
    loop, samples = made(SETTINGS, late={20: late_s}, inertia_kg_m2=HAND_KG_M2)
    ended = run_ticks(loop, 1, 100, constant(1.0))
    assert (ended.cause is Cause.STALLED) == stalled
    at_tick = samples[20].velocity_command_rad_s
    assert at_tick == (0.0 if stalled else pytest.approx(1.0))


def test_after_a_suspension_nothing_is_set_going_again():
    """No tick is late, for the loop's clock slept too."""
    loop, _ = made(SETTINGS, desk=Desk({20: Cause.STALLED}))
    ended = run_ticks(loop, 1, 100, constant(1.0))
    assert (ended.cause, written(loop)[-1], loop.tick) == (Cause.STALLED, 0.0, 21)


def test_the_ticks_that_enabling_took_are_left_out_and_the_rig_read():
    loop, samples = made(SETTINGS, late={0: 0.3004, 300: 0.0012})
    skip_passed_ticks(loop)
    assert loop.rig.of("read") == [300, 1]
    assert (loop.tick, loop.time_s) == (301, pytest.approx(0.301))
    run_ticks(loop, 1, 2, constant(0.0))
    assert [(s.tick, s.lateness_s) for s in samples] == [(301, 0.0), (302, 0.0)]
    assert samples[0].motion_time_s == pytest.approx(0.301)  # of now, not of before


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


# The ramp to rest


def test_a_ramp_that_cannot_be_recorded_waits_for_each_tick():
    loop, samples = made(SETTINGS)
    run_ticks(loop, 1, 10, constant(2.0))
    began_s = loop.time_s

    def full(sample):
        loop.clock.late = {sample.tick: 0.0071}  # which took its time: the ramp does not hurry
        raise OSError("disk full")

    loop.record = full
    loop.clock.deadlines_s.clear()
    with pytest.raises(OSError, match="disk full"):
        ramp_to_rest(loop)
    assert_ramps(written(loop)[9:], 10)
    assert loop.at_rest
    waits = [round((t - began_s) / INTERVAL_S) for t in loop.clock.deadlines_s]
    # The tick that failed, how late that has made it, and then one tick after the other.
    assert waits == [0, 0, *range(7, 7 + len(written(loop)[11:]))]
    assert len(samples) == 10


def test_a_ramp_that_does_not_come_to_rest_is_given_up_ten_ticks_late():
    """From 9.5 ticks' worth of velocity, which never becomes less."""
    loop, samples = made(SETTINGS)
    loop.guard = moving = loop.guard._replace(velocity_rad_s=9.5 * CHANGE_RAD_S)

    def give_back(sample):
        samples.append(sample)
        loop.guard = moving

    loop.record = give_back
    ramp_to_rest(loop)
    assert len(samples) == 10 + 10


def test_a_ramp_takes_both_signs_and_ends_at_zero():
    for sign in (1.0, -1.0):
        loop, samples = made(SETTINGS)
        run_ticks(loop, 1, 10, constant(sign * 2.0))
        ramp_to_rest(loop)
        assert_ramps([sign * v for v in written(loop)[9:]], 10)
        assert loop.at_rest
        assert {s.epoch for s in samples[10:]} == {REST}
        assert all(math.isnan(s.target_angle_rad) for s in samples[10:])
        assert not any(s.perturbation_nm for s in samples[10:])
        ticks = len(samples)
        ramp_to_rest(loop)  # at rest already: nothing is sent
        assert len(samples) == ticks


# The admittance


def test_the_admittance_is_made_for_one_tick_and_for_as_many_as_may_be_missed():
    loop, _ = made(SETTINGS)
    set_admittance(loop, 0.05, 2.0)
    assert (loop.inertia_kg_m2, loop.damping_nm_s_rad) == (0.05, 2.0)
    expected = [admittance(0.05, 2.0, n * INTERVAL_S) for n in range(1, LONGEST_STEP + 1)]
    assert loop.admittances == expected
