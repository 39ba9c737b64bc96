"""A complete rig without hardware: an emulated torque sensor and an emulated drive on one arm.

The torque sensor sends UDP packets like an ATI Net F/T. The drive speaks CANopen on a UDP multicast
group, or ASCII on a pseudo-terminal. The drivers under test are the same as on a real rig.

Commands are lines of text. Each is answered by one line of JSON with the key ``ok``:

    state                           angle, velocity, power, drive state, last stop, times
    misbehave torque|drive NAME [VALUE]
    behave                          end every misbehaviour of both emulators
    joint J B K                     change the arm: kg·m², N·m·s/rad and N·m/rad
    place DEG                       put the joint at an angle, at rest
    push NM                         push the joint with a constant torque
    press, release                  the emergency stop in the drive's enable circuit
    log                             the events that the drive logged
    help                            list commands and misbehaviours
    quit                            end, like the end of the input

Times are those of CLOCK_MONOTONIC, which all processes of a machine share.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import random
import socket
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import plain_values
from rigidimeter.core.settings import DriveSideSettings
from rigidimeter.model import JointDynamics
from rigidimeter.testing import ascii_emulator
from rigidimeter.testing.cia402 import cia402_emulator as cia402
from rigidimeter.testing.cia402 import servo
from rigidimeter.testing.emulated_arm import EmulatedArm
from rigidimeter.testing.rdt import rdt_emulator as rdt
from rigidimeter.testing.rdt import rdt_records

MULTICAST_GROUP = "239.74.163.2"
"""Of the emulated CAN bus; each rig uses its own port."""

PRESSED = {
    # An emergency stop removes the power, and the drive cannot be enabled until it is released.
    "cia402": (("leave operation", None), ("refuse enable", None)),
    "ascii": (("power_lost", 1.0),),
}
"""Misbehaviours of the drive while the emergency stop is pressed."""

SINES = 8
PRIORITY = 20
"""Real-time priority of the emulators where the system grants it: hardware is never preempted."""

SWITCH_S = 0.0005
"""Thread switch interval: Python's default of 5 ms would delay one emulator behind another."""


