"""Statuswords and controlwords of CiA 402, and the frames of CANopen; no bus access.

The state is coded in six bits of the statusword (0x6041), and transitions are commanded by bits of
the controlword (0x6040):

    switch-on disabled --0x06--> ready --0x07--> switched on --0x0F--> operation enabled
            ^                                                              | 0x02
            +---------------- 0x00, from anywhere ------------- quick stop active

A frame of n data bytes takes at most 8n + 47 + ⌊(34 + 8n − 1)/4⌋ bit times on the wire, stuff bits
and interframe space included.

References
----------
CiA 301, CANopen application layer and communication profile.
CiA 402-2 (IEC 61800-7-201), drives and motion control: finite state automaton.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple

PROFILE_VELOCITY = 3
"""The mode of operation, 0x6060 and 0x6061."""

SYNC_ID = 0x080
BOOTED, STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0x00, 0x04, 0x05, 0x7F
"""NMT states in a node's heartbeat."""

TICK_FRAMES, TICK_FRAMES_WITH_TORQUE = (6, 0, 7, 4), (6, 0, 7, 6)
"""Data bytes of the frames of one tick: command, SYNC, position, velocity."""

INPUTS_BYTES = 4
"""Data bytes of the frame of a hand-held stop, one more a tick."""

HIGHEST_LOAD = 0.7

INTERNAL_LIMIT, SLIPPED = 1 << 11, 1 << 13
"""Bits of the statusword: a bound of the drive acts; the slippage is above its maximum."""


class Cia402State(IntEnum):
    """State of the drive's finite state automaton; UNKNOWN if the bits code none."""

    UNKNOWN = 0
    NOT_READY = 1
    SWITCH_ON_DISABLED = 2
    READY = 3
    SWITCHED_ON = 4
    OPERATION_ENABLED = 5
    QUICK_STOP_ACTIVE = 6
    FAULT_REACTION = 7
    FAULT = 8

    @property
    def words(self) -> str:
        """The name in the standard."""
        return _WORDS[self]


_WORDS = {
    Cia402State.UNKNOWN: "an unknown state",
    Cia402State.NOT_READY: "not ready to switch on",
    Cia402State.SWITCH_ON_DISABLED: "switch-on disabled",
    Cia402State.READY: "ready to switch on",
    Cia402State.SWITCHED_ON: "switched on",
    Cia402State.OPERATION_ENABLED: "operation enabled",
    Cia402State.QUICK_STOP_ACTIVE: "quick stop active",
    Cia402State.FAULT_REACTION: "fault reaction active",
    Cia402State.FAULT: "fault",
}


class Control(IntEnum):
    """Controlwords."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80


class Nmt(IntEnum):
    """Network management commands."""

    START = 0x01
    PRE_OPERATIONAL = 0x80


POWERED = (
    Cia402State.UNKNOWN,
    Cia402State.OPERATION_ENABLED,
    Cia402State.QUICK_STOP_ACTIVE,
    Cia402State.FAULT_REACTION,
)
"""States in which the drive may turn the motor; in all others its torque is off."""

NEXT_CONTROL = {
    Cia402State.SWITCH_ON_DISABLED: Control.SHUTDOWN,
    Cia402State.READY: Control.SWITCH_ON,
    Cia402State.SWITCHED_ON: Control.ENABLE_OPERATION,
    Cia402State.OPERATION_ENABLED: Control.ENABLE_OPERATION,
}
"""The controlword for the next step toward operation, from the states that have one."""


def state_of(statusword: int) -> Cia402State:
    """Return the state that a statusword codes.

    >>> state_of(0x0637)
    <Cia402State.OPERATION_ENABLED: 5>
    """
    return _STATES[statusword & 0x6F]


def _coded(bits: int) -> Cia402State:
    # Bit 5 (quick stop) is not defined in the first two states and in the two fault states.
    short = bits & 0x4F
    if short == 0x00:
        return Cia402State.NOT_READY
    if short == 0x40:
        return Cia402State.SWITCH_ON_DISABLED
    if short == 0x0F:
        return Cia402State.FAULT_REACTION
    if short == 0x08:
        return Cia402State.FAULT
    return {
        0x21: Cia402State.READY,
        0x23: Cia402State.SWITCHED_ON,
        0x27: Cia402State.OPERATION_ENABLED,
        0x07: Cia402State.QUICK_STOP_ACTIVE,
    }.get(bits, Cia402State.UNKNOWN)


_STATES = tuple(_coded(bits) for bits in range(0x70))


class Frames(NamedTuple):
    """Identifiers of one node's frames in the predefined connection set."""

    command: int
    position: int
    velocity: int
    emergency: int
    heartbeat: int
    sdo_request: int
    sdo_answer: int
    inputs: int


