"""When a live J, B or K is shown, and with which interval."""

import math

import pytest

from rigidimeter.core.settings import OnlineSettings
from rigidimeter.model import STATE_SIZE, online_design, online_step
from rigidimeter.rig.acquisition.processes import LiveEstimate
from rigidimeter.rig.console import caution, live_values, settling_s

SETTINGS = OnlineSettings()


def estimate(time_s, stiffness=1.7, se=0.02, **more):
    values = {
        "epoch": 3,
        "inertia_kg_m2": 0.0045,
        "inertia_kg_m2_se": 1e-5,
        "damping_nm_s_rad": 0.137,
        "damping_nm_s_rad_se": 0.001,
        "stiffness_nm_rad": stiffness,
        "stiffness_nm_rad_se": se,
        "memory_s": 5.0 * (1.0 - math.exp(-time_s / 5.0)),
    }
    return LiveEstimate(time_s=time_s, **{**values, **more})


def steady(until_s, **more):
    return [estimate(0.1 * k, **more) for k in range(1, round(10 * until_s) + 1)]


def test_the_high_pass_has_forgotten_its_beginning_to_a_twentieth():
    # A step on the high-pass section alone: exp(-u) (cos u - sin u) with u = ω t / √2.
    assert settling_s(SETTINGS) == pytest.approx(4.50, abs=0.01)
    u = 2 * math.pi * 0.15 * settling_s(SETTINGS) / math.sqrt(2)
    closed = math.exp(-u) * (math.cos(u) - math.sin(u))
    assert abs(closed) < 0.06
    rate_hz = 1000.0
    design, state = online_design(SETTINGS, rate_hz), [0.0] * STATE_SIZE
    online_step(design, state, 0.0, 0.0, 0.0)
    for _ in range(round(settling_s(SETTINGS) * rate_hz)):
        online_step(design, state, 1.0, 0.0, 0.0)
    high, band = state[1:3], 1.0 - state[2]  # what its low-pass part has not followed yet
    assert abs(band - math.sqrt(2) * high[0]) == pytest.approx(abs(closed), rel=0.05)


def test_a_value_is_shown_with_its_interval_once_it_means_something():
    J, B, K = live_values(steady(10.0), "prbs", SETTINGS)
    assert all(value.settled for value in (J, B, K))
    assert K.half_width == pytest.approx(1.96 * 0.02, rel=1e-4)
    assert K.text == "K 1.700 ± 0.039 N·m/rad"
    assert J.text == "J (4.500 ± 0.020)·10⁻³ kg·m²"
    assert B.text == "B 0.1370 ± 0.0020 N·m·s/rad"


def test_nothing_is_shown_before_the_filters_have_settled():
    K = live_values(steady(4.4), "prbs", SETTINGS)[2]
    assert (K.settled, K.text) == (False, "K in 1 s")
    assert live_values(steady(1.0), "prbs", SETTINGS)[2].text == "K in 4 s"
    over = live_values(steady(1.0), "prbs", SETTINGS, running=False)
    assert over[2].text == "K not known: the epoch was too short"
    assert live_values(steady(4.6), "prbs", SETTINGS)[2].settled


def test_the_numbers_that_a_first_look_once_gave_are_not_shown():
    """At rest, before anything has moved, the fit is of noise, with intervals as wild as it."""
    wild = estimate(
        0.3,
        stiffness=75761.14,
        se=30000.0,
        inertia_kg_m2=0.4701,
        inertia_kg_m2_se=0.3,
        damping_nm_s_rad=-341.779,
        damping_nm_s_rad_se=200.0,
        epoch=1,
    )
    assert not any(value.settled for value in live_values([wild], "prbs", SETTINGS))
    late = [wild._replace(time_s=0.1 * k, memory_s=5.0) for k in range(200)]
    assert not any(value.settled for value in live_values(late, "prbs", SETTINGS))
    # And were its intervals narrow: it would still be coming down.
    narrow = [
        one._replace(stiffness_nm_rad=75761.14 / 2**k, stiffness_nm_rad_se=1.0)
        for k, one in enumerate(late[::10][:10])
    ]
    assert live_values(narrow, "prbs", SETTINGS)[2].why_not == "still changes"


