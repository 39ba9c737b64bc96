"""Questions and answers (SDO) with a CANopen node: every one may be refused, and none may be lost.

They wait for the answer, so they belong before the loop, never into it.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from typing import Any

from rigidimeter.devices.base import DeviceError
from rigidimeter.devices.cia402.setup import Object

__all__ = ["get", "library", "put", "read_back", "text"]

NOT_THERE = (0x06020000, 0x06090011)
"""The abort codes of an index and of a subindex that do not exist."""


def library(name: str) -> Any:
    """Return a library that only this drive needs."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        raise DeviceError(
            f"the CiA 402 drive needs the package {name}, which is not installed: "
            "pip install 'rigidimeter[canopen]'"
        ) from None


def put(sdo: Any, entry: Object, who: str) -> bool:
    """Write one object; return False if it is optional and the drive does not have it.

    Raises
    ------
    DeviceError
        If the drive does not answer or does not take it.
    """
    data = entry.value.to_bytes(entry.size, "little", signed=entry.signed)
    try:
        sdo.download(entry.index, entry.subindex, data)
    except library("canopen").SdoAbortedError as error:
        if entry.optional and error.code in NOT_THERE:
            return False
        raise DeviceError(
            f"{who}: {entry.label} = {entry.value} was refused with abort code 0x{error.code:08X}; "
            "the settings must name a value the drive takes"
        ) from None
    except _silence() as error:
        raise _no_answer(entry, who, error) from None
    return True


def get(sdo: Any, entry: Object, who: str) -> int | None:
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
            f"{who}: {entry.label} cannot be read, abort code 0x{error.code:08X}; the drive must "
            "have this object"
        ) from None
    except _silence() as error:
        raise _no_answer(entry, who, error) from None
    return int.from_bytes(data[: entry.size], "little", signed=entry.signed)


def text(sdo: Any, index: int, who: str) -> str:
    """Read a text that a drive may have, empty if it has not."""
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
    kept = {(entry.index, entry.subindex): entry for entry in written}
    found: dict[str, int] = {}
    for entry in kept.values():
        value = get(sdo, entry, who)
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
