"""Every object of a CiA 402 drive that the driver reads or writes, and what each is for.

Of the objects that a drive must have the table says what they do, of the optional ones what is lost
without them.
"""

from __future__ import annotations

from typing import NamedTuple

from rigidimeter.rig.devices.bounds import DriveBounds
from rigidimeter.rig.devices.cia402.drive_bounds import bound_objects, read_only
from rigidimeter.rig.devices.cia402.drive_torque import torque_objects
from rigidimeter.rig.devices.cia402.setup import (
    IDENTITY,
    Cia402Settings,
    Object,
    displayed_mode,
    inputs,
    objects,
)

DEVICE_TYPE = Object("device type", 0x1000, 0, 4, 0)
TEXTS = (
    Object("device name", 0x1008, 0, 0, 0, optional=True, lost="the name of the drive in records"),
    Object(
        *("software version", 0x100A, 0, 0, 0),
        optional=True,
        lost="a firmware that was exchanged is not noticed",
    ),
)
STATUSWORD = 0x6041
VELOCITY = 0x606C

PURPOSES = {
    0x1000: "asked for by SDO where the answer to a SYNC is lost, so that no older one counts",
    0x1016: "the drive stops by itself when the computer falls silent",
    0x1017: "the computer notices a drive that fell silent, restarted or left operation",
    0x1018: "the drive is the one that was commissioned",
    0x1400: "commands come in one frame, at every tick",
    0x1600: "what is in that frame: controlword and target velocity",
    0x1800: "statusword, mode and position come at every SYNC",
    0x1801: "velocity (and torque) come at every SYNC",
    0x1802: "a hand-held stop in the drive's inputs comes at every SYNC",
    0x1A00: "what is in the first of these frames",
    0x1A01: "what is in the second",
    0x1A02: "what is in the third",
    0x6007: "what the drive does when the computer falls silent: it stops",
    0x6040: "power on and off, and the quick stop",
    0x6041: "the state, faults, and bounds that act",
    0x605A: "the drive stays at rest after a quick stop",
    0x6060: "profile velocity mode",
    0x6061: "that the drive is in this mode",
    0x6064: "the angle of the joint",
    0x606C: "the velocity of the joint",
    0x6083: "the drive's ramp up",
    0x6084: "the drive's ramp down, which must be no slower than the guard's",
    0x6085: "the ramp of the quick stop, no slower either",
    0x60FD: "a hand-held stop; needed where `button_bit` names one",
    0x60FF: "the velocity that is commanded",
}
"""What the objects are for that a drive must have, by the index of an axis at offset 0."""


class DriveObject(NamedTuple):
    """A row: index and sub-indices, name, whether it is optional, and what it is for."""

    address: int
    subindices: tuple[int, ...]
    name: str
    optional: bool
    purpose: str


def drive_objects(
    settings: Cia402Settings, bounds: DriveBounds, with_torque: bool = True
) -> tuple[DriveObject, ...]:
    """Return a row for each object, sub-indices of one purpose together, by address."""
    used = (
        *(DEVICE_TYPE, *TEXTS, *IDENTITY, *objects(settings, with_torque)),
        *(displayed_mode(settings), inputs(settings)),
        *(*torque_objects(settings), *read_only(settings), *bound_objects(settings, bounds)),
        Object("statusword", *settings.axis(STATUSWORD), 2, 0),
        Object("velocity actual value", *settings.axis(VELOCITY), 4, 0, signed=True),
    )
    rows: dict[tuple[int, bool, str], list[Object]] = {}
    for entry in used:
        purpose = entry.lost if entry.optional else PURPOSES[_profile_index(entry, settings)]
        rows.setdefault((entry.index, entry.optional, purpose), []).append(entry)
    return tuple(
        DriveObject(
            index,
            tuple(sorted({entry.subindex for entry in entries})),
            _name(entries),
            optional,
            purpose,
        )
        for (index, optional, purpose), entries in sorted(rows.items())
    )


def _profile_index(entry: Object, settings: Cia402Settings) -> int:
    return entry.index - settings.axis_offset if entry.index >= 0x6000 else entry.index


def _name(entries: list[Object]) -> str:
    """Return the names of the entries; parts of a message are called by the message alone."""
    message = 0x1400 <= entries[0].index < 0x1B00 and "'s " in entries[0].name
    return ", ".join(
        dict.fromkeys(entry.name.split("'s ")[0] if message else entry.name for entry in entries)
    )
