"""What can be set of a serial drive, and its port."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from rigidimeter.devices.ascii.line import Port
from rigidimeter.devices.base import DeviceError
from rigidimeter.settings.section import Section, quantity

__all__ = ["POWER_UP_BAUD", "AsciiDriveSettings", "open_port"]

POWER_UP_BAUD = 9600


class AsciiDriveSettings(Section):
    """How the drive is wired and what it may do.

    Parameters
    ----------
    port : str
        Serial port, such as ``/dev/ttyUSB0``.
    counts_per_turn : float
        Encoder counts for one turn of the joint, gear included.
    """

    port: str
    counts_per_turn: float = Field(gt=0.0, le=1e9, json_schema_extra={"unit": "counts"})
    baud: Literal[9600, 19200, 38400, 57600, 115200] = 115200
    sign: Literal[1, -1] = 1
    angle_offset_deg: float = quantity(0.0, "deg", -360.0, 360.0)
    mode: Literal["moves", "velocity"] = "moves"
    external_watchdog: bool = False
    horizon_s: float = quantity(0.1, "s", 0.01, 1.0)
    max_velocity_deg_s: float = quantity(90.0, "deg/s", 0.0, 720.0, above=True)
    acceleration_deg_s2: float = quantity(2000.0, "deg/s²", 0.0, 100_000.0, above=True)
    deceleration_deg_s2: float = quantity(7000.0, "deg/s²", 0.0, 100_000.0, above=True)
    lost_s: float = quantity(0.1, "s", 0.01, 2.0)
    jump_deg: float = quantity(2.0, "deg", 0.0, 90.0, above=True)

    @property
    def emulated(self) -> bool:
        """Whether the port is a pseudo-terminal: the other end of it is a program."""
        return self.port.startswith("/dev/pts/")


def open_port(settings: AsciiDriveSettings) -> Port:
    """Open the port at the rate a drive has after power-up; sends nothing.

    Raises
    ------
    DeviceError
        If pyserial is missing or the port cannot be opened.
    """
    try:
        import serial
    except ImportError as error:
        raise DeviceError(
            "a serial drive needs pyserial: pip install 'rigidimeter[serial]'"
        ) from error
    lost_s = settings.lost_s
    try:
        port: Port = serial.Serial(
            settings.port, POWER_UP_BAUD, timeout=lost_s, write_timeout=lost_s, exclusive=True
        )
    except (OSError, ValueError) as error:
        raise DeviceError(f"drive: port {settings.port!r} cannot be opened: {error}") from error
    return port
