"""Least squares of torque and motion alone, each line weighted by its noise."""

import numpy as np
import pytest

from rigidimeter.analysis.estimation import fit_epoch
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import DriveModel, JointDynamics
from rigidimeter.virtual.batch import simulate_epochs

SETTINGS = Settings()
TRUTH = np.array([0.0045, 0.137, 1.75])


def imposed(measured, rate_hz=500.0):
    """An imposed sum of sines with the torque of J, B and K, the angle as `measured` makes it."""
    rng = np.random.default_rng(0)
    time_s = np.arange(round(10 * rate_hz)) / rate_hz
    w = 2 * np.pi * np.arange(0.3, 40.0, 0.5)
    a = 0.01 / (1 + (w / 30.0) ** 2)
    phase = np.outer(time_s, w) + rng.uniform(0, 2 * np.pi, w.size)
    angle, velocity = np.sin(phase) @ a, np.cos(phase) @ (a * w)
    torque = TRUTH @ [-np.sin(phase) @ (a * w**2), velocity, angle]
    torque += 1e-3 * rng.standard_normal(torque.size)
    channels = {"torque_nm": torque, "angle_rad": measured(angle, rng)}
    return Epoch("made", "1", {n: Channel(n, time_s, v) for n, v in channels.items()}, task="prbs")


@pytest.mark.parametrize(
    "measured",
    [
        lambda angle, rng: 0.002 * np.round(angle / 0.002),
        lambda angle, rng: 0.004 * np.round(angle / 0.004),
        lambda angle, rng: angle + 5e-4 * rng.standard_normal(angle.size),
    ],
    ids=["steps of 2 mrad", "steps of 4 mrad", "noise of 0.5 mrad"],
)
def test_noise_of_the_angle_does_not_make_the_inertia_small(measured):
    """With all samples as their own instruments J is 2 to 20 % low."""
    fit = fit_epoch(imposed(measured), "bandlimited", SETTINGS)
    assert fit.value == pytest.approx(TRUTH, rel=0.01)


@pytest.mark.parametrize(
    ("swing", "reason"),
    [
        ({"angle_rad": 0.1}, "the motion that is fitted cannot distinguish J, B and K"),
        (
            {"angle_rad": 0.1, "velocity_rad_s": 1e-300},
            "nothing moved the joint in the band of the fit",
        ),
    ],
    ids=["one sine", "no velocity"],
)
def test_a_refusal_does_not_speak_of_a_perturbation_that_is_not_used(swing, reason):
    time_s = np.arange(5000) / 500
    sine = np.sin(2 * np.pi * 2 * time_s)
    torque = 0.175 * sine + 0.0137 * np.gradient(sine, time_s)
    values = {"torque_nm": torque, **{name: size * sine for name, size in swing.items()}}
    channels = {name: Channel(name, time_s, value) for name, value in values.items()}
    fit = fit_epoch(Epoch("made", "1", channels, task="prbs"), "bandlimited", SETTINGS)
    assert fit.outcome.reason == reason


def test_torque_of_the_subject_does_not_bias_it_and_the_interval_holds_what_is_left():
    """Forty epochs of torque and angle alone: 95 % of the intervals hold each of J, B, K."""
    settings = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": 0.2}}})
    made = simulate_epochs(
        settings, 40, joints=[JointDynamics(*TRUTH)] * 40, conditions="OFF", seed=4
    )
    alone = [
        Epoch(e.source, e.label, {n: e.channels[n] for n in ("torque_nm", "angle_rad")})
        for e in (made.epoch(k) for k in range(40))
    ]
    fits = [fit_epoch(one, "bandlimited", settings) for one in alone]
    error = np.mean([fit.value for fit in fits], axis=0) / TRUTH - 1
    assert np.all(np.abs(error) < [0.02, 0.05, 0.05])  # without weights B is 66 % low
    held = np.mean([(fit.low <= TRUTH) & (fit.high >= TRUTH) for fit in fits], axis=0)
    assert np.all(held >= 0.85)


def test_a_drive_that_is_not_known_moves_it_as_that_of_the_settings():
    """Commands held from tick to tick, exactly: the interval reaches to J and B and not beyond."""
    rig = SETTINGS.rig
    drive = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    n, interval_s = 20_000, 1.0 / rig.tick_rate_hz
    rng = np.random.default_rng(3)
    command = np.cumsum(rng.standard_normal(n)) * 0.01
    command -= np.convolve(command, np.ones(1000) / 1000, "same")
    moved = drive.held(command, interval_s)
    torque = TRUTH @ [moved.acceleration_rad_s2, moved.velocity_rad_s, moved.angle_rad]
    torque += 5e-5 * rng.standard_normal(n)
    values = {
        "torque_nm": torque,
        "velocity_rad_s": moved.velocity_rad_s,
        "angle_rad": moved.angle_rad,
    }
    time_s = interval_s * np.arange(n)
    epoch = Epoch("made", "1", {name: Channel(name, time_s, one) for name, one in values.items()})
    fit = fit_epoch(epoch, "bandlimited", SETTINGS)
    away, half = np.abs(fit.value - TRUTH), (fit.high - fit.low) / 2
    assert away[0] > 0.005 * TRUTH[0]
    assert np.all(away <= half)
    assert np.all(half[:2] < 1.5 * away[:2])
