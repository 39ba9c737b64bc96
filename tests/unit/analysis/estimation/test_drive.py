import math
from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation.drive import (
    Drive,
    Sampling,
    alternatives,
    beyond,
    find_drive,
    since_ticks,
    without_drive,
)
from rigidimeter.core.records import Channel, Epoch, LeftOut, Ticks
from rigidimeter.core.settings import RigSettings, settings_from
from rigidimeter.model import DriveModel

SETTINGS = settings_from()
SECOND_ORDER = DriveModel.second_order(23.0, 0.6)
# ((p + q) s + p q) / ((s + p) (s + q)): its acceleration jumps by p + q at an edge of the command.
PI = DriveModel((complex(-220.0), complex(-90.0)), (complex(372.3), complex(-62.3)), 2e-4)


def sent(n, rate_hz, seed=6):
    values = 0.01 * np.cumsum(np.random.default_rng(seed).standard_normal(n))
    return Channel("velocity_command_rad_s", np.arange(n) / rate_hz, values)


def recorded(command, velocity, time_s=None, **more):
    time_s = command.time_s if time_s is None else time_s
    motion = Channel("velocity_rad_s", time_s, velocity)
    return Epoch("file", "1", {command.name: command, motion.name: motion}, **more)


def noisy(values, share, seed=8):
    noise = np.random.default_rng(seed).standard_normal(values.size)
    return values + share * np.std(values) * noise


@pytest.mark.parametrize("delay_s", [0.0, 0.0042])
def test_a_drive_without_noise_is_the_model_also_between_the_samples(delay_s):
    """The velocity comes 50 times a second, the command 1000 times and not evenly."""
    command, rng = sent(4000, 1000.0), np.random.default_rng(5)
    command = replace(command, time_s=command.time_s + rng.uniform(0.0, 4e-4, 4000))
    model, stamps_s = replace(SECOND_ORDER, delay_s=delay_s), np.arange(0.1, 3.9, 0.0201)
    epoch = recorded(command, Drive(model).motion(command, stamps_s)[1], stamps_s)
    found = find_drive([epoch], SETTINGS)
    assert found.model.poles_rad_s == pytest.approx(model.poles_rad_s, rel=1e-4)
    assert found.model.delay_s == pytest.approx(delay_s, abs=1e-6)
    between_s = rng.uniform(0.5, 3.5, 500)
    made, true = found.motion(command, between_s), Drive(model).motion(command, between_s)
    assert np.all(np.max(np.abs(made - true), axis=1) < 1e-3 * np.std(true, axis=1))


def test_a_pi_drive_is_found_in_noise_and_ticks_that_were_missed():
    command = sent(3000, 500.0)
    ran = np.random.default_rng(1).random(3000) > 0.02
    command = Channel(command.name, command.time_s[ran], command.values[ran])
    clean = Drive(PI).motion(command, command.time_s)[1]
    found = find_drive([recorded(command, noisy(clean, 1e-5))], SETTINGS)
    assert len(found.model.poles_rad_s) == 2
    assert found.model.jump == pytest.approx(310.0, rel=0.01)
    assert found.model.delay_s == pytest.approx(2e-4, abs=1e-5)


@pytest.mark.parametrize(
    "model",
    [
        DriveModel((complex(-1 / 0.006),), (complex(1 / 0.006),)),
        DriveModel.second_order(25.0, 0.7, 0.0023),
    ],
    ids=["first order, 6 ms", "second order, late"],
)
def test_the_angle_of_an_encoder_shows_the_drive(model):
    command, step_rad = sent(5000, 500.0), 2 * math.pi / 2**17
    angle = Drive(model).motion(command, command.time_s)[2] + 0.3
    angle = Channel("angle_rad", command.time_s, np.round(angle / step_rad) * step_rad)
    epoch = Epoch("file", "1", {command.name: command, angle.name: angle})
    found = find_drive([epoch], SETTINGS).model
    assert found.poles_rad_s == pytest.approx(model.poles_rad_s, rel=5e-3)
    assert found.delay_s == pytest.approx(model.delay_s, abs=3e-5)


