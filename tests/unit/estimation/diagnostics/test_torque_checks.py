"""A torque that was computed from the angle, and one that a joint has."""

import numpy as np
import pytest

from rigidimeter.estimation import epoch_signals
from rigidimeter.estimation.diagnostics.torque_checks import static_torque
from rigidimeter.records import Channel, Epoch
from rigidimeter.settings import DiagnosticsSettings, EstimationSettings

SETTINGS = DiagnosticsSettings()
TIME_S = np.arange(10_000) / 500.0


def looked(torque, frequency_hz=(0.3, 0.7, 1.9, 4.3)):
    """Look at a torque, given as a function of angle, velocity and acceleration."""
    x, v, a = np.zeros((3, TIME_S.size))
    for k, f in enumerate(frequency_hz):
        w = 2 * np.pi * f
        x, v = x + 0.05 * np.sin(w * TIME_S + k), v + 0.05 * w * np.cos(w * TIME_S + k)
        a = a - 0.05 * w**2 * np.sin(w * TIME_S + k)
    values = {"torque_nm": torque(x, v, a), "angle_rad": x}
    epoch = Epoch("made", "1", {name: Channel(name, TIME_S, y) for name, y in values.items()})
    return static_torque(epoch, epoch_signals(epoch, "bandlimited", EstimationSettings()), SETTINGS)


@pytest.mark.parametrize(
    "torque",
    [
        lambda x, v, a: 1.2 * np.sin(x),
        lambda x, v, a: 1.2 * np.sin(x + 0.8) + 3.0,
        lambda x, v, a: 2.0 * x + 300.0 * x**3,
    ],
)
def test_a_function_of_the_angle_is_not_measured(torque):
    look = looked(torque)
    assert look.failed
    assert look.value < 0.05
    assert SETTINGS.levels.static_torque == "exclude"


def test_a_joint_has_inertia_and_damping_in_its_torque():
    look = looked(lambda x, v, a: 0.0045 * a + 0.137 * v + 1.75 * x)
    assert not look.failed
    assert look.value > 10.0


def test_a_torque_that_knows_nothing_of_the_angle_has_all_of_its_variance():
    noise = np.convolve(np.random.default_rng(2).standard_normal(10_049), np.ones(50), "valid")
    assert looked(lambda x, v, a: noise).value == pytest.approx(100.0, abs=10.0)
