"""What of a drive fits the driver, by the drive's EDS (CiA 306), before it is on the bus.

An EDS lists a drive's objects with type, access and limits. It does not say what the drive does:
commissioning tries that.
"""

from __future__ import annotations

import io
import logging
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import TABLE_BYTES, read_bytes
from rigidimeter.rig.devices.bounds import DriveBounds
from rigidimeter.rig.devices.cia402.drive_bounds import bound_objects
from rigidimeter.rig.devices.cia402.drive_torque import FACT, torque_entries, torque_objects
from rigidimeter.rig.devices.cia402.sdo_transfers import library
from rigidimeter.rig.devices.cia402.setup import (
    IDENTITY,
    INVALID,
    Cia402Settings,
    Object,
    displayed_mode,
    inputs,
    objects,
)


class EdsMatch(NamedTuple):
    """One object: its name and address, whether it fits, what the EDS says, what must be.

    `lost` is what is lost without it, where it is optional and not there.
    """

    label: str
    fits: bool
    found: str
    needed: str
    lost: str = ""


def compare_eds(
    path: Path, settings: Cia402Settings, bounds: DriveBounds | None = None
) -> list[EdsMatch]:
    """Compare an EDS with what the driver writes, reads and maps with these settings.

    Bounds are compared too where they are given.

    Raises
    ------
    UserError
        If the file cannot be read.
    """
    library("canopen")
    reader = library("canopen.objectdictionary.eds")
    reader.logger.setLevel(logging.ERROR)  # what is missing is told below
    content = read_bytes(path, TABLE_BYTES)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", "replace")
    try:
        described = reader.import_eds(io.StringIO(text), settings.node_id)
    except Exception as error:  # configparser's, and whatever a wrong value makes of it
        reason = " ".join(str(error).split())
        raise UserError(
            f"{path}: cannot be read as an EDS ({reason}); it must be the drive's own, with a "
            "section for each object, such as [6040]"
        ) from None
    if 0x1000 not in described:
        raise UserError(f"{path}: is no EDS: it must have a section [1000], as every node has")
    lacking = _lacking_torque(described, settings)
    # What is written last remains.
    last = {(entry.index, entry.subindex): entry for entry in objects(settings, lacking is None)}
    found = [_written(entry, described) for entry in last.values()]
    found += [] if lacking is None else [lacking]
    if bounds is not None:
        held = (o for o in bound_objects(settings, bounds) if (o.index, o.subindex) not in last)
        found += [_written(entry, described) for entry in held]
    read = (IDENTITY[0], displayed_mode(settings), inputs(settings))
    found += [_read(entry, described) for entry in read]
    return found + [
        _mapped(entry, described)
        for entry in last.values()
        if entry.index & 0xFE00 in (0x1600, 0x1A00) and entry.subindex and _free(entry, described)
    ]


def _lacking_torque(described: Any, settings: Cia402Settings) -> EdsMatch | None:
    """Return why the drive's own torque is not read, None if it is."""
    if not settings.reads_torque:
        return EdsMatch(FACT, True, "reads_torque is false", "optional")
    read = (replace(entry, optional=False) for entry in torque_objects(settings))
    entries = torque_entries(settings)
    needed = [_read(entry, described) for entry in read]
    needed += [_written(replace(entry, optional=False), described) for entry in entries]
    needed += [
        _mapped(entry, described) for entry in entries if entry.subindex and _free(entry, described)
    ]
    first = next((match for match in needed if not match.fits), None)
    lost = torque_objects(settings)[1].lost
    return first and first._replace(fits=True, needed="optional", lost=lost)


def _free(entry: Object, described: Any) -> bool:
    variable = _variable(described, entry.index, entry.subindex)
    return variable is not None and bool(variable.writable)


def _variable(described: Any, index: int, subindex: int) -> Any:
    """Return an object of the EDS, None if there is none."""
    entry = described.get(index)
    members = getattr(entry, "subindices", None)
    if members is None:
        return None if subindex else entry
    # An array may list its first entry for all of them (CompactSubObj).
    if subindex > 1 and set(members) == {0, 1} and hasattr(entry, "last_subindex"):
        return entry[subindex]
    return members.get(subindex)


def _missing(entry: Object, described: Any) -> EdsMatch:
    found = "no such sub-index" if entry.index in described else "no such object"
    needed = "optional" if entry.optional else "needed"
    return EdsMatch(entry.label, entry.optional, found, needed, entry.lost)


def _read(entry: Object, described: Any) -> EdsMatch:
    variable = _variable(described, entry.index, entry.subindex)
    if variable is None:
        return _missing(entry, described)
    return EdsMatch(entry.label, variable.readable, variable.access_type, "readable")


def _written(entry: Object, described: Any) -> EdsMatch:
    variable = _variable(described, entry.index, entry.subindex)
    if variable is None:
        return _missing(entry, described)
    if len(variable) != 8 * entry.size:
        return EdsMatch(entry.label, False, f"{len(variable)} bits", f"{8 * entry.size} bits")
    if not (variable.writable and variable.readable):
        default = variable.default
        fixed = entry.fixed and variable.readable and default is not None
        fits = fixed and not (default ^ entry.value) & entry.mask
        found = f"{variable.access_type}, {_number(entry, default)}"
        return EdsMatch(entry.label, fits, found, f"rw, or fixed at {_number(entry, entry.value)}")
    low, high = variable.min, variable.max
    inside = (low is None or entry.value >= low) and (high is None or entry.value <= high)
    if not inside:
        found = f"{_number(entry, low)} to {_number(entry, high)}"
        return EdsMatch(entry.label, False, found, f"takes {_number(entry, entry.value)}")
    return EdsMatch(entry.label, True, variable.access_type, f"takes {_number(entry, entry.value)}")


def _mapped(entry: Object, described: Any) -> EdsMatch:
    index, subindex, bits = entry.value >> 16, entry.value >> 8 & 0xFF, entry.value & 0xFF
    label = f"0x{index:04X}:{subindex:02X} in a frame"
    variable = _variable(described, index, subindex)
    if variable is None:
        return EdsMatch(label, False, "no such object", f"{bits} bits")
    found = f"{len(variable)} bits" + ("" if variable.pdo_mappable else ", not to be mapped")
    return EdsMatch(label, variable.pdo_mappable and len(variable) == bits, found, f"{bits} bits")


def _number(entry: Object, value: int | None) -> str:
    if value is None:
        return "no value"
    return (
        f"0x{value:X}" if value >= INVALID or entry.fixed or entry.index == 0x1016 else f"{value}"
    )
