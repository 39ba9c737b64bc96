"""Frames to and from an interface of python-can; what cannot be sent or received is counted."""

from __future__ import annotations

import select
from collections.abc import Iterable
from typing import Any

from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.devices.cia402.sdo_transfers import library
from rigidimeter.rig.devices.cia402.setup import Cia402Settings


class CanPort:
    """One interface; `open` it first.

    Parameters
    ----------
    settings : Cia402Settings
    who : str
        Name of the drive in error messages.
    counts : dict of str to int
        Of `damaged` and `unsent` frames; added to.

    Attributes
    ----------
    bus : can.BusABC or None
        None while it is not open.
    """

    def __init__(self, settings: Cia402Settings, who: str, counts: dict[str, int]) -> None:
        self._settings, self._who, self._counts = settings, who, counts
        self._can: Any = None
        self.bus: Any = None
        self._ready: select.poll | None = None  # says whether something has come
        self._room: select.poll | None = None  # says whether something can be sent

    @property
    def is_open(self) -> bool:
        """Whether the bus is open."""
        return self.bus is not None

    def open(self) -> None:
        """Open the bus.

        Raises
        ------
        DeviceError
            If python-can cannot open it.
        """
        library("canopen")
        self._can = can = library("can")
        settings = self._settings
        more = {"port": settings.port} if settings.interface == "udp_multicast" else {}
        try:
            self.bus = can.Bus(
                interface=settings.interface,
                channel=settings.channel,
                bitrate=settings.bitrate,
                ignore_config=True,
                **more,
            )
        except Exception as error:  # each interface raises what its vendor's library does
            raise DeviceError(
                f"{self._who}: the bus does not open ({error}); check interface, channel and that "
                "the operating system has brought the bus up"
            ) from None
        try:
            self._ready, self._room = select.poll(), select.poll()
            self._ready.register(self.bus.fileno(), select.POLLIN)
            self._room.register(self.bus.fileno(), select.POLLOUT)
        except NotImplementedError:  # no file behind it: what has come is in a queue of its own
            self._ready = self._room = None

    def close(self) -> None:
        """Close the bus."""
        bus, self.bus = self.bus, None
        if bus is not None:
            bus.shutdown()

    def message(self, identifier: int, data: bytes = b"") -> Any:
        """Return a frame, to be sent once or again."""
        return self._can.Message(
            arbitration_id=identifier, data=bytearray(data), is_extended_id=False
        )

    def send(self, message: Any) -> bool:
        """Send a frame without waiting; return whether the interface took it."""
        try:
            # python-can waits, whatever its timeout, for a serial adapter that takes nothing.
            if self._room is not None and not self._room.poll(0):
                raise BlockingIOError
            self.bus.send(message, timeout=0)
        except (self._can.CanError, OSError):
            # Not raised: the drive will not answer a frame it did not receive and counts as lost.
            self._counts["unsent"] += 1
            return False
        return True

    def receive(self, wait_s: float) -> tuple[bool, Any]:
        """Return whether something came within `wait_s`, and the frame, None if it has no data."""
        if self.bus is None:
            return False, None
        try:
            if self._ready is not None:
                # An adapter's own messages give no frame, although more has come behind them.
                if not self._ready.poll(1e3 * wait_s):
                    return False, None
                wait_s = 0.0
            message = self.bus.recv(wait_s)
        except (self._can.CanError, OSError, ValueError, IndexError):
            self._counts["damaged"] += 1
            return True, None
        if message is None:
            return self._ready is not None, None
        if message.is_error_frame or message.is_remote_frame or message.is_extended_id:
            self._counts["damaged"] += message.is_error_frame
            return True, None
        return True, message

    def notifier(self, listeners: Iterable[Any], timeout_s: float) -> Any:
        """Return a thread of python-can that hands each frame to the listeners until its `stop`."""
        return self._can.Notifier(self.bus, listeners, timeout_s)
