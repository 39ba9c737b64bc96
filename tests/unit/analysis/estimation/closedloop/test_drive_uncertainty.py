import math

import numpy as np
import pytest

from rigidimeter.analysis.estimation.closedloop.between_samples import (
    acceleration_beyond_slope,
)
from rigidimeter.analysis.estimation.closedloop.drive_motion import driven
from rigidimeter.analysis.estimation.closedloop.drive_search import mean_sign, search
from rigidimeter.analysis.estimation.closedloop.drive_terms import Samples, Structure
from rigidimeter.analysis.estimation.closedloop.drive_uncertainty import as_likely
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
    """At low frequency A/V − jω is the part of jω that the torque at the ticks does not see."""
    rig = RigSettings(tick_rate_hz=1000.0, drive_bandwidth_hz=50.0)
    hidden = -((2 * math.pi * 50.0 / 1000.0) ** 2) / 12
    slow = np.array([2 * math.pi * 0.1])
    beyond = acceleration_beyond_slope(rig, None, slow) / (1j * slow)
    assert beyond.real.item() == pytest.approx(hidden, abs=2e-4)
