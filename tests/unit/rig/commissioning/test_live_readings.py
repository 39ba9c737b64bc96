"""Live readings without power: what is shown, and that the drive is never enabled."""

from __future__ import annotations

import math

import pytest

from rigidimeter.rig.commissioning import HEADING, LiveReading, Operator, Setup, live_readings
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause


@pytest.fixture
def shown(settings, fake_rig, monkeypatch):
    def run(*, push_nm: float = 0.0, times: int = 2, **faults) -> list[LiveReading]:
        made = fake_rig((0.0045, 0.1368, 1.751), 0.005, True, faults)
        made.world.push_nm[0] = push_nm
        monkeypatch.delattr(type(made.rig), "enable")  # to give it power is an error
        seen: list[LiveReading] = []

        def show(reading: LiveReading) -> bool:
            seen.append(reading)
            return len(seen) < times

        live_readings(Setup(made.rig, settings, made.timebase, Operator(lambda _: False)), show)
        return seen

    return run


def test_a_weight_is_seen_and_nothing_gets_power(shown):
    seen = shown(push_nm=1.5, times=3)
    assert len(seen) == 3
    assert abs(seen[-1].torque_nm) == pytest.approx(1.5, abs=0.01)
    assert seen[-1].angle_rad == pytest.approx(0.0, abs=1e-6)
    assert seen[-1].cause is Cause.NONE
    assert seen[-1].torque_hz > 0


def test_what_a_wire_loses_is_counted(shown):
    lost = [reading.lost for reading in shown(times=3, lost_each=1)]
    assert lost[0] > 0
    assert lost == sorted(set(lost))


def test_a_device_that_does_not_answer_is_named(shown):
    with pytest.raises(DeviceError, match="no answer; check the cable"):
        shown(no_answer=True)


def test_the_values_stand_under_their_heading():
    reading = LiveReading(-1.25, 0.004, 996.0, math.radians(-171.5), 0.0, 498.0, 3, Cause.NONE)
    assert len(reading.words) == len(HEADING)
    assert reading.words.endswith("none")
    assert reading._replace(drive_torque_nm=-0.125).words.endswith("-0.125")
    values = ["-1.250", "0.004", "996", "-171.50", "+0.00", "498", "3"]
    assert reading.words.split() == [*values, "none"]
    stale = reading._replace(cause=Cause.TORQUE_STALE).words
    assert stale.endswith(Cause.TORQUE_STALE.sentence)