@pytest.mark.parametrize("seed", range(4))
def test_in_noise_a_pole_and_a_delay_do_not_pass_for_two_poles(seed):
    """In noise of 5 % they leave 3 % more power; repeated recordings scatter by 4 % in a pole."""
    command, model = sent(3000, 1000.0), DriveModel.second_order(50.0, 0.7)
    clean = Drive(model).motion(command, command.time_s)[1]
    found = find_drive([recorded(command, noisy(clean, 0.05, seed))], SETTINGS).model
    assert found.poles_rad_s == pytest.approx(model.poles_rad_s, rel=0.1)
    assert found.delay_s == 0.0


def test_noise_is_averaged_over_the_epochs_that_show_the_same_drive():
    """The pole of four epochs scatters half as much as that of one; others add nothing."""
    model, errors = DriveModel.second_order(50.0, 0.7), []
    for seed in range(0, 40, 4):
        epochs = []
        for number in range(seed, seed + 4):
            command = sent(3000, 1000.0, number)
            clean = Drive(model).motion(command, command.time_s)[1]
            epochs.append(recorded(command, noisy(clean, 0.05, number)))
        alone, together = (find_drive(some, SETTINGS) for some in (epochs[:1], epochs))
        poles = [one.model.poles_rad_s[0] - model.poles_rad_s[0] for one in (alone, together)]
        errors.append(np.abs(poles))
    one, four = np.sqrt(np.mean(np.square(errors), axis=0))
    assert four < 0.75 * one
    unlike = recorded(command, np.random.default_rng(4).standard_normal(3000))
    slower = recorded(sent(3000, 500.0, 39), clean)
    found = find_drive([epochs[0], unlike, slower], SETTINGS)
    assert found.model == alone.model


@pytest.mark.parametrize("rate_hz", [1000.0, 200.0])
def test_dry_friction_does_not_bend_the_poles(rate_hz):
    """A PI drive with friction F sgn(v), by steps of a twentieth of a tick."""
    command, omega, steps = sent(3000, rate_hz), 2 * math.pi * 50.0, 20
    step_s, friction = 1 / (rate_hz * steps), 0.02 * omega * np.std(command.values)
    velocity, integral, seen = 0.0, 0.0, []
    for value in command.values.tolist():
        seen.append(velocity)
        for _ in range(steps):
            off = value - velocity
            push = omega * (off + 0.2 * omega * integral) - friction * math.tanh(1e3 * velocity)
            velocity, integral = velocity + step_s * push, integral + step_s * off
    found = find_drive([recorded(command, np.array(seen))], SETTINGS).model
    slow, fast = sorted(-pole.real for pole in found.poles_rad_s)  # s² + ω s + 0.2 ω²
    assert (slow, fast) == pytest.approx((0.2764 * omega, 0.7236 * omega), rel=0.06)
    assert found.jump == pytest.approx(omega, rel=0.05)


def test_a_velocity_that_the_command_does_not_explain_shows_no_drive_but_the_next_epoch_may():
    command, rng = sent(2000, 1000.0), np.random.default_rng(4)
    other = recorded(command, rng.standard_normal(2000))
    assert find_drive([other], SETTINGS) is None
    shown = recorded(command, Drive(SECOND_ORDER).motion(command, command.time_s)[1])
    assert find_drive([other, shown], SETTINGS) is not None


def test_a_command_that_was_logged_more_slowly_than_it_was_sent_shows_no_drive():
    slow = sent(2000, 200.0)
    time_s = np.arange(20000) / 2000.0
    fine = Channel(slow.name, time_s, np.interp(time_s, slow.time_s, slow.values))
    epoch = recorded(slow, Drive(SECOND_ORDER).motion(fine, fine.time_s)[1][::10])
    assert find_drive([epoch], SETTINGS) is None
    # A loop of ours logs each command, so there the stairs are known.
    assert find_drive([replace(epoch, ticks=Ticks(2000, 0, 0))], SETTINGS) is not None


