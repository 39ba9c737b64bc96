"""A contact in the drive's hardware enable, opened by software through a line of a serial port.

RTS or DTR of a serial port drives a relay, and the relay's contact lies in the drive's enable
circuit, in series with the emergency stop. Opening it takes the power away whatever the drive's own
software thinks: for when commands no longer reach it.

What it does and does not do, on Linux:

- When the process ends, by itself or killed, the kernel closes the port and drops both lines (the
  port's HUPCL flag, which is set). The contact opens.
- When the process is stopped or hangs, the line stays as it is. This contact is no watchdog;
  for that a relay is needed that falls open without pulses.
- Opening the port raises both lines for a moment before the driver can lower them. Wire the relay
  so that a moment is not enough, and close the emergency stop last.
- Adapters differ: some keep their lines when the cable is pulled from the computer but not from
  its supply. Try it at commissioning, by pulling and by killing.

It reports nothing back: that the relay opened is seen in the drive's status.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any, ClassVar, Literal, Protocol

from rigidimeter.devices.base import DeviceError, Now
from rigidimeter.settings.section import Section

__all__ = ["EnableLine", "SerialEnableLine", "SerialEnableLineSettings"]


class EnableLine(Protocol):
    """A contact without which the drive has no power."""

    def close_contact(self) -> None:
        """Let the drive be energised."""

    def open_contact(self) -> None:
        """Take the power away; safe at any time, and twice."""

    def close(self) -> None:
        """Open the contact and close the port; safe twice."""


class SerialEnableLineSettings(Section):
    """Which line of which port drives the relay.

    Parameters
    ----------
    port : str
        Serial port, such as ``/dev/ttyS0``; not the one that carries the drive's commands.
    line : {"rts", "dtr"}
    """

    port: str
    line: Literal["rts", "dtr"] = "rts"


class SerialEnableLine:
    """A relay on RTS or DTR of a serial port of its own; open until it is closed.

    The port is opened with the first `close_contact`, not before.

    Parameters
    ----------
    settings : SerialEnableLineSettings
    now : callable
        Not used; every driver is made with it.
    serial_port : callable, optional
        Opens an object with the attributes `rts` and `dtr` and the method `close`, in place of the
        port of that name.
    """

    Settings: ClassVar[type[SerialEnableLineSettings]] = SerialEnableLineSettings

    def __init__(
        self,
        settings: SerialEnableLineSettings,
        now: Now,
        serial_port: Callable[[str], Any] | None = None,
    ) -> None:
        self._name = settings.port
        self._line = settings.line
        self._open = _opened if serial_port is None else serial_port
        self._port: Any = None

    def close_contact(self) -> None:
        """Open the port if it is not, and raise the line.

        Raises
        ------
        DeviceError
            If pyserial is missing, or the line cannot be set; the contact is open then.
        """
        try:
            if self._port is None:
                self._port = self._open(self._name)
                self._port.rts = False
                self._port.dtr = False
            setattr(self._port, self._line, True)
        except OSError as error:
            self.close()
            raise DeviceError(
                f"enable contact: {self._line} of {self._name!r} cannot be set: {error}"
            ) from error

    def open_contact(self) -> None:
        """Lower the line; where that fails, close the port, which lowers it too."""
        if self._port is None:
            return
        try:
            setattr(self._port, self._line, False)
        except OSError:
            self.close()

    def close(self) -> None:
        """Open the contact and close the port; safe twice."""
        port, self._port = self._port, None
        if port is None:
            return
        # A port that fails here is closed all the same, and the kernel lowers its lines.
        with contextlib.suppress(OSError):
            setattr(port, self._line, False)
        with contextlib.suppress(OSError):
            port.close()


def _opened(name: str) -> Any:
    try:
        import serial
    except ImportError as error:
        raise DeviceError(
            "an enable contact needs pyserial: pip install 'rigidimeter[serial]'"
        ) from error
    port = serial.Serial()
    port.port = name
    # Set before opening, so that pyserial lowers both lines as its first act.
    port.rts = port.dtr = False
    try:
        port.open()
    except (OSError, ValueError) as error:
        raise DeviceError(f"enable contact: port {name!r} cannot be opened: {error}") from error
    return port
