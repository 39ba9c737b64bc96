from __future__ import annotations

import time

import pytest

from rigidimeter.rig.devices import SerialEnableLine
from rigidimeter.rig.devices.base import DeviceError


class Port:
    def __init__(self) -> None:
        self.lines = {"rts": True, "dtr": True}
        self.broken = self.closed = False

    def __setattr__(self, name, value):
        if name in ("rts", "dtr"):
            if self.broken:
                raise OSError("input/output error")
            self.lines[name] = value
        else:
            super().__setattr__(name, value)

    def close(self):
        self.closed = True


@pytest.fixture
def port():
    return Port()


def line_on(port, line="rts"):
    settings = SerialEnableLine.Settings(port="/dev/ttyS9", line=line)
    return SerialEnableLine(settings, time.monotonic, lambda _: port)


@pytest.mark.parametrize(("line", "other"), [("rts", "dtr"), ("dtr", "rts")])
def test_the_contact_follows_one_line_and_the_other_stays_low(port, line, other):
    contact = line_on(port, line)
    contact.close_contact()
    assert port.lines == {line: True, other: False}
    contact.open_contact()
    contact.open_contact()
    assert port.lines == {line: False, other: False}


def test_a_line_that_cannot_be_lowered_is_lowered_by_closing_the_port(port):
    contact = line_on(port)
    contact.close_contact()
    port.broken = True
    contact.open_contact()
    assert port.closed


def test_a_line_that_cannot_be_raised_is_named(port):
    port.broken = True
    with pytest.raises(DeviceError, match="rts of '/dev/ttyS9' cannot be set"):
        line_on(port).close_contact()
    assert port.closed


def test_opening_before_closing_touches_no_port():
    contact = SerialEnableLine(SerialEnableLine.Settings(port="/dev/ttyS9"), time.monotonic)
    contact.open_contact()
    contact.close()


def test_a_port_that_is_not_there_is_named():
    contact = SerialEnableLine(SerialEnableLine.Settings(port="/dev/no-such"), time.monotonic)
    with pytest.raises(DeviceError, match="no-such"):
        contact.close_contact()


def test_the_port_is_opened_once_and_the_line_lowered_before_it_is_closed(port):
    opened = []
    settings = SerialEnableLine.Settings(port="/dev/ttyS9")
    contact = SerialEnableLine(settings, time.monotonic, lambda name: opened.append(name) or port)
    contact.close_contact()
    contact.close_contact()
    assert opened == ["/dev/ttyS9"]
    contact.close()
    contact.close()
    assert (port.lines["rts"], port.closed) == (False, True)
