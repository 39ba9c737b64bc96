import math
from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation.closedloop.between_samples import acceleration_beyond_slope
from rigidimeter.analysis.estimation.closedloop.drive_answer import from_angle
from rigidimeter.analysis.estimation.closedloop.drive_fit import fit_drive
from rigidimeter.analysis.estimation.closedloop.drive_motion import driven, since_ticks
from rigidimeter.core.records import Channel, Epoch, Ticks
from rigidimeter.core.settings import RigSettings
from rigidimeter.model import DriveModel, DriveState, drive, drive_step

SECOND_ORDER = DriveModel.second_order(50.0, 0.7071)


def stepped(commands, bandwidth_hz=40.0, ratio=0.8, interval_s=1e-3):
    """Return the state at each tick by the steps of the virtual rig."""
    one, state, states = drive(bandwidth_hz, ratio, interval_s), DriveState(), []
    for command in commands:
        states.append(state)
        state = drive_step(one, state, command)
    return np.array(states)


def test_driven_motion_is_the_rigs_to_rounding():
    commands = np.random.default_rng(0).standard_normal(300)
    command = Channel("velocity_command_rad_s", np.arange(300) / 1000.0, commands)
    found = driven(DriveModel.second_order(40.0, 0.8), command, command.time_s)
    expected = stepped(commands)
    np.testing.assert_allclose(found.angle_rad, expected[:, 0], atol=1e-12)
    np.testing.assert_allclose(found.velocity_rad_s, expected[:, 1], atol=1e-11)
    np.testing.assert_allclose(found.acceleration_rad_s2, expected[:, 2], atol=1e-9)


def test_between_ticks_it_is_exact_too():
    # One held command from rest: v = c (1 − e^(−σt)(cos ω_d t + σ/ω_d sin ω_d t)).
    command = Channel("velocity_command_rad_s", np.arange(100) / 1000.0, np.full(100, 0.3))
    t = np.random.default_rng(1).uniform(0.0, 0.099, 50)
    omega, ratio = 2 * math.pi * 40.0, 0.8
    sigma, omega_d = ratio * omega, omega * math.sqrt(1 - ratio**2)
    closed = 0.3 * (
        1 - np.exp(-sigma * t) * (np.cos(omega_d * t) + sigma / omega_d * np.sin(omega_d * t))
    )
    found = driven(DriveModel.second_order(40.0, 0.8), command, t)
    np.testing.assert_allclose(found.velocity_rad_s, closed, atol=1e-12)


def test_a_delay_moves_everything():
    commands = np.random.default_rng(2).standard_normal(200)
    command = Channel("velocity_command_rad_s", np.arange(200) / 1000.0, commands)
    late = driven(DriveModel.second_order(40.0, 0.8, 0.0035), command, command.time_s[50:])
    there = driven(DriveModel.second_order(40.0, 0.8), command, command.time_s[50:] - 0.0035)
    np.testing.assert_array_equal(late.velocity_rad_s, there.velocity_rad_s)


@pytest.mark.parametrize("delay_s", [0.0, 0.0042])
def test_the_drive_is_found_from_command_and_velocity(delay_s):
    commands = np.cumsum(np.random.default_rng(3).standard_normal(4000)) * 0.01
    command = Channel("velocity_command_rad_s", np.arange(4000) / 1000.0, commands)
    stamps = np.arange(0.1, 3.9, 0.0201)
    velocity = driven(DriveModel.second_order(23.0, 0.6, delay_s), command, stamps).velocity_rad_s
    channels = {
        "velocity_command_rad_s": command,
        "velocity_rad_s": Channel("velocity_rad_s", stamps, velocity),
    }
    found = fit_drive(Epoch("file", "1", channels), SECOND_ORDER)
    (pole,) = found.model.poles_rad_s
    assert abs(pole) == pytest.approx(2 * math.pi * 23.0, rel=1e-3)
    assert -pole.real / abs(pole) == pytest.approx(0.6, rel=1e-3)
    assert found.model.delay_s == pytest.approx(delay_s, abs=1e-5)


