"""A rig on the emulated arm, on a clock that only moves when it is waited for."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

from rigidimeter.core.settings import CommissioningSettings, Settings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.rig.acquisition import NoSupervision, Supervision
from rigidimeter.rig.commissioning import (
    CommissioningRecord,
    Operator,
    Setup,
    Timebase,
    commission_rig,
)
from rigidimeter.rig.devices import BoundFound, ComposedRig, RigFile, Tight
from rigidimeter.rig.devices.base import DeviceError, DeviceFacts, MotionSample, TorqueSample
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import EmulatedArm

RATE_HZ = 100.0
QUICK = CommissioningSettings(idle_s=1.0, swings=1, steps_s=1.2, known_torque_s=1.0)


class FakeTime:
    def __init__(self) -> None:
        self.time_s = 0.0

    def now(self) -> float:
        return self.time_s

    def wait_until(self, deadline_s: float) -> float:
        self.time_s = max(self.time_s, deadline_s)
        return self.time_s


class FakeSensor:
    def __init__(self, arm: EmulatedArm, now: Callable[[], float], faults: Mapping[str, Any]):
        self._arm, self._now, self._faults = arm, now, faults
        self._sample = TorqueSample(math.nan, -math.inf)
        self._history: deque[TorqueSample] = deque()
        self._noise = np.random.default_rng(1)
        self.counts: dict[str, int] = {"received": 0, "lost": 0}

    def connect(self) -> None: ...

    def configure(self) -> DeviceFacts:
        if "no_answer" in self._faults:
            raise DeviceError("torque sensor: no answer; check the cable")
        return DeviceFacts("fake torque", "T1", 1e4, None, {"counts_per_torque": 1e6, "bias": "0"})

    def read(self) -> TorqueSample:
        now_s, faults = self._now(), self._faults
        if now_s - self._sample.time_s >= faults.get("torque_interval_s", 0.0) - 1e-9:
            torque = faults.get("torque_scale", 1.0) * self._arm.torque_nm()
            torque += faults.get("bias_nm", 0.0)
            if "dead" in faults:
                torque = 0.0
            if "other_axis" in faults:
                torque = 0.001 * float(self._noise.standard_normal())
            self._sample = TorqueSample(torque, now_s)
            self._history.append(self._sample)
            self.counts["received"] += 1
            self.counts["lost"] += faults.get("lost_each", 0)
        late_s = faults.get("torque_delay_s", 0.0)
        history = self._history
        while len(history) > 1 and history[1].time_s <= now_s - late_s + 1e-9:
            history.popleft()
        # A sensor that does not know its delay stamps what it sends with the time of sending.
        ahead_s = faults.get("stamp_ahead_s", 0.0)
        return history[0]._replace(time_s=self._sample.time_s + ahead_s)

    def close(self) -> None: ...


class FakeDrive:
    def __init__(self, arm: EmulatedArm, now: Callable[[], float], faults: Mapping[str, Any]):
        self._arm, self._now, self._faults = arm, now, faults
        self._on, self._status, self._cause = "on_before" in faults, 0, Cause.NONE
        self._written_s = 0.0
        self._queue: deque[tuple[float, float]] = deque()
        self._tight: Tight | None = None
        self._start_rad = 0.0
        self.counts: dict[str, int] = {"received": 0, "lost": 0}

    @property
    def bounds(self) -> tuple[BoundFound, ...]:
        where = {"obeyed": "0x1", "asleep": "0x1", "absent": ""}
        given = self._faults.get("bounds", {})
        return tuple(BoundFound(name, where[how], "w", "l") for name, how in given.items())

    def tighten(self, tight: Tight | None) -> None:
        self._tight = tight

    def _bounded(self, wanted_rad_s: float) -> float:
        """Obey the bound that is tight, if it is one that the drive obeys."""
        tight = self._tight
        if tight is None or self._faults["bounds"][tight.name] != "obeyed" or not wanted_rad_s:
            return wanted_rad_s
        if tight.name in ("speed", "motor speed"):
            return math.copysign(min(abs(wanted_rad_s), 0.5 * tight.speed_rad_s), wanted_rad_s)
        if tight.name == "position":
            outward = math.copysign(1.0, wanted_rad_s) * (self._arm.motion()[0] - self._start_rad)
            return 0.0 if outward >= 0.5 * tight.reach_rad else wanted_rad_s
        if tight.name == "slippage":
            self._halt()
            self._status, self._cause = 8, Cause.DRIVE_FAULT
        return 0.0

    def connect(self) -> None: ...

    def configure(self) -> DeviceFacts:
        watchdog_s = self._faults.get("watchdog_s", 0.1)
        values = {
            "cycle_s": self._now(),
            "braking_rad_s2": self._faults.get("braking_rad_s2", 120.0),
            "button_bit": self._faults.get("button_bit"),
        }
        known = {name: value for name, value in values.items() if value is not None}
        return DeviceFacts("fake drive", "D1", 1e4, watchdog_s, known)

    def enable(self) -> None:
        if self._pressed():
            raise DeviceError("drive: no power; release the emergency stop")
        self._on, self._status, self._cause = True, 1, Cause.NONE
        self._written_s = self._now()
        self._start_rad = self._arm.motion()[0]

    def _pressed(self) -> bool:
        return self._now() >= float(self._faults.get("pressed_at_s", math.inf))

    def _live(self) -> None:
        now_s = self._now()
        while self._queue and self._queue[0][0] <= now_s + 1e-9:
            wanted_rad_s = self._faults.get("command_scale", 1.0) * self._queue.popleft()[1]
            wanted_rad_s = self._bounded(wanted_rad_s)
            self._arm.command(wanted_rad_s + self._faults.get("drift_rad_s", 0.0))
        after_s = self._faults.get("stops_after_s", 0.1)
        silent = "deaf_watchdog" not in self._faults and now_s - self._written_s > after_s
        if self._on and (silent or self._pressed()):
            self._halt()
            self._status, self._cause = 8, Cause.DRIVE_FAULT

    def _halt(self) -> None:
        self._on = False
        self._queue.clear()
        self._arm.release()

    def read(self) -> MotionSample:
        self._live()
        angle, velocity = self._arm.motion()
        scale = self._faults.get("angle_scale", 1.0)
        if self._on and self._now() >= self._faults.get("button_at_s", math.inf):
            self._halt()
            self._status, self._cause = 9, Cause.EMERGENCY_STOP
        status, cause, faults = self._status, self._cause, self._faults
        if self._on and self._now() >= self._faults.get("given_up_s", math.inf):
            cause = Cause.DRIVE_STATE
        if "silent_watchdog" in self._faults:
            status, cause = 0, Cause.NONE
        return MotionSample(
            scale * angle,
            self._faults.get("velocity_per_angle", scale) * velocity,
            self._now(),
            status=status,
            cause=int(cause),
            drive_torque_nm=self._arm.drive_torque_nm() if "drive_side" in faults else math.nan,
        )

    def write(self, velocity_rad_s: float) -> float:
        self._live()
        self._written_s = self._now()
        if not self._on and "restarts" not in self._faults:
            return 0.0
        self._queue.append((self._now() + self._faults.get("delay_s", 0.0), velocity_rad_s))
        self._live()
        return velocity_rad_s

    def stop(self) -> None:
        self._halt()

    @property
    def powered(self) -> bool:
        return self._on

    def disable(self) -> None:
        if "keeps_power" not in self._faults:
            self._halt()

    def close(self) -> None: ...


Commissioned = Callable[..., CommissioningRecord]


def at_hand(question: str, world: World) -> bool:
    """Agree to everything, lead the joint to its stops, press and release the emergency stop."""
    for end, angle_rad in (("one end", 0.75), ("the other end", -0.5), ("back to where", 0.0)):
        if end in question:
            world.arm.place(angle_rad)
    if question.startswith("Emergency"):
        world.faults["pressed_at_s"] = world.time.now() + 1.0
    if question.startswith("Release"):
        world.faults.pop("pressed_at_s", None)
    return True


class World(NamedTuple):
    """What a test's operator can lay hands on."""

    faults: dict[str, Any]
    arm: EmulatedArm
    time: FakeTime
    push_nm: list[float]


