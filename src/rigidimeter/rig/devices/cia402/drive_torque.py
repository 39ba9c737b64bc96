"""The torque that a drive reports of its motor: whether it can be had, and its scale.

0x6077 is the actual torque in thousandths of the motor's rated torque, 0x6076 that rated torque in
mN·m (CiA 402-2). At the joint, with the gear and the sign of the drive,

    torque = 0x6077 / 1000 · 0x6076 / 1000 · gear_ratio · sign

Both objects are optional, and so is room for the torque in the velocity frame.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rigidimeter.rig.devices.cia402.sdo_transfers import read_object
from rigidimeter.rig.devices.cia402.setup import Cia402Settings, Object, objects

FACT = "drive's torque"
"""The name under which the facts say why there is none."""


def torque_objects(settings: Cia402Settings) -> tuple[Object, Object]:
    """Return rated and actual torque; read, never written."""
    rated = Object("motor rated torque", *settings.axis(0x6076), 4, 0, optional=True)
    actual = Object("actual torque", *settings.axis(0x6077), 2, 0, signed=True, optional=True)
    return (
        replace(rated, lost="the drive's torque as a second witness, and the bound of the torque"),
        replace(actual, lost="the drive's torque as a second witness of the torque sensor"),
    )


def torque_entries(settings: Cia402Settings) -> tuple[Object, ...]:
    """Return the objects that differ where the velocity frame has the torque."""
    without = set(objects(settings))
    return tuple(entry for entry in objects(settings, True) if entry not in without)


def find_rated_torque(sdo: Any, settings: Cia402Settings, who: str) -> tuple[float, str]:
    """Return the rated torque at the joint in N·m, with its sign; 0 and why if there is none.

    Raises
    ------
    DeviceError
        If the drive does not answer.
    """
    if not settings.reads_torque:
        return 0.0, "not read: reads_torque is false"
    rated, actual = (read_object(sdo, entry, who) for entry in torque_objects(settings))
    for value, name in ((rated, "0x6076"), (actual, "0x6077")):
        if value is None:
            return 0.0, f"not available: the drive has no {name}"
    if not rated:
        return 0.0, "not available: the rated torque (0x6076) is 0"
    return rated * 1e-3 * settings.gear_ratio * settings.sign, ""


def is_in_frame(sdo: Any, settings: Cia402Settings, who: str) -> bool:
    """Return whether the drive took the torque into its velocity frame."""
    return all(read_object(sdo, entry, who) == entry.value for entry in torque_entries(settings))
