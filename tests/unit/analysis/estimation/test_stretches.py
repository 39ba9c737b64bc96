"""Stretches that are left out: what is left gives the joint that was there before the fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation.bad_stretches import (
    bad_stretches,
    without_bad_stretches,
)
from rigidimeter.analysis.estimation.diagnostics import checked
from rigidimeter.analysis.estimation.methods import method_named
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.core.records import Channel, Epoch, LeftOut
from rigidimeter.core.settings import Settings, parse_settings

SETTINGS = Settings()
RATE_HZ = 200.0
TRUTH = np.array([0.005, 0.14, 1.8])
FREQUENCIES_HZ = (0.31, 0.73, 1.51, 3.13, 6.07, 9.01)


def motion(time_s):
    """Return acceleration, velocity and angle of a sum of sines."""
    w = 2 * np.pi * np.array(FREQUENCIES_HZ)
    phase = np.outer(time_s, w) + np.arange(w.size) ** 2
    a = 0.02 / w
    return (
        (-a * w**2 * np.sin(phase)).sum(1),
        (a * w * np.cos(phase)).sum(1),
        (a * np.sin(phase)).sum(1),
    )


def an_epoch(length_s=20.0, **extra):
    time_s = np.arange(0.0, length_s, 1 / RATE_HZ)
    acceleration, velocity, angle = motion(time_s)
    noise = 1e-3 * np.random.default_rng(1).standard_normal(time_s.size)
    torque = np.column_stack([acceleration, velocity, angle]) @ TRUTH + noise
    values = {"torque_nm": torque, "angle_rad": angle, "velocity_rad_s": velocity, **extra}
    channels = {name: Channel(name, time_s, column) for name, column in values.items()}
    return Epoch("made", "1", channels, task="prbs")


def hung(epoch, name, start_s, stop_s):
    channel = epoch.channels[name]
    values = channel.values.copy()
    rows = (channel.time_s >= start_s) & (channel.time_s <= stop_s)
    values[rows] = values[rows][0]
    changed = Channel(name, channel.time_s, values)
    return replace(epoch, channels={**epoch.channels, name: changed})


def fitted(epoch, settings=SETTINGS):
    (prepared,) = prepare([epoch], settings)
    (fit,), _ = method_named("bandlimited").fit([prepared], None, lambda _: None, False)
    return checked(prepared, fit)


def finding(fit, name):
    return next(found for found in fit.findings if found.name == name)


def test_a_torque_at_the_end_of_its_range_for_a_second_is_left_out():
    epoch = an_epoch()
    torque = epoch.channels["torque_nm"]
    values = torque.values.copy()
    limit = 2 * values.max()
    for start_s in (8.0, 8.2):
        values[(torque.time_s >= start_s) & (torque.time_s <= start_s + 0.091)] = limit
    clipped = Channel("torque_nm", torque.time_s, values)
    fit = fitted(replace(epoch, channels={**epoch.channels, "torque_nm": clipped}))
    assert fit.outcome.included
    assert fit.value == pytest.approx(TRUTH, rel=0.01)
    found = finding(fit, "saturation")
    assert found.level == "note"
    assert found.facts["spans"] == "from 8 to 8.09 s and from 8.2 to 8.29 s"


def test_a_short_rest_in_a_long_recording_excludes_nothing():
    fit = fitted(hung(an_epoch(100.0), "angle_rad", 50.0, 50.2))
    assert fit.outcome.included
    assert finding(fit, "frozen").level == "note"


def test_a_sensor_that_hung_for_most_of_the_epoch_excludes_it():
    fit = fitted(hung(an_epoch(), "torque_nm", 4.0, 16.0))
    assert fit.outcome.kind == "excluded"
    assert "torque_nm repeats one value for 12 s" in fit.outcome.reason
    assert finding(fit, "frozen").level == "exclude"


def test_too_little_that_is_left_excludes():
    settings = parse_settings({"diagnostics": {"max_left_out_percent": 99.0}})
    epoch = hung(an_epoch(), "torque_nm", 3.0, 17.0)
    assert fitted(epoch, settings).outcome.kind == "excluded"
    by_hand = replace(an_epoch(), left_out=(LeftOut(3.0, 17.0),))
    fit = fitted(by_hand)
    assert fit.outcome.kind == "failed"
    assert "leaves 2 s; at least 3 s are needed" in fit.outcome.reason


@pytest.mark.parametrize("level", ["note", "caution"])
def test_what_is_not_to_be_excluded_is_left_in(level):
    settings = parse_settings({"diagnostics": {"levels": {"frozen": level}}})
    epoch = hung(an_epoch(), "torque_nm", 8.0, 9.0)
    assert without_bad_stretches(epoch, settings) is epoch
    assert finding(fitted(epoch, settings), "frozen").level == level


def held(**extra):
    """Steps to either side with rests between, in which the angle is constant, at its extremes."""
    time_s = np.arange(0.0, 20.0, 1 / RATE_HZ)
    pulse = np.where(time_s % 2 < 0.5, np.sin(2 * np.pi * time_s), 0.0) ** 2
    command = 0.3 * pulse * np.where(time_s % 4 < 2, 1.0, -1.0)
    late = np.roll(command, 2)  # by the delay of the drive
    epoch = an_epoch(velocity_command_rad_s=command, **extra)
    moved = {"velocity_rad_s": late, "angle_rad": np.round(np.cumsum(late) / RATE_HZ, 9)}
    channels = {name: Channel(name, time_s, values) for name, values in moved.items()}
    return replace(epoch, channels={**epoch.channels, **channels})


def found_in(epoch):
    frozen, saturated = (
        {
            stretch.reason.split()[0]
            for stretch in bad_stretches(epoch, SETTINGS.diagnostics)
            if stretch.check == check
        }
        for check in ("frozen", "saturation")
    )
    return frozen, saturated


def test_a_joint_that_was_told_to_rest_is_no_broken_sensor():
    assert found_in(held()) == (set(), set())
    assert found_in(held(perturbation_nm=np.zeros(4000))) == (set(), set())


def ramps(**changed):
    """Positions that are reached at one speed, which the velocity repeats, with rests between."""
    time_s = np.arange(0.0, 20.0, 1 / RATE_HZ)
    going = (time_s % 2 > 0.5) & (time_s % 2 < 0.8)
    command = np.where(going, np.where(time_s % 4 < 2, 0.3, -0.3), 0.0)
    velocity = np.roll(command, 2)  # by the delay of the drive
    moved = {"velocity_rad_s": velocity, "angle_rad": np.cumsum(velocity) / RATE_HZ, **changed}
    return an_epoch(velocity_command_rad_s=command, **moved)


def test_a_joint_that_was_told_to_go_on_at_one_velocity_is_no_broken_sensor():
    assert found_in(ramps()) == (set(), set())


def test_a_velocity_that_is_not_the_one_told_is_one():
    stuck = ramps().channels["velocity_rad_s"].values.copy()
    stuck[stuck != 0] *= 0.5
    assert found_in(ramps(velocity_rad_s=stuck)) == ({"velocity_rad_s"}, {"velocity_rad_s"})


def test_a_coarse_velocity_is_no_broken_sensor_while_the_angle_moves_as_it_says():
    time_s = np.arange(0.0, 20.0, 1 / RATE_HZ)
    omega = 2 * np.pi * 0.4
    angle, velocity = 0.4 * np.sin(omega * time_s), 0.4 * omega * np.cos(omega * time_s)
    coarse = {"angle_rad": angle, "velocity_rad_s": np.round(velocity / 0.2) * 0.2}
    assert found_in(an_epoch(**coarse)) == (set(), set())
    clipped = {"angle_rad": angle, "velocity_rad_s": np.clip(velocity, -0.8, 0.8)}
    assert found_in(an_epoch(**clipped)) == ({"velocity_rad_s"}, {"velocity_rad_s"})


def test_a_joint_that_rests_though_something_moves_it_is_one():
    both = {"angle_rad", "velocity_rad_s"}
    assert found_in(held(perturbation_nm=np.full(4000, 0.3))) == (both, {"angle_rad"})
    epoch = held()
    nobody = {k: v for k, v in epoch.channels.items() if k != "velocity_command_rad_s"}
    assert found_in(replace(epoch, channels=nobody)) == (both, {"angle_rad"})
