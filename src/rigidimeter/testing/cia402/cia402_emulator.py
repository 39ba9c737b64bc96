"""An emulated CANopen servo drive, profile CiA 402, that can be made to misbehave.

It works with any master: SDO, commands and SYNC with the mapping that the master wrote, network
management, heartbeats in both directions. If the master goes silent while the drive moves, the
drive stops by itself: when the master's heartbeat (0x1016) or the command deadline (0x1400:05)
expires, it sends an emergency, 0x8130 or 0x8250, and acts as set in 0x6007, usually by a quick stop
along 0x6085.

Two threads use it under a lock: python-can's receiver, and one that checks the deadlines about
every millisecond.
"""

from __future__ import annotations

import importlib
import threading
import time
from collections.abc import Collection, Iterator
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.testing.cia402.object_dictionary import (
    COMMAND_MESSAGES,
    INVALID,
    MEASUREMENT_MESSAGES,
    PROFILE_VELOCITY,
    dictionary,
)
from rigidimeter.testing.cia402.servo import (
    BOUNDS,
    CIA402_MISBEHAVIOURS,
    DEFAULTS,
    GENERIC_ERROR,
    POWERED,
    UNITS_PER_RAD,
    Phase,
    Servo,
    statusword,
)
from rigidimeter.testing.emulated_arm import EmulatedArm

WATCH_S = 0.001
HEARTBEAT_LOST, COMMAND_LOST = 0x8130, 0x8250
WRONG_VALUE = 0x06090030


