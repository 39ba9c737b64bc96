"""The velocity against the angle: scale and delay put in are found."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.scenarios.catalogue import SCENARIOS

from rigidimeter.analysis.estimation.diagnostics.motion_checks import (
    velocity_fit,
    velocity_shape,
)
from rigidimeter.analysis.estimation.stretches import bridged
from rigidimeter.analysis.study import estimate
from rigidimeter.core.records import Channel, Epoch, LeftOut
from rigidimeter.core.settings import DiagnosticsSettings

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


def test_what_does_not_move_says_nothing_of_scale():
    still = [Channel(n, TIME_S, np.zeros(TIME_S.size)) for n in ("angle_rad", "velocity_rad_s")]
    assert np.isnan(velocity_fit(Epoch("made", "1", {c.name: c for c in still}))).all()


def joint(worse=None, share=0.15):
    """A joint's torque, angle and velocity, and in one of them a ripple of this share."""
    rng = np.random.default_rng(3)
    made = epoch()
    angle, velocity = (made.channels[n].values for n in ("angle_rad", "velocity_rad_s"))
    acceleration = np.gradient(velocity, TIME_S)
    torque = 0.005 * acceleration + 0.14 * velocity + 1.8 * angle
    w = 2 * math.pi * np.array([2.3, 4.7, 8.1])
    phase = np.outer(TIME_S, w)
    size = share * np.std(velocity) / math.sqrt(1.5)
    if worse == "velocity_rad_s":
        velocity = velocity + size * np.sin(phase).sum(axis=1)
    if worse == "angle_rad":
        angle = angle - (size * np.cos(phase) / w).sum(axis=1)
    values = {
        "torque_nm": torque + 1e-3 * rng.standard_normal(TIME_S.size),
        "angle_rad": angle,
        "velocity_rad_s": velocity,
    }
    return Epoch("made", "1", {name: Channel(name, TIME_S, x) for name, x in values.items()})


@pytest.mark.parametrize(
    ("worse", "variant"), [("velocity_rad_s", "velocity"), ("angle_rad", "angle")]
)
def test_a_ripple_in_one_of_them_is_found_and_the_torque_says_in_which(worse, variant):
    look = velocity_shape(joint(worse), (0.15, 50.0), SETTINGS)
    assert look.failed
    assert look.value == pytest.approx(15.0, rel=0.1)
    assert look.variant == variant
    assert (look.facts["by_angle"] > look.facts["by_velocity"]) == (worse == "velocity_rad_s")


@pytest.mark.parametrize("name", ["velocity differenced", "velocity behind 40 Hz", "relaxed"])
def test_a_late_velocity_is_said_where_it_moves_damping_beyond_its_interval(name):
    """B is K τ too low, also where τ is far below the largest delay of the settings."""
    (epoch,), truth = SCENARIOS[name].simulated(0, 1)
    (fit,) = estimate([epoch], "iv", settings=SCENARIOS[name].analysed_with()).fits
    said = [finding for finding in fit.findings if finding.name == "velocity_delay"]
    if name == "relaxed":
        assert said == []
        return
    (finding,) = said
    assert finding.level == "caution"
    assert finding.limit < 0.2
    assert fit.high[1] < truth[0, 1]
    assert 1e-3 * finding.value * truth[0, 2] == pytest.approx(truth[0, 1] - fit.value[1], rel=0.3)


@pytest.mark.parametrize("worse", [None, "velocity_rad_s"])
@pytest.mark.parametrize("length_s", [0.1, 1.0, 3.0])
def test_what_is_left_out_has_no_shape(worse, length_s):
    """A line across the angle has another slope than the line across the velocity."""
    whole = joint(worse)
    part = bridged(replace(whole, left_out=(LeftOut(5.0, 5.0 + length_s),)))
    before, after = (velocity_shape(each, (0.15, 50.0), SETTINGS).value for each in (whole, part))
    assert after == pytest.approx(before, rel=0.05, abs=0.1)


def test_scale_delay_and_noise_are_no_other_shape():
    for of in (joint(), epoch(scale=1.2), epoch(delay_s=0.005), epoch(noise=0.02)):
        assert velocity_shape(of, (0.15, 50.0), SETTINGS).value < 3.0
