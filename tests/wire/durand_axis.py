"""A CiA 402 axis on another CANopen stack than the one that the driver's SDO client is from.

`durand` has NMT, SDO, PDO, SYNC, emergencies and a heartbeat of its own; the consumer of the
master's heartbeat (0x1016) is added here, or left out: then the node accepts it, reads it back as
written, and never acts on it. State machine and arm are those of the emulated servo. What CiA 402
leaves to the drive is left undone: a change of the NMT state does not stop it.
"""

from __future__ import annotations

import logging
import threading
import time
from typing import Any

import can
import durand.scheduler
from durand.datatypes import DatatypeEnum as Type
from durand.network import CANBusNetwork
from durand.node import MinimalNode
from durand.object_dictionary import Record, Variable
from durand.services.nmt import StateEnum

from rigidimeter.testing import POWERED, EmulatedArm, Servo, statusword

logging.getLogger("durand").setLevel(logging.CRITICAL)

OBJECTS = {
    0x6007: (Type.INTEGER16, 1),
    0x6040: (Type.UNSIGNED16, 0),
    0x6041: (Type.UNSIGNED16, 0),
    0x605A: (Type.INTEGER16, 2),
    0x6060: (Type.INTEGER8, 0),
    0x6061: (Type.INTEGER8, 0),
    0x6064: (Type.INTEGER32, 0),
    0x606C: (Type.INTEGER32, 0),
    0x607F: (Type.UNSIGNED32, 2**32 - 1),
    0x6083: (Type.UNSIGNED32, 1_000_000),
    0x6084: (Type.UNSIGNED32, 1_000_000),
    0x6085: (Type.UNSIGNED32, 1_000_000),
    0x60FF: (Type.INTEGER32, 0),
}
MEASURED = (0x6041, 0x6061, 0x6064, 0x606C)


class _Timers(durand.scheduler.AbstractScheduler):
    def __init__(self) -> None:
        self._lock, self._ended = threading.RLock(), False

    @property
    def lock(self) -> Any:
        return self._lock

    def add(self, delay: float, callback: Any, args: Any = (), kwargs: Any = None) -> Any:
        def due() -> None:
            with self._lock:
                if not self._ended:
                    callback(*args, **kwargs or {})

        timer = threading.Timer(delay, due)
        timer.daemon = True
        timer.start()
        return timer

    def cancel(self, entry: Any) -> None:
        entry.cancel()

    def end(self) -> None:
        with self._lock:
            self._ended = True


class DurandAxis:
    """One node; `watches` says whether it has a consumer of the master's heartbeat."""

    def __init__(
        self, arm: EmulatedArm, *, watches: bool = True, node_id: int = 1, **bus: Any
    ) -> None:
        self._timers = _Timers()
        durand.scheduler.set_scheduler(self._timers)
        self._arm, self._watches, self._beaten_s = arm, watches, None
        self._lock = threading.RLock()
        self._bus = can.Bus(ignore_config=True, **bus)
        self._network = CANBusNetwork(self._bus)
        self._network._notifier.timeout = 0.02
        self._node = node = MinimalNode(self._network, node_id)
        self._objects = objects = node.object_dictionary
        objects[0x1008].value = b"durand axis"
        objects[0x1016] = record = Record("Consumer heartbeat time")
        record[1] = Variable(Type.UNSIGNED32, "rw", 0)
        for index, (kind, value) in OBJECTS.items():
            objects[index] = Variable(kind, "ro" if index in MEASURED else "rw", value)
        self._servo = Servo(arm, self)
        for index in MEASURED:
            objects.set_read_callback(index, 0, lambda index=index: self._measured(index))
        objects.download_callbacks[(0x6040, 0)].add(self._controlled)
        objects.download_callbacks[(0x60FF, 0)].add(lambda _: self._moved())
        node.sync.callbacks.add(self._sampled)  # before the PDOs', which send what it stores
        node.nmt.state_callbacks.add(self._network_state)
        self._network.add_subscription(0x77F, self._heard)
        self._ended = threading.Event()
        self._watch = threading.Thread(target=self._watching)
        self._watch.start()

    def state(self) -> dict[str, Any]:
        with self._lock:
            return {
                "velocity_rad_s": self._arm.motion()[1],
                "power": self._servo.phase in POWERED,
                "state": self._servo.phase.name,
                "network": self._node.nmt.state.name,
            }

    def die(self) -> None:
        """Send nothing more, as if its cable were cut."""
        self._network.send = lambda *_: None

    def close(self) -> None:
        self._timers.end()
        self._ended.set()
        self._watch.join()
        self._network.stop()
        self._bus.shutdown()

    # What the servo uses

    def value(self, index: int, subindex: int = 0) -> int:
        return int(self._objects.read(index, subindex))

    def has(self, index: int) -> bool:
        return index in OBJECTS

    def emergency(self, code: int, register: int) -> None:
        self._node.emcy.set(code, register)

    def changed(self) -> None:
        pass

    def note(self, event: str) -> None:
        pass

    # What the stack calls

    def _measured(self, index: int) -> int:
        with self._lock:
            if index == 0x6041:
                return statusword(self._servo.phase)
            if index == 0x6061:
                return self.value(0x6060)
            return self._servo.measured()[index == 0x606C]

    def _sampled(self) -> None:
        for index in MEASURED:
            self._objects.write(index, 0, self._measured(index))

    def _controlled(self, control: int) -> None:
        with self._lock:
            self._servo.control(control)

    def _moved(self) -> None:
        with self._lock:
            self._servo.move()

    def _network_state(self, state: StateEnum) -> None:
        if state == StateEnum.INITIALISATION:
            with self._lock:
                self._servo.restart()
                self._beaten_s = None

    def _heard(self, _identifier: int, _data: bytes) -> None:
        self._beaten_s = time.monotonic()

    def _watching(self) -> None:
        while not self._ended.wait(0.001):
            with self._lock:
                now_s = time.monotonic()
                limit_s = (self.value(0x1016, 1) & 0xFFFF) * 1e-3
                late = self._beaten_s is not None and now_s - self._beaten_s > limit_s > 0
                if late and self._watches:
                    self._beaten_s = None
                    self._servo.connection_lost(0x8130, "heartbeat lost")
                self._servo.watch_rest(now_s)
