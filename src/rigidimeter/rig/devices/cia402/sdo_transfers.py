"""SDO transfers of a CiA 402 drive: each object is written and read back.

Enabling reads all of them again, because a drive that restarted in between has lost them, including
its watchdog. These functions wait; they are not for use in the loop.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Iterable, Mapping
from typing import Any

from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.devices.cia402.setup import IDENTITY, Object

NOT_THERE = {
    0x06020000: "the drive has no such object",
    0x06090011: "the drive has no such sub-index",
}
"""What the abort codes of an index and of a subindex that do not exist mean."""

SECOND_ANSWER_S = 0.05
"""A node answers within some ms; the second of two has the bus as soon as the first has sent."""


def library(name: str) -> Any:
    """Import a library that only this drive needs."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        raise DeviceError(
            f"the CiA 402 drive needs the package {name}, which is not installed: "
            "pip install 'rigidimeter[canopen]'"
        ) from None


def write_object(sdo: Any, entry: Object, who: str) -> bool:
    """Write one object; return False if it is optional and the drive does not have it.

    Raises
    ------
    DeviceError
        If the drive does not answer or refuses the value, or the object has no room for it.
    """
    try:
        data = entry.value.to_bytes(entry.size, "little", signed=entry.signed)
    except OverflowError:
        raise DeviceError(
            f"{who}: {entry.label} = {entry.value} does not fit into its {entry.size} bytes; "
            "velocity, ramps or their units in the rig file are too large"
        ) from None
    try:
        sdo.download(entry.index, entry.subindex, data)
    except library("canopen").SdoAbortedError as error:
        missing = NOT_THERE.get(error.code)
        if entry.optional and missing:
            return False
        if entry.fixed and not missing:
            return True  # `read_back` says whether it is as it must be
        why = missing or "the settings must name a value the drive takes"
        raise DeviceError(
            f"{who}: {entry.label} = {entry.value} was refused with abort code 0x{error.code:08X}; "
            f"{why}"
        ) from None
    except _silence() as error:
        raise _no_answer(entry, who, error) from None
    return True


def read_object(sdo: Any, entry: Object, who: str) -> int | None:
    """Read one object, None if it is optional and the drive does not have it.

    Raises
    ------
    DeviceError
        If the drive does not answer or does not have it.
    """
    try:
        data = sdo.upload(entry.index, entry.subindex)
    except library("canopen").SdoAbortedError as error:
        if entry.optional and error.code in NOT_THERE:
            return None
        raise DeviceError(
            f"{who}: {entry.label} cannot be read, abort code 0x{error.code:08X}; "
            f"{NOT_THERE.get(error.code, 'the drive must have this object')}"
        ) from None
    except _silence() as error:
        raise _no_answer(entry, who, error) from None
    return int.from_bytes(data[: entry.size], "little", signed=entry.signed)


def refuse_two_nodes(sdo: Any, who: str) -> None:
    """Ask one question and wait a moment for a second answer.

    Two nodes of one number would both move at each command, and answer for each other.

    Raises
    ------
    DeviceError
        If nobody answers, or two do.
    """
    read_object(sdo, IDENTITY[0], who)
    time.sleep(SECOND_ANSWER_S)
    if not sdo.responses.empty():
        raise DeviceError(
            f"{who}: two answers came to one question, so another node on the bus has this node_id "
            "too; give each node its own, or take the other off the bus"
        )


def read_text(sdo: Any, index: int, who: str) -> str:
    """Read an optional text object; empty if the drive does not have it."""
    try:
        data = bytes(sdo.upload(index, 0))
    except library("canopen").SdoAbortedError:
        return ""
    except _silence() as error:
        raise _no_answer(Object("text", index, 0, 0, 0), who, error) from None
    return data.rstrip(b"\0").decode("ascii", "replace")


def read_back(sdo: Any, written: Iterable[Object], who: str) -> Mapping[str, int]:
    """Read every object and return the values by name, without the optional ones that are absent.

    Raises
    ------
    DeviceError
        If a value is not the one that was written.
    """
    last = {(entry.index, entry.subindex): entry for entry in written}
    found: dict[str, int] = {}
    for entry in last.values():
        value = read_object(sdo, entry, who)
        if value is None:
            continue
        if (value ^ entry.value) & entry.mask:
            raise DeviceError(
                f"{who}: {entry.label} reads back as {value} where it must be {entry.value}; the "
                "drive must take this value, or the settings must name one that it takes"
            )
        found[entry.label] = value
    return found


def _silence() -> tuple[type[Exception], ...]:
    return (library("canopen").SdoCommunicationError, library("can").CanError, OSError)


def _no_answer(entry: Object, who: str, error: Exception) -> DeviceError:
    return DeviceError(
        f"{who}: no answer about {entry.label} ({error}); check power, wiring, bit rate and node_id"
    )