@pytest.mark.parametrize(
    "model",
    [
        DriveModel((complex(-1 / 0.006),), (complex(1 / 0.006),)),
        DriveModel.second_order(25.0, 0.7, 0.0023),
    ],
    ids=["first order, 6 ms", "second order, late"],
)
def test_the_drive_is_found_from_command_and_angle(model):
    n, step_rad = 5000, 2 * math.pi / 2**17
    command = Channel("velocity_command_rad_s", np.arange(n) / 500.0, smooth_commands(n))
    angle = driven(model, command, command.time_s).angle_rad + 0.3
    angle = np.round(angle / step_rad) * step_rad
    channels = {command.name: command, "angle_rad": Channel("angle_rad", command.time_s, angle)}
    found = fit_drive(Epoch("file", "1", channels), SECOND_ORDER).model
    assert found.poles_rad_s == pytest.approx(model.poles_rad_s, rel=5e-3)
    assert found.delay_s == pytest.approx(model.delay_s, abs=3e-5)
    assert found.gain == pytest.approx(1.0, abs=1e-3)


def test_an_angle_is_used_as_the_velocity_through_a_low_pass():
    """θ = sin ωt: ∫ e^(-a(t - s)) ω cos ωs ds → ω (a cos ωt + ω sin ωt) / (a² + ω²)."""
    a, omega, t = 2 * math.pi * 10.0, 2 * math.pi * 3.0, np.arange(20_000) / 20_000
    made = from_angle(np.sin(omega * t), 1 / 20_000)
    closed = omega * (a * np.cos(omega * t) + omega * np.sin(omega * t)) / (a**2 + omega**2)
    np.testing.assert_allclose(made[10_000:], closed[10_000:], atol=2e-3)


@pytest.mark.parametrize("bandwidth_hz", [5.0, 10.0, 20.0])
def test_a_drive_far_slower_than_that_of_the_settings_is_found(bandwidth_hz):
    """At 100/s the drive of the settings, 50 Hz, is nearly too fast to be seen."""
    commands = smooth_commands(2000)
    command = Channel("velocity_command_rad_s", np.arange(2000) / 100.0, commands)
    model = DriveModel.second_order(bandwidth_hz, 0.7)
    velocity = driven(model, command, command.time_s).velocity_rad_s
    velocity = velocity + 1e-4 * np.std(velocity) * np.random.default_rng(8).standard_normal(2000)
    found = fit_drive(recorded(commands, velocity, 0.01), SECOND_ORDER)
    (pole,) = found.model.poles_rad_s
    assert pole == pytest.approx(model.poles_rad_s[0], rel=2e-3)


def test_a_velocity_that_the_command_does_not_explain_gives_no_drive():
    rng = np.random.default_rng(4)
    t = np.arange(2000) / 1000.0
    channels = {
        "velocity_command_rad_s": Channel("velocity_command_rad_s", t, rng.standard_normal(2000)),
        "velocity_rad_s": Channel("velocity_rad_s", t, rng.standard_normal(2000)),
    }
    assert fit_drive(Epoch("file", "1", channels), SECOND_ORDER) is None


def test_ticks_that_do_not_come_evenly_are_exact_too():
    rng = np.random.default_rng(5)
    ticks_s = np.arange(400) / 1000.0 + rng.uniform(0.0, 4e-4, 400)
    commands = rng.standard_normal(400)
    command = Channel("velocity_command_rad_s", ticks_s, commands)
    state, states = DriveState(), []
    for one, length_s in zip(commands, np.diff(ticks_s, append=ticks_s[-1] + 1e-3), strict=True):
        states.append(state)
        state = drive_step(drive(40.0, 0.8, length_s), state, one)
    found = driven(DriveModel.second_order(40.0, 0.8), command, ticks_s)
    expected = np.array(states)
    np.testing.assert_allclose(found.angle_rad, expected[:, 0], atol=1e-12)
    np.testing.assert_allclose(found.velocity_rad_s, expected[:, 1], atol=1e-11)
    np.testing.assert_allclose(found.acceleration_rad_s2, expected[:, 2], atol=1e-8)


def recorded(commands, velocity, interval_s):
    t = interval_s * np.arange(len(commands))
    channels = {
        "velocity_command_rad_s": Channel("velocity_command_rad_s", t, commands),
        "velocity_rad_s": Channel("velocity_rad_s", t, velocity),
    }
    return Epoch("file", "1", channels)


