"""Send and receive the frames of one CANopen node; decisions are made in `drive`.

Only the functions that say so wait, and no thread sends anything by itself. Times are those of the
caller's clock, not python-can's time stamps, which are wall time. Frames that cannot be sent or
decoded are counted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rigidimeter.devices.base import DeviceError, Now
from rigidimeter.devices.cia402.setup import Cia402Settings, library
from rigidimeter.devices.cia402.state_words import (
    BOOTED,
    OPERATIONAL,
    PROFILE_VELOCITY,
    SYNC_ID,
    Control,
    Nmt,
    State,
    command_bytes,
    emergency,
    frames,
    position_of,
    sdo_write_bytes,
    state_of,
    velocity_of,
)

COMMUNICATION = (0x81, 0x82)
"""The upper bytes of the error codes of a node that misses frames (CiA 301)."""

QUIET_S = 0.01
LONGEST_DRAIN_S = 0.5


class NodeBus:
    """Send to one node, and store what it reported last.

    Parameters
    ----------
    settings : Cia402Settings
    now : callable
        Seconds on the loop's clock.
    who : str
        Name of the drive in error messages.
    """

    def __init__(self, settings: Cia402Settings, now: Now, who: str) -> None:
        self._settings, self._now, self._who = settings, now, who
        self._ids = frames(settings.node_id)
        self._can: Any = None
        self._bus: Any = None
        self._position: int | None = None
        self._velocity: int | None = None
        self._beaten_s = -math.inf
        self.statusword = 0
        self.mode = 0
        self.raw = (0, 0)
        """Position and velocity of the last complete measurement, in the drive's units."""
        self.sequence = 0
        """Number of complete measurements received."""
        self.sync_s = -math.inf
        """When the last SYNC was sent."""
        self.asked_s = math.inf
        """When the oldest unanswered SYNC was sent; infinite if all are answered."""
        self.heard_s = -math.inf
        """When the last heartbeat was read."""
        self.network_state = BOOTED
        """The NMT state in that heartbeat."""
        self.booted = False
        """Whether the node restarted; reset by `configure`."""
        self.left_operation = False
        """Whether a measurement showed another state or mode; reset by `enable`.

        The command that keeps a drive in operation also brings back one that fell to switched on,
        so a later measurement may show nothing of it.
        """
        self.alarmed = False
        """Whether an emergency message arrived; reset by `enable` and `reset_fault`."""
        self.unheard = False
        """Whether one said that the node misses our frames; reset by `enable`.

        It also says so some time after a session's end, while the next is being configured.
        """
        self.emergency = 0
        self.counts = dict.fromkeys(
            ("received", "lost", "damaged", "unsent", "backlog", "emergencies"), 0
        )

    @property
    def is_open(self) -> bool:
        """Whether the bus is open."""
        return self._bus is not None

    @property
    def state(self) -> State:
        """The state that the drive last reported."""
        return state_of(self.statusword)

    @property
    def in_operation(self) -> bool:
        """Whether the drive last reported that it is enabled, and in the right mode."""
        return self.state is State.OPERATION_ENABLED and self.mode == PROFILE_VELOCITY

    def open(self) -> None:
        """Open the bus.

        Raises
        ------
        DeviceError
            If python-can cannot open it.
        """
        if self._bus is not None:
            return
        library("canopen")
        self._can = can = library("can")
        settings = self._settings
        more = {"port": settings.port} if settings.interface == "udp_multicast" else {}
        try:
            self._bus = can.Bus(
                interface=settings.interface,
                channel=settings.channel,
                bitrate=settings.bitrate,
                ignore_config=True,
                **more,
            )
        except Exception as error:  # each interface raises what its vendor's library does
            raise DeviceError(
                f"{self._who}: the bus does not open ({error}); check interface, channel and that "
                "the operating system has brought the bus up"
            ) from None
        self._command = self._message(self._ids.command, command_bytes(0, 0))
        self._sync = self._message(SYNC_ID)
        self._heartbeat = self._message(0x700 + settings.master_id, bytes([OPERATIONAL]))

    def close(self) -> None:
        """Close the bus."""
        bus, self._bus = self._bus, None
        if bus is not None:
            bus.shutdown()

    def network(self, command: Nmt) -> None:
        """Send a network management command to the node."""
        self._send(self._message(0, bytes([command, self._settings.node_id])))

    def ask(self, control: Control, target: int) -> bool:
        """Send a SYNC, a command and, if due, our heartbeat; return if the command was sent.

        The SYNC comes first, so that the drive reports the state that it fell to by itself before
        the command can bring it back.
        """
        now_s = self._now()
        self._send(self._sync)
        self.sync_s = now_s
        self.asked_s = min(self.asked_s, now_s)
        self._command.data[:] = command_bytes(control, target)
        sent = self._send(self._command)
        if now_s - self._beaten_s >= self._settings.heartbeat_s:
            self._send(self._heartbeat)
            self._beaten_s = now_s
        return sent

    def send_both_ways(self, control: Control) -> None:
        """Send a controlword in the command frame and as an SDO write, which needs no mapping."""
        self.ask(control, 0)
        self._send(self._message(self._ids.sdo_request, sdo_write_bytes(0x6040, 0, control, 2)))

    def receive(self, wait_s: float = 0.0) -> bool:
        """Process one frame, waiting for it up to `wait_s`; return whether there was one."""
        if self._bus is None:
            return False
        try:
            message = self._bus.recv(wait_s)
        except (self._can.CanError, OSError):
            self.counts["damaged"] += 1
            return True
        if message is None:
            return False
        if message.is_error_frame or message.is_remote_frame or message.is_extended_id:
            self.counts["damaged"] += message.is_error_frame
        elif not self._take(message.arbitration_id, message.data):
            self.counts["damaged"] += 1
        return True

    def drain(self, wait_s: float = 0.0) -> None:
        """Process frames that piled up, until none arrives for `wait_s`."""
        until_s = self._now() + LONGEST_DRAIN_S
        while self.receive(wait_s) and self._now() < until_s:
            pass
        self._position = self._velocity = None
        self.asked_s = math.inf

    @contextmanager
    def sdo_client(self) -> Iterator[Any]:
        """Yield an SDO client; its receiving thread ends with the context."""
        canopen = library("canopen")
        # Late answers to SDO writes that nobody waited for must not be mistaken for new ones.
        self.drain(QUIET_S)
        network = canopen.Network(self._bus)
        node = network.add_node(
            canopen.RemoteNode(self._settings.node_id, canopen.ObjectDictionary())
        )
        node.sdo.RESPONSE_TIMEOUT = self._settings.sdo_timeout_s
        network.subscribe(self._ids.heartbeat, lambda _id, data, _at: self._take_heartbeat(data))
        notifier = self._can.Notifier(self._bus, network.listeners, QUIET_S)
        try:
            yield node.sdo
        finally:
            notifier.stop()

    def _message(self, identifier: int, data: bytes = b"") -> Any:
        return self._can.Message(
            arbitration_id=identifier, data=bytearray(data), is_extended_id=False
        )

    def _send(self, message: Any) -> bool:
        try:
            self._bus.send(message, timeout=0)
        except (self._can.CanError, OSError):
            # Not raised: the drive will not answer a frame it did not receive and counts as lost.
            self.counts["unsent"] += 1
            return False
        return True

    def _take(self, identifier: int, data: bytearray) -> bool:
        """Decode one frame; return False if it is damaged."""
        ids = self._ids
        if identifier == ids.position:
            report = position_of(data)
            if report is None:
                return False
            self.counts["lost"] += self._position is not None
            self.statusword, self.mode, self._position = report
            self.left_operation = self.left_operation or not self.in_operation
        elif identifier == ids.velocity:
            self._velocity = velocity_of(data)
            if self._velocity is None:
                return False
        elif identifier == ids.heartbeat:
            return self._take_heartbeat(data)
        elif identifier == ids.emergency:
            return self._take_emergency(data)
        else:
            return True
        if self._position is not None and self._velocity is not None:
            self.raw = (self._position, self._velocity)
            self._position = self._velocity = None
            self.asked_s = math.inf
            self.sequence += 1
            self.counts["received"] += 1
        return True

    def _take_heartbeat(self, data: bytearray) -> bool:
        if len(data) != 1:
            return False
        self.network_state = data[0] & 0x7F
        self.heard_s = self._now()
        self.booted = self.booted or self.network_state == BOOTED
        return True

    def _take_emergency(self, data: bytearray) -> bool:
        report = emergency(data)
        if report is None:
            return False
        if report.code:  # 0 revokes earlier ones, which are kept all the same
            self.emergency = report.code
            if report.code >> 8 in COMMUNICATION:
                self.unheard = True
            else:
                self.alarmed = True
            self.counts["emergencies"] += 1
        return True