def test_after_lost_samples_the_state_of_the_drive_is_not_used():
    command = sent(3000, 500.0)
    velocity = Drive(SECOND_ORDER).motion(command, command.time_s)[1]
    kept = (command.time_s < 2.0) | (command.time_s > 2.5)
    command = Channel(command.name, command.time_s[kept], command.values[kept])
    lost = (LeftOut(2.0, 2.5, check="lost_samples"),)
    found = find_drive([recorded(command, velocity[kept], left_out=lost)], SETTINGS)
    assert found.model.poles_rad_s == pytest.approx(SECOND_ORDER.poles_rad_s, rel=1e-3)


def test_rivals_are_two_standard_errors_of_repeated_recordings_away():
    command, model = sent(1500, 200.0), replace(PI, delay_s=1e-3)
    clean = Drive(model).motion(command, command.time_s)[1]
    found = [
        find_drive([recorded(command, noisy(clean, 1e-4, seed))], SETTINGS) for seed in range(16)
    ]
    scatter_s = np.std([one.model.delay_s for one in found], ddof=1)
    moved = [one.delay_s - found[0].model.delay_s for one in found[0].rivals]
    # Each axis either way: the squares of the axes add up to those of two standard errors.
    assert math.sqrt(np.sum(np.square(moved)) / 2) == pytest.approx(2 * scatter_s, rel=0.4)


@pytest.mark.parametrize("jitter_s", [0.0, 0.0004, 0.02])
def test_the_last_tick_before_a_time_is_found_however_the_ticks_came(jitter_s):
    rng = np.random.default_rng(3)
    ticks_s = np.sort(np.arange(200) / 1000 + rng.uniform(0, jitter_s, 200)) + 5.0
    command = Channel("velocity_command_rad_s", ticks_s, np.zeros(200))
    time_s = rng.uniform(4.99, 5.25, 500)
    tick, after_s = since_ticks(command, time_s, 0.0)
    assert tick.tolist() == [max(int(np.sum(ticks_s <= t + 1e-5)) - 1, 0) for t in time_s]
    late = after_s > 0
    assert after_s[late] == pytest.approx((time_s - ticks_s[tick])[late], abs=1e-12)


def test_a_drive_of_second_order_hides_the_square_of_its_bandwidth_times_the_tick():
    """At low frequency the torque at the ticks does not see (ω_n T)²/12 of the acceleration."""
    rig, slow = RigSettings(tick_rate_hz=1000.0, drive_bandwidth_hz=50.0), 2 * math.pi * 0.1
    motion = np.ones((1, 3), dtype=complex)
    none, hidden = without_drive(motion, rig, Sampling((slow, slow, 1), 1e-3))
    assert not np.any(none)
    assert (hidden[0, 0] / (1j * slow)).real == pytest.approx(
        -((2 * math.pi * 50.0 / 1000.0) ** 2) / 12, abs=2e-4
    )


def test_motion_that_the_command_causes_changes_by_other_drives_alone():
    at = Sampling((2 * math.pi, 2 * math.pi * 29, 29), 1e-3)
    command, (seen, velocity) = np.ones((29, 1), dtype=complex), beyond(PI, at, 0.0)
    motion = np.repeat(velocity * command, 3, axis=1)
    rival = DriveModel.second_order(50.0, 0.7)
    changes = alternatives(Drive(PI, (rival,)), motion, command, at, np.zeros(500))
    none, share, other, beside = changes
    np.testing.assert_array_equal(none, -seen * command)
    np.testing.assert_allclose(share, 0.005 * none)
    np.testing.assert_allclose(other, (beyond(rival, at, 0.0)[0] - seen) * command)
    np.testing.assert_allclose(beside, 0.0, atol=1e-12 * np.max(np.abs(seen)))