def smooth_commands(n, seed=6):
    return np.cumsum(np.random.default_rng(seed).standard_normal(n)) * 0.01


def test_a_pi_drive_is_told_from_one_of_second_order():
    # H = ((p + q) s + p q) / ((s + p)(s + q)), whose acceleration jumps by p + q per command.
    model = DriveModel((complex(-220.0), complex(-90.0)), (complex(372.3), complex(-62.3)), 2e-4)
    assert model.gain == pytest.approx(1.0, rel=1e-3)
    commands = smooth_commands(3000)
    command = Channel("velocity_command_rad_s", np.arange(3000) / 500.0, commands)
    noise = 1e-5 * np.random.default_rng(7).standard_normal(3000)
    velocity = driven(model, command, command.time_s).velocity_rad_s + noise
    found = fit_drive(recorded(commands, velocity, 0.002), SECOND_ORDER)
    assert len(found.model.poles_rad_s) == 2
    assert found.model.jump == pytest.approx(310.0, rel=0.01)
    assert found.model.delay_s == pytest.approx(2e-4, abs=1e-5)


def test_a_command_that_was_logged_more_slowly_than_it_was_sent_gives_no_drive():
    fine = np.interp(np.arange(20000) / 10, np.arange(2000), smooth_commands(2000))
    command = Channel("velocity_command_rad_s", np.arange(20000) / 2000.0, fine)
    model = DriveModel.second_order(20.0, 0.7)
    velocity = driven(model, command, command.time_s).velocity_rad_s[::10]
    epoch = recorded(fine[::10], velocity, 0.005)
    assert fit_drive(epoch, SECOND_ORDER) is None
    # A loop of ours logs each command, so there the stairs are known.
    ours = replace(epoch, ticks=Ticks(2000, 0, 0))
    assert fit_drive(ours, SECOND_ORDER) is not None


def drive_of(poles, numerator):
    """Return the drive N(s) / Π(s − λ) of gain 1, with poles of a pair given both."""
    numerator = np.poly1d(numerator) * (np.prod(np.negative(poles)).real / np.poly1d(numerator)(0))
    residues = {p: numerator(p) / np.prod([p - q for q in poles if q != p]) for p in poles}
    kept = [complex(p) for p in poles if p.imag >= 0]
    return DriveModel(tuple(kept), tuple(complex(residues[p]) for p in kept))


@pytest.mark.parametrize(
    ("model", "rate_hz"),
    [
        # At 100/s two faster poles and a delay of 2 ms leave nearly as little.
        (drive_of([-293 + 273j, -293 - 273j, -81.5 + 0j], [157.0, 9870.0]), 100.0),
        # A bandwidth of 50 Hz leads two poles to one that is too fast to be seen.
        (drive_of([-197 + 200j, -197 - 200j, -50 + 0j], [1.0]), 1000.0),
    ],
    ids=["PI with lag", "slow position loop"],
)
def test_three_poles_without_a_delay_are_found_as_such(model, rate_hz):
    n = 2000
    commands = smooth_commands(n)
    command = Channel("velocity_command_rad_s", np.arange(n) / rate_hz, commands)
    velocity = driven(model, command, command.time_s).velocity_rad_s
    velocity = velocity + 1e-4 * np.std(velocity) * np.random.default_rng(8).standard_normal(n)
    found = fit_drive(recorded(commands, velocity, 1 / rate_hz), SECOND_ORDER)
    assert found.model.delay_s < 2e-5
    np.testing.assert_allclose(
        sorted(found.model.poles_rad_s, key=abs), sorted(model.poles_rad_s, key=abs), rtol=0.02
    )


def test_what_leaves_more_than_noise_is_no_rival():
    # A delay of 0.5 ms in place of the lag leaves three times the power of the noise.
    model = drive_of([-86 + 92j, -86 - 92j, -1829 + 0j], [172.0, 15860.0])
    rng = np.random.default_rng(6)
    commands = np.convolve(rng.standard_normal(3000), np.ones(10) / 10, "same")
    command = Channel("velocity_command_rad_s", np.arange(3000) / 1000.0, commands)
    velocity = driven(model, command, command.time_s).velocity_rad_s
    velocity = velocity + 3e-3 * np.std(velocity) * rng.standard_normal(3000)
    found = fit_drive(recorded(commands, velocity, 0.001), DriveModel.second_order(20.0, 0.7071))
    assert max(drive.delay_s for drive in found.rivals) < 3e-4


