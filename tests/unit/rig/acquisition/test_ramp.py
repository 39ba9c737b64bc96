"""The ramp to rest: what is written, and when, whatever fails meanwhile."""

import math
from itertools import pairwise

import pytest
from tests.unit.rig.acquisition.exact_rig import (
    CHANGE_RAD_S,
    INTERVAL_S,
    SETTINGS,
    Desk,
    constant,
    made,
)

from rigidimeter.rig.acquisition import REST, ramp_to_rest, run_ticks
from rigidimeter.rig.guard import Cause


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


def test_a_ramp_goes_on_in_real_time_through_a_late_tick():
    """The guard hears of the missed ticks: three ticks' worth of braking in one step."""
    loop, _ = made(SETTINGS, desk=Desk({10: Cause.DRIVE_FAULT}), late={13: 0.0025})
    run_ticks(loop, 1, 20, constant(2.0))
    ramp_to_rest(loop)
    down = [-step / CHANGE_RAD_S for step in steps(written(loop)[9:])]
    assert down[:8] == pytest.approx([1, 1, 1, 3, 1, 1, 1, 1])


def fail_once(loop, tick, owner, name):
    """Let this call fail at one tick, after it has done its work."""
    call = getattr(owner, name)

    def failing(value):
        done = call(value)
        if loop.rig.tick == tick:
            setattr(owner, name, call)
            raise OSError("disk full")
        return done

    setattr(owner, name, failing)


@pytest.mark.parametrize("what", ["record", "write"])
@pytest.mark.parametrize("first", [0, 987])  # 1.001 s at 1 kHz is rounded to before tick 1001
@pytest.mark.parametrize("tick", [9, 10, 13])
def test_a_tick_that_failed_after_the_guard_is_not_braked_in_twice(what, first, tick):
    """Whether it failed in the epoch or in the ramp: in each tick one tick's worth."""
    loop, samples = made(SETTINGS)
    loop.tick, loop.rig.tick = first, first - 1
    write, at = loop.rig.write, []

    def write_at(velocity_rad_s):
        at.append(round(loop.clock.deadlines_s[-1] / INTERVAL_S))
        return write(velocity_rad_s)

    def run():
        run_ticks(loop, 1, 10, constant(2.0))
        ramp_to_rest(loop)

    loop.rig.write = write_at
    fail_once(loop, first + tick, loop if what == "record" else loop.rig, what)
    with pytest.raises(OSError, match="disk full"):
        run()
    ramp_to_rest(loop)  # as at the end of a session, whatever failed
    assert at == list(range(first, first + len(at)))
    assert_ramps(written(loop)[9:], 10)
    recorded = [s.tick for s in samples]
    assert recorded == sorted(set(recorded))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()])
def test_a_ramp_that_cannot_be_recorded_or_is_interrupted_waits_for_each_tick(sign, error):
    loop, samples = made(SETTINGS)
    run_ticks(loop, 1, 10, constant(sign * 2.0))
    began_s = loop.time_s

    def full(sample):
        # Which took its time, 7.1 ms: the ramp does not hurry.
        loop.clock.late = {sample.tick + 1: 0.0061}
        raise error

    loop.record = full
    loop.clock.deadlines_s.clear()
    with pytest.raises(type(error)):
        ramp_to_rest(loop)
    assert_ramps([sign * v for v in written(loop)[9:]], 10)
    assert loop.at_rest
    waits = [round((t - began_s) / INTERVAL_S) for t in loop.clock.deadlines_s]
    # The tick that failed, how late that has made the next, and then one tick after the other.
    assert waits == [0, 1, *range(7, 7 + len(written(loop)[11:]))]
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


@pytest.mark.parametrize("how", ["suspended", "before the tick", "in the tick"])
def test_no_ramp_goes_on_from_the_velocity_before_the_computer_stood_still(how):
    """A signal that waited ends the tick, and the drive has long stopped by itself."""
    stalled = {20: SETTINGS.loop.stall_s + 0.0005}
    desk = Desk({20: Cause.STALLED} if how == "suspended" else {})
    loop, _ = made(SETTINGS, desk=desk, late=stalled if how == "before the tick" else {})
    run_ticks(loop, 1, 20, constant(2.0))
    before = len(written(loop))
    assert loop.rig.velocity_rad_s > 10 * CHANGE_RAD_S

    def fails(elapsed_ticks=1):
        if how == "in the tick":
            loop.clock.late.update(stalled)
        raise KeyboardInterrupt

    loop.rig.read = fails
    with pytest.raises(KeyboardInterrupt):
        ramp_to_rest(loop)
    assert set(written(loop)[before:]) == {0.0}
