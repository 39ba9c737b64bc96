"""A drive of any order against its steps, its closed form and the sum of all that is folded."""

import cmath
import math

import numpy as np
import pytest

from rigidimeter.model import (
    DriveModel,
    DriveState,
    drive,
    drive_step,
    lowpass,
    state_at_ticks,
)

SECOND_ORDER = DriveModel.second_order(40.0, 0.8)


def velocity_pi(fast=220.0, slow=90.0, gain=1.0, delay_s=0.0):
    """Return H = ((p + q) s + p q) / ((s + p)(s + q)): an inertia under a PI controller."""
    along = fast + slow
    residue = (-fast * along + fast * slow) / (slow - fast)
    other = (-slow * along + fast * slow) / (fast - slow)
    poles = (complex(-fast), complex(-slow))
    return DriveModel(poles, (complex(gain * residue), complex(gain * other)), delay_s)


def stepped(commands, bandwidth_hz=40.0, ratio=0.8, interval_s=1e-3):
    """Return the state at each tick by the steps of the virtual rig."""
    one, state, states = drive(bandwidth_hz, ratio, interval_s), DriveState(), []
    for command in commands:
        states.append(state)
        state = drive_step(one, state, command)
    return np.array(states)


def folded(model, part, omega, interval_s, after_s, most=20_000):
    """Return Σ_k s^part H(s) (1 − e^(−sT)) / (sT) e^(sδ) at s = j(ω + 2πk/T)."""
    s = 1j * (omega + 2 * np.pi * np.arange(-most, most + 1) / interval_s)
    held = (1 - np.exp(-s * interval_s)) / (s * interval_s)
    terms = s**part * model.response(s) * held * np.exp(s * (after_s - model.delay_s))
    return complex(np.sum(terms))


def test_held_commands_move_the_drive_as_its_steps_do():
    commands = np.random.default_rng(0).standard_normal(300)
    found = SECOND_ORDER.held(commands, 1e-3)
    np.testing.assert_allclose(np.stack(found), stepped(commands).T[::-1], atol=1e-9)


def test_the_transfer_function_is_that_of_the_steps():
    # A command z^k answers, in the long run, with the transfer function times z^k.
    z = np.exp(2j * np.pi * 12.5 / 1000.0)
    k = np.arange(4000)
    states = stepped(np.real(z**k)) + 1j * stepped(np.imag(z**k))
    acceleration, velocity, _ = SECOND_ORDER.transfer(np.array([z]), 1e-3)
    assert states[-1, 1] / z ** k[-1] == pytest.approx(velocity[0], rel=1e-9)
    assert states[-1, 2] / z ** k[-1] == pytest.approx(acceleration[0], rel=1e-9)


@pytest.mark.parametrize("after_s", [0.0013, 0.004])
@pytest.mark.parametrize("delay_s", [0.0, 0.0007, 0.0068])
@pytest.mark.parametrize("make", [velocity_pi, lambda **k: DriveModel.second_order(40.0, 0.8, **k)])
def test_the_motion_between_ticks_is_the_sum_of_all_that_sampling_folds(make, delay_s, after_s):
    model, omega, interval_s = make(delay_s=delay_s), 2 * np.pi * 12.0, 0.005
    z = np.array([np.exp(1j * omega * interval_s)])
    found = model.transfer(z, interval_s, after_s)[:, 0]
    wanted = [folded(model, part, omega, interval_s, after_s) for part in (1, 0, -1)]
    np.testing.assert_allclose(found, wanted, rtol=2e-3)
    np.testing.assert_allclose(found[1:], wanted[1:], rtol=1e-7)


def test_a_drive_of_second_order_holds_the_acceleration_at_the_ticks_low():
    omega = np.array([2 * np.pi * 0.1])
    model = DriveModel.second_order(50.0, 0.7071)
    acceleration, velocity, _ = model.transfer(np.exp(1j * omega * 1e-3), 1e-3)
    ratio = acceleration / (1j * omega * velocity)
    assert ratio[0].real == pytest.approx(1 - (2 * np.pi * 50.0 * 1e-3) ** 2 / 12, abs=2e-4)


