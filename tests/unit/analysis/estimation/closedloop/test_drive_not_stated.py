"""Torque and angle alone, sampled slowly, nothing stated: what a drive may take off J is in it."""

from dataclasses import replace

import pytest

import rigidimeter as rm

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
    assert "with a faster drive further too low" in details


def test_settings_of_the_recording_say_how_often_commands_are_sent():
    """A loop of 2000 ticks/s moves the joint evenly between samples of the torque at 250/s."""
    epochs = two_channels(250.0, 35.0)
    fast = {"rig": {"tick_rate_hz": 2000.0, "torque": {"rate_hz": 250.0}}}
    assert said(rm.estimate(epochs).pooled[0])
    assert not said(rm.estimate(epochs, settings=fast).pooled[0])


def test_at_1000_samples_a_second_nothing_is_said():
    (pool,) = rm.estimate(two_channels(1000.0, 50.0)).pooled
    assert pool.low[0] < TRUE_J < pool.high[0]
    assert not said(pool)
