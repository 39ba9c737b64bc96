"""A rig of two devices and a contact: where it may be enabled, and how it is left."""

from __future__ import annotations

import math
import time

import pytest

from rigidimeter.rig.devices import ComposedRig, Home, SerialEnableLine
from rigidimeter.rig.devices.base import DeviceError, MotionSample, TorqueSample
from rigidimeter.rig.guard import Cause

ANGLE_RAD = 0.4


class Sensor:
    def __init__(self) -> None:
        self.time_s = 0.0
        self.counts = {"received": 2}

    def read(self) -> TorqueSample:
        self.time_s += 0.001
        return TorqueSample(1.5, self.time_s)

    closed = False

    def close(self) -> None:
        self.closed = True


class Drive:
    """At rest on a scale of its own; keeps what was asked of it."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.written: list[float] = []
        self.counts = {"received": 3}

    def read(self) -> MotionSample:
        return MotionSample(ANGLE_RAD, 0.0, 0.0)

    def write(self, velocity_rad_s: float) -> float:
        self.written.append(velocity_rad_s)
        return velocity_rad_s

    def __getattr__(self, name):
        if name.startswith("_") or name == "reset_fault":
            raise AttributeError(name)
        return lambda: self.asked.append(name)


class Port:
    rts = dtr = True
    closed = False

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def drive():
    return Drive()


@pytest.fixture
def port():
    return Port()


@pytest.fixture
def line(port):
    settings = SerialEnableLine.Settings(port="/dev/ttyS9")
    return SerialEnableLine(settings, time.monotonic, lambda _: port)


def test_closing_takes_the_power_first_and_the_contacts_port_last(drive, line, port):
    rig = ComposedRig(Sensor(), drive, 100.0, line)
    rig.enable()
    assert port.rts
    assert not port.closed
    rig.close()
    assert drive.asked == ["enable", "disable", "close"]
    assert not port.rts
    assert port.closed
    rig.close()  # twice does no harm


def test_the_contact_is_open_before_the_drive_is_told(line, port):
    """A drive that does not answer keeps its driver waiting, and must not keep the power."""
    contact: list[bool] = []

    class Waited(Drive):
        def disable(self) -> None:
            contact.append(port.rts)

    rig = ComposedRig(Sensor(), Waited(), 100.0, line)
    rig.enable()
    assert port.rts
    rig.disable()
    assert contact == [False]


def test_angle_and_torque_count_from_where_it_was_enabled(drive):
    rig = ComposedRig(Sensor(), drive, 100.0)
    rig.enable()
    rig.zero(0.5)
    reading = rig.read()
    assert rig.origin_rad == ANGLE_RAD
    assert (reading.angle_rad, reading.torque_nm) == (0.0, 1.0)
    assert math.isnan(reading.drive_torque_nm)
    assert math.isnan(reading.drive_torque_time_s)
    assert set(drive.written) == {0.0}


def test_the_drives_torque_has_the_stamp_of_its_angle_and_is_not_zeroed(drive):
    drive.read = lambda: MotionSample(ANGLE_RAD, 0.0, 0.25, drive_torque_nm=-0.75)
    rig = ComposedRig(Sensor(), drive, 100.0)
    rig.zero(0.5)
    reading = rig.read()
    assert (reading.drive_torque_nm, reading.drive_torque_time_s) == (-0.75, 0.25)
    assert reading.torque_time_s != 0.25
    assert rig.counts == {"torque_received": 2, "drive_received": 3}


@pytest.mark.parametrize("off_deg", [2.9, -2.9])
def test_a_joint_near_its_home_is_enabled(drive, off_deg):
    home = Home(ANGLE_RAD + math.radians(off_deg), math.radians(3.0))
    ComposedRig(Sensor(), drive, 100.0, home=home).enable()
    assert "disable" not in drive.asked


@pytest.mark.parametrize("home_rad", [ANGLE_RAD + 0.06, ANGLE_RAD - 0.06, -ANGLE_RAD, math.nan])
def test_a_joint_that_stands_elsewhere_loses_its_power(drive, line, port, home_rad):
    """Where the last session left it is no place to begin from: the limits would move with it."""
    rig = ComposedRig(Sensor(), drive, 100.0, line, Home(home_rad, 0.05))
    with pytest.raises(DeviceError, match=r"stands at 22\.9 deg of the drive's scale; it must be"):
        rig.enable()
    assert drive.asked == ["enable", "disable"]
    assert not port.rts
    assert set(drive.written) == {0.0}


@pytest.mark.parametrize(("took_s", "named"), [(1.5, True), (0.5, False)])
def test_a_drive_that_answers_so_late_that_samples_are_lost_is_named(drive, took_s, named):
    class Flooded(Sensor):
        def read(self) -> TorqueSample:
            return super().read()._replace(cause=int(Cause.TORQUE_PACKETS))

    rig = ComposedRig(Flooded(), drive, 100.0)
    if named:
        with pytest.raises(DeviceError, match=r"drive: it took 1\.5 s to be enabled"):
            rig._fresh_angle_rad(took_s)
    else:  # the loop names the sensor
        assert rig._fresh_angle_rad(took_s) == ANGLE_RAD


def test_a_rig_without_a_contact_ends_by_its_drive(drive):
    sensor = Sensor()
    rig = ComposedRig(sensor, drive, 100.0)
    rig.stop()
    rig.disable()
    rig.close()
    assert drive.asked == ["stop", "disable", "disable", "close"]
    assert sensor.closed


class Stubborn:
    """A device of which every step of the way out fails."""

    def __init__(self) -> None:
        self.tried: list[str] = []

    def __getattr__(self, name):
        def step(*_):
            self.tried.append(name)
            raise RuntimeError(name)

        return step


def test_every_step_of_the_way_out_is_tried(line, port):
    sensor, drive = Stubborn(), Stubborn()
    rig = ComposedRig(sensor, drive, 50.0, line)
    line.close_contact()
    with pytest.raises(RuntimeError):
        rig.close()
    assert (drive.tried, sensor.tried) == (["disable", "close"], ["close"])
    assert (port.rts, port.closed) == (False, True)


def test_a_contact_that_cannot_be_opened_spares_no_step():
    sensor, drive, contact = Stubborn(), Stubborn(), Stubborn()
    with pytest.raises(RuntimeError):
        ComposedRig(sensor, drive, 50.0, contact).close()
    assert (drive.tried, sensor.tried) == (["disable", "close"], ["close"])
    assert contact.tried == ["open_contact", "close"]