class Cia402Emulator:
    """One node on a bus of its own; `close` it.

    Parameters
    ----------
    arm : EmulatedArm
        The arm it moves.
    interface, channel : str
        Of python-can.
    node_id : int
    without : collection of int
        Objects that this drive does not have.
    options : Any
        Further arguments of python-can, such as `port`.
    """

    def __init__(
        self,
        arm: EmulatedArm,
        *,
        interface: str,
        channel: str,
        node_id: int = 1,
        without: Collection[int] = (),
        **options: Any,
    ) -> None:
        try:
            can, canopen = importlib.import_module("can"), importlib.import_module("canopen")
        except ModuleNotFoundError as error:
            raise UserError(
                f"the emulated servo needs the package {error.name}, which is not installed: "
                "pip install 'rigidimeter[canopen]'"
            ) from None
        self._can, self._abort = can, canopen.SdoAbortedError
        self._arm, self._node_id = arm, node_id
        self._lock = threading.RLock()
        self._servo = Servo(arm, self)
        self.inputs = 1
        """The digital inputs; bit 0 is a contact that opens when a button is pressed."""
        self._later: list[tuple[float, bytes]] = []
        self.log: list[tuple[float, str]] = []
        """Events with their times."""
        self._forget()
        self._bus = can.Bus(interface=interface, channel=channel, ignore_config=True, **options)
        self._network = network = canopen.Network(self._bus)
        network.send_message = self._transmit
        rated_mnm = self._servo.rated_torque_mnm
        objects = dictionary(canopen.objectdictionary, node_id, rated_mnm, without)
        self._node = node = network.create_node(canopen.LocalNode(node_id, objects))
        network.unsubscribe(0x600 + node_id, node.sdo.on_request)
        network.subscribe(0x600 + node_id, self._on_sdo_request)
        node.add_read_callback(self._on_read)
        node.add_write_callback(self._on_write)
        node.nmt.send_command(0x81)
        node.nmt.send_command(0x80)
        network.listeners.append(self._on_frame)
        self._notifier = can.Notifier(self._bus, network.listeners, 0.02)
        self._ended = threading.Event()
        self._watch = threading.Thread(target=self._watching, name=f"node {node_id}")
        self._watch.start()

    def misbehave(self, name: str, value: Any = None) -> None:
        """Start the misbehaviour of this name in `CIA402_MISBEHAVIOURS`."""
        if name not in CIA402_MISBEHAVIOURS:
            raise ValueError(f"{name!r} is none of {', '.join(CIA402_MISBEHAVIOURS)}")
        with self._lock:
            self.note(f"misbehaves: {name}")
            self._servo.wrong[name] = DEFAULTS.get(name) if value is None else value
            if name == "fault":
                self._servo.fault(self._servo.wrong[name], name)
            elif name == "emergency":
                self.emergency(self._servo.wrong[name], GENERIC_ERROR)
            elif name == "short emergency":
                message = bytes.fromhex("1042010000000000")[: int(self._servo.wrong[name])]
                self._transmit(0x80 + self._node_id, message)
            elif name == "leave operation":
                self._servo.go(Phase.SWITCH_ON_DISABLED, name)
            elif name == "fall to switched on":
                del self._servo.wrong[name]
                self._servo.go(Phase.SWITCHED_ON, name)
            elif name == "encoder frozen":
                self._servo.wrong[name] = self._servo.measured()
            elif name == "torque frozen":
                self._servo.wrong[name] = self._servo.torque()
            elif name in ("stop heartbeat", "die"):
                self._node.nmt.stop_heartbeat()
            elif name == "reboot":
                del self._servo.wrong[name]
                self._reboot()
            self._servo.move()

    def behave(self) -> None:
        """End all misbehaviours, like a repaired drive; its state is unchanged."""
        with self._lock:
            self.note("behaves")
            self._servo.wrong.clear()
            self._node.nmt.start_heartbeat(self.value(0x1017))
            self._servo.move()

    def state(self) -> dict[str, Any]:
        """Return the state of the arm and of the drive."""
        with self._lock:
            angle_rad, velocity_rad_s = self._arm.motion()
            return {
                "angle_rad": angle_rad,
                "velocity_rad_s": velocity_rad_s,
                "power": self._servo.phase in POWERED,
                "state": self._servo.phase.name,
                "network": self._node.nmt.state,
                "target_rad_s": self._servo.target() / UNITS_PER_RAD,
                "stop_reason": self._servo.last_stop.reason,
                "stop_began_s": self._servo.last_stop.began_s,
                "stop_rest_s": self._servo.last_stop.rest_s,
            }

    def close(self) -> None:
        """Leave the bus."""
        if self._ended.is_set():
            return
        self._ended.set()
        self._watch.join()
        self._node.nmt.stop_heartbeat()
        self._notifier.stop()
        self._bus.shutdown()

    # State of the node

    def _forget(self) -> None:
        self._heartbeat_s: float | None = None  # None: not monitored
        self._command_s: float | None = None
        self._syncs = 0

    def _reboot(self) -> None:
        self._servo.restart()
        self._node.nmt.stop_heartbeat()
        self._node.data_store.clear()
        self._forget()
        self._node.nmt.send_command(0x81)
        self._node.nmt.send_command(0x80)

    # Functions that the servo uses

    def has(self, index: int) -> bool:
        """Return whether there is such an object."""
        return index in self._node.object_dictionary

    def value(self, index: int, subindex: int = 0) -> int:
        """Return an object's value."""
        kind = self._node.object_dictionary[index]
        entry = kind if not hasattr(kind, "subindices") else kind[subindex]
        return int(entry.decode_raw(self._node.get_data(index, subindex)))

    def emergency(self, code: int, register: int) -> None:
        """Send an emergency message."""
        self.note(f"emergency 0x{code:04X}")
        self._node.data_store.setdefault(0x603F, {})[0] = code.to_bytes(2, "little")
        self._node.data_store.setdefault(0x1001, {})[0] = bytes([register])
        self._node.emcy.send(code, register)

    def changed(self) -> None:
        """Send the PDOs that are triggered by a change instead of SYNC."""
        if self._operational():
            for index in MEASUREMENT_MESSAGES:
                if self.value(index, 2) >= 254:
                    self._send_measurements(index)

    def note(self, event: str) -> None:
        """Log an event."""
        self.log.append((time.monotonic(), event))

    # SDO requests

    def _on_sdo_request(self, _identifier: int, data: bytearray, _time: float) -> None:
        with self._lock:
            if "die" in self._servo.wrong or self._node.nmt.state == "STOPPED":
                return
            if "slow answers" in self._servo.wrong:
                self._later.append(
                    (time.monotonic() + self._servo.wrong["slow answers"], bytes(data))
                )
                return
            self._node.sdo.on_request(0, data, 0.0)

    def _on_read(self, index: int, subindex: int, **_: Any) -> int | None:
        if index == 0x6041:
            return statusword(self._servo.phase) | self._servo.bound_bits()
        if index == 0x60FD:
            return self.inputs & ~1 if "press button" in self._servo.wrong else self.inputs
        if index == 0x6072 and "wrong bound" in self._servo.wrong:
            return int(self._servo.wrong["wrong bound"])
        if index == 0x6061:
            shown = self._servo.wrong.get("change mode")
            return self.value(0x6060) if shown is None else int(shown)
        if index == 0x6064:
            return self._servo.measured()[0]
        if index == 0x606C:
            return self._servo.measured()[1]
        if index == 0x6077:
            return self._servo.torque()
        if index == 0x60FF and "stale target" in self._servo.wrong:
            return round(self._servo.target())
        if (index, subindex) == (0x1016, 1) and "wrong watchdog" in self._servo.wrong:
            return int(self._servo.wrong["wrong watchdog"])
        return None

    def _on_write(self, index: int, subindex: int, data: bytes, **_: Any) -> None:
        if index == 0x6060 and data[0] not in (0, PROFILE_VELOCITY):
            raise self._abort(WRONG_VALUE)
        if index == 0x6040:
            self._servo.control(int.from_bytes(data, "little"))
        if index in (0x6040, 0x60FF, *BOUNDS):
            # canopen stores the value after this callback; the servo needs it now.
            self._node.data_store.setdefault(index, {})[subindex] = bytes(data)
            self._servo.move()

    # Other frames

    def _operational(self) -> bool:
        return bool(self._node.nmt.state == "OPERATIONAL")

    def _on_frame(self, message: Any) -> None:
        identifier, data = message.arbitration_id, message.data
        with self._lock:
            if "die" in self._servo.wrong or message.is_error_frame or message.is_remote_frame:
                return
            if identifier == 0 and len(data) == 2 and data[1] in (0, self._node_id):
                if data[0] in (0x81, 0x82):
                    self._reboot()
                return
            if 0x700 < identifier < 0x780:
                self._on_heartbeat(identifier - 0x700)
            elif self._operational():
                if identifier == 0x80:
                    self._on_sync()
                for index in COMMAND_MESSAGES:
                    if identifier == self.value(index, 1):
                        self._on_command(index, bytes(data))

    def _on_heartbeat(self, node_id: int) -> None:
        watched = self.value(0x1016, 1)
        if node_id == watched >> 16 and watched & 0xFFFF:
            if self._heartbeat_s is None:
                self.note("watches the master's heartbeat")
            self._heartbeat_s = time.monotonic()

    def _mapping(self, index: int) -> Iterator[tuple[int, int, int]]:
        """Yield index, subindex and size in bytes of the objects mapped to a PDO."""
        for k in range(1, self.value(index + 0x200) + 1):
            entry = self.value(index + 0x200, k)
            yield entry >> 16, entry >> 8 & 0xFF, (entry & 0xFF) // 8

    def _on_command(self, index: int, data: bytes) -> None:
        at = 0
        mapped = list(self._mapping(index))
        if len(data) < sum(size for _, _, size in mapped):
            return
        self._command_s = time.monotonic()
        parts = []
        for entry, subindex, size in mapped:
            parts.append((entry, subindex, data[at : at + size]))
            at += size
        # The controlword is last, so that a new state starts with the new target.
        for entry, subindex, part in sorted(parts, key=lambda part: part[0] == 0x6040):
            self._node.set_data(entry, subindex, part)

    def _on_sync(self) -> None:
        self._syncs += 1
        for index in MEASUREMENT_MESSAGES:
            every = self.value(index, 2)
            if 1 <= every <= 240 and self._syncs % every == 0:
                self._send_measurements(index)

    def _send_measurements(self, index: int) -> None:
        identifier = self.value(index, 1)
        wrong = self._servo.wrong
        silent = "stop measurements" in wrong or (index == 0x1802 and "stop inputs" in wrong)
        if identifier & INVALID or silent:
            return
        parts = [
            self._node.get_data(entry, sub)[:size] for entry, sub, size in self._mapping(index)
        ]
        self._transmit(identifier & 0x7FF, b"".join(parts))

    def _transmit(self, identifier: int, data: Any, remote: bool = False) -> None:
        if "die" in self._servo.wrong or remote:
            return
        can = self._can
        try:
            self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))
        except can.CanError as error:
            self.note(f"not sent: {error}")

    # Deadlines

    def _watching(self) -> None:
        while not self._ended.wait(WATCH_S):
            with self._lock:
                now_s = time.monotonic()
                self._watch_connection(now_s)
                self._servo.watch_rest(now_s)
                self._servo.watch_bounds()
                due = [data for at_s, data in self._later if at_s <= now_s]
                self._later = [item for item in self._later if item[0] > now_s]
                for data in due:
                    self._node.sdo.on_request(0, data, 0.0)

    def _watch_connection(self, now_s: float) -> None:
        limit_s = (self.value(0x1016, 1) & 0xFFFF) * 1e-3
        if self._heartbeat_s is not None and limit_s and now_s - self._heartbeat_s > limit_s:
            self._heartbeat_s = None
            self._servo.connection_lost(HEARTBEAT_LOST, "heartbeat lost")
        limit_s = self.value(COMMAND_MESSAGES[0], 5) * 1e-3
        if self._command_s is not None and limit_s and now_s - self._command_s > limit_s:
            self._command_s = None
            self._servo.connection_lost(COMMAND_LOST, "command deadline passed")
