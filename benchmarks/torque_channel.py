"""What the drive's own torque costs a tick: CPU time with and without it, in turn.

The real loop runs at rest as fast as it goes, with the CiA 402 driver, the ring of the recorder,
and a stand-in for the CAN interface that answers each SYNC at once: with a velocity frame of six
bytes, velocity and torque, and with one of four. The least of some runs is taken: whatever else the
machine does only adds.

    python -m benchmarks.torque_channel
"""

from __future__ import annotations

import argparse
import math
import struct
import time
from collections import deque
from typing import Any

from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition import ControlLoop, rest
from rigidimeter.rig.acquisition.processes import SampleRing
from rigidimeter.rig.devices import Cia402Drive, Cia402Settings, ComposedRig, Control
from rigidimeter.rig.devices.base import TorqueSample

SECONDS = 10.0
RATE_HZ = 1000.0
SYNC, POSITION, VELOCITY = 0x080, 0x181, 0x281
OPERATIONAL = 5


class Clock:
    """It is always exactly the deadline, and says so to the driver."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def wait_until(self, deadline_s: float) -> float:
        """Return the deadline itself."""
        self.time_s = deadline_s
        return deadline_s

    def now_s(self) -> float:
        """Return the last deadline."""
        return self.time_s


class Frame:
    """As python-can has them."""

    def __init__(self, identifier: int, data: bytes) -> None:
        self.arbitration_id, self.data = identifier, bytearray(data)


class Port:
    """Answers each SYNC at once, for a drive that is enabled and stands still."""

    is_open, bus = True, None

    def __init__(self, with_torque: bool) -> None:
        self._velocity = struct.pack("<ih", 0, 25) if with_torque else struct.pack("<i", 0)
        self._came: deque[Frame] = deque()
        self._sent = 0

    def message(self, identifier: int, data: bytes = b"") -> Frame:
        """Return a frame."""
        return Frame(identifier, data)

    def send(self, frame: Frame) -> bool:
        """Take a frame."""
        if frame.arbitration_id == SYNC:
            self._sent += 1
            position = struct.pack("<Hbi", 0x0637, 3, self._sent % 3)
            self._came += (Frame(POSITION, position), Frame(VELOCITY, self._velocity))
        return True

    def receive(self, _: float = 0.0) -> tuple[bool, Frame | None]:
        """Return the next frame."""
        return (True, self._came.popleft()) if self._came else (False, None)


class Sensor:
    """Some noise at every tick."""

    def __init__(self, clock: Clock) -> None:
        self._clock, self._read = clock, 0
        self.counts: dict[str, int] = {}

    def read(self) -> TorqueSample:
        """Return a new sample."""
        self._read += 1
        return TorqueSample(0.01 * math.sin(self._read), self._clock.time_s, self._read)


def enabled_drive(clock: Clock, with_torque: bool) -> Any:
    """Return a driver that has been through its set-up, on a port of ours."""
    drive: Any = Cia402Drive(Cia402Settings(interface="virtual"), clock.now_s)
    wire = drive._wire
    wire._port = port = Port(with_torque)
    wire._command, wire._sync = port.message(0x201, bytes(6)), port.message(SYNC)
    wire._heartbeat = port.message(0x77F, bytes([OPERATIONAL]))
    wire.has_torque = with_torque
    drive._nm_per_permille = 0.01 if with_torque else math.nan
    drive._configured, drive._control = True, Control.ENABLE_OPERATION
    wire.heard_s, wire.network_state = math.inf, OPERATIONAL
    wire.ask(drive._control, 0)
    while wire.receive():
        pass
    wire.left_operation = False
    return drive


def tick_us(with_torque: bool) -> float:
    """Return the CPU time of a tick, in µs."""
    clock, ring = Clock(), SampleRing.create(1024)

    def record(sample: Any) -> None:
        ring.push(sample)
        ring.recorded = ring.written

    sensor: Any = Sensor(clock)
    rig = ComposedRig(sensor, enabled_drive(clock, with_torque), RATE_HZ)
    loop = ControlLoop(Settings(), rig, clock, record)
    began_s = time.process_time()
    result = rest(loop, SECONDS, 0.35)
    took_s = time.process_time() - began_s
    last = ring.held_rows()[-1]
    ring.close()
    assert not result.cause, result.cause
    assert math.isfinite(last["drive_torque_nm"]) == with_torque
    return 1e6 * took_s / loop.tick


def main() -> None:
    """Print what a tick costs with and without the torque."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--repeats", type=int, default=8)
    repeats = parser.parse_args().repeats
    found = [(tick_us(True), tick_us(False)) for _ in range(repeats)]
    ours, without = (min(column) for column in zip(*found, strict=True))
    print(
        f"{ours:.1f} µs a tick, {without:.1f} µs without the drive's torque: {ours / without:.3f}"
    )


if __name__ == "__main__":
    main()
