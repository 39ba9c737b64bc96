"""RIG.toml: the devices of a rig, each with the settings of its driver.

    name = "elbow rig, room 12"
    home_deg = 0.0             # where the joint must be to be enabled, on the drive's scale
    home_tolerance_deg = 3.0
    absolute_angle = true      # the drive's angle means the same place after its power was off

    [torque_sensor]
    driver = "ati-rdt"
    address = "192.168.1.1"

    [drive]
    driver = "cia402"
    channel = "can0"

A driver is one of the names in `DRIVERS`, or ``package.module:Class``. A driver class has its
settings class as `Settings` and is created by ``Class(settings, now)``.
"""

from __future__ import annotations

import hashlib
import importlib
import inspect
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import read_toml
from rigidimeter.core.settings import validated
from rigidimeter.rig.devices.base import DeviceFacts, Now
from rigidimeter.rig.devices.bounds import DriveBounds
from rigidimeter.rig.devices.composed import ComposedRig, Home
from rigidimeter.rig.devices.rig_lock import RigLock

DRIVERS: Mapping[str, Mapping[str, str]] = {
    "torque_sensor": {
        "ati-rdt": "rigidimeter.rig.devices.ati.rdt:AtiRdt",
        "ati-analogue": "rigidimeter.rig.devices.ati.analogue:AtiAnalogue",
    },
    "drive": {
        "cia402": "rigidimeter.rig.devices.cia402.drive:Cia402Drive",
        "ascii": "rigidimeter.rig.devices.ascii.drive:AsciiDrive",
    },
    "enable_line": {"serial-line": "rigidimeter.rig.devices.enable_line:SerialEnableLine"},
}
"""The built-in drivers, by role and name."""

METHODS: Mapping[str, tuple[str, ...]] = {
    "torque_sensor": ("connect", "configure", "read", "counts", "close"),
    "drive": (
        *("connect", "configure", "enable", "read", "write"),
        *("counts", "stop", "disable", "close"),
    ),
    "enable_line": ("close_contact", "open_contact", "close"),
}
"""Attributes that a driver of each role must have; see `rig.devices.base`."""

REQUIRED = ("torque_sensor", "drive")
HOME: Mapping[str, float | None] = {"home_deg": None, "home_tolerance_deg": 3.0}
"""Keys of the initial position, with their defaults."""
ABSOLUTE = "absolute_angle"


@dataclass(frozen=True)
class RigFile:
    """A rig as described by its file; checked, but not connected.

    Parameters
    ----------
    path : Path
    name : str
    devices : mapping
        Class and settings by role.
    digest : str
        Hash of the contents: a commissioning record is valid for one digest.
    home : Home or None
        Where the joint must be to be enabled.
    absolute_angle : bool
        Whether the drive's angle means the same place after its power was off.
    """

    path: Path
    name: str
    devices: Mapping[str, tuple[type[Any], Any]]
    digest: str
    home: Home | None = None
    absolute_angle: bool = False

    @property
    def emulated(self) -> bool:
        """Whether no device of the rig is hardware.

        Each driver derives it from its connection (loopback, a pseudo-terminal, a virtual CAN bus),
        not from an entry in the file. A driver without the property counts as hardware.
        """
        return bool(self.devices) and all(
            getattr(settings, "emulated", False) for _, settings in self.devices.values()
        )

    def claim(self) -> RigLock:
        """Reserve the hardware of this rig for this process until the returned lock is closed.

        Each driver's settings say in `lock_names` what it is; of a driver without the property, its
        settings are locked.

        Raises
        ------
        UserError
            If another process uses it.
        """
        lock = RigLock(self.path)
        for driver, settings in self.devices.values():
            default = (f"{driver.__module__}.{driver.__qualname__} {settings.model_dump_json()}",)
            lock.take(getattr(settings, "lock_names", default))
        return lock

    def build(
        self,
        now: Now,
        tick_rate_hz: float,
        home: Home | None = None,
        lock: RigLock | None = None,
        bounds: DriveBounds | None = None,
    ) -> ComposedRig:
        """Create the devices without connecting.

        `home` overrides that of the file. `lock` takes the serial numbers too, once they are read:
        one device may have two addresses. `bounds` are those that a drive must not exceed by
        itself, where its driver has a method `bound` that takes them.
        """

        def take_serials(facts: Mapping[str, DeviceFacts]) -> None:
            if lock is not None:
                lock.take(
                    f"{role.replace('_', ' ')}, serial number {found.serial}"
                    for role, found in facts.items()
                    if found.serial and not getattr(self.devices[role][1], "emulated", False)
                )

        made = {role: driver(settings, now) for role, (driver, settings) in self.devices.items()}
        if bounds is not None and hasattr(made["drive"], "bound"):
            made["drive"].bound(bounds)
        return ComposedRig(
            made["torque_sensor"],
            made["drive"],
            tick_rate_hz,
            made.get("enable_line"),
            home or self.home,
            take_serials,
            bounds.range_rad if bounds is not None else None,
        )