class EmulatedRig:
    """An emulated rig; `close` it, or use it as a context.

    Parameters
    ----------
    drive : {"cia402", "ascii"}
    joint : JointDynamics
    voluntary_sd_nm : float
        Standard deviation of the voluntary torque, a sum of sines from 0.3 to 4 Hz.
    torque_rate_hz, noise_sd_nm, bandwidth_hz : float
        Of the torque sensor and the drive.
    seed : int
    drive_side : DriveSideSettings, optional
        Motor and gear of the drive, and how it reports its torque; by default a small joint's.
    """

    def __init__(
        self,
        drive: Literal["cia402", "ascii"],
        joint: JointDynamics,
        *,
        voluntary_sd_nm: float = 0.0,
        torque_rate_hz: float = 1000.0,
        noise_sd_nm: float = 0.005,
        bandwidth_hz: float = 50.0,
        seed: int = 1,
        drive_side: DriveSideSettings | None = None,
    ) -> None:
        self._kind = drive
        # For the threads started later, if the system permits.
        with contextlib.suppress(OSError, AttributeError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        self._push_nm = 0.0
        self._voluntary = _voluntary(voluntary_sd_nm, seed)
        self.arm = EmulatedArm(
            joint,
            bandwidth_hz=bandwidth_hz,
            noise_sd_nm=noise_sd_nm,
            voluntary_nm=lambda time_s: self._push_nm + self._voluntary(time_s),
            seed=seed,
            drive_side=drive_side,
        )
        self._wrong: dict[str, float | None] = {}
        self._pressed = False
        self._bus: dict[str, Any] = {}
        self.torque = rdt.RdtEmulator(self.arm, rate_hz=torque_rate_hz, seed=seed)
        self.torque.start()
        with contextlib.ExitStack() as on_failure:
            on_failure.callback(self.torque.stop)
            self.drive: Any = self._make_drive()
            on_failure.pop_all()
        self._commands: Mapping[str, Callable[..., dict[str, Any]]] = {
            "state": self._state,
            "misbehave": self._misbehave,
            "behave": self._behave,
            "joint": self._joint,
            "place": self._place,
            "push": self._hand,
            "press": self._press,
            "release": self._release,
            "log": self._log,
            "help": self._help,
        }

    def _make_drive(self) -> Any:
        if self._kind == "ascii":
            return ascii_emulator.AsciiEmulator(self.arm)
        self._bus = {
            "interface": "udp_multicast",
            "channel": MULTICAST_GROUP,
            "port": _free_udp_port(),
        }
        return cia402.Cia402Emulator(self.arm, **self._bus)

    def __enter__(self) -> EmulatedRig:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close both emulators, each even if the other fails."""
        try:
            self.drive.close()
        finally:
            self.torque.stop()

    def rig_toml(self) -> str:
        """Return the contents of a rig file for this rig."""
        side = self.arm.drive_side
        if self._kind == "ascii":
            drive = (
                f'driver = "ascii"\nport = "{self.drive.port}"\n'
                "counts_per_turn = 360000.0\nlost_s = 0.2\n"
            )
        else:
            drive = (
                'driver = "cia402"\n'
                f'interface = "udp_multicast"\nchannel = "{MULTICAST_GROUP}"\n'
                f"port = {self._bus['port']}\n"
                "acceleration_rad_s2 = 150.0\ndeceleration_rad_s2 = 150.0\n"
                f"reflected_inertia_kg_m2 = {side.reflected_inertia_kg_m2}\n"
                f"friction_nm = {side.friction_nm}\n"
                # The emulators are threads of one process and reply later than a servo would.
                "command_deadline_s = 0.1\nlost_s = 0.15\n"
            )
        return (
            'name = "emulated rig"\n\n[torque_sensor]\ndriver = "ati-rdt"\n'
            f'address = "{self.torque.address}"\nport = {self.torque.port}\n'
            f"http_port = {self.torque.http_port}\n\n[drive]\n{drive}"
        )

    def ready(self) -> dict[str, Any]:
        """Return what is needed to connect to the rig."""
        return {
            "ok": True,
            "ready": True,
            "drive": self._kind,
            "torque": {"address": self.torque.address, "port": self.torque.port},
            "bus": self._bus or {"port": self.drive.port},
            "time_s": time.monotonic(),
        }

    def answer(self, line: str) -> dict[str, Any]:
        """Execute a command line; an invalid one gets an error reply and raises nothing."""
        name, *words = line.split() or [""]
        command = self._commands.get(name)
        if command is None:
            known = ", ".join((*self._commands, "quit"))
            return {"ok": False, "error": f"there is no command {name!r}; known: {known}"}
        try:
            return {"ok": True, **command(*words)}
        except (TypeError, ValueError) as error:
            return {"ok": False, "error": f"{line.strip()!r}: {error}"}

    def _state(self) -> dict[str, Any]:
        now_s = time.monotonic()
        found = self.drive.state()
        return {"time_s": now_s, "power": found.pop("power"), "pressed": self._pressed, **found}

    def _misbehave(self, role: str, *words: str) -> dict[str, Any]:
        if role not in ("torque", "drive"):
            raise ValueError("say misbehave torque NAME or misbehave drive NAME")
        value = None
        if len(words) > 1 and (number := _number(words[-1])) is not None:
            value, words = number, words[:-1]
        name = self._known(role, " ".join(words))
        if role == "torque":
            self.torque.misbehave(name, value)
        else:
            self._tell_drive(name, value)
            self._wrong[name] = value
        return {"misbehaves": name, "value": value, "time_s": time.monotonic()}

    def _known(self, role: str, name: str) -> str:
        """Return the name as the emulator spells it; blanks, dashes and underscores are equal."""
        wanted = name.replace("_", " ").replace("-", " ")
        for known in self._misbehaviours(role):
            if known.replace("_", " ") == wanted:
                return known
        raise ValueError(
            f"{role} has no misbehaviour {name!r}; known: {', '.join(self._misbehaviours(role))}"
        )

    def _misbehaviours(self, role: str) -> Mapping[str, str]:
        if role == "torque":
            return rdt_records.RDT_MISBEHAVIOURS
        return (
            servo.CIA402_MISBEHAVIOURS
            if self._kind == "cia402"
            else ascii_emulator.ASCII_MISBEHAVIOURS
        )

    def _tell_drive(self, name: str, value: float | None) -> None:
        # Emergency codes, modes and bits are whole numbers.
        integer = int(value) if value is not None and value.is_integer() else value
        self.drive.misbehave(name, *(() if integer is None else (integer,)))

    def _behave(self) -> dict[str, Any]:
        self._wrong.clear()
        self.torque.behave()
        self._restore_drive()
        return {"time_s": time.monotonic()}

    def _restore_drive(self) -> None:
        """Restart the misbehaviours that still apply, including the emergency stop."""
        self.drive.behave()
        for name, value in self._wrong.items():
            self._tell_drive(name, value)
        if self._pressed:
            for name, value in PRESSED[self._kind]:
                self._tell_drive(name, value)

    def _joint(self, inertia: str, damping: str, stiffness: str) -> dict[str, Any]:
        self.arm.joint = JointDynamics(float(inertia), float(damping), float(stiffness))
        return {}

    def _place(self, angle_deg: str) -> dict[str, Any]:
        self.arm.place(math.radians(float(angle_deg)))
        return {}

    def _hand(self, torque_nm: str) -> dict[str, Any]:
        self._push_nm = float(torque_nm)
        return {}

    def _press(self) -> dict[str, Any]:
        time_s = time.monotonic()
        self._pressed = True
        for name, value in PRESSED[self._kind]:
            self._tell_drive(name, value)
        return {"time_s": time_s}

    def _release(self) -> dict[str, Any]:
        time_s = time.monotonic()
        self._pressed = False
        self._restore_drive()
        return {"time_s": time_s}

    def _log(self) -> dict[str, Any]:
        return {"log": [list(entry) for entry in tuple(self.drive.log)]}

    def _help(self) -> dict[str, Any]:
        roles = ("torque", "drive")
        return {
            "commands": [*self._commands, "quit"],
            **{role: dict(self._misbehaviours(role)) for role in roles},
        }


def serve(rig: EmulatedRig, rig_out: Path | None = None) -> None:
    """Write the rig file, report that the rig is ready, then answer commands to the input's end."""
    if rig_out is not None:
        rig_out.write_text(rig.rig_toml(), encoding="utf-8")
    sys.setswitchinterval(SWITCH_S)
    _say(rig.ready() | {"rig": None if rig_out is None else str(rig_out)})
    while line := sys.stdin.readline():
        if not line.strip():
            continue
        if line.strip() == "quit":
            _say({"ok": True})
            return
        _say(rig.answer(line))


def _say(answer: dict[str, Any]) -> None:
    print(json.dumps(plain_values(answer)), flush=True)


def _number(word: str) -> float | None:
    try:
        return float(int(word, 0)) if word.lower().startswith("0x") else float(word)
    except ValueError:
        return None


def _voluntary(sd_nm: float, seed: int) -> Callable[[float], float]:
    """Return sines between 0.3 and 4 Hz with random phases."""
    if sd_nm < 0:
        raise UserError(f"--voluntary {sd_nm:g} N·m: must not be negative")
    rng = random.Random(seed)
    amplitude = sd_nm * math.sqrt(2.0 / SINES)
    sines = [(2 * math.pi * rng.uniform(0.3, 4.0), rng.uniform(0, 7.0)) for _ in range(SINES)]
    return lambda time_s: amplitude * sum(math.sin(w * time_s + p) for w, p in sines)


def _free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        port: int = probe.getsockname()[1]
        return port
