"""Whatever is asked for, the guard keeps its limits, on drives and encoders of many kinds."""

import itertools
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidimeter.model import DriveState, drive, drive_step
from rigidimeter.rig.guard import (
    REACTIONS,
    Cause,
    GuardLimits,
    Limited,
    Reaction,
    guard_state,
    guard_step,
)

DT = 0.001
LIMITS = GuardLimits(
    position_rad=0.5,
    speed_rad_s=3.0,
    acceleration_rad_s2=100.0,
    reaction_time_s=0.02,
    interval_s=DT,
)

requests = st.lists(
    st.one_of(st.floats(-50, 50), st.just(1e6), st.just(-1e6)), min_size=1, max_size=40
)


# Following to 0.1 mrad for drives that are pure delays, whose angle is one that was commanded.
EXACT = LIMITS._replace(following_rad=1e-4)


def run(limits, wanted, move, *, hold, every=1, late=0):
    """Drive a joint with requests held `hold` ticks; return angles and commands.

    Encoder samples are taken every so many ticks and arrive so many ticks late, with true stamps.
    """
    state = guard_state(limits)
    angles, commands = [0.0], []
    for k in range(len(wanted) * hold):
        taken = max((k - late) // every * every, 0)
        state, sent, _ = guard_step(
            limits, state, wanted[k // hold], 0.0, angles[taken], 0.0, (k - taken) * DT
        )
        commands.append(sent)
        angles.append(move(k, commands))
    return np.array(angles), np.array(commands), state


def second_order(bandwidth_hz):
    one_tick, plant = drive(bandwidth_hz, 0.7071, DT), [DriveState()]

    def move(_, commands):
        plant[0] = drive_step(one_tick, plant[0], commands[-1])
        return plant[0].angle_rad

    return move


def pure_delay(ticks):
    angle = [0.0]

    def move(k, commands):
        angle[0] += commands[k - ticks] * DT if k >= ticks else 0.0
        return angle[0]

    return move


@given(requests, st.integers(1, 20), st.integers(0, 25), st.integers(0, 20), st.integers(20, 200))
@settings(max_examples=80)
def test_a_drive_that_lags_by_up_to_the_reaction_time_never_crosses(wanted, every, late, lag, hold):
    angles, _, state = run(EXACT, wanted, pure_delay(lag), hold=hold, every=every, late=late)
    assert np.abs(angles).max() <= LIMITS.position_rad + 1e-9
    assert state.cause == Cause.NONE


@given(requests, st.integers(1, 20), st.integers(0, 25), st.floats(25.0, 200.0))
@settings(max_examples=80)
def test_a_second_order_drive_passes_by_its_own_overshoot_at_most(wanted, every, late, bandwidth):
    angles, _, state = run(LIMITS, wanted, second_order(bandwidth), hold=60, every=every, late=late)
    assert np.abs(angles).max() <= LIMITS.position_rad + np.deg2rad(0.05)
    assert state.cause == Cause.NONE


RANGE = EXACT._replace(lowest_rad=-0.2, highest_rad=0.35, at_limit_of_s=0.5, apart_s=0.2)


@given(requests, st.integers(1, 20), st.integers(0, 25), st.integers(0, 20), st.integers(20, 200))
@settings(max_examples=80)
def test_a_range_is_never_left_on_either_side(wanted, every, late, lag, hold):
    angles, _, state = run(RANGE, wanted, pure_delay(lag), hold=hold, every=every, late=late)
    assert angles.min() >= RANGE.lowest_rad - 1e-9
    assert angles.max() <= RANGE.highest_rad + 1e-9
    assert state.cause == Cause.NONE


@given(requests, st.integers(0, 20), st.integers(20, 200), st.floats(0.1, 2.0))
@settings(max_examples=80)
def test_the_hardest_braking_begins_at_the_speed_of_arrival(wanted, lag, hold, arrival):
    """Within u T + u²/(2a) of the limit the joint is no faster toward it than u."""
    limits = EXACT._replace(arrival_rad_s=arrival)
    angles, _, state = run(limits, wanted, pure_delay(lag), hold=hold)
    assert np.abs(angles).max() <= limits.position_rad + 1e-9
    assert state.cause == Cause.NONE
    speeds = np.diff(angles) / DT
    left = limits.position_rad - np.sign(speeds) * angles[:-1]
    near = arrival * DT + arrival**2 / (2.0 * limits.acceleration_rad_s2)
    inside = left < near - 1e-9
    assert np.abs(speeds[inside]).max(initial=0.0) <= arrival + 1e-9


@given(requests, st.integers(1, 6), st.integers(20, 200))
@settings(max_examples=30)
def test_what_is_counted_at_the_limit_is_what_the_limit_held_back(wanted, passed, hold):
    """Against a list of all ticks: those at the limit of the last half second, and arrivals."""
    state, move, angles, commands = guard_state(RANGE), pure_delay(3), [0.0], []
    marks, came = [], []
    for k in range(len(wanted) * hold // passed):
        request = wanted[min(k * passed // hold, len(wanted) - 1)]
        state, sent, limited = guard_step(
            RANGE, state, request, 0.0, angles[-1], 0.0, 0.0, 0.0, 0, passed
        )
        for _ in range(passed):
            commands.append(sent)
            angles.append(move(len(commands) - 1, commands))
        at_limit = limited == Limited.POSITION
        begins = at_limit and not (marks and marks[-1])
        marks += [at_limit] * passed
        if begins and (not came or len(marks) - came[-1] >= 200):
            came.append(len(marks))
        if at_limit or k % 50 == 0:
            assert state.contact.ticks == sum(marks[-500:])
        assert state.contact.arrivals == len(came)
        if len(came) > 2:
            assert abs(state.contact.three_s - (came[-1] - came[-3]) * DT) < 1e-9


@given(requests)
@settings(max_examples=40)
def test_only_the_position_limit_brakes_harder_than_the_acceleration_limit(wanted):
    _, sent, _ = run(LIMITS, wanted, second_order(50.0), hold=60)
    assert np.abs(sent).max() <= LIMITS.speed_rad_s
    faster = [abs(b - a) for a, b in itertools.pairwise(sent) if abs(b) > abs(a)]
    assert max(faster, default=0.0) <= 0.1 + 1e-12


def test_worst_phase_squares_on_the_papers_encoder():
    # 50 samples/s, 25 ms old: the case in which a guard that forgets gradually lets the arm by.
    worst = 0.0
    for period in range(60, 400, 7):
        wanted = [9.0, -9.0] * (4000 // period)
        angles, _, _ = run(
            LIMITS, [w + 0.4 for w in wanted], second_order(50.0), hold=period // 2,
            every=20, late=25,
        )  # fmt: skip
        worst = max(worst, np.rad2deg(np.abs(angles).max() - LIMITS.position_rad))
    assert worst < 0.05


def test_it_does_not_hold_the_arm_at_the_limit():
    angles, _, _ = run(
        LIMITS, [9.0] * 20 + [-1.0] * 5, second_order(50.0), hold=50, every=20, late=25
    )
    assert angles[1000] > 0.99 * LIMITS.position_rad
    assert angles[-1] < 0.6 * LIMITS.position_rad


@given(
    requests,
    st.lists(st.integers(1, 6), min_size=1, max_size=60),
    st.integers(0, 20),
    st.integers(0, 25),
    st.integers(1, 200),
)
@settings(max_examples=120)
def test_steps_that_come_late_by_up_to_the_gap_never_let_it_cross(wanted, steps, lag, late, hold):
    limits = EXACT._replace(gap_s=0.005)
    state, move, commands, angles, tick, missed = (
        guard_state(limits), pure_delay(lag), [], [0.0], 0, 1
    )  # fmt: skip
    pattern = itertools.cycle(steps)
    while tick < 60 * hold:
        taken = max(tick - late, 0)
        request = wanted[tick // hold % len(wanted)]
        state, sent, _ = guard_step(
            limits, state, request, 0.0, angles[taken], 0.0, (tick - taken) * DT, 0.0, 0, missed
        )
        missed = next(pattern)
        for _ in range(missed):
            commands.append(sent)
            angles.append(move(tick, commands))
            tick += 1
    assert np.abs(angles).max() <= limits.position_rad + 1e-9
    assert state.cause == Cause.NONE


anything = st.one_of(
    st.floats(),
    st.floats(-5, 5),
    st.just(0.0),
    st.sampled_from([math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324]),
)
STRICT = LIMITS._replace(
    gap_s=0.005,
    overspeed_rad_s=3.75,
    stale_s=0.05,
    torque_nm=2.0,
    torque_stop_nm=4.0,
    power_w=5.0,
    energy_j=2.0,
    following_rad=0.1,
    at_limit_s=0.02,
    at_limit_of_s=0.1,
    arrivals_s=1.0,
    apart_s=0.01,
    arrival_rad_s=1.0,
    lowest_rad=-0.1,
    highest_rad=0.3,
)
ticks = st.lists(
    st.tuples(
        *(st.one_of(st.floats(-5, 5), anything), st.one_of(st.floats(-2.5, 2.5), anything)),
        *(st.one_of(st.floats(-0.6, 0.6), anything), st.one_of(st.floats(-1, 1), anything)),
        *(st.one_of(st.floats(0, 0.04), anything), st.one_of(st.floats(0, 0.04), anything)),
        st.sampled_from([0] * 20 + [int(cause) for cause in Cause]),
        st.one_of(st.just(1), st.integers(-3, 200), st.integers(0, 10**15)),
    ),
    min_size=1,
    max_size=40,
)


@given(ticks, st.sampled_from([LIMITS, STRICT]))
@settings(max_examples=300)
def test_whatever_comes_in_whatever_order(inputs, limits):
    state = guard_state(limits)
    most = limits.acceleration_rad_s2 * DT
    for values in inputs:
        before = state
        state, sent, limited = guard_step(limits, state, *values)
        assert math.isfinite(sent)
        assert abs(sent) <= limits.speed_rad_s
        assert state.velocity_rad_s == sent
        assert limited in set(Limited)
        assert np.isfinite(state.sent_rad).all()
        assert 0 <= state.newest < state.sent_rad.size
        # Toward rest it may brake as hard as it must; away from it never.
        change = sent - before.velocity_rad_s
        if (
            abs(sent) > abs(before.velocity_rad_s)
            or sent * before.velocity_rad_s < 0
            or limited < Limited.POSITION
        ):
            assert abs(change) <= most + 1e-12
        # The first cause is kept, the reaction never weaker than each one's own.
        if before.cause != Cause.NONE:
            assert state.cause == before.cause
            assert abs(sent) <= abs(before.velocity_rad_s)
            assert limited == Limited.LATCHED
        assert state.reaction >= max(before.reaction, REACTIONS[values[6]])
        assert (state.cause == Cause.NONE) == (state.reaction == Reaction.NONE)
        if state.reaction == Reaction.CUT:
            assert sent == 0.0


@given(ticks, st.integers(1, 20))
@settings(max_examples=60)
def test_what_is_latched_comes_to_rest_within_the_ramp(inputs, speed):
    state = guard_state(STRICT)._replace(
        velocity_rad_s=0.15 * speed, cause=int(Cause.SOFTWARE), reaction=int(Reaction.RAMP)
    )
    inputs = (inputs * 31)[:31]  # 3 rad/s at 0.1 rad/s a step, and one for what was rounded
    for values in inputs:
        state, sent, _ = guard_step(STRICT, state, *values)
    assert sent == 0.0


@given(st.lists(st.floats(-5, 5), min_size=60, max_size=60), st.integers(0, 20), st.integers(0, 20))
@settings(max_examples=60)
def test_an_encoder_that_jumps_is_found_at_once_and_one_that_does_not_never(wanted, lag, late):
    state, move, commands, angles = guard_state(EXACT), pure_delay(lag), [], [0.0]
    for k, request in enumerate(np.repeat(wanted, 5).tolist()):
        taken = max(k - late, 0)
        state, sent, _ = guard_step(
            EXACT, state, request, 0.0, angles[taken], 0.0, (k - taken) * DT
        )
        commands.append(sent)
        angles.append(move(k, commands))
    assert state.cause == Cause.NONE
    assert state.origin_rad == 0.0
    width = 0.045 * LIMITS.speed_rad_s  # no stretch is wider: twice the reaction time and two ticks
    jumped = math.copysign(width + 2e-4, -angles[-1] or 1.0) + angles[-1]
    state, _, _ = guard_step(EXACT, state, 0.0, 0.0, jumped, 0.0, 0.0)
    assert state.cause == Cause.NOT_FOLLOWING