@pytest.fixture
def rigfile() -> RigFile:
    return RigFile(Path("RIG.toml"), "fake rig", {}, "digest of the rig file")


@pytest.fixture
def settings() -> Settings:
    sensor = {"rate_hz": RATE_HZ}
    rig = {"tick_rate_hz": RATE_HZ, "torque": sensor, "motion": sensor}
    return parse_settings({"rig": rig, "guard": {"reaction_time_s": 0.1}})


class FakeRig(NamedTuple):
    """A rig, its file, its clock, and the world that it stands in."""

    rig: ComposedRig
    file: RigFile
    timebase: Timebase
    world: World


@pytest.fixture
def fake_rig(rigfile: RigFile, monkeypatch: Any) -> Callable[..., FakeRig]:
    """Build a fake rig with faults."""

    def build(
        joint: tuple[float, float, float], noise_sd_nm: float, emulated: bool, faults: Any
    ) -> FakeRig:
        time = FakeTime()
        slept = SimpleNamespace(monotonic=time.now, sleep=lambda s: time.wait_until(time.now() + s))
        monkeypatch.setattr("rigidimeter.rig.devices.composed.time", slept)
        push_nm = [0.0]
        arm = EmulatedArm(
            JointDynamics(*joint),
            bandwidth_hz=faults.get("bandwidth_hz", 50.0),
            noise_sd_nm=noise_sd_nm,
            voluntary_nm=lambda _: push_nm[0],
            now=time.now,
            drive_side=faults.get("drive_side"),
        )
        rig = ComposedRig(
            FakeSensor(arm, time.now, faults), FakeDrive(arm, time.now, faults), RATE_HZ
        )
        wires = {"drive": (object, SimpleNamespace(emulated=emulated))}
        return FakeRig(
            rig,
            replace(rigfile, devices=wires),
            Timebase(time.now, time.wait_until),
            World(faults, arm, time, push_nm),
        )

    return build


@pytest.fixture
def commissioned(settings: Settings, fake_rig: Callable[..., FakeRig]) -> Commissioned:
    """Commission a fake rig with faults, and with the settings and operator given."""

    def run(
        *,
        joint: tuple[float, float, float] = (0.0045, 0.1368, 1.751),
        noise_sd_nm: float = 0.005,
        ask: Callable[[str, World], bool] = at_hand,
        present: bool = True,
        known_torque_nm: float | None = None,
        known_angle_deg: float | None = None,
        tables: Mapping[str, Any] | None = None,
        emulated: bool = False,
        signed_by: str = "A. Weber",
        supervise: Callable[[], Supervision] = NoSupervision,
        **faults: Any,
    ) -> CommissioningRecord:
        rig, file, timebase, world = fake_rig(joint, noise_sd_nm, emulated, faults)
        chosen = settings.model_copy(update={"commissioning": QUICK, **(tables or {})})
        operator = Operator(
            ask=lambda question: ask(question, world),
            present=present,
            known_torque_nm=known_torque_nm,
            known_angle_deg=known_angle_deg,
        )
        return commission_rig(
            Setup(rig, chosen, timebase, operator, supervise),
            file,
            made_utc="2026-01-01T00:00:00+00:00",
            software="0",
            signed_by=signed_by,
        )

    return run
