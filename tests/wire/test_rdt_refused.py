"""A sensor that cannot be used, has changed, or is not the expected one is refused."""

import time

import pytest
from tests.wire.rdt_wire import arm, emulator, sensor, sensor_of

from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import RdtEmulator

__all__ = ["arm", "emulator", "sensor", "sensor_of"]


def test_what_the_sensor_says_of_itself_is_kept(emulator, sensor_of):
    facts = sensor_of(emulator).configure()
    assert (facts.model, facts.serial) == ("Emulated Net F/T", "FT00001")
    assert facts.fastest_tick_rate_hz == 1000.0
    assert facts.values["counts_per_torque"] == 1e6
    assert facts.values["torque_unit"] == "Nm"


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("unknown_units", None, "scfgtu.*'cubit-stone'.*Nm, Nmm"),
        ("rdt_disabled", None, "comrdte.*'Disabled'"),
        ("page_status", None, "analog board supply too low"),
        ("http_silent", None, "no answer within 0.3 s"),
        ("http_slow", 1.0, "no answer within 0.3 s"),
        ("http_drip", 0.05, "does not end within 0.3 s"),
        ("http_error", None, "answers 500"),
        ("http_garbage", None, "not the page of a Net F/T"),
        ("deaf", None, "no sample from 127.0.0.1"),
        ("silent", None, "no sample from 127.0.0.1"),
        ("delay", 0.15, r"the first sample came 0\.1\d s after each request, not .* within 0\.1 s"),
        ("delay", 1.0, "no sample from 127.0.0.1"),
        ("short", 1, "no sample.*'short': [1-9]"),
        ("foreign", None, None),
        ("serious_status", None, "analog board supply too low"),
        ("saturated", None, "saturated"),
    ],
)
def test_a_sensor_that_cannot_be_used_is_refused(emulator, sensor_of, lateness, name, value, words):
    emulator.misbehave(name, value)
    sensor = sensor_of(emulator, timeout_s=0.8 if name == "delay" else 0.3)
    if words is None:
        sensor.configure()
        return
    began_s = time.monotonic()
    with pytest.raises(DeviceError, match=words) as refused:
        sensor.configure()
    assert str(refused.value).startswith("torque sensor at 127.0.0.1: ")
    assert time.monotonic() - began_s < 1.0 + lateness.worst_s(began_s)
    emulator.behave()
    sensor.configure()  # and it can be used when it is right again


@pytest.mark.parametrize("stated_hz", [7000.0, 500.0])
def test_a_stream_of_another_rate_than_the_page_states_is_refused(emulator, sensor_of, stated_hz):
    """1,000 records/s taken for 7,000/s seem 3.4 s old after 4 s, for 500/s never old at all."""
    emulator.misbehave("page_rate", stated_hz)
    words = f"its page states {stated_hz:g} records/s and it sends (9|10)[0-9]{{2}}"
    with pytest.raises(DeviceError, match=words):
        sensor_of(emulator).configure()


def test_no_web_server_and_no_sensor_are_refused(arm, sensor_of):
    with RdtEmulator(arm) as emulator:
        pass
    sensor = sensor_of(emulator, timeout_s=0.3)
    with pytest.raises(DeviceError, match=r"no answer.*check the sensor's power"):
        sensor.configure()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("changed_units", "torque_unit 'Nm' became 'lbf-in'"),
        ("changed_calibration", "serial 'FT00001' became 'FT99999', calibration 0 became 7"),
        ("changed_bias", "bias"),
    ],
)
def test_a_sensor_that_comes_back_changed_is_refused(emulator, sensor_of, sensor, name, words):
    sensor.close()
    emulator.misbehave(name)
    sensor.connect()
    with pytest.raises(DeviceError, match=f"came back changed.*{words}"):
        sensor.configure()
    sensor_of(emulator).configure()  # a new session looks at it with fresh eyes
    emulator.behave()
    sensor.connect()
    sensor.configure()
    assert sensor.read().cause == Cause.NONE


def test_a_sensor_that_was_refused_is_not_started_again(emulator, sensor):
    """Enabling a rig asks for the samples anew; that must not pass by what configuring found."""
    sensor.restart()  # as it is, it may
    assert sensor.read().sequence >= 0
    sensor.close()
    emulator.misbehave("changed_units")
    sensor.connect()
    with pytest.raises(DeviceError, match="came back changed"):
        sensor.configure()
    asked = len(emulator.requests)
    with pytest.raises(DeviceError, match="it is not configured; configure it first"):
        sensor.restart()
    assert len(emulator.requests) == asked
    assert sensor.read().sequence < 0
    emulator.behave()
    with pytest.raises(DeviceError, match="it is not configured"):  # well again, not looked at
        sensor.restart()
    sensor.configure()
    sensor.restart()
    assert sensor.read().cause == Cause.NONE


def test_a_sensor_that_gave_no_sample_is_not_started_again(emulator, sensor_of):
    sensor = sensor_of(emulator)
    emulator.misbehave("deaf")
    for _ in range(2):
        with pytest.raises(DeviceError, match="no sample"):
            sensor.configure()
        with pytest.raises(DeviceError, match="it is not configured"):
            sensor.restart()


@pytest.mark.parametrize(
    ("expected", "words"),
    [
        ({"expected_serial": "FT2"}, "serial is 'FT00001' where expected_serial is 'FT2'"),
        ({"expected_calibration": 3}, "calibration is 0 where"),
        ({"expected_torque_unit": "Nmm"}, "torque_unit is 'Nm' where"),
        ({"expected_force_unit": "lbf"}, "force_unit is 'N' where"),
        ({"expected_rate_hz": 7000.0}, "rate_hz is 1000.0 where"),
    ],
)
def test_a_sensor_that_is_not_the_expected_one_is_refused(emulator, sensor_of, expected, words):
    sensor = sensor_of(emulator, **expected)
    with pytest.raises(DeviceError, match=words):
        sensor.configure()
    assert not emulator.requests  # it was never asked to send


def test_the_expected_sensor_is_taken_however_its_unit_is_spelled(emulator, sensor_of):
    sensor_of(
        emulator, expected_serial="FT00001", expected_calibration=0, expected_torque_unit="N-m"
    ).configure()
