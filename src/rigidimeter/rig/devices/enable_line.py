"""A contact in the drive's hardware enable circuit, switched by a line of a serial port.

RTS or DTR of a serial port drives a relay whose contact is in the drive's enable circuit, in series
with the emergency stop. Opening it removes the power whatever the state of the drive's software,
also when commands no longer reach the drive.

What it does and does not do, on Linux:

- When the process exits or is killed, the kernel closes the port and drops both lines (the port's
  HUPCL flag, which is set). The contact opens.
- When the process is stopped or hangs, the line stays as it is. This contact is no watchdog; that
  takes a relay that opens when pulses cease.
- Opening the port raises both lines briefly before the driver can lower them. Choose a relay that
  does not respond to so short a pulse, and close the emergency stop last.
- Adapters differ: some keep their lines up when the cable is unplugged from the computer while the
  adapter still has power. Test it at commissioning: unplug the cable, and kill the process.

There is no feedback: only the drive's status shows that the relay opened.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from typing import Any, ClassVar, Literal, Protocol

from rigidimeter.core.settings import Section
from rigidimeter.rig.devices.base import DeviceError, Now


class EnableLine(Protocol):
    """A contact without which the drive has no power."""

    def close_contact(self) -> None:
        """Allow the drive to be energised."""

    def open_contact(self) -> None:
        """Remove the power; safe at any time and when repeated."""

    def close(self) -> None:
        """Open the contact and close the port; safe when repeated."""


class SerialEnableLineSettings(Section):
    """The serial port and line that drive the relay.

    Parameters
    ----------
    port : str
        Serial port, such as ``/dev/ttyS0``; not the one that carries the drive's commands.
    line : {"rts", "dtr"}
    """

    port: str
    line: Literal["rts", "dtr"] = "rts"

    @property
    def lock_names(self) -> tuple[str, ...]:
        """What the contact is on, in whatever rig file."""
        return (f"serial port {os.path.realpath(self.port)}",)


class SerialEnableLine:
    """A relay on RTS or DTR of a dedicated serial port.

    The port is opened by the first `close_contact`, not before.

    Parameters
    ----------
    settings : SerialEnableLineSettings
    now : callable
        Not used; all drivers take it.
    serial_port : callable, optional
        Replaces the opening of the port: takes its name and returns an object with the attributes
        `rts` and `dtr` and the method `close`.
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
            If pyserial is missing, or the line cannot be set; the contact is then open.
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
        """Lower the line; if that fails, close the port, which lowers it too."""
        if self._port is None:
            return
        try:
            setattr(self._port, self._line, False)
        except OSError:
            self.close()

    def close(self) -> None:
        """Open the contact and close the port; safe when repeated."""
        port, self._port = self._port, None
        if port is None:
            return
        # If the line cannot be set, closing the port makes the kernel lower it.
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
    # Set before opening, so that pyserial lowers both lines first.
    port.rts = port.dtr = False
    try:
        port.open()
    except (OSError, ValueError) as error:
        raise DeviceError(f"enable contact: port {name!r} cannot be opened: {error}") from error
    return port
