"""Whatever is asked for, the guard keeps its limits, on drives and encoders of many kinds."""

import itertools
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidimeter.guard import Cause, GuardLimits, guard_state, guard_step
from rigidimeter.simulation import DriveState, drive, drive_step

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
@settings(max_examples=80, deadline=None)
def test_a_drive_that_lags_by_up_to_the_reaction_time_never_crosses(wanted, every, late, lag, hold):
    angles, _, state = run(LIMITS, wanted, pure_delay(lag), hold=hold, every=every, late=late)
    assert np.abs(angles).max() <= LIMITS.position_rad + 1e-9
    assert state.cause == Cause.NONE


@given(requests, st.integers(1, 20), st.integers(0, 25), st.floats(25.0, 200.0))
@settings(max_examples=80, deadline=None)
def test_a_second_order_drive_passes_by_its_own_overshoot_at_most(wanted, every, late, bandwidth):
    angles, _, state = run(LIMITS, wanted, second_order(bandwidth), hold=60, every=every, late=late)
    assert np.abs(angles).max() <= LIMITS.position_rad + np.deg2rad(0.05)
    assert state.cause == Cause.NONE


@given(requests)
@settings(max_examples=40, deadline=None)
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


@given(st.floats(allow_nan=True, allow_infinity=True), st.floats(-3, 3))
def test_what_is_sent_is_always_finite(request, velocity):
    state = guard_state(LIMITS)._replace(velocity_rad_s=velocity)
    _, sent, _ = guard_step(LIMITS, state, request, 0.0, 0.0, 0.0, 0.0)
    assert math.isfinite(sent)
