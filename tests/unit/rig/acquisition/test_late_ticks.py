"""What a late tick does to the ticks after it, to the guard and to the commands."""

import pytest
from tests.unit.rig.acquisition.exact_rig import INTERVAL_S, SETTINGS, Desk, constant, made

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.acquisition import run_ticks, skip_passed_ticks
from rigidimeter.rig.guard import Cause

HAND_KG_M2 = 0.0045


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
    assert (ended.late_ticks, ended.missed_ticks, ended.cause) == (1, 2, Cause.NONE)
    assert run_ticks(loop, 1, 3, constant(0.0)).missed_ticks == 0


def test_a_tick_late_by_less_than_its_length_misses_none_by_its_length_one():
    for late_s, missed in ((0.00099, 0), (0.001, 1)):
        loop, _ = made(SETTINGS, late={0: late_s})
        assert run_ticks(loop, 1, 5, constant(0.0)).missed_ticks == missed


def test_a_tick_late_by_more_than_half_of_one_is_late_and_nothing_is_missed():
    loop, _ = made(SETTINGS, late={1: 0.0005, 3: 0.00051, 5: 0.0009})
    ended = run_ticks(loop, 1, 10, constant(0.0))
    assert (ended.late_ticks, ended.missed_ticks) == (2, 0)
    assert run_ticks(loop, 1, 3, constant(0.0)).late_ticks == 0


def test_a_tick_late_beyond_the_end_of_its_stretch_is_its_last():
    loop, _ = made(SETTINGS, late={3: 0.0045})
    asked = []
    run_ticks(loop, 1, 5, lambda r, t, k: asked.append(k) or (0.0, 0.0, 0.0))
    assert asked == [0, 1, 2, 4]
    assert loop.tick == 8


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
    loop, samples = made(settings, late={2: 0.001, 4: 0.001, 6: 0.001})  # also after some on time
    assert run_ticks(loop, 1, 20, constant(0.0)).cause is Cause.DEADLINES_MISSED
    assert [s.tick for s in samples] == [0, 1, 3, 5, 7]


@pytest.mark.parametrize(("late_s", "stalled"), [(0.0399, False), (0.0401, True)])
def test_a_loop_that_stood_still_sets_nothing_going_again(late_s, stalled):
    """From 40 ms on the drive's own watchdog has stopped it."""
    loop, samples = made(SETTINGS, late={20: late_s}, inertia_kg_m2=HAND_KG_M2)
    ended = run_ticks(loop, 1, 100, constant(1.0))
    assert (ended.cause is Cause.STALLED) == stalled
    at_tick = samples[20].velocity_command_rad_s
    assert at_tick == (0.0 if stalled else pytest.approx(1.0))


def test_a_loop_that_stood_still_stops_at_once_however_little_the_arm_may_be_accelerated():
    """10 deg/s² is 0.17 mrad/s in a tick: a ramp from any velocity would go on for ticks."""
    settings = parse_settings({"guard": {"acceleration_limit_deg_s2": 10.0}})
    loop, samples = made(settings, late={20: 0.0401}, inertia_kg_m2=HAND_KG_M2)
    ended = run_ticks(loop, 1, 100, constant(1.0))
    assert ended.cause is Cause.STALLED
    assert samples[19].velocity_command_rad_s > 0.003
    assert samples[20].velocity_command_rad_s == 0.0


def test_after_a_suspension_nothing_is_set_going_again():
    """No tick is late, for the loop's clock slept too."""
    loop, _ = made(SETTINGS, desk=Desk({20: Cause.STALLED}))
    ended = run_ticks(loop, 1, 100, constant(1.0))
    assert (ended.cause, loop.rig.of("write")[-1], loop.tick) == (Cause.STALLED, 0.0, 21)


def test_the_ticks_that_enabling_took_are_left_out_and_the_rig_read():
    loop, samples = made(SETTINGS, late={0: 0.3004, 300: 0.0012})
    skip_passed_ticks(loop)
    assert loop.rig.of("read") == [300, 1]
    assert (loop.tick, loop.time_s) == (301, pytest.approx(0.301))
    run_ticks(loop, 1, 2, constant(0.0))
    assert [(s.tick, s.lateness_s) for s in samples] == [(301, 0.0), (302, 0.0)]
    assert samples[0].motion_time_s == pytest.approx(0.301)  # of now, not of before