PI = DriveModel((complex(-220.0), complex(-90.0)), (complex(372.3), complex(-62.3)), 1e-3)


def repeated(seed):
    """Return the drive that 1500 samples at 200/s show, with other noise in each recording."""
    commands = smooth_commands(1500)
    command = Channel("velocity_command_rad_s", np.arange(1500) / 200.0, commands)
    clean = driven(PI, command, command.time_s).velocity_rad_s
    noise = 1e-4 * np.std(clean) * np.random.default_rng(seed).standard_normal(1500)
    return fit_drive(recorded(commands, clean + noise, 0.005), SECOND_ORDER)


def test_neighbours_are_two_standard_errors_of_repeated_recordings_away():
    found = [repeated(seed) for seed in range(30)]
    scatter_s = np.std([one.model.delay_s for one in found], ddof=1)
    first = found[0]
    moved = [rival.delay_s - first.model.delay_s for rival in first.rivals]
    # Each axis either way: the squares of the axes add up to those of two standard errors.
    assert math.sqrt(np.sum(np.square(moved)) / 2) == pytest.approx(2 * scatter_s, rel=0.35)


@pytest.mark.parametrize("rate_hz", [1000.0, 200.0])
def test_dry_friction_does_not_bend_the_poles(rate_hz):
    """A PI drive with friction F sgn(v), by steps of a twentieth of a tick."""
    fine, omega, steps = smooth_commands(3000), 2 * math.pi * 50.0, 20
    step_s, friction = 1 / (rate_hz * steps), 0.02 * omega * np.std(fine)
    velocity, integral, seen = 0.0, 0.0, []
    for sent in fine:
        seen.append(velocity)
        for _ in range(steps):
            off = sent - velocity
            push = omega * (off + 0.2 * omega * integral) - friction * math.tanh(1e3 * velocity)
            velocity, integral = velocity + step_s * push, integral + step_s * off
    found = fit_drive(recorded(fine, np.array(seen), 1 / rate_hz), SECOND_ORDER)
    # s² + ω s + 0.2 ω²
    slow, fast = sorted(-pole.real for pole in found.model.poles_rad_s)
    assert (slow, fast) == pytest.approx((0.2764 * omega, 0.7236 * omega), rel=0.06)
    assert found.model.jump == pytest.approx(omega, rel=0.05)


@pytest.mark.parametrize("jitter_s", [0.0, 0.0004, 0.02])
def test_the_last_tick_before_a_time_is_found_however_the_ticks_came(jitter_s):
    rng = np.random.default_rng(3)
    ticks_s = np.sort(np.arange(200) / 1000 + rng.uniform(0, jitter_s, 200)) + 5.0
    command = Channel("velocity_command_rad_s", ticks_s, np.zeros(200))
    time_s = rng.uniform(4.99, 5.25, 500)
    tick, after_s = since_ticks(command, time_s, 0.0)
    wanted = [max((k for k in range(200) if ticks_s[k] <= t + 1e-5), default=0) for t in time_s]
    assert tick.tolist() == wanted
    late = after_s > 0
    assert after_s[late] == pytest.approx((time_s - ticks_s[tick])[late], abs=1e-12)


def test_a_drive_of_second_order_hides_the_square_of_its_bandwidth_times_the_tick():
    """At low frequency A/V − jω is the part of jω that the torque at the ticks does not see."""
    rig = RigSettings(tick_rate_hz=1000.0, drive_bandwidth_hz=50.0)
    hidden = -((2 * math.pi * 50.0 / 1000.0) ** 2) / 12
    slow = np.array([2 * math.pi * 0.1])
    beyond = acceleration_beyond_slope(rig, rig.tick_rate_hz, None, slow) / (1j * slow)
    assert beyond.real.item() == pytest.approx(hidden, abs=2e-4)
