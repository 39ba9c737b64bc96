"""Readings that agree, and that do not: closed-form cases of every law."""

import math

import numpy as np
import pytest
from tests.unit.rig.guard.many_steps import DT, NOTHING, run

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.guard import (
    AnswerLimits,
    Cause,
    MeansState,
    agreement,
    answer_state,
    consistency_limits,
    consistency_state,
    consistency_step,
    means_step,
)

# --- velocity


VELOCITY = NOTHING._replace(unseen_rad=0.002)
OMEGA = 2.0 * math.pi * 5.0


def swing(gain=1.0, late_s=0.0):
    """Return angle and reported velocity of a swing of 0.05 rad at 5 Hz, the velocity spoiled."""
    return (
        lambda t: 0.05 * math.sin(OMEGA * t),
        lambda t: gain * 0.05 * OMEGA * math.cos(OMEGA * (t - late_s)),
    )


@pytest.mark.parametrize(
    ("gain", "late_s"), [(1.0, 0.0), (1.0, 0.01), (1.0, -0.01), (0.7, 0.0), (1.45, 0.0)]
)
def test_a_velocity_that_is_somewhat_off_passes(gain, late_s):
    assert run(VELOCITY, 3000, *swing(gain, late_s))[1] == Cause.NONE


@pytest.mark.parametrize("gain", [0.0, -1.0, -0.2, 0.2, 0.5, 0.6, 1.6, 2.0, 5.0])
def test_a_velocity_that_is_not_the_change_of_the_angle_is_found_within_a_memory(gain):
    k, cause, _ = run(VELOCITY, 3000, *swing(gain))
    assert cause == Cause.VELOCITY_WRONG
    assert k < 300


def test_the_squares_are_what_theory_says():
    # p = θ high-passed at 1/W: |p| = 0.05 ωW/√(1 + ω²W²), and half its square in the mean.
    p2 = 0.5 * (0.05 * OMEGA * 0.05) ** 2 / (1 + (OMEGA * 0.05) ** 2)
    for gain, apart, both in ((1.0, 0.0, 2.0), (0.0, 1.0, 1.0), (-1.0, 4.0, 2.0)):
        state = run(NOTHING, 5000, *swing(gain))[2]
        total = state.means.moved_rad2 + state.means.reported_rad2
        assert total == pytest.approx(both * p2, rel=0.15)
        assert state.means.disagreement_rad2 == pytest.approx(apart * p2, rel=0.15, abs=1e-3 * p2)


def test_what_resolution_explains_is_not_looked_at():
    angle, velocity = swing(0.0)
    assert run(VELOCITY._replace(unseen_rad=0.05), 3000, angle, velocity)[1] == Cause.NONE


