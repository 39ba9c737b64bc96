"""Three rigs that go wrong when told to: one simulated, two on true wires.

    virtual        `SimulatedRig` behind a wrapper that spoils readings and commands, on a simulated
                   clock: times are exact and the same every time
    rdt_canopen    `AtiRdt` over UDP at 1 kHz and `Cia402Drive` over CANopen, in real time
    rdt_ascii      `AtiRdt` over UDP at 1 kHz and `AsciiDrive` on a pseudo-terminal, in real time

On the wires the emulators' threads share the process with the loop, which makes it run later. So
every bound in real time is that of the settings plus `SLACK_S` plus the worst lateness
of the probe beside the test (`tests.lateness`); on the virtual rig nothing is added. Tests on wires
run at a real-time priority, as the loop of a true rig does, so that other programs disturb them
less.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from tests.faults.spoiled_rig import SpoiledRig

from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.rig.acquisition import DeadlineClock, SimulatedClock
from rigidimeter.rig.devices import AsciiDrive, AtiRdt, Cia402Drive, ComposedRig, SimulatedRig
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.testing import AsciiEmulator, Cia402Emulator, EmulatedArm, RdtEmulator

CANOPEN, ASCII = "rdt_canopen", "rdt_ascii"
WIRES = (CANOPEN, ASCII)
RIGS = ("virtual", *WIRES)
SLACK_S = 0.03
"""What a busy machine may add on a wire: three emulators' threads and a loop in one process."""
JOINT = JointDynamics(0.0045, 0.1368, 1.751)
_EPOCH = {
    "sinusoid": {
        "amplitude_deg": 10.0,
        "frequency_hz": 2.0,
        "motion_s": 1.0,
        "duration_s": 1.0,
        "taper_s": 0.1,
    },
    "prbs": {"duration_s": 1.0},
    "protocol": {"blocks": [{"task": "sinusoid", "epochs": 1}], "rests_s": [0.5], "return_s": 0.5},
}
SETTINGS: dict[str, dict[str, Any]] = {
    "virtual": _EPOCH,
    CANOPEN: {
        **_EPOCH,
        "rig": {
            "tick_rate_hz": 500.0,
            "torque": {"rate_hz": 500.0},
            "motion": {"rate_hz": 500.0},
        },
        "guard": {"reaction_time_s": 0.03},
        "loop": {"missed_in_a_row": 100, "stall_s": 0.5},
    },
    ASCII: {
        **_EPOCH,
        "rig": {"tick_rate_hz": 50.0, "torque": {"rate_hz": 50.0}, "motion": {"rate_hz": 50.0}},
        "controller": {"torque_cutoff_hz": 10.0},
        "guard": {
            "reaction_time_s": 0.1,
            "speed_limit_deg_s": 80.0,
            "acceleration_limit_deg_s2": 1500.0,
        },
        "loop": {"missed_in_a_row": 100, "stall_s": 0.5},
        "sinusoid": {**_EPOCH["sinusoid"], "amplitude_deg": 4.0},
    },
}
"""The speed at which a fault finds the arm is 126 deg/s; on the slow serial line 50 deg/s."""
CANOPEN_DRIVE: dict[str, Any] = {
    # A drive must brake at least as hard as the guard thinks it does: 6000 deg/s² = 105 rad/s².
    "acceleration_rad_s2": 120.0,
    "deceleration_rad_s2": 120.0,
    "quick_stop_rad_s2": 120.0,
    "command_deadline_s": 0.1,
    "drive_watchdog_s": 0.2,
    "lost_s": 0.05,
    "enable_timeout_s": 0.3,
}
ASCII_DRIVE: dict[str, Any] = {"counts_per_turn": 360_000.0}
_channels = itertools.count()


class Wrong(NamedTuple):
    """One thing gone wrong: at the sensor, at the drive, or with the arm itself."""

    where: str
    name: str
    value: Any = None


class WatchedArm(EmulatedArm):
    """Keeps when it was where, and how fast: the truth, whatever the wires say."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        self.trace: list[tuple[float, float, float]] = []
        super().__init__(*arguments, **options)

    def _advance(self) -> None:
        super()._advance()
        self.trace.append((self._at_s, self._state.angle_rad, self._state.velocity_rad_s))


class Line:
    """A hardware enable that says when it was opened."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self.closed = self.port_closed = False
        self.opened_s = math.nan

    def close_contact(self) -> None:
        self.closed = True

    def open_contact(self) -> None:
        if self.closed:
            self.opened_s = self._now()
        self.closed = False

    def close(self) -> None:
        self.open_contact()
        self.port_closed = True


class VirtualClock(SimulatedClock):
    """On time, but for given ticks, which are late by so much."""

    def __init__(self, rate_hz: float) -> None:
        self.rate_hz, self.time_s = rate_hz, 0.0
        self.late: dict[int, float] = {}

    def wait_until(self, deadline_s: float) -> float:
        self.time_s = deadline_s + self.late.pop(round(deadline_s * self.rate_hz), 0.0)
        return self.time_s

    def now_s(self) -> float:
        return self.time_s


