"""Settings and set-up of a serial drive: requests that wait for their replies and check them."""

from __future__ import annotations

import os
from statistics import median
from typing import Literal

from pydantic import Field

from rigidimeter.core.settings import Section, quantity
from rigidimeter.rig.devices.ascii.language import (
    DISABLED_BITS,
    FAULT_BITS,
    STATUS_DISABLED,
    STATUS_FAULTS,
    Reply,
    line_time_s,
    named_bits,
    parse,
    read_request,
    set_request,
)
from rigidimeter.rig.devices.ascii.line import AsciiLine, Port
from rigidimeter.rig.devices.base import DeviceError, Now

OFF = 0
POWER_UP_BAUD = 9600
MEASURED_CYCLES = 7
MARGIN = 1.4
"""Factor on the median cycle time: a tick during an unfinished cycle sends no command."""
PATIENCE = 4.0
"""A request may take this many times the longest reply: queueing plus the reply itself."""


class AsciiDriveSettings(Section):
    """Port, scaling and limits of the drive.

    Parameters
    ----------
    port : str
        Serial port, such as ``/dev/ttyUSB0``.
    counts_per_turn : float
        Encoder counts for one turn of the joint, gear included.
    torque_nm_per_a : float
        Torque at the joint for an ampere of the motor, gear included, positive; 0 where the current
        is not read. Reading it makes a cycle longer.
    reflected_inertia_kg_m2, friction_nm : float
        Of motor and gear, seen at the joint; where the first is 0, it is not known, and the torque
        is not bounded (see `drive_bounds`).
    """

    port: str
    counts_per_turn: float = Field(gt=0.0, le=1e9, json_schema_extra={"unit": "counts"})
    baud: Literal[9600, 19200, 38400, 57600, 115200] = 115200
    sign: Literal[1, -1] = 1
    torque_nm_per_a: float = quantity(0.0, "N·m/A", 0.0, 1e5)
    reflected_inertia_kg_m2: float = quantity(0.0, "kg·m²", 0.0, 100.0)
    friction_nm: float = quantity(0.0, "N·m", 0.0, 200.0)
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
    def current_registers(self) -> tuple[int, ...]:
        """Return what is read for the torque of the motor: nothing, or its current."""
        return (0x0C,) if self.torque_nm_per_a else ()

    @property
    def lock_names(self) -> tuple[str, ...]:
        """What the drive is on, in whatever rig file; a port may have several links to it."""
        return (f"serial port {os.path.realpath(self.port)}",)

    @property
    def emulated(self) -> bool:
        """Whether the port is a pseudo-terminal, with a program at its other end."""
        return self.port.startswith("/dev/pts/")