def frames(node_id: int) -> Frames:
    """Return the identifiers of a node's frames."""
    return Frames(
        command=0x200 + node_id,
        position=0x180 + node_id,
        velocity=0x280 + node_id,
        emergency=0x080 + node_id,
        heartbeat=0x700 + node_id,
        sdo_request=0x600 + node_id,
        sdo_answer=0x580 + node_id,
        inputs=0x380 + node_id,
    )


_COMMAND = struct.Struct("<Hi")
_POSITION = struct.Struct("<Hbi")
_VELOCITY, _VELOCITY_TORQUE = struct.Struct("<i"), struct.Struct("<ih")
_EMERGENCY = struct.Struct("<HB")
_SDO = struct.Struct("<BHBI")
_INPUTS = struct.Struct("<I")


def command_bytes(control: int, target: int) -> bytes:
    """Return the data of the command frame: controlword and target velocity."""
    return _COMMAND.pack(control, target)


def position_of(data: bytes | bytearray) -> tuple[int, int, int] | None:
    """Return statusword, mode and position of a position frame, None if it is damaged."""
    return _POSITION.unpack(data) if len(data) == _POSITION.size else None


def velocity_of(data: bytes | bytearray) -> int | None:
    """Return the velocity of a velocity frame, None if it is damaged."""
    return int(_VELOCITY.unpack(data)[0]) if len(data) == _VELOCITY.size else None


def inputs_of(data: bytes | bytearray) -> int | None:
    """Return the digital inputs of their frame, None if it is damaged."""
    return int(_INPUTS.unpack(data)[0]) if len(data) == _INPUTS.size else None


def velocity_torque_of(data: bytes | bytearray) -> tuple[int, int] | None:
    """Return velocity and torque of a velocity frame with both, None if it is damaged."""
    return _VELOCITY_TORQUE.unpack(data) if len(data) == _VELOCITY_TORQUE.size else None


class Emergency(NamedTuple):
    """Content of an emergency frame; code 0 revokes earlier ones."""

    code: int
    register: int


UNREADABLE = 0x1000
"""The code of an emergency frame whose own cannot be read: CiA 301's generic error."""


def emergency(data: bytes | bytearray) -> Emergency:
    """Return the code and the error register of an emergency frame.

    A frame of another length than 8 bytes is an emergency all the same: a drive sends this
    identifier for nothing else. Only a whole one revokes, and what one lacks is `UNREADABLE`.
    """
    if len(data) == 8:
        return Emergency(*_EMERGENCY.unpack_from(data))
    code = int.from_bytes(data[:2], "little") if len(data) >= 2 else 0
    return Emergency(code or UNREADABLE, data[2] if len(data) > 2 else 0)


def sdo_write_bytes(index: int, subindex: int, value: int, size: int) -> bytes:
    """Return the data of an expedited SDO write."""
    return _SDO.pack(0x23 | (4 - size) << 2, index, subindex, value)


def sdo_read_bytes(index: int, subindex: int) -> bytes:
    """Return the data of an SDO read."""
    return _SDO.pack(0x40, index, subindex, 0)


class SdoAnswer(NamedTuple):
    """Index of the object of an SDO answer, and its value if one was read."""

    object: int
    value: int | None


def sdo_answer(data: bytes | bytearray) -> SdoAnswer | None:
    """Return the content of an SDO answer, None if it is damaged."""
    if len(data) != 8:
        return None
    head, index, _, value = _SDO.unpack(data)
    return SdoAnswer(index, value if head & 0xE2 == 0x42 else None)


def frame_bits(data_bytes: int) -> int:
    """Return the largest number of bit times of a frame with an 11-bit identifier.

    >>> frame_bits(8)
    135
    """
    return 8 * data_bytes + 47 + (34 + 8 * data_bytes - 1) // 4


def fastest_tick_rate_hz(bitrate: float, data_bytes: Iterable[int] = TICK_FRAMES) -> float:
    """Return the tick rate at which these frames use the bus up to `HIGHEST_LOAD`."""
    return HIGHEST_LOAD * bitrate / sum(frame_bits(n) for n in data_bytes)
