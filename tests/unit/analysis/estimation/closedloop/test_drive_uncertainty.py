import math

import numpy as np
import pytest

from rigidimeter.analysis.estimation.bandlimited import zero_phase_band
from rigidimeter.analysis.estimation.closedloop.as_sampled import moved_by_settings
from rigidimeter.analysis.estimation.closedloop.between_samples import (
    acceleration_by_settings,
)
from rigidimeter.analysis.estimation.closedloop.drive_motion import driven
from rigidimeter.analysis.estimation.closedloop.drive_search import mean_sign, search
from rigidimeter.analysis.estimation.closedloop.drive_terms import Samples, Structure
from rigidimeter.analysis.estimation.closedloop.drive_uncertainty import as_likely
from rigidimeter.analysis.estimation.signals import Signals, spline_slopes
from rigidimeter.core.records import Channel
from rigidimeter.core.settings import RigSettings
from rigidimeter.model import DriveModel

PI = Structure("velocity PI", 2, 1)
MODEL = DriveModel((complex(-220.0), complex(-90.0)), (complex(372.3), complex(-62.3)), 1e-3)
INTERVAL_S, NOISE = 0.005, 1e-4


def noisy(seed):
    commands = np.cumsum(np.random.default_rng(6).standard_normal(1500)) * 0.01
    command = Channel("velocity_command_rad_s", INTERVAL_S * np.arange(1500), commands)
    clean = driven(MODEL, command, command.time_s).velocity_rad_s
    scale = float(np.std(clean))
    velocity = clean + NOISE * scale * np.random.default_rng(seed).standard_normal(1500)
    sign = mean_sign(command.time_s, velocity)
    return Samples(command, sign, INTERVAL_S, command.time_s, velocity, scale)


def test_a_move_along_the_axes_is_two_standard_errors_of_repeated_recordings():
    found = [search(noisy(seed), PI, MODEL) for seed in range(40)]
    scatter_s = np.std([one.model.delay_s for one in found], ddof=1)
    moved = [drive.delay_s - found[0].model.delay_s for drive in as_likely(noisy(0), found[0])]
    # Each axis either way: the squares of the axes add up to those of two standard errors.
    two_s = math.sqrt(np.sum(np.square(moved)) / 2)
    assert two_s == pytest.approx(2 * scatter_s, rel=0.25)


def test_a_drive_of_second_order_hides_the_square_of_its_bandwidth_times_the_tick():
    rig = RigSettings(tick_rate_hz=1000.0, drive_bandwidth_hz=50.0)
    expected = 1 - (2 * math.pi * 50.0 / 1000.0) ** 2 / 12
    assert acceleration_by_settings(rig, None) == pytest.approx(expected, abs=2e-4)


def test_least_squares_of_held_commands_is_moved_as_the_drive_of_the_settings_says():
    J, B, K = 0.0045, 0.02, 1.75
    rig = RigSettings(tick_rate_hz=1000.0, drive_bandwidth_hz=50.0)
    drive = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    n = 20000
    slow = zero_phase_band(np.random.default_rng(3).standard_normal(n), 1000.0, (0.2, 25.0))
    moved = drive.held(slow, 1e-3)
    derivative = spline_slopes(1e-3 * np.arange(n), moved.velocity_rad_s)
    torque = J * moved.acceleration_rad_s2 + B * moved.velocity_rad_s + K * moved.angle_rad
    columns = (torque, derivative, moved.velocity_rad_s, moved.angle_rad)
    filtered = (zero_phase_band(one, 1000.0, (0.4, 30.0))[1000:-1000] for one in columns)
    signals = Signals(1e-3 * np.arange(n - 2000), *filtered, 1000.0, (0.4, 30.0))
    predicted = J * moved_by_settings(rig, None, signals)
    error = signals.solution.values - [J, B, K]
    np.testing.assert_allclose(predicted[:2], error[:2], rtol=0.02)
    assert error[1] > 0.003 * B
    assert predicted[2] == pytest.approx(error[2], rel=0.25)