def open_port(settings: AsciiDriveSettings) -> Port:
    """Open the port at the power-up baud rate; nothing is sent.

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


class AsciiTalk:
    """Requests that wait for their replies; not for use in the loop.

    Parameters
    ----------
    line : AsciiLine
    settings : AsciiDriveSettings
    """

    def __init__(self, line: AsciiLine, settings: AsciiDriveSettings) -> None:
        self._line = line
        self._settings = settings
        self._patience_s = PATIENCE * settings.lost_s

    def answer(self, request: str) -> Reply | None:
        """Send a request; return None if there is no valid reply."""
        text = self._line.ask(request, self._patience_s)
        reply = None if text is None else parse(text)
        return None if reply is None or reply.kind == "?" else reply

    def value(self, register: int) -> int:
        """Read a register.

        Raises
        ------
        DeviceError
            If the drive returns no value.
        """
        reply = self.answer(read_request(register))
        if reply is None or reply.kind != "v":
            raise DeviceError(
                f"drive: register 0x{register:02x} gave {_found(reply)}; expected a value"
            )
        return reply.value

    def text(self, register: int) -> str:
        """Read a text register; empty if the drive has none."""
        answer = self._line.ask(read_request(register), self._patience_s)
        return answer[2:] if answer is not None and answer.startswith("v ") else ""

    def command(self, request: str) -> None:
        """Send a request that must be acknowledged by ok.

        Raises
        ------
        DeviceError
            If it is not acknowledged.
        """
        reply = self.answer(request)
        if reply is None or reply.kind != "ok":
            raise DeviceError(f"drive: {request!r} gave {_found(reply)}; expected ok")

    def set(self, register: int, value: int) -> None:
        """Set a register and read it back.

        Raises
        ------
        DeviceError
            If the drive keeps another value.
        """
        self.command(set_request(register, value))
        found = self.value(register)
        if found != value:
            raise DeviceError(
                f"drive: register 0x{register:02x} is {found} after {value} was written; "
                "the drive does not take it"
            )

    def agree_on_baud(self) -> None:
        """Find the drive at its power-up baud rate or at the wanted one, and set the latter.

        Raises
        ------
        DeviceError
            If it answers at neither, or does not accept the rate.
        """
        line, port, baud = self._line, self._line.port, self._settings.baud
        # A break resets a drive of an earlier session to its power-up rate.
        port.send_break(0.05)
        for rate in dict.fromkeys((POWER_UP_BAUD, baud)):
            port.baudrate = rate
            if self.answer(read_request(0x90)) is not None:
                break
        else:
            raise DeviceError(
                f"drive: no answer on {self._settings.port} at {POWER_UP_BAUD} or {baud} baud; "
                "check the cable, the power and that no other program holds the drive"
            )
        if port.baudrate != baud:
            # The reply may come at either rate, so it is ignored.
            line.ask(set_request(0x90, baud), self._patience_s)
            port.baudrate = baud
        found = self.answer(read_request(0x90))
        if found is None or found.value != baud:
            raise DeviceError(
                f"drive: the baud rate is {'unknown' if found is None else found.value} "
                f"after it was set; expected {baud}"
            )

    def clear_faults(self) -> int:
        """Clear the latched faults of a drive without power; return what was latched.

        Raises
        ------
        DeviceError
            If a fault remains.
        """
        latched = self.value(0xA4)
        if latched:
            self.command(set_request(0xA4, latched))
        status = self.value(0xA0)
        if status & STATUS_FAULTS:
            raise DeviceError(
                f"drive: event status 0x{status:x} has a fault that does not clear "
                f"({named_bits(status, FAULT_BITS)}); remove its cause and configure again"
            )
        return latched

    def write_profile(self, acceleration: float, deceleration: float) -> float:
        """Set zero velocity, absolute trapezoids and the ramps in counts/s².

        Returns
        -------
        float
            The deceleration as the drive rounds it.
        """
        self.set(0x2F, 0)
        self.set(0xCB, 0)
        self.set(0xC8, 0)
        moves, velocity = (max(1, round(deceleration / unit)) for unit in (10.0, 1000.0))
        for register, value in (
            (0xCC, max(1, round(acceleration / 10.0))),
            (0xCD, moves),
            (0xCF, moves),
            (0x36, max(1, round(acceleration / 1000.0))),
            (0x37, velocity),
        ):
            self.set(register, value)
        return 10.0 * moves if self._settings.mode == "moves" else 1000.0 * velocity

    def energise(self, state_on: int, max_counts: float) -> None:
        """Write zero velocity and the present position as target, read them back, then energise.

        Parameters
        ----------
        state_on : int
            The desired state of an enabled drive.
        max_counts : float
            Largest movement allowed meanwhile.

        Raises
        ------
        DeviceError
            If a target is not zero, or the drive does not start at rest.
        """
        state = self.value(0x24)
        if state != OFF:
            raise DeviceError(f"drive: desired state is {state} before enable; expected 0")
        self.set(0x2F, 0)
        self.set(0xCB, 0)
        before = self.value(0x32)
        self.set(0xCA, before)
        self.command(set_request(0x24, state_on))
        state, status = self.value(0x24), self.value(0xA0)
        if state != state_on or status & (STATUS_FAULTS | STATUS_DISABLED):
            why = named_bits(status, FAULT_BITS | DISABLED_BITS) or "no reason given"
            raise DeviceError(
                f"drive: desired state {state}, event status 0x{status:x} after enable ({why}); "
                f"expected state {state_on} without these bits"
            )
        moved = self.value(0x32) - before
        if abs(moved) > max_counts:
            raise DeviceError(f"drive: moved {moved} counts on enable; it must stand still")

    def measured_cycle_s(self, now: Now) -> float:
        """Return the time to allow for a cycle, measured with requests of the same length.

        Raises
        ------
        DeviceError
            If the drive stops answering.
        """
        line = self._line
        commands: tuple[str, ...] = (set_request(0xCA, -100_000), set_request(0xCB, 100_000), "t 0")
        if self._settings.mode == "velocity":
            commands = (set_request(0x2F, 0),)
        asked = (0x32, 0x18, *self._settings.current_registers, 0xA0)
        cycle = (*commands, *map(read_request, asked))
        taken_s = []
        for _ in range(MEASURED_CYCLES):
            began_s = now()
            line.submit(*cycle)
            if not line.wait(len(cycle) * self._patience_s):
                raise DeviceError("drive: stopped answering while its speed was measured")
            taken_s.append(now() - began_s)
        line.drop()
        self.set(0xCB, 0)
        # Never shorter than the time that the characters take.
        replies = len(commands) * len("ok\r") + len(asked) * len("v -1234567\r")
        sent = sum(len(request) + 1 for request in cycle)
        return max(MARGIN * median(taken_s), line_time_s(sent + replies, self._settings.baud))


def _found(reply: Reply | None) -> str:
    if reply is None:
        return "no answer"
    return f"error {reply.value}" if reply.kind == "e" else reply.kind
