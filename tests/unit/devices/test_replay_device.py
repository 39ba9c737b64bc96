from __future__ import annotations

import math

import numpy as np
import pytest

from rigidimeter.devices.base import DeviceError
from rigidimeter.devices.composed import ComposedRig
from rigidimeter.devices.replay_device import ReplayDrive, ReplaySensor

TIMES = np.array([0.0, 0.001, 0.003])
COLUMNS = {
    "torque_nm": np.array([1.0, 2.0, math.nan]),
    "torque_time_s": TIMES,
    "angle_rad": np.array([0.1, 0.2, 0.3]),
    "velocity_rad_s": np.array([10.0, 20.0, 30.0]),
    "motion_time_s": TIMES + 0.5,
}


def playing(device):
    device.connect()
    device.configure()
    return device


def test_a_record_is_played_tick_by_tick_and_then_grows_stale():
    sensor = playing(ReplaySensor(COLUMNS, shift_s=100.0))
    first = sensor.read()
    assert (first.torque_nm, first.time_s) == (1.0, 100.0)
    assert sensor.read().torque_nm == 2.0
    assert not sensor.finished
    last = sensor.read()
    assert math.isnan(last.torque_nm), "a record is passed on as it is"
    assert sensor.finished
    assert sensor.read().time_s == last.time_s


def test_both_devices_make_a_rig():
    rig = ComposedRig(ReplaySensor(COLUMNS), ReplayDrive(COLUMNS), tick_rate_hz=100.0)
    rig.connect()
    assert set(rig.configure()) == {"torque_sensor", "drive"}
    rig.zero(0.25)
    assert rig.read().torque_nm == 0.75


def test_commands_are_noted_and_move_nothing():
    drive = ReplayDrive(COLUMNS)
    drive.connect()
    drive.configure()
    assert drive.write(0.5) == 0.0
    drive.enable()
    assert drive.write(0.5) == 0.5
    assert drive.read().angle_rad == 0.1
    drive.stop()
    drive.write(0.7)
    assert drive.written == [0.5]


def test_causes_and_sequences_of_the_record_are_played():
    columns = {**COLUMNS, "cause": [0, 8, 8], "torque_sequence": [7, 8, 9]}
    sensor = ReplaySensor(columns)
    sensor.connect()
    sensor.configure()
    assert [(s.sequence, s.cause) for s in (sensor.read(), sensor.read())] == [(7, 0), (8, 8)]


@pytest.mark.parametrize(
    ("device", "change", "message"),
    [
        (ReplayDrive, {"velocity_rad_s": [0.1]}, "column 'velocity_rad_s' has shape"),
        (ReplaySensor, {"torque_nm": np.zeros((3, 2))}, "column 'torque_nm' has shape"),
    ],
)
def test_columns_of_another_length_are_refused(device, change, message):
    with pytest.raises(DeviceError, match=message):
        device({**COLUMNS, **change})


def test_a_missing_column_is_named():
    with pytest.raises(DeviceError, match="no column 'velocity_rad_s'"):
        ReplayDrive({name: COLUMNS[name] for name in ("angle_rad", "motion_time_s")})