class RealClock(DeadlineClock):
    """The loop's own clock, but for given ticks, which are late by so much."""

    def __init__(self, rate_hz: float) -> None:
        super().__init__()
        self.rate_hz = rate_hz
        self.late: dict[int, float] = {}

    def wait_until(self, deadline_s: float) -> float:
        now_s = super().wait_until(deadline_s)
        late_s = self.late.pop(round(deadline_s * self.rate_hz), 0.0)
        if not late_s:
            return now_s
        return super().wait_until(deadline_s + late_s)


@dataclass
class Bench:
    """A rig with everything behind it."""

    name: str
    settings: Settings
    clock: Any
    rig: Any
    sensor_emulator: Any = None
    drive_emulator: Any = None
    arm: Any = None
    line: Any = None
    drive: Any = None
    facts: dict[str, Any] = field(default_factory=dict)

    @property
    def rate_hz(self) -> float:
        return self.settings.rig.tick_rate_hz

    @property
    def virtual(self) -> bool:
        return self.name == "virtual"

    def misbehave(self, wrong: Wrong) -> None:
        if self.virtual:
            self.rig.habits[wrong.name] = wrong.value
        elif wrong.where == "arm":
            self.arm.voluntary_nm = wrong.value
        else:
            emulator = self.sensor_emulator if wrong.where == "sensor" else self.drive_emulator
            emulator.misbehave(wrong.name, *(() if wrong.value is None else (wrong.value,)))

    def behave(self) -> None:
        if self.virtual:
            self.rig.habits.clear()
        else:
            self.sensor_emulator.behave()
            self.drive_emulator.behave()

    @property
    def powered(self) -> bool:
        """Whether the drive has power: its own word, not the driver's."""
        if self.virtual:
            return bool(self.rig.powered)
        return bool(self.drive_emulator.state()["power"])

    def trace(self) -> Any:
        """Return time on the loop's clock, angle and velocity of the arm itself."""
        if self.virtual:
            return np.array(self.rig.trace)
        with self.arm._lock:
            trace = np.array(self.arm.trace)
        # The arm's time is that of the machine.
        trace[:, 0] += self.clock.now_s() - time.monotonic()
        return trace

    def settle(self, longest_s: float = 0.6) -> None:
        """Live on until the arm is at rest, or for so long."""
        if self.virtual:
            habits, self.rig.habits = self.rig.habits, {}
            for _ in range(round(0.3 * self.rate_hz)):
                SpoiledRig.read(self.rig)
            self.rig.habits = habits
            return
        until_s = time.monotonic() + longest_s
        still = 0
        while time.monotonic() < until_s and still < 5:  # once may be on its way back
            still = still + 1 if abs(self.arm.motion()[1]) < 1e-3 else 0
            time.sleep(0.005)


TOO_SLOW = ("keeps up with", "too short for a cycle", "no answer", "stopped answering")
"""What a driver says of a serial emulator whose thread did not run for a while."""


def configured(rig: ComposedRig) -> dict[str, Any]:
    """Configure; a busy machine may make the serial emulator too slow for a moment."""
    for _ in range(10):
        try:
            return dict(rig.configure())
        except DeviceError as error:
            if not any(words in str(error) for words in TOO_SLOW):
                raise
            slow = error
            time.sleep(0.1)
    raise slow


@contextmanager
def bench(name: str, connected: bool = True, **tables: Any) -> Iterator[Bench]:
    """Give a rig, connected and configured; all it stands on ends with it."""
    values = {**SETTINGS[name]}
    for table, more in tables.items():
        values[table] = {**values.get(table, {}), **more}
    settings = parse_settings(values)
    rate_hz = settings.rig.tick_rate_hz
    if name == "virtual":
        subject = settings.subject["OFF"]
        inner = SimulatedRig(settings.rig, subject, np.random.default_rng(1))
        yield Bench(name, settings, VirtualClock(rate_hz), SpoiledRig(inner))
        return
    yield from _on_wires(name, settings, connected)


def _on_wires(name: str, settings: Settings, connected: bool) -> Iterator[Bench]:
    rate_hz = settings.rig.tick_rate_hz
    clock = RealClock(rate_hz)
    arm = WatchedArm(JOINT)
    line = Line(clock.now_s)
    with RdtEmulator(arm, rate_hz=1000.0) as sensor_emulator:
        sensor = AtiRdt(
            AtiRdt.Settings(
                address="127.0.0.1", port=sensor_emulator.port, http_port=sensor_emulator.http_port
            ),
            clock.now_s,
        )
        drive_emulator: Any
        drive: Any
        if name == CANOPEN:
            wire = {"interface": "virtual", "channel": f"faults {next(_channels)}"}
            drive_emulator = Cia402Emulator(arm, **wire)
            drive = Cia402Drive(Cia402Drive.Settings(**wire, **CANOPEN_DRIVE), clock.now_s)
        else:
            drive_emulator = AsciiEmulator(arm)
            drive = AsciiDrive(
                AsciiDrive.Settings(port=drive_emulator.port, **ASCII_DRIVE), clock.now_s
            )
        rig = ComposedRig(sensor, drive, rate_hz, line)
        made = Bench(name, settings, clock, rig, sensor_emulator, drive_emulator, arm, line, drive)
        try:
            if connected:
                rig.connect()
                made.facts = configured(rig)
            yield made
        finally:
            try:
                rig.close()
            finally:
                drive_emulator.close()
