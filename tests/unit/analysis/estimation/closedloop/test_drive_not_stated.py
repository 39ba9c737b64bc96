"""Torque and angle alone, sampled slowly, nothing stated: what a drive may take off J is in it."""

from dataclasses import replace

import pytest

import rigidimeter as rm
from rigidimeter.core.settings import dump_settings, recorded_settings, settings_from

TRUE_J = 0.0045


def two_channels(rate_hz: float, bandwidth_hz: float, seed: int = 1):
    rates = {"torque": {"rate_hz": rate_hz}, "motion": {"rate_hz": rate_hz}}
    rig = {"tick_rate_hz": rate_hz, "drive_bandwidth_hz": bandwidth_hz, **rates}
    blocks = {"rests_s": [1.0], "blocks": [{"task": "prbs", "epochs": 2}]}
    session = rm.simulate({"seed": seed, "rig": rig, "protocol": blocks})
    wanted = ("torque_nm", "angle_rad")
    return [
        replace(epoch, channels={name: epoch.channels[name] for name in wanted})
        for epoch in session.epochs
    ]


def said(fit) -> list[str]:
    return [one.details for one in fit.findings if one.name == "between_samples"]


@pytest.mark.parametrize(
    ("rate_hz", "bandwidth_hz"), [(125.0, 50.0), (250.0, 50.0), (250.0, 100.0)]
)
def test_the_interval_of_j_holds_what_a_drive_takes_off_it(rate_hz, bandwidth_hz):
    """One of 50 Hz commanded 125 times a second takes 28 % off it, one of 100 Hz at 250/s 10 %."""
    (pool,) = rm.estimate(two_channels(rate_hz, bandwidth_hz)).pooled
    assert pool.low[0] < TRUE_J < pool.high[0]
    assert pool.low[2] < 1.751 < pool.high[2]
    (details,) = said(pool)
    assert f"with 50 Hz, commanded {rate_hz:g} times a second" in details
    assert "a faster drive would make J lower still" in details


def test_settings_that_state_it_say_how_often_commands_are_sent():
    """A loop of 1000 ticks/s moves the joint evenly between samples of the torque at 250/s."""
    epochs = two_channels(250.0, 35.0)
    unstated = settings_from(rig={"drive_bandwidth_hz": 60.0, "torque": {"rate_hz": 250.0}})
    stated = settings_from(rig={"tick_rate_hz": 1000.0})
    recorded = recorded_settings(dump_settings(settings_from()), source="manifest.json")
    (details,) = said(rm.estimate(epochs, settings=unstated).pooled[0])
    assert "with 60 Hz, commanded 250 times a second" in details
    for settings in (stated, settings_from(stated, rig={"drive_bandwidth_hz": 35.0}), recorded):
        assert not said(rm.estimate(epochs, settings=settings).pooled[0])
    changed = settings_from(unstated, rig={"drive_damping_ratio": 0.8})
    assert said(rm.estimate(epochs, settings=changed).pooled[0])  # still not stated


def test_at_1000_samples_a_second_nothing_is_said():
    (pool,) = rm.estimate(two_channels(1000.0, 50.0)).pooled
    assert pool.low[0] < TRUE_J < pool.high[0]
    assert not said(pool)