def test_a_first_order_drive_has_lost_most_of_its_acceleration_at_the_next_tick():
    # v' = λ (c − v): before an edge λ e^(−λT) (c − v), in the mean (1 − e^(−λT)) (c − v) / T.
    rate, interval_s, omega = 200.0, 0.005, np.array([1e-3])
    model = DriveModel((complex(-rate),), (complex(rate),))
    acceleration, velocity, _ = model.transfer(np.exp(1j * omega * interval_s), interval_s)
    ratio = (acceleration / (1j * omega * velocity))[0].real
    assert ratio == pytest.approx(rate * interval_s / math.expm1(rate * interval_s), rel=1e-6)


def test_at_a_tick_the_edge_of_its_command_has_not_come():
    commands = np.array([1.0, 0.0, -2.0, 0.5])
    model = velocity_pi()
    found = model.held(commands, 1e-3).acceleration_rad_s2
    tick = np.arange(4)
    soon = model.motion(commands, 1e-3, tick, np.full(4, 1e-7)).acceleration_rad_s2
    assert found[0] == 0.0
    np.testing.assert_allclose(soon - found, model.jump * np.diff(commands, prepend=0.0), rtol=1e-3)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_low_pass_behind_the_drive_is_the_product_of_both(order):
    s = 2j * np.pi * np.array([0.5, 10.0, 80.0, 400.0])
    both = velocity_pi().smoothed(100.0, order)
    wanted = velocity_pi().response(s) * lowpass(s, 100.0, order)
    np.testing.assert_allclose(both.response(s), wanted, rtol=1e-9)
    power = 1 / (1 + np.abs(s / (200j * np.pi)) ** (2 * order))
    np.testing.assert_allclose(np.abs(lowpass(s, 100.0, order)) ** 2, power, rtol=1e-9)


def test_a_low_pass_whose_pole_is_the_drives_own_is_not_divided_by_zero():
    model = DriveModel((complex(-200 * np.pi),), (complex(200 * np.pi),))
    s = 2j * np.pi * np.array([10.0, 100.0])
    wanted = (200 * np.pi / (s + 200 * np.pi)) ** 2
    np.testing.assert_allclose(model.smoothed(100.0, 1).response(s), wanted, rtol=1e-3)


@pytest.mark.parametrize("pole", [complex(-50.0), complex(-50.0, 80.0)])
def test_the_state_at_ticks_follows_tick_by_tick(pole):
    """x(t + T) = e^(λT) x(t) + (e^(λT) − 1)/λ c, tick by tick."""
    command = np.random.default_rng(0).normal(size=100)
    decay, state, states = cmath.exp(pole * 1e-3), 0j, []
    for sent in command:
        states.append(state)
        state = decay * state + (decay - 1) / pole * sent
    each = state_at_ticks(pole, command, 1e-3)
    assert each == pytest.approx(np.array(states), rel=1e-12)


@pytest.mark.parametrize("rate", [20.0, 300.0, 6000.0])
def test_a_command_that_is_held_for_many_ticks_moves_the_drive_by_the_closed_form(rate):
    """v' = λ (c − v) is the sum of its steps: v(t) = Σ (c_k − c_(k−1)) (1 − e^(−λ (t − t_k)))."""
    rng = np.random.default_rng(0)
    lengths_s = 1e-3 * rng.choice(
        [0.4, 1.0, 1.6, 20.4, 500.0], size=299, p=[0.2, 0.5, 0.2, 0.08, 0.02]
    )
    ticks_s = np.concatenate(([0.0], np.cumsum(lengths_s)))
    commands = rng.standard_normal(300)
    after_s = rng.uniform(0.0, 1.0, 299) * lengths_s
    since_s = (ticks_s[:-1] + after_s)[:, None] - ticks_s
    steps = np.diff(commands, prepend=0.0)
    velocity = np.sum(steps * -np.expm1(-rate * np.maximum(since_s, 0.0)), axis=1)
    angle = np.sum(steps * np.maximum(since_s, 0.0), axis=1) - velocity / rate
    model = DriveModel((complex(-rate),), (complex(rate),))
    found = model.motion(commands, lengths_s, np.arange(299), after_s)
    np.testing.assert_allclose(found.velocity_rad_s, velocity, atol=1e-11)
    np.testing.assert_allclose(found.angle_rad, angle, atol=1e-11)
    np.testing.assert_allclose(
        found.acceleration_rad_s2, rate * (commands[:-1] - velocity), rtol=1e-9, atol=1e-8
    )