@pytest.mark.parametrize("every", [1, 3, 20])
def test_samples_slower_than_the_loop_and_missed_ticks_make_no_difference(every):
    angle, velocity = swing(0.0)

    def held(value):
        return lambda t: value(math.floor(t / DT / every + 1e-6) * every * DT)

    def age(t):
        return t - math.floor(t / DT / every + 1e-6) * every * DT

    k, cause, _ = run(VELOCITY, 3000, held(angle), held(velocity), ages=(age, 0.0))
    assert (k < 320, cause) == (True, Cause.VELOCITY_WRONG)
    angle, velocity = swing()
    assert run(VELOCITY, 3000, held(angle), held(velocity), ages=(age, 0.0))[1] == Cause.NONE
    assert run(VELOCITY, 999 // every, angle, velocity, elapsed=every)[1] == Cause.NONE


def test_a_drive_at_rest_and_a_reading_that_is_no_number_show_nothing():
    assert run(VELOCITY, 2000, 0.5, 0.0)[1] == Cause.NONE
    angle, velocity = swing()

    def broken(t):
        return math.nan if 0.5 < t < 0.6 else angle(t)

    _, cause, _ = run(VELOCITY, 2000, broken, velocity, torque=math.nan)
    assert cause == Cause.NONE


@pytest.mark.parametrize("passed_s", [0.01, 0.04])
def test_one_mean_after_another_is_what_the_equations_say(passed_s):
    answer = answer_state()
    before = MeansState(answer, 0.2, 1.0, 0.0, 0.3, 0.1, 0.05, 0.06, 0.02, 0.5)
    limits = NOTHING._replace(mean_of_ticks=40)
    after, cause = means_step(limits, before, 0, 0, 0.3, 2.0, passed_s, 0, 0, passed_s + 0.001, 0)
    kept = 1.0 - passed_s / 0.05
    moved, reported = 0.3 * kept + 0.1, 0.1 * kept + 1.5 * passed_s
    weight = passed_s / 0.3
    pace = 0.5 + (0.1 - 0.5 * passed_s) / max(passed_s, 0.02)
    assert cause == Cause.NONE
    assert after[1:10] == pytest.approx(
        (
            *(0.3, 2.0, 0.001, moved, reported),
            0.05 + ((moved - reported) ** 2 - 0.05) * weight,
            0.06 + (moved**2 - 0.06) * weight,
            0.02 + (reported**2 - 0.02) * weight,
            pace,
        )
    )
    same, _ = means_step(NOTHING, after, 0, 0, 9.0, 9.0, -0.001, 0, 0, 0.008, 0)
    assert same[1:10] == (*after[1:3], pytest.approx(0.009), *after[4:10])


@pytest.mark.parametrize(
    ("angle", "said"), [(0.3, 1.0), (1.4, 1.2), (9.0, 2.0), (1.2, 1.0), (2.2, 2.0)]
)
@pytest.mark.parametrize("turned", [False, True])
def test_over_a_gap_the_velocity_was_any_of_those_before_and_after(angle, said, turned):
    """From 0.2 rad on, for 1 s, at 1 rad/s and then at 2, or the other way round."""
    first, then = (2.0, 1.0) if turned else (1.0, 2.0)
    before = MeansState(answer_state(), 0.2, first, 0.0, 0.3, 0.1, 0.05, 0.06, 0.06, 0.5)
    after, _ = means_step(NOTHING, before, 0, 0, angle, then, 1.0, 0, 0, 1.0, 0)
    assert after[4:6] == pytest.approx((angle - 0.2, said))
    for elapsed_s, late in (
        (0.0118, False),
        (1.5 * 8 * DT, False),
        (0.0121, True),
    ):  # means are of 8 ms
        after, _ = means_step(
            NOTHING._replace(mean_of_ticks=8), before, 0, 0, 0.2, then, 0.01, 0, 0, elapsed_s, 0
        )
        assert after.reported_rad == pytest.approx(0.08 + (0.01 if late else 0.015))


def test_a_command_that_changes_before_a_gap_is_no_wrong_velocity():
    """Told 0.5 rad/s, then 0 at the tick before the loop stood still for 200 ms."""
    limits = VELOCITY._replace(mean_of_ticks=1)
    state = consistency_state(limits)
    angle = 0.0
    for velocity, elapsed in (*[(0.5, 1)] * 300, (0.0, 200)):
        angle += velocity * elapsed * DT
        state, cause = consistency_step(
            limits, state, velocity, 0.0, 0.0, angle, velocity, 0.0, 0.0, elapsed
        )
        assert cause == Cause.NONE


# --- energy


def test_the_energy_is_that_of_the_angle():
    # 2 N·m in phase with 1.57 rad/s: half their product in the mean, less what smoothing takes,
    # 1/(1 + ω²S²), and its lag; within a second 1 − e^(−1) of it is there.
    angle, velocity = swing()
    limits = NOTHING._replace(energy_j=10.0)
    state = run(limits, 6000, angle, lambda _: 0.0, torque=lambda t: 2.0 * velocity(t) / 1.5708)[2]
    lag = math.atan(OMEGA * 0.02)
    product = math.sin(lag) + (0.5 * math.pi - lag) * math.cos(lag)  # of two sines, rectified
    mean = 1.5708 * math.cos(lag) * 2.0 / math.pi * product
    assert state.means.energy_j == pytest.approx(mean, rel=0.1)
    limits = NOTHING._replace(energy_j=0.5 * mean)
    k, cause, _ = run(limits, 6000, angle, 0.0, torque=lambda t: 2.0 * velocity(t) / 1.5708)
    assert cause == Cause.ENERGY_HIGH
    assert k * DT == pytest.approx(math.log(2.0), abs=0.1)


# --- freshness


FRESH = NOTHING._replace(torque_old_s=0.012, motion_old_s=0.012)


def paused(pause_s, period_s):
    """Return the age of a reading that comes not at all for so long in each period."""
    return lambda t: max(math.fmod(t, period_s) - (period_s - pause_s), 0.0)


@pytest.mark.parametrize("sensor", [0, 1])
@pytest.mark.parametrize(
    ("pause_s", "period_s", "within_s"), [(0.095, 0.1, 0.2), (0.03, 0.06, 0.6)]
)
def test_a_sensor_that_pauses_too_often_is_found(sensor, pause_s, period_s, within_s):
    ages = [0.0, 0.0]
    ages[sensor] = paused(pause_s, period_s)
    k, cause, _ = run(FRESH, 3000, 0.0, 0.0, ages=ages)
    assert cause == Cause.SELDOM_FRESH
    assert k * DT < within_s


@pytest.mark.parametrize("ages", [(0.012, 0.012), (paused(0.1, 5.0), paused(0.1, 5.0))])
def test_a_slow_sensor_and_a_single_pause_are_none(ages):
    assert run(FRESH, 5000, 0.0, 0.0, ages=ages)[1] == Cause.NONE


@pytest.mark.parametrize("elapsed", [1, 3])
@pytest.mark.parametrize("sensor", [0, 1])
def test_the_share_is_of_the_time_not_of_the_steps_and_of_the_sensor_that_is_old(sensor, elapsed):
    # Three times 38 ms, to 0.2, 0.1 and 0 s before the end, with a memory of 0.5 s.
    expected = sum(math.exp(-s / 0.5) - math.exp(-(s + 0.038) / 0.5) for s in (0.2, 0.1, 0.0))
    ages = [0.0, 0.0]
    ages[sensor] = paused(0.05, 0.1)
    means = run(FRESH, 300 // elapsed, 0.0, 0.0, ages=ages, elapsed=elapsed)[2].means
    shares = means.motion_old, means.torque_old
    assert shares[sensor] == pytest.approx(expected, abs=0.02)
    assert shares[1 - sensor] == 0.0


# --- a reading that repeats itself


REPEATED = NOTHING._replace(unseen_rad=0.0021, stale_s=0.0995, motion_old_s=0.0125)


def repeating(speed_rad_s):
    """Return angle and velocity of a motion that speeds up; from 50 ms on they repeat."""
    return (
        lambda t: speed_rad_s * min(t, 0.05),
        lambda t: speed_rad_s * (1.0 + 1e-3 * min(t, 0.05)),
    )


def test_a_reading_that_repeats_itself_is_as_old_as_its_first_repetition():
    limits = REPEATED._replace(mean_of_ticks=1000)
    _, cause, state = run(limits, 71, *repeating(1.0))
    assert (cause, state.ticks) == (Cause.NONE, 70)
    assert state.same_s == pytest.approx(0.020)
    assert state.motion_old_ticks == 8  # from 13 to 20 ms
    # Within 2.1 mrad the angle may be right, so that its stamp counts: 1 and 2 ms of the 20.
    assert state.stamp_s == pytest.approx(1e-3 * (sum(range(1, 71)) - sum(range(3, 21))))


def test_what_its_stamp_says_is_older_stays_older():
    state = run(REPEATED._replace(mean_of_ticks=1000), 71, *repeating(1.0), ages=(0.05, 0.0))[2]
    assert state.motion_old_ticks == 70
    assert state.before_s == pytest.approx(70 * 0.05)


@pytest.mark.parametrize(
    ("speed_rad_s", "sent", "tick", "cause"),
    [
        (1.0, 1.0, 150, Cause.MOTION_STALE),
        (-1.0, 1.0, 150, Cause.MOTION_STALE),
        (0.018, 1.0, 155, Cause.NONE),  # 1.8 mrad in 100 ms: no more than they may disagree
        (1.0, 0.0, 112, Cause.VELOCITY_WRONG),  # the joint may be at rest
    ],
)
def test_a_reading_that_repeats_itself_for_too_long_is_stale(speed_rad_s, sent, tick, cause):
    found = run(REPEATED, 155, *repeating(speed_rad_s), sent=sent)
    assert found[:2] == (tick, cause)


@pytest.mark.parametrize(
    ("angle", "velocity"),
    [(0.0, lambda t: 1.0 + t), (lambda t: t, 1.0)],
    ids=["the velocity changes", "the angle changes"],
)
def test_a_reading_of_which_one_part_changes_is_a_new_one(angle, velocity):
    limits = REPEATED._replace(mean_of_ticks=1000)
    _, cause, state = run(limits, 400, angle, velocity)
    assert (cause, state.same_s, state.motion_old_ticks) == (Cause.NONE, 0.0, 0)


def test_what_repeats_itself_may_go_as_far_and_stay_as_long_as_the_limits():
    limits = NOTHING._replace(mean_of_ticks=1000, unseen_rad=0.002)
    assert run(limits, 3, 0.0, 1.0)[2].before_s == 0.0  # 2 mrad in 2 ms
    assert run(limits, 4, 0.0, 1.0)[2].before_s == pytest.approx(0.003)
    limits = limits._replace(unseen_rad=0.0005, stale_s=0.002)
    assert run(limits, 5, 0.0, 1.0)[:2] == (3, Cause.MOTION_STALE)


def test_the_torque_is_not_asked_to_answer_a_motion_that_is_old():
    asked = []
    for old_s in (0.0125, 0.013):
        ages = (lambda t, old_s=old_s: old_s if 0.0995 < t < 0.1135 else 0.0, 0.0)
        states = [run(REPEATED, n, *swing(), ages=ages)[2].means for n in (105, 113, 121)]
        asked.append([means.unanswered_s for means in states])
    assert asked[0] == [0.0] * 3
    assert asked[1] == pytest.approx([0.008, 0.016, 0.0])


# --- the ticks between two means


def test_the_first_tick_is_a_mean_of_its_own_where_the_filters_begin():
    state = consistency_state(NOTHING)
    for k in range(9):
        state, _ = consistency_step(NOTHING, state, 1.0, 0.0, 1.0 + k, 0.1 * k, 1.0, 0.003, 0.0)
        if k == 0:
            assert state.means.answer.torque == (1.0,) * 5
            assert state.means.answer.angle == (0.003,) * 5  # 3 ms later, at the torque's time
            assert state.means.since_s == pytest.approx(0.003)
    assert (state.means.angle_rad, state.means.since_s) == pytest.approx((0.45, 0.0065))
    assert state.ticks == 0


def test_a_mean_is_of_the_ticks_with_readings_over_the_time_of_all():
    state = consistency_state(NOTHING)._replace(ticks=0)
    means = []
    for k, (torque, elapsed) in enumerate([(1.0, 1), (math.nan, 1), (2.0, 5), (6.0, 1)]):
        assert means == []
        state, _ = consistency_step(
            NOTHING, state, 1.0, 0.5, torque, 0.1 * k, 1.0, 0.0, 0.0, elapsed
        )
        if state.ticks == 0:
            means.append(k)
    assert means == [3]
    answer = state.means.answer
    assert (answer.torque[0], answer.angle[0]) == pytest.approx((3.0, 0.5 / 3))
    assert answer.perturbation_nm == 0.5
    assert (state.means.angle_rad, state.means.velocity_rad_s) == pytest.approx((0.5 / 3, 1.0))
    # Read 1, 7 and 8 ms after the last mean, so 5.33 ms after it, 2.67 ms before its own end.
    assert state.means.since_s == pytest.approx(0.008 / 3)
    assert state[6:17] == (0,) * 5 + (0.0,) * 6
    assert state.wild.fifth_nm == 6.0


def test_no_reading_in_all_the_ticks_makes_no_mean():
    state = consistency_state(NOTHING)._replace(ticks=0)
    for k in range(20):
        state, _ = consistency_step(NOTHING, state, 1.0, 0.5, math.nan, 0.1, 1.0, 0.0, 0.0)
        assert (state.ticks, state.readings) == (k + 1, 0)
    state, _ = consistency_step(NOTHING, state, 1.0, 0.5, 2.0, 0.1, 1.0, 0.0, 0.0)
    assert (state.ticks, state.means.answer.torque[0]) == (0, 2.0)


def test_ticks_of_which_one_is_not_perturbed_are_not():
    for first, expected in ((0.0, 0), (-0.5, 1)):
        state = consistency_state(NOTHING)._replace(ticks=0)
        for k in range(8):
            given = first if k == 0 else 0.25
            state, _ = consistency_step(NOTHING, state, 1.0, given, 2.0, 0.1, 1.0, 0.0, 0.0)
        assert state.means.answer.steps == expected


# --- settings


def test_each_limit_is_the_settings_in_si_units():
    limits = consistency_limits(
        parse_settings(
            {
                "guard": {"hold_limit_deg": 2.0, "reaction_time_s": 0.05, "stale_s": 0.2},
                "rig": {
                    "tick_rate_hz": 500.0,
                    "torque": {"rate_hz": 100.0, "latency_s": 0.003, "jitter_s": 0.001},
                    "motion": {
                        "rate_hz": 400.0,
                        "latency_s": 0.002,
                        "angle_resolution_deg": 0.25,
                        "velocity_resolution_deg_s": 2.0,
                    },
                },
            }
        )
    )
    values = limits._asdict()
    assert values.pop("answer").rate_per_s > 0.0
    assert values.pop("mean_of_ticks") == 4
    assert values == pytest.approx(
        {
            "interval_s": 0.002,
            "settle_s": 0.1,
            "stale_s": 0.2,
            "hold_rad": math.radians(2.25),
            "summed_s": 0.05,
            "unseen_rad": math.radians(0.1 + 2 * 0.25 + 0.05 * 2.0),
            "energy_j": 5.0,
            "torque_old_s": 0.003 + 3 * 0.011,
            "motion_old_s": 0.002 + 0.012,
            "old_memory_s": 1.0,
            "wild_nm": 5.0,
        }
    )


def test_on_a_slow_line_the_sums_hold_three_samples():
    rates = {"tick_rate_hz": 50.0, "torque": {"rate_hz": 50.0}, "motion": {"rate_hz": 40.0}}
    tables = {"controller": {"torque_cutoff_hz": 10.0}, "guard": {"reaction_time_s": 0.1}}
    limits = consistency_limits(parse_settings({"rig": rates, **tables}))
    assert limits.summed_s == pytest.approx(0.075)
    assert limits.motion_old_s == pytest.approx(0.001 + 0.075)


def test_whatever_comes_the_state_stays_finite():
    rng, limits = np.random.default_rng(3), consistency_limits(parse_settings({}))
    state = consistency_state(limits)
    values = [math.nan, math.inf, -math.inf, 0.0, 1.0, -0.3, 0.02, 1e300]
    for _ in range(3000):
        drawn = rng.choice(values[:-1], 7).tolist()
        state, cause = consistency_step(limits, state, *drawn, int(rng.integers(-3, 200)))
        assert cause in set(Cause)
        assert all(
            math.isfinite(value) for value in (state.still_s, *state[5:17], *state.means[2:])
        )
        assert math.isfinite(state.wild.usual_nm)


def test_the_figures_of_the_laws_and_what_they_begin_with():
    assert (agreement.SUMMED_S, agreement.SQUARED_S, agreement.WRONG_SHARE) == (
        0.05,
        0.3,
        0.375,
    )
    assert (agreement.UNSEEN_DEG, agreement.SMOOTHED_S) == (0.1, 0.02)
    assert (agreement.WRONG_GAIN, agreement.LATE) == (1.5, 1.5)
    assert (agreement.FEW_SAMPLES, agreement.MIN_OLD_S) == (3.0, 0.012)
    assert (*(0.2, 0.5, 5.0),) == (
        agreement.OLD_SHARE,
        agreement.OLD_MEMORY_S,
        agreement.OLD_MEMORY_STALES,
    )
    # Nothing is found where nothing is given.
    assert NOTHING[1:3] == (AnswerLimits(), 8)
    assert NOTHING[3:] == (
        0.0,
        math.inf,
        math.inf,
        0.05,
        math.inf,
        math.inf,
        math.inf,
        math.inf,
        0.5,
        math.inf,
    )
    state = consistency_state(NOTHING)
    assert state.still_s == 0.0
    assert all(map(math.isnan, (state.held_rad, state.read_rad, state.read_rad_s)))
    assert state[5:17] == (0.0, 7, 0, 0, 0, 0) + (0.0,) * 6
    assert state.wild.counted == 0
    assert math.isnan(state.means.angle_rad)
    assert state.means[2:] == (0.0,) * 12


def test_what_is_summed_of_the_ticks_is_how_long_before_the_torque_the_motion_was_taken():
    """2 and 4 ms before it in turn: 3 ms, at 5 rad/s."""
    state = consistency_state(NOTHING)
    for k in range(9):
        ages = 0.003 + 0.002 * (k % 2), 0.001
        state, _ = consistency_step(NOTHING, state, 1.0, 0.0, 0.0, 0.2, 5.0, *ages)
    # Of the first tick, and of the mean of eight.
    assert state.means.answer.angle[0] == pytest.approx(0.2 + 5.0 * 0.003)
    state, _ = consistency_step(NOTHING, state, 1.0, 0.0, 0.0, 0.2, 5.0, 0.003, math.inf)
    assert (state.readings, state.before_s) == (0, 0.0)
