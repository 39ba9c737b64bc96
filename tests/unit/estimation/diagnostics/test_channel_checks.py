"""The velocity against the angle: scale and delay put in are found."""

import math

import numpy as np
import pytest

from rigidimeter.estimation.diagnostics.channel_checks import (
    velocity_delay,
    velocity_fit,
    velocity_scale,
)
from rigidimeter.records import Channel, Epoch
from rigidimeter.settings import DiagnosticsSettings

SETTINGS = DiagnosticsSettings()
TIME_S = np.arange(0.0, 10.0, 0.002)


def epoch(scale=1.0, delay_s=0.0, noise=0.0):
    """A sum of three sines, whose velocity is known exactly."""
    rng = np.random.default_rng(1)
    parts = [(0.06, 0.7), (0.04, 1.9), (0.01, 6.3)]
    w = [2 * math.pi * f for _, f in parts]
    angle = sum(a * np.sin(k * TIME_S) for (a, _), k in zip(parts, w, strict=True))
    then = TIME_S - delay_s
    velocity = sum(a * k * np.cos(k * then) for (a, _), k in zip(parts, w, strict=True)) / scale
    velocity = velocity + noise * rng.standard_normal(TIME_S.size)
    channels = [Channel("angle_rad", TIME_S, angle), Channel("velocity_rad_s", TIME_S, velocity)]
    return Epoch("made", "1", {c.name: c for c in channels})


def test_what_belongs_together_is_not_faulted():
    scale, delay_s = velocity_fit(epoch(noise=0.02))
    assert scale == pytest.approx(1.0, abs=0.005)
    assert delay_s == pytest.approx(0.0, abs=0.0005)
    for check in (velocity_scale, velocity_delay):
        assert not check((scale, delay_s), SETTINGS).failed


@pytest.mark.parametrize("scale", [180 / math.pi, math.pi / 180, -1.0, 1.2])
def test_another_unit_or_sign_excludes(scale):
    fitted = velocity_fit(epoch(scale=scale))
    assert fitted[0] == pytest.approx(scale, rel=0.01)
    assert velocity_scale(fitted, SETTINGS).failed
    assert SETTINGS.levels.velocity_scale == "exclude"


@pytest.mark.parametrize("delay_s", [0.015, 0.007, -0.01])
def test_a_delay_is_found_and_doubted(delay_s):
    fitted = velocity_fit(epoch(delay_s=delay_s))
    look = velocity_delay(fitted, SETTINGS)
    assert look.value == pytest.approx(1e3 * delay_s, rel=0.1)
    assert look.failed


def test_what_does_not_move_says_nothing_of_scale():
    still = [Channel(n, TIME_S, np.zeros(TIME_S.size)) for n in ("angle_rad", "velocity_rad_s")]
    assert np.isnan(velocity_fit(Epoch("made", "1", {c.name: c for c in still}))).all()
