from __future__ import annotations

import math

import numpy as np
import pytest

from rigidimeter.device.base import DeviceError
from rigidimeter.device.replay import ReplayDrive, ReplayRig, ReplaySensor

TIMES = np.array([0.0, 0.001, 0.003])
COLUMNS = {
    "torque_nm": np.array([1.0, 2.0, math.nan]),
    "torque_time_s": TIMES,
    "angle_rad": np.array([0.1, 0.2, 0.3]),
    "velocity_rad_s": np.array([10.0, 20.0, 30.0]),
    "motion_time_s": TIMES + 0.5,
}


def test_a_rig_plays_tick_by_tick_and_then_grows_stale():
    rig = ReplayRig(COLUMNS, shift_s=100.0)
    rig.connect()
    rig.configure()
    rig.zero(0.25)
    first = rig.read()
    assert (first.torque_nm, first.torque_time_s, first.motion_time_s) == (0.75, 100.0, 100.5)
    assert rig.read().angle_rad == 0.2
    assert not rig.finished
    last = rig.read()
    assert math.isnan(last.torque_nm), "a record is passed on as it is"
    assert rig.finished
    assert rig.read().motion_time_s == last.motion_time_s


def test_a_missed_tick_is_skipped():
    rig = ReplayRig(COLUMNS)
    rig.configure()
    rig.read()
    assert rig.read(2).angle_rad == 0.3


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
    ("change", "message"),
    [
        ({"angle_rad": [0.1]}, "column 'angle_rad' has shape"),
        ({"torque_nm": np.zeros((3, 2))}, "column 'torque_nm' has shape"),
    ],
)
def test_columns_of_another_length_are_refused(change, message):
    with pytest.raises(DeviceError, match=message):
        ReplayRig({**COLUMNS, **change})


def test_a_missing_column_is_named():
    with pytest.raises(DeviceError, match="no column 'velocity_rad_s'"):
        ReplayDrive({name: COLUMNS[name] for name in ("angle_rad", "motion_time_s")})
