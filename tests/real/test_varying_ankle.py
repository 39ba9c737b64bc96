"""A measured ankle that was held in one place does not vary; one that is moved and does, does."""

from dataclasses import replace

import numpy as np
import pytest

import rigidimeter as rm
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.readers import read_recording
from rigidimeter.core.records import Channel
from rigidimeter.core.settings import Settings

OPTIONS = ReadOptions(
    columns={"angle_rad": "position_rad", "torque_nm": "torque_Nm"},
    reaction=True,
    epoch_length_s=20.0,
)


def varying(epochs):
    return [
        {f.name: f.details for f in fit.findings if f.name.startswith("varying")}
        for fit in rm.estimate(epochs, "bandlimited", settings=Settings()).fits
    ]


def moved(epoch, share):
    """Return the epoch on a movement of 2.5 deg and 0.5 Hz, K going up and down by a share with it.

    K is highest half-way, so that the angle does not tell it; nor is the torque of the movement
    itself in phase with it.
    """
    angle, torque = (epoch.channels[name] for name in ("angle_rad", "torque_nm"))
    phase = 2 * np.pi * 0.5 * (angle.time_s - angle.time_s[0])
    about = angle.values - np.mean(angle.values)
    more = share * 60.0 * np.sin(phase) * about + 2.0 * np.cos(phase - 1.0)
    channels = {
        "angle_rad": angle.values + np.radians(2.5) * np.cos(phase),
        "torque_nm": torque.values + more,
    }
    channels = {name: Channel(name, angle.time_s, v) for name, v in channels.items()}
    return replace(epoch, channels=channels, task="prbs")


@pytest.mark.parametrize("name", ["z_df", "z_df2", "z_pf"])
def test_an_ankle_that_was_held_stays_the_same(shared_data, name):
    epochs, _ = read_recording(shared_data / "ankle" / f"{name}.npz", OPTIONS)
    assert varying(epochs) == [{}] * 3
    assert varying([moved(epoch, 0.0) for epoch in epochs[:1]]) == [{}]


def test_an_ankle_whose_stiffness_follows_a_movement_varies_with_its_phase(shared_data):
    epochs, _ = read_recording(shared_data / "ankle" / "z_df2.npz", OPTIONS)
    for found in varying([moved(epoch, 0.5) for epoch in epochs]):
        assert found.keys() == {"varying_with_phase"}
        assert "K changes from" in found["varying_with_phase"]
