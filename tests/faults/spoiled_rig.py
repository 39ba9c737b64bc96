"""The virtual rig, and what can be wrong with it."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.rig.devices.base import DeviceError


class SpoiledRig:
    """The virtual rig, and what can be wrong with it."""

    origin_rad = 0.0

    def __init__(self, inner: SimulatedRig) -> None:
        self.inner = inner
        self.habits: dict[str, Any] = {}
        self.trace: list[tuple[float, float, float]] = []
        self._held: Any = None
        self._sent: Any = None
        self._past: deque[float] = deque()
        self._constant_nm = math.nan
        self._ticks, self.rate_hz = 0, 1.0 / inner._interval_s
        self._angle_held = math.nan
        self.connect, self.configure = inner.connect, inner.configure
        self.zero, self.stop = inner.zero, inner.stop
        self.powered = False

    def enable(self) -> None:
        if "refuse enable" in self.habits:
            raise DeviceError("drive: did not come up; its supply voltage must be on")
        self.powered = True
        self.inner.enable()

    def disable(self) -> None:
        self.powered = False
        self.inner.disable()

    def close(self) -> None:
        self.disable()

    @property
    def counts(self) -> dict[str, int]:
        return {}

    def read(self, elapsed_ticks: int = 1) -> Any:
        for _ in range(elapsed_ticks - 1):
            self._see(self.inner.read())
        true = self._see(self.inner.read())
        reading, habits = true, self.habits
        if "push" in habits:
            # The drive is stiff: what the subject does shows in the torque and nowhere else.
            reading = reading._replace(torque_nm=reading.torque_nm - habits["push"])
        if "tremor" in habits:
            amplitude_nm, frequency_hz = habits["tremor"]
            phase = 2 * math.pi * frequency_hz * true.torque_time_s
            reading = reading._replace(torque_nm=reading.torque_nm + amplitude_nm * math.sin(phase))
        if "torque is" in habits:
            reading = reading._replace(torque_nm=habits["torque is"])
        if "angle is" in habits:
            reading = reading._replace(angle_rad=habits["angle is"])
        if "velocity is" in habits:
            reading = reading._replace(velocity_rad_s=habits["velocity is"])
        if "velocity gain" in habits:
            reading = reading._replace(
                velocity_rad_s=habits["velocity gain"] * reading.velocity_rad_s
            )
        reading = self._untrue(reading)
        if "torque stops" in habits:
            self._held = self._held or reading
            reading = reading._replace(
                torque_nm=self._held.torque_nm, torque_time_s=self._held.torque_time_s
            )
        if "motion stops" in habits:
            self._held = self._held or reading
            reading = self._held._replace(
                torque_nm=reading.torque_nm, torque_time_s=reading.torque_time_s
            )
        if "encoder frozen" in habits:
            if math.isnan(self._angle_held):
                self._angle_held = true.angle_rad
            reading = reading._replace(angle_rad=self._angle_held)
        if "encoder jump" in habits:
            reading = reading._replace(angle_rad=reading.angle_rad + habits["encoder jump"])
        if "encoder sign" in habits:
            reading = reading._replace(
                angle_rad=-reading.angle_rad, velocity_rad_s=-reading.velocity_rad_s
            )
        if "reports" in habits:
            reading = reading._replace(cause=int(habits["reports"]))
        if "raises" in habits:
            raise habits["raises"]
        return reading

    def _untrue(self, reading: Any) -> Any:
        """Spoil the torque as the emulated sensor does."""
        habits, torque_nm = self.habits, reading.torque_nm
        self._ticks += 1
        if "late" in habits:
            self._past.append(torque_nm)
            ready = len(self._past) > habits["late"] * self.rate_hz
            torque_nm = self._past.popleft() if ready else self._past[0]
        torque_nm *= habits.get("gain", 1.0)
        torque_nm += habits.get("offset", 0.0)
        if "zeros" in habits:  # a subject who pushes, and a sensor that drops one sample of twenty
            torque_nm = torque_nm - habits["zeros"] if self._ticks % 20 else 0.0
        if "toggles" in habits:
            torque_nm = 0.0005 * (self._ticks % 2)
        if "axis_constant" in habits:
            self._constant_nm = torque_nm if math.isnan(self._constant_nm) else self._constant_nm
            torque_nm = self._constant_nm
        reading = reading._replace(torque_nm=torque_nm)
        for name, sends_s in (("pauses", habits.get("pauses", 0.0)), ("bursts", 0.005)):
            if name in habits and self._sent is not None:
                phase_s = (self._ticks / self.rate_hz) % (sends_s + habits[name])
                if phase_s >= sends_s:
                    reading = reading._replace(
                        torque_nm=self._sent.torque_nm, torque_time_s=self._sent.torque_time_s
                    )
        self._sent = reading
        return reading

    def _see(self, reading: Any) -> Any:
        self.trace.append((reading.motion_time_s, reading.angle_rad, reading.velocity_rad_s))
        return reading

    def write(self, velocity_rad_s: float) -> float:
        if "does not follow" in self.habits:
            self.inner.write(0.0)
            return velocity_rad_s
        if "runs away" in self.habits:
            self.inner.write(self.habits["runs away"])
            return velocity_rad_s if self.powered else 0.0
        if "drifts" in self.habits:
            self.inner.write(velocity_rad_s + self.habits["drifts"])
            return velocity_rad_s if self.powered else 0.0
        return self.inner.write(velocity_rad_s)