@pytest.mark.parametrize(("se", "shown"), [(0.43, True), (0.44, False)])
def test_half_the_interval_must_be_below_half_the_value(se, shown):
    K = live_values(steady(10.0, se=se), "prbs", SETTINGS)[2]
    assert K.settled is shown
    assert shown or K.why_not == "not known yet (±51 %)"


@pytest.mark.parametrize(("before", "shown"), [(0.9, True), (0.8, False), (2.6, False)])
def test_the_value_must_not_have_moved_by_half_since_half_of_the_memory(before, shown):
    history = steady(10.0)
    # Of 10 s, 4.3 s count; half of that ago is 7.84 s.
    history[:78] = [one._replace(stiffness_nm_rad=before) for one in history[:78]]
    assert live_values(history, "prbs", SETTINGS)[2].settled is shown
    history[:78] = [one._replace(stiffness_nm_rad=1.7) for one in history[:78]]
    assert live_values(history, "prbs", SETTINGS)[2].settled


def test_each_parameter_settles_for_itself():
    K_wide = steady(10.0, se=5.0)
    assert [v.settled for v in live_values(K_wide, "prbs", SETTINGS)] == [True, True, False]


def test_a_wrong_sign_is_shown_as_it_is():
    K = live_values(steady(10.0, stiffness=-1.7), "prbs", SETTINGS)[2]
    assert K.text == "K −1.700 ± 0.039 N·m/rad"


def test_of_a_sinusoid_and_before_any_epoch_nothing_is_shown():
    assert live_values(steady(10.0), "sinusoid", SETTINGS)[2].why_not == "not from a sinusoid"
    assert live_values([], "", SETTINGS)[2].why_not == "no epoch yet"
    assert live_values([LiveEstimate()], "prbs", SETTINGS)[2].why_not == "no epoch yet"


def test_an_estimate_that_began_anew_is_not_compared_with_the_one_before():
    old = [one._replace(since_s=0.0, stiffness_nm_rad=9.0) for one in steady(20.0)]
    new = [one._replace(since_s=20.0, time_s=20.0 + one.time_s) for one in steady(6.0)]
    assert live_values([*old, *new], "prbs", SETTINGS)[2].settled


ARMS = (0.25 * 0.0045, 4.0 * 0.0045)


def of_epoch(J, se_part=0.02, step_nm=0.01):
    return LiveEstimate(inertia_kg_m2=J, inertia_kg_m2_se=se_part * J, step_nm=step_nm)


BEFORE = [of_epoch(J) for J in (0.0044, 0.0045, 0.006)]


@pytest.mark.parametrize(
    ("now", "words"),
    [
        (of_epoch(0.5 * 0.0045), "J 0.00225 kg·m² is 0.5 times that of the epochs before"),
        (of_epoch(1.61 * 0.0045), "1.6 times that of the epochs before"),
        (of_epoch(1.59 * 0.0045), ""),
        (of_epoch(0.63 * 0.0045), ""),
        (of_epoch(0.5 * 0.0045, se_part=0.11), ""),  # J is not known well enough
        (of_epoch(-0.5, se_part=-0.01), ""),
        (of_epoch(0.0045, step_nm=0.031), "3.1 times as much from tick to tick as in those before"),
        (of_epoch(0.0045, se_part=9.0, step_nm=0.1), "10.0 times"),
        (of_epoch(0.0045, step_nm=0.029), ""),
        (LiveEstimate(), ""),
    ],
)
def test_a_torque_unlike_that_of_the_epochs_before_is_named(now, words):
    found = caution(now, BEFORE, ARMS)
    assert words in found
    assert bool(found) is bool(words)


def test_the_first_epoch_is_compared_with_the_rig_and_the_arms_that_were_commissioned():
    assert caution(of_epoch(0.0045), [], ARMS, 0.005) == ""  # 0.9 of it: a live estimate is no more
    assert "is less than the rig's alone, 0.006: " in caution(of_epoch(0.0045), [], ARMS, 0.006)
    assert "not within 0.00112 to 0.018, " in caution(of_epoch(0.045), [], ARMS)
    assert caution(of_epoch(0.00225), [], ARMS) == ""
