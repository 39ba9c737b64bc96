"""Single torque samples that are far from those around them."""

import itertools
import math

import numpy as np
import pytest

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.guard import (
    Cause,
    WildState,
    consistency_limits,
    consistency_state,
    consistency_step,
    median,
    wild_step,
    wild_torque,
)

TICK_S = 0.001
WILD_NM = 5.0


USUAL = WildState(averaged=20.0)
"""Of 20 samples that were all alike."""


def heard(torques, *, every=1, age_s=0.002, state=USUAL):
    """Return the state after samples that are new every so many ticks, and when it was held."""
    held = []
    for k in range(len(torques) * every):
        value, age = torques[k // every], age_s + (k % every) * TICK_S
        state, cause = wild_step(state, WILD_NM, float(value), age, TICK_S)
        if cause:
            assert cause == Cause.TORQUE_WILD
            held.append(k)
    return state, held


def test_the_median_of_five_whatever_their_order():
    for values in itertools.permutations([0.0, 1.0, 2.0, 2.0, 7.0]):
        assert median(*values) == 2.0
    for k in range(5):
        values = [1.0] * 5
        values[k] = math.nan
        assert math.isnan(median(*values))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("true_nm", "counted"), [(5.001, 1), (5.0, 0), (9.0, 1), (0.5, 0)])
def test_a_single_zero_counts_where_the_torque_is_above_half_the_limit(sign, true_nm, counted):
    torques = [sign * true_nm] * 10 + [0.0] + [sign * true_nm] * 10
    state, held = heard(torques)
    assert (state.counted, held) == (counted, [])
    # it is found when two more samples have come
    assert heard(torques[:12])[0].counted == 0
    assert heard(torques[:13])[0].counted == counted


@pytest.mark.parametrize("every", [1, 10])
def test_a_sample_that_is_read_again_counts_once(every):
    state, _ = heard([6.0] * 8 + [0.0] + [6.0] * 8, every=every)
    assert state.counted == 1


def test_the_third_within_a_second_holds_and_the_count_goes_on():
    one = [6.0] * 19 + [0.0]
    state, held = heard(one * 10)
    assert (state.counted, held) == (9, [3 * 20 + 1, 6 * 20 + 1, 9 * 20 + 1])
    # 0.499 s apart the third comes within a second, 0.51 s apart after it
    assert len(heard(([6.0] * 498 + [0.0]) * 3 + [6.0] * 9)[1]) == 1
    state, held = heard(([6.0] * 509 + [0.0]) * 9)
    assert (state.counted, held) == (8, [])


def test_two_alike_count_and_three_are_the_joints_own():
    assert heard([6.0] * 9 + [0.0] * 2 + [6.0] * 9)[0].counted == 2
    assert heard([6.0] * 9 + [0.0] * 3 + [6.0] * 9)[0].counted == 0


@pytest.mark.parametrize(
    "torque",
    [
        lambda k: 4.0 * k,  # whatever the slope
        lambda k: 9.0 * (k >= 20) - 9.0 * (k >= 40),
        lambda k: 9.0 * np.sin(0.3 * k),
        lambda k: 9.0 * (-1.0) ** (k // 3),
    ],
)
def test_what_a_joint_may_do_is_not_wild(torque):
    assert heard([torque(k) for k in range(200)])[0].counted == 0


def test_what_is_usual_for_these_samples_is_not_wild():
    rng = np.random.default_rng(1)
    noisy = rng.uniform(-8.0, 8.0, 5000)
    state, held = heard(noisy[:400], state=WildState())
    usual = [abs(noisy[k] - np.median(noisy[k - 2 : k + 3])) for k in range(200, 398)]
    assert state.usual_nm == pytest.approx(np.mean(usual), rel=0.15)
    assert (heard(noisy, state=WildState())[0].counted, held) == (0, [])
    # the same spike is wild where little is usual
    quiet = 0.05 * noisy[:400]
    quiet[300] += 9.0
    assert heard(quiet)[0].counted == 1
    loud = noisy[:400].copy()
    loud[300] = 9.0
    assert heard(loud, state=WildState())[0].counted == 0


def test_of_the_first_samples_none_is_wild():
    """Twenty differences are known once 24 samples have come: the 23rd is judged with the 25th."""
    for place, counted in ((21, 0), (22, 1)):
        torques = [6.0] * 30
        torques[place] = 0.0
        assert heard(torques, state=WildState())[0].counted == counted


def test_wild_samples_are_not_what_is_usual():
    torques = ([6.0, 6.0, 0.0] * 60)[:-1]
    assert heard(torques)[0].usual_nm == 0.0


def test_a_number_that_is_none_is_left_out():
    torques = [6.0] * 9 + [math.nan, 0.0, math.inf] + [6.0] * 9
    assert heard(torques)[0].counted == 1
    state, _ = wild_step(WildState(), WILD_NM, 6.0, math.nan, TICK_S)
    assert math.isnan(state.fifth_nm)


def test_the_figures_of_the_law_and_what_it_begins_with():
    assert (wild_torque.TIMES_USUAL, wild_torque.THREE_S) == (5.0, 1.0)
    assert (wild_torque.MEMORY, wild_torque.FEW, wild_torque._SAME_STAMP_S) == (200.0, 20.0, 1e-6)
    state = WildState()
    assert all(math.isnan(torque_nm) for torque_nm in state[:5])
    assert state[5:] == (math.inf, 0.0, 0.0, math.inf, math.inf, 0)


def test_a_torque_and_an_age_that_are_infinite_alike_are_left_out():
    state, _ = wild_step(WildState(), WILD_NM, math.inf, math.inf, TICK_S)
    assert math.isnan(state.fifth_nm)
    state, _ = wild_step(WildState(), WILD_NM, 6.0, -math.inf, TICK_S)
    assert math.isnan(state.fifth_nm)


def test_it_is_one_of_the_laws_that_need_time():
    settings = parse_settings({"guard": {"torque_limit_nm": 8.0, "torque_stop_nm": 20.0}})
    limits = consistency_limits(settings)
    assert limits.wild_nm == 4.0
    state, causes = consistency_state(limits), []
    for k in range(120):
        torque_nm = 0.0 if k % 20 == 10 and k > 25 else 4.5
        state, cause = consistency_step(limits, state, 0.0, 0.0, torque_nm, 0.0, 0.0, 0.0, 0.0, 1)
        causes.append(cause)
    assert [k for k, cause in enumerate(causes) if cause] == [72]
    assert causes[72] == Cause.TORQUE_WILD
    assert Cause.TORQUE_WILD.reaction.name == "HOLD"
    assert state.wild.counted == 5


@pytest.mark.parametrize(
    ("tick_hz", "torque_hz", "wild_nm"),
    [(1000.0, 100.0, 5.0), (100.0, 100.0, 5.0), (1000.0, 99.0, math.inf), (50.0, 50.0, math.inf)],
)
def test_with_few_samples_a_second_nothing_is_wild(tick_hz, torque_hz, wild_nm):
    settings = parse_settings(
        {
            "controller": {"torque_cutoff_hz": 10.0},
            "guard": {"reaction_time_s": 0.1},
            "rig": {
                "tick_rate_hz": tick_hz,
                "torque": {"rate_hz": torque_hz},
                "motion": {"rate_hz": tick_hz},
            },
        }
    )
    assert consistency_limits(settings).wild_nm == wild_nm
