"""The object dictionary of the emulated servo.

As in the predefined connection set, there is one command PDO (0x1400) and there are three
measurement PDOs (0x1800 to 0x1802), with mappings that the master may change.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

NAME = "emulated servo"
COMMAND_MESSAGES = (0x1400,)
MEASUREMENT_MESSAGES = (0x1800, 0x1801, 0x1802)
I8, I16, I32, U8, U16, U32, TEXT = 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x09
INVALID = 1 << 31
PROFILE_VELOCITY, PROFILE_VELOCITY_ONLY = 3, 0x04


@dataclass(frozen=True)
class Entry:
    """One object: index, subindex, name, type, and what a master may do with it."""

    index: int
    subindex: int
    name: str
    kind: int
    access: str = "rw"
    default: int | str = 0


def _entries(node_id: int, rated_torque_mnm: int | None) -> tuple[Entry, ...]:
    torque = (
        ()
        if rated_torque_mnm is None
        else (
            Entry(0x6076, 0, "motor rated torque in mN·m", U32, "const", rated_torque_mnm),
            Entry(0x6077, 0, "actual torque in thousandths of it", I16, "ro"),
        )
    )
    return (
        Entry(0x1000, 0, "device type", U32, "const", 0x00020192),
        Entry(0x1001, 0, "error register", U8, "ro"),
        Entry(0x1005, 0, "SYNC identifier", U32, "rw", 0x80),
        Entry(0x1008, 0, "device name", TEXT, "const", NAME),
        Entry(0x100A, 0, "software version", TEXT, "const", "1.0"),
        Entry(0x1014, 0, "emergency identifier", U32, "ro", 0x80 + node_id),
        Entry(0x1016, 0, "number of heartbeats", U8, "const", 1),
        Entry(0x1016, 1, "heartbeat 1", U32),
        Entry(0x1017, 0, "heartbeat time", U16),
        Entry(0x1018, 0, "number of identities", U8, "const", 4),
        Entry(0x1018, 1, "vendor", U32, "const", 0x0000_0402),
        Entry(0x1018, 2, "product", U32, "const", 1),
        Entry(0x1018, 3, "revision", U32, "const", 0x0001_0000),
        Entry(0x1018, 4, "serial", U32, "const", 1000 + node_id),
        *_message(0x1400, 0x200 + node_id, (0x6040_0010,)),
        *_message(0x1800, 0x180 + node_id, (0x6041_0010,)),
        *_message(0x1801, INVALID | 0x280 + node_id, ()),
        *_message(0x1802, INVALID | 0x380 + node_id, ()),
        Entry(0x6007, 0, "abort-connection option", I16, "rw", 1),
        Entry(0x603F, 0, "error code", U16, "ro"),
        Entry(0x6040, 0, "controlword", U16),
        Entry(0x6041, 0, "statusword", U16, "ro"),
        Entry(0x605A, 0, "quick-stop option", I16, "rw", 2),
        Entry(0x6060, 0, "mode of operation", I8),
        Entry(0x6061, 0, "mode of operation display", I8, "ro"),
        Entry(0x6064, 0, "actual position", I32, "ro"),
        Entry(0x606C, 0, "actual velocity", I32, "ro"),
        *torque,
        Entry(0x6072, 0, "max torque", U16, "rw", 0xFFFF),
        Entry(0x6073, 0, "max current", U16, "rw", 0xFFFF),
        Entry(0x607C, 0, "home offset", I32),
        Entry(0x607D, 0, "number of position limits", U8, "const", 2),
        Entry(0x607D, 1, "min position limit", I32),
        Entry(0x607D, 2, "max position limit", I32),
        Entry(0x607F, 0, "max profile velocity", U32, "rw", 0xFFFF_FFFF),
        Entry(0x6080, 0, "max motor speed", U32, "rw", 0xFFFF_FFFF),
        Entry(0x6083, 0, "profile acceleration", U32, "rw", 1_000_000),
        Entry(0x6084, 0, "profile deceleration", U32, "rw", 1_000_000),
        Entry(0x6085, 0, "quick-stop deceleration", U32, "rw", 1_000_000),
        Entry(0x60F8, 0, "max slippage", I32, "rw", 2**31 - 1),
        Entry(0x60FD, 0, "digital inputs", U32, "ro"),
        Entry(0x60FF, 0, "target velocity", I32),
        Entry(0x6502, 0, "supported modes", U32, "const", PROFILE_VELOCITY_ONLY),
    )


def _message(index: int, identifier: int, mapped: tuple[int, ...]) -> tuple[Entry, ...]:
    slots = (*mapped, *(0,) * 8)[:8]
    return (
        Entry(index, 0, "highest subindex", U8, "const", 5),
        Entry(index, 1, "identifier", U32, "rw", identifier),
        Entry(index, 2, "transmission type", U8, "rw", 255),
        Entry(index, 3, "inhibit time", U16),
        Entry(index, 5, "event timer", U16),
        Entry(index + 0x200, 0, "number of entries", U8, "rw", len(mapped)),
        *(Entry(index + 0x200, k, f"entry {k}", U32, "rw", s) for k, s in enumerate(slots, 1)),
    )


def dictionary(
    objectdictionary: Any,
    node_id: int,
    rated_torque_mnm: int | None = None,
    without: Collection[int] = (),
) -> Any:
    """Return the object dictionary, made with `canopen.objectdictionary`.

    Without a rated torque the drive has no object of its torque; `without` names further objects
    that it does not have.
    """
    made = objectdictionary.ObjectDictionary()
    every = _entries(node_id, rated_torque_mnm)
    entries = [entry for entry in every if entry.index not in without]
    several = {entry.index for entry in entries if entry.subindex}
    for entry in entries:
        variable = objectdictionary.ODVariable(entry.name, entry.index, entry.subindex)
        variable.data_type, variable.access_type = entry.kind, entry.access
        variable.default = entry.default
        if entry.index not in several:
            made.add_object(variable)
            continue
        if entry.index not in made:
            made.add_object(objectdictionary.ODRecord(f"object 0x{entry.index:04X}", entry.index))
        made[entry.index].add_member(variable)
    return made
