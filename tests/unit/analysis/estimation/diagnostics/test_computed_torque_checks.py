"""A torque that was computed from the angle, and one that a joint has."""

import numpy as np
import pytest

from rigidimeter.analysis.estimation.diagnostics import checked
from rigidimeter.analysis.estimation.diagnostics.computed_torque_checks import (
    computed_torque,
)
from rigidimeter.analysis.estimation.methods import method_named
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import DiagnosticsSettings, Settings

SETTINGS = DiagnosticsSettings()
TIME_S = np.arange(10_000) / 500.0


def recorded(torque, **more):
    """A recording with angle and velocity, and a torque made of them as written in a file."""
    w = 2 * np.pi * np.array([0.3, 0.7, 1.9, 4.3])
    phase = np.outer(TIME_S, w) + np.arange(w.size)
    x, v = 0.05 * np.sin(phase).sum(axis=1), 0.05 * (w * np.cos(phase)).sum(axis=1)
    p = 0.3 * np.sign(np.random.default_rng(4).standard_normal(TIME_S.size // 50)).repeat(50)
    values = {"angle_rad": x, "velocity_rad_s": v, "perturbation_nm": p}
    values["torque_nm"] = np.round(torque(x, v, p), 7)
    channels = {name: Channel(name, TIME_S, y) for name, y in values.items()}
    return Epoch("made", "1", channels, **more)


@pytest.mark.parametrize(
    ("torque", "origin"),
    [
        (lambda x, v, p: 1.8 * x + 0.14 * v + 0.4, "the motion"),
        (lambda x, v, p: 1.8 * x + 0.14 * v + 0.005 * np.gradient(v, TIME_S), "the motion"),
        (
            lambda x, v, p: 1.8 * x + 0.005 * np.gradient(np.gradient(x, TIME_S), TIME_S),
            "the motion",
        ),
        (lambda x, v, p: 0.2 - 0.5 * p, "the perturbation"),
        (lambda x, v, p: np.roll(p, 1), "the perturbation"),
    ],
)
def test_a_torque_that_was_computed_is_excluded(torque, origin):
    look = computed_torque(recorded(torque), SETTINGS)
    assert look.failed
    assert look.facts["origin"] == origin
    assert SETTINGS.levels.computed_torque == "exclude"
    assert computed_torque(recorded(torque, virtual=True), SETTINGS) is None


def test_a_binary_torque_that_was_computed_is_not_called_a_sensor_at_its_limit():
    (prepared,) = prepare([recorded(lambda x, v, p: 0.5 * p, task="prbs")], Settings())
    (fit,), _ = method_named("bandlimited").fit([prepared], None, lambda _: None, False)
    found = checked(prepared, fit)
    assert "saturation" in {finding.name for finding in found.findings}
    assert "The torque was computed from the perturbation" in found.outcome.reason


def test_a_torque_with_the_noise_of_a_good_sensor_was_measured():
    noise = 1e-4 * np.random.default_rng(5).standard_normal(TIME_S.size)
    torque = recorded(lambda x, v, p: 1.8 * x + 0.14 * v + noise)
    look = computed_torque(torque, SETTINGS)
    assert not look.failed
    expected = 100 * 1e-4 / np.std(torque.channels["torque_nm"].values)
    assert look.value == pytest.approx(expected, rel=0.05)