def load_rig(path: Path) -> RigFile:
    """Read RIG.toml.

    Raises
    ------
    UserError
        If the file cannot be read, or names a device, a driver or a value that does not exist.
    """
    values = read_toml(path)
    unknown = sorted(set(values) - set(DRIVERS) - {"name", ABSOLUTE, *HOME})
    if unknown:
        known = ", ".join(("name", *HOME, ABSOLUTE, *DRIVERS))
        raise UserError(f"{path}: unknown key {unknown[0]}; known are {known}")
    missing = [role for role in REQUIRED if role not in values]
    if missing:
        raise UserError(f"{path}: has no [{missing[0]}] table, which names a driver")
    devices = {role: _device(path, role, values[role]) for role in DRIVERS if role in values}
    name = values.get("name", path.stem)
    if not isinstance(name, str):
        raise UserError(f"{path}: name must be text, got {name!r}")
    absolute = values.get(ABSOLUTE, False)
    if not isinstance(absolute, bool):
        raise UserError(f"{path}: {ABSOLUTE} must be true or false, got {absolute!r}")
    digest = hashlib.sha256(repr(sorted_values(values)).encode()).hexdigest()
    return RigFile(path, name, devices, digest, _home(path, values), absolute)


def _home(path: Path, values: Mapping[str, Any]) -> Home | None:
    angle, tolerance = (values.get(key, default) for key, default in HOME.items())
    for key, value in zip(HOME, (angle, tolerance), strict=True):
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise UserError(f"{path}: {key} must be a number of degrees, got {value!r}")
        if value is not None and not math.isfinite(value):
            raise UserError(f"{path}: {key} must be a finite number of degrees, got {value!r}")
    if tolerance is None or not 0 < tolerance <= 180:
        raise UserError(
            f"{path}: home_tolerance_deg must be above 0 and at most 180 degrees, got {tolerance!r}"
        )
    if angle is None:
        return None
    return Home(math.radians(angle), math.radians(tolerance))


def sorted_values(values: Any) -> Any:
    """Return nested mappings as sorted pairs, so that the order of keys does not matter."""
    if isinstance(values, Mapping):
        return sorted((key, sorted_values(value)) for key, value in values.items())
    return values


def _device(path: Path, role: str, table: Any) -> tuple[type[Any], Any]:
    if not isinstance(table, dict) or not isinstance(table.get("driver"), str):
        known = ", ".join(DRIVERS[role])
        raise UserError(f"{path}: [{role}] must name its driver: {known}, or package.module:Class")
    driver = _driver(path, role, table["driver"])
    values = {key: value for key, value in table.items() if key != "driver"}
    return driver, validated(driver.Settings, values, f"{path}, [{role}]")


def _driver(path: Path, role: str, name: str) -> Any:
    place = DRIVERS[role].get(name, name)
    module, _, attribute = place.partition(":")
    if not attribute or not module or module.startswith("."):
        known = ", ".join(DRIVERS[role])
        raise UserError(
            f"{path}, [{role}]: there is no driver {name!r}; known are {known}, and others are "
            "written package.module:Class"
        )
    try:
        driver = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise UserError(f"{path}, [{role}]: driver {name!r} cannot be loaded ({error})") from None
    except (Exception, SystemExit) as error:  # a foreign module may raise anything
        what = f"{type(error).__name__}: {error}"
        raise UserError(
            f"{path}, [{role}]: driver {name!r} cannot be loaded, its module fails with {what}"
        ) from error
    settings = getattr(driver, "Settings", None)
    if settings is None:
        raise UserError(f"{path}, [{role}]: {name!r} is no driver: it has no Settings")
    if not (isinstance(settings, type) and issubclass(settings, BaseModel)):
        raise UserError(
            f"{path}, [{role}]: {name!r} is no driver: its Settings must be a class derived from "
            "rigidimeter.core.settings.Section"
        )
    lacking = [method for method in METHODS[role] if not hasattr(driver, method)]
    if lacking:
        raise UserError(
            f"{path}, [{role}]: {name!r} is no driver for a {role.replace('_', ' ')}: it has no "
            f"{', '.join(lacking)}"
        )
    try:
        inspect.signature(driver).bind(None, None)
    except TypeError as error:
        raise UserError(
            f"{path}, [{role}]: {name!r} is no driver: it must be made with (settings, now), but "
            f"{error}"
        ) from None
    return driver
