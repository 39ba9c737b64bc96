"""An angle in steps makes J of least squares too small, by no more than its interval says.

The motion is slow against the samples, or so fast that each sample is many steps from the last,
where errors of rounding are white and their power in the acceleration has a closed form.
"""

import numpy as np
import pytest

from rigidimeter.analysis.estimation.bandlimited import bandlimited_signals
from rigidimeter.analysis.estimation.methods import fit_epoch
from rigidimeter.analysis.estimation.steps import moved_by_steps, step_of
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import Settings

SETTINGS = Settings()
TRUTH = np.array([0.0045, 0.137, 1.75])


def an_epoch(step_rad=0.0, rate_hz=500.0, highest_hz=40.0, scale_rad=0.01):
    """An imposed sum of sines, the torque of J, B and K, and the angle in steps."""
    rng = np.random.default_rng(0)
    time_s = np.arange(round(10 * rate_hz)) / rate_hz
    w = 2 * np.pi * np.arange(0.3, highest_hz, 0.5)
    a = scale_rad / (1 + (w / 30.0) ** 2)
    phase = np.outer(time_s, w) + rng.uniform(0, 2 * np.pi, w.size)
    angle, velocity = np.sin(phase) @ a, np.cos(phase) @ (a * w)
    torque = TRUTH @ [-np.sin(phase) @ (a * w**2), velocity, angle]
    torque += 1e-3 * rng.standard_normal(torque.size)
    measured = step_rad * np.round(angle / step_rad) if step_rad else angle
    channels = {"torque_nm": torque, "angle_rad": measured}
    return Epoch("made", "1", {n: Channel(n, time_s, v) for n, v in channels.items()}, task="prbs")


def signals_of(epoch):
    return bandlimited_signals(epoch, SETTINGS.estimation)


@pytest.mark.parametrize("step_rad", [0.002, 0.004])
def test_j_is_too_small_and_the_interval_holds_it(step_rad):
    epoch = an_epoch(step_rad)
    signals = signals_of(epoch)
    too_small = TRUTH[0] - signals.solution.values[0]
    assert too_small > 0.02 * TRUTH[0]
    fit = fit_epoch(epoch, "bandlimited", SETTINGS)
    assert fit.low[0] <= TRUTH[0] <= fit.high[0]
    half = fit.high[0] - fit.value[0]
    drive_and_chance = fit_epoch(an_epoch(), "bandlimited", SETTINGS)
    others = drive_and_chance.high[0] - drive_and_chance.value[0]
    assert 0.9 * too_small < half - others < 2.0 * too_small


def test_the_errors_of_fast_motion_are_white():
    rate_hz, step_rad = 200.0, 0.002
    epoch = an_epoch(step_rad, rate_hz, highest_hz=45.0, scale_rad=0.1)
    made = []

    def seen(of):
        made.append(signals_of(of))
        return made[0]

    exact = an_epoch(0.0, rate_hz, highest_hz=45.0, scale_rad=0.1).channels["angle_rad"].values
    moved_by_steps(epoch, signals_of(epoch), seen, lambda _: exact)
    f = np.linspace(0.1, 100.0, 2000)
    # The filter of the band is of fourth order and goes over the samples twice.
    power = (2 * np.pi * f) ** 4 * step_rad**2 / (6 * rate_hz) / (1 + (f / 50.0) ** 8) ** 2
    assert np.var(made[0].acceleration_rad_s2) == pytest.approx(np.trapezoid(power, f), rel=0.2)


def test_steps_are_found_where_many_samples_share_them():
    angle = an_epoch(0.001).channels["angle_rad"].values
    assert step_of(angle) == pytest.approx(0.001, rel=1e-9)
    assert step_of(an_epoch().channels["angle_rad"].values) == 0.0
    assert step_of(an_epoch(1e-7).channels["angle_rad"].values) == 0.0
    assert step_of(np.zeros(100)) == 0.0
    uneven = np.tile([0.0, 0.001, 0.00237, 0.01], 100)
    assert step_of(uneven) == 0.0


def test_an_angle_without_steps_moves_nothing():
    epoch = an_epoch()
    moved = moved_by_steps(epoch, signals_of(epoch), signals_of, lambda channel: channel.values)
    assert np.all(moved == 0.0)
