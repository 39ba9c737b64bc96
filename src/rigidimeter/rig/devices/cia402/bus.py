"""Send and receive the frames of one CANopen node; decisions are made in `drive`.

Only the functions that say so wait, and no thread sends anything by itself. Times are those of the
caller's clock, not python-can's time stamps, which are wall time. Frames that cannot be sent or
decoded are counted.

Which SYNC an answer belongs to is not in the answer, and an adapter may hold frames back in a queue
that nobody sees. So there is never more than one question: no SYNC is sent before the one before it
is answered, by one position frame and one velocity frame. What comes late is then old by its stamp,
and no queue of answers can grow. An answer that is lost would end the questions, so after a quarter
of `lost_s` an SDO read is sent, and not waited for. The node had at least a tick for the SYNC, and
frames come in order: once the SDO answer is here, the answer to the SYNC is lost. Until then no
SYNC is sent, and the question is put once, so that no older answer can be mistaken for it. A frame
that nothing asked for, a late one or the answer to another master's SYNC, shows that there is no
such order on this bus, and nothing on it can be placed: `unplaced`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rigidimeter.rig.devices.base import Now
from rigidimeter.rig.devices.cia402.can_port import CanPort
from rigidimeter.rig.devices.cia402.sdo_transfers import library
from rigidimeter.rig.devices.cia402.setup import Cia402Settings
from rigidimeter.rig.devices.cia402.state_words import (
    BOOTED,
    OPERATIONAL,
    PROFILE_VELOCITY,
    STOPPED,
    SYNC_ID,
    Cia402State,
    Control,
    Nmt,
    command_bytes,
    emergency,
    frames,
    inputs_of,
    position_of,
    sdo_answer,
    sdo_read_bytes,
    sdo_write_bytes,
    state_of,
    velocity_of,
    velocity_torque_of,
)

COMMUNICATION = (0x81, 0x82)
"""The upper bytes of the error codes of a node that misses frames (CiA 301)."""

DEVICE_TYPE = 0x1000
"""An object that every node has."""

STOPS = (Control.QUICK_STOP, Control.DISABLE_VOLTAGE)

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
        self._settings, self._now = settings, now
        self._ids = frames(settings.node_id)
        self._statusword = settings.axis(0x6041)
        self._open = False  # the last SYNC is not answered
        self._probing = False  # an SDO read was sent because of that, and is not answered
        self._repeats_s = math.inf  # when a stop is sent again, or what it did is asked for
        self._asks_state = False
        self._position: int | None = None
        self._velocity: tuple[int, int] | None = None  # and torque
        self._beaten_s = -math.inf
        self.statusword = 0
        self.seen_bits = 0
        """Every bit that a statusword had; reset by `enable`."""
        self.inputs: int | None = None
        """The digital inputs, None until their frame came."""
        self.inputs_s = -math.inf
        """When it came last."""
        self.mode = 0
        self.raw = (0, 0)
        """Position and velocity of the last complete measurement, in the drive's units."""
        self.has_torque = False
        """Whether the velocity frame is mapped with the torque in it."""
        self.torque = 0
        """Torque of the last complete measurement, in thousandths of the rated torque."""
        self.sequence = 0
        """Number of complete measurements received."""
        self.measured_s = -math.inf
        """When the SYNC of that measurement was sent."""
        self.sync_s = -math.inf
        """When the last SYNC was sent."""
        self.commanded_s = -math.inf
        """When the last command was sent."""
        self.asked_s = math.inf
        """When the first SYNC after that measurement was due; infinite if none was."""
        self.unplaced = False
        """Whether a frame came that nothing asked for; reset by `drain`."""
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
            ("received", "lost", "damaged", "unsent", "unplaced", "backlog", "emergencies"), 0
        )
        self._port = CanPort(settings, who, self.counts)

    @property
    def is_open(self) -> bool:
        """Whether the bus is open."""
        return self._port.is_open

    @property
    def state(self) -> Cia402State:
        """The state that the drive last reported."""
        return state_of(self.statusword)

    def open(self) -> None:
        """Open the bus.

        Raises
        ------
        DeviceError
            If python-can cannot open it.
        """
        if self._port.is_open:
            return
        self._port.open()
        self._command = self._port.message(self._ids.command, command_bytes(0, 0))
        self._sync = self._port.message(SYNC_ID)
        self._heartbeat = self._port.message(0x700 + self._settings.master_id, bytes([OPERATIONAL]))

    def close(self) -> None:
        """Close the bus."""
        self._port.close()

    def network(self, command: Nmt) -> None:
        """Send a network management command to the node."""
        self._port.send(self._port.message(0, bytes([command, self._settings.node_id])))

    def ask(self, control: Control, target: int) -> bool:
        """Send a SYNC, a command and, if due, our heartbeat; return if the command was sent.

        The SYNC comes first, so that the drive reports the state that it fell to by itself before
        the command can bring it back. It is left out while an answer is awaited.
        """
        self.commanded_s = now_s = self._now()
        late = self._open and now_s - self.sync_s > self._settings.lost_s / 4
        if late and not self._probing:
            self._probing = self._send_sdo(sdo_read_bytes(DEVICE_TYPE, 0))
        elif not (self._open or self._probing):
            self._open = self._port.send(self._sync)
            self.sync_s = now_s
        self.asked_s = min(self.asked_s, now_s)
        self._command.data[:] = command_bytes(control, target)
        sent = self._port.send(self._command)
        if now_s - self._beaten_s >= self._settings.heartbeat_s:
            self._port.send(self._heartbeat)
            self._beaten_s = now_s
        if control in STOPS and now_s > self._repeats_s and (late or self._probing):
            self._repeat_by_sdo(control)
        return sent

    def send_both_ways(self, control: Control) -> None:
        """Send a controlword in the command frame and by SDO; neither is waited for.

        A node that is not operational takes no command frames and does not answer SYNC, but takes
        SDOs; one that is stopped takes neither, and is made pre-operational first. While SYNC
        remains unanswered, `ask` goes on to read the statusword and to send the stop, in turns.
        """
        self._asks_state = False
        self._repeat_by_sdo(control)
        self.ask(control, 0)

    def _repeat_by_sdo(self, control: Control) -> None:
        self._repeats_s = self._now() + self._settings.lost_s / 4
        if self._asks_state:
            self._send_sdo(sdo_read_bytes(*self._statusword))
        else:
            if self.network_state == STOPPED:
                self.network(Nmt.PRE_OPERATIONAL)
            self._send_sdo(sdo_write_bytes(*self._settings.axis(0x6040), control, 2))
        self._asks_state = not self._asks_state

    def receive(self, wait_s: float = 0.0) -> bool:
        """Process one frame, waiting for it up to `wait_s`; return whether there was one."""
        came, message = self._port.receive(wait_s)
        if message is not None and not self._take(message.arbitration_id, message.data):
            self.counts["damaged"] += 1
        return came

    def drain(self, wait_s: float = QUIET_S) -> None:
        """Process frames that piled up, until none arrives for `wait_s`."""
        until_s = self._now() + LONGEST_DRAIN_S
        while self.receive(wait_s) and self._now() < until_s:
            pass
        self._close_question()
        self._probing = self.unplaced = False
        self.asked_s = math.inf

    @contextmanager
    def sdo_client(self) -> Iterator[Any]:
        """Yield an SDO client; its receiving thread ends with the context."""
        canopen = library("canopen")
        # Late answers to SDO writes that nobody waited for must not be mistaken for new ones.
        self.drain()
        network = canopen.Network(self._port.bus)
        node = network.add_node(
            canopen.RemoteNode(self._settings.node_id, canopen.ObjectDictionary())
        )
        node.sdo.RESPONSE_TIMEOUT = self._settings.sdo_timeout_s
        network.subscribe(self._ids.heartbeat, lambda _id, data, _at: self._take_heartbeat(data))
        notifier = self._port.notifier(network.listeners, QUIET_S)
        try:
            yield node.sdo
        finally:
            notifier.stop()

    def _send_sdo(self, request: bytes) -> bool:
        return self._port.send(self._port.message(self._ids.sdo_request, request))

    def _take(self, identifier: int, data: bytearray) -> bool:
        """Decode one frame; return False if it is damaged."""
        ids = self._ids
        if identifier == ids.position:
            report = position_of(data)
            if report is None:
                return False
            self.statusword, self.mode, position = report
            self.seen_bits |= self.statusword
            enabled = self.state is Cia402State.OPERATION_ENABLED
            if not (enabled and self.mode == PROFILE_VELOCITY):
                self.left_operation = True
            if self._expected(self._position is None):
                self._position = position
        elif identifier == ids.velocity:
            velocity = self._velocity_in(data)
            if velocity is None:
                return False
            if self._expected(self._velocity is None):
                self._velocity = velocity
        elif identifier == ids.inputs and self._settings.button_bit >= 0:
            levels = inputs_of(data)
            if levels is None:
                return False
            self.inputs, self.inputs_s = levels, self._now()
        elif identifier == ids.sdo_answer:
            return self._take_sdo_answer(data)
        elif identifier == ids.heartbeat:
            return self._take_heartbeat(data)
        elif identifier == ids.emergency:
            return self._take_emergency(data)
        else:
            return True
        if self._position is not None and self._velocity is not None:
            self.raw = (self._position, self._velocity[0])
            self.torque = self._velocity[1]
            self.measured_s = self.sync_s
            self.asked_s = math.inf
            self.sequence += 1
            self.counts["received"] += 1
            self._close_question()
        return True

    def _velocity_in(self, data: bytearray) -> tuple[int, int] | None:
        if self.has_torque:
            return velocity_torque_of(data)
        velocity = velocity_of(data)
        return None if velocity is None else (velocity, 0)

    def _expected(self, first: bool) -> bool:
        """Return whether a frame is the first of its kind since a SYNC of ours, and note others."""
        if self._open and first:
            return True
        self.unplaced = True
        self.counts["unplaced"] += 1
        return False

    def _close_question(self) -> None:
        self._open = False
        self._position = self._velocity = None

    def _take_sdo_answer(self, data: bytearray) -> bool:
        answer = sdo_answer(data)
        if answer is None:
            return False
        if self._probing and answer.object == DEVICE_TYPE:
            self._probing = False
            self.counts["lost"] += self._open
            self._close_question()
        elif answer.object == self._statusword[0] and answer.value is not None:
            self.statusword = answer.value & 0xFFFF
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
        if report.code:  # 0 revokes earlier ones, which are kept all the same
            self.emergency = report.code
            if report.code >> 8 in COMMUNICATION:
                self.unheard = True
            else:
                self.alarmed = True
            self.counts["emergencies"] += 1
        return len(data) == 8
