"""Under which program, on which computer and kernel a record was made.

The sources are those that are installed, from a wheel or a checkout: a digest over the names and
texts of the modules, with the same ends of lines everywhere. Compiled files are not looked at.
"""

from __future__ import annotations

import hashlib
import platform
import sys
import time
from collections.abc import Iterable, Mapping
from contextlib import suppress
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from rigidimeter.core.version import __version__
from rigidimeter.rig.devices import RigFile

SOURCES = {
    "guard_sources": "rigidimeter.rig.guard",
    "loop_sources": "rigidimeter.rig.acquisition",
    "device_sources": "rigidimeter.rig.devices",
}
"""Packages that decide, run and speak to the devices, by the key of their digest."""

OWN = "rigidimeter."
GOVERNORS = "cpu[0-9]*/cpufreq/scaling_governor"
PROCESSORS = Path("/sys/devices/system/cpu")
BOOT_ID = Path("/proc/sys/kernel/random/boot_id")


def program_identity(rigfile: RigFile) -> dict[str, str]:
    """Return version, digests of sources, host, kernel and processor governor of this moment.

    A driver that is not of this package adds its module to the digest of the devices. The governor
    is empty where the kernel has none, as on a virtual machine.
    """
    found = {"version": __version__}
    for key, package in SOURCES.items():
        texts = dict(_modules(files(package), package))
        if key == "device_sources":
            texts |= _foreign(driver for driver, _ in rigfile.devices.values())
        found[key] = sources_digest(texts)
    system = platform.uname()
    governors = {_text(path) for path in PROCESSORS.glob(GOVERNORS)}
    return found | {
        "host": system.node,
        "kernel": f"{system.system} {system.release} {system.version}".strip(),
        "governor": ", ".join(sorted(governors - {""})),
    }


def sources_digest(texts: Mapping[str, bytes]) -> str:
    """Return the SHA-256 of modules by name, whatever ends their lines."""
    found = hashlib.sha256()
    for name in sorted(texts):
        text = texts[name].replace(b"\r\n", b"\n")
        found.update(f"{name}:{len(text)}:".encode() + text)
    return found.hexdigest()


def boot_clock() -> tuple[str, float]:
    """Return which start of the computer this is, and the seconds since it that nobody can set.

    The name is empty where the system has none.
    """
    clock = getattr(time, "CLOCK_BOOTTIME", None)
    if clock is None:
        return "", 0.0
    return _text(BOOT_ID), time.clock_gettime(clock)


def _modules(folder: Traversable, name: str) -> Iterable[tuple[str, bytes]]:
    for entry in folder.iterdir():
        if entry.is_dir():
            yield from _modules(entry, f"{name}/{entry.name}")
        elif entry.name.endswith(".py"):
            yield f"{name}/{entry.name}", entry.read_bytes()


def _foreign(drivers: Iterable[type[Any]]) -> dict[str, bytes]:
    """Return the modules of drivers that others wrote."""
    texts = {}
    for driver in drivers:
        source = getattr(sys.modules.get(driver.__module__), "__file__", None)
        if not driver.__module__.startswith(OWN) and source and source.endswith(".py"):
            texts[driver.__module__] = Path(source).read_bytes()
    return texts


def _text(path: Path) -> str:
    with suppress(OSError):
        return path.read_text(encoding="utf-8").strip()
    return ""
