"""An emulated torque sensor on a true wire, and its driver."""

import time

import pytest

from rigidimeter.model import JointDynamics
from rigidimeter.rig.devices import AtiRdt
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import EmulatedArm, RdtEmulator

ANGLE_RAD = 0.3
STIFFNESS_NM_RAD = 2.0
TORQUE_NM = STIFFNESS_NM_RAD * ANGLE_RAD
NOISE_NM = 0.005


@pytest.fixture
def arm():
    arm = EmulatedArm(JointDynamics(0.08, 0.8, STIFFNESS_NM_RAD), noise_sd_nm=NOISE_NM)
    arm.place(ANGLE_RAD)
    return arm


@pytest.fixture
def emulator(arm):
    with RdtEmulator(arm) as emulator:
        yield emulator


@pytest.fixture
def sensor_of():
    """Make a driver of an emulator; all are closed in the end."""
    made = []

    def make(emulator, now=time.monotonic, **settings):
        # A busy machine may hold a thread up for longer than a real sensor ever is.
        values = {"timeout_s": 1.0, "tolerated_packets": 5, "frozen_s": 0.1, **settings}
        sensor = AtiRdt(
            AtiRdt.Settings(
                address="127.0.0.1", port=emulator.port, http_port=emulator.http_port, **values
            ),
            now,
        )
        made.append(sensor)
        sensor.connect()
        return sensor

    yield make
    for sensor in made:
        sensor.close()


@pytest.fixture
def sensor(emulator, sensor_of):
    sensor = sensor_of(emulator)
    sensor.configure()
    return sensor


def watch(sensor, duration_s):
    """Read at 1 kHz; return the samples."""
    samples = []
    until_s = time.monotonic() + duration_s
    while time.monotonic() < until_s:
        samples.append(sensor.read())
        time.sleep(0.001)
    return samples


def first_cause(sensor, within_s=2.0):
    """Read at 1 kHz until there is a cause; return it with the time that took."""
    start_s = time.monotonic()
    while (elapsed_s := time.monotonic() - start_s) < within_s:
        cause = sensor.read().cause
        if cause:
            return Cause(cause), elapsed_s
        time.sleep(0.001)
    return Cause.NONE, elapsed_s


def newest(samples):
    return samples[-1].torque_nm


def bad_counts(sensor):
    return {name: n for name, n in sensor.counts.items() if n and name != "received"}
