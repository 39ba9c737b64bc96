"""What a serial drive said last: position, velocity, status, and the first thing that was wrong.

The position's stamp is the end of the request, found from the end of the reply and the time its
characters take.
"""

from __future__ import annotations

import math

from rigidimeter.devices.ascii.ascii_language import Reply, get, parse, seconds
from rigidimeter.devices.ascii.line import Exchange
from rigidimeter.devices.ascii.setup import STATUS_DISABLED, STATUS_FAULTS
from rigidimeter.guard import Cause

__all__ = ["Feedback"]

DAMAGED_IN_A_ROW = 3


class Feedback:
    """Replies in; position and velocity in the drive's units, and a cause, out.

    Parameters
    ----------
    baud : int
    jump, fastest : float
        How far the position may be from where it was, in counts: so much, and so much a second.
    state_on : int
        The desired state of a drive that has power.
    """

    def __init__(self, baud: int, jump: float, fastest: float, state_on: int) -> None:
        self._baud, self._jump, self._fastest, self._state_on = baud, jump, fastest, state_on
        self.position = self.speed = self.status = 0
        """In counts, in 0.1 counts/s, and the event status."""
        self.position_s = -math.inf
        self.sequence = -1
        self.cause = Cause.NONE
        self.heard_s = 0.0
        self.refused = False
        """A move was refused once: the next answers say why."""
        self.counts = dict.fromkeys(("received", "lost", "damaged", "refused", "skipped"), 0)
        self._damaged_in_a_row = 0

    def latch(self, cause: Cause) -> None:
        """Keep the first cause."""
        if self.cause is Cause.NONE:
            self.cause = cause

    def begin(self, position: int, speed: int, status: int, now_s: float) -> None:
        """Begin again from a fresh sample, without the causes of a life before."""
        self.cause = Cause.NONE
        self.refused = False
        self._damaged_in_a_row = 0
        self.position, self.position_s, self.sequence = position, now_s, 0
        self.speed, self.heard_s = speed, now_s
        self._take_status(status, commanding=False)

    def hear(self, exchange: Exchange, *, commanding: bool) -> None:
        """Take one answer; what is wrong with it is latched."""
        request, text, at_s = exchange
        if text is None:
            self.counts["lost"] += 1
            self.latch(Cause.DRIVE_LOST)
            return
        self.heard_s = at_s
        reply = parse(text)
        if reply.kind == "e":
            self.counts["refused"] += 1
            if request == "t 1" and not self.refused:
                self.refused = True
            else:
                self.latch(Cause.DRIVE_FAULT)
        elif reply.kind != ("v" if request.startswith("g") else "ok"):
            self.counts["damaged"] += 1
            self._damaged_in_a_row += 1
            if self._damaged_in_a_row >= DAMAGED_IN_A_ROW:
                self.latch(Cause.DRIVE_LOST)
        else:
            self.counts["received"] += 1
            self._damaged_in_a_row = 0
            self._take(request, reply, at_s - seconds(len(text) + 1, self._baud), commanding)

    def _take(self, request: str, reply: Reply, asked_s: float, commanding: bool) -> None:
        if request == get(0x32):
            reach = self._jump + self._fastest * max(0.0, asked_s - self.position_s)
            if abs(reply.value - self.position) > reach:
                self.latch(Cause.NOT_FOLLOWING)
            self.position, self.position_s = reply.value, asked_s
            self.sequence += 1
        elif request == get(0x18):
            self.speed = reply.value
        elif request == get(0xA0):
            self._take_status(reply.value, commanding)
        elif request == get(0x24) and commanding and reply.value != self._state_on:
            self.latch(Cause.DRIVE_STATE)

    def _take_status(self, status: int, commanding: bool) -> None:
        self.status = status
        if status & STATUS_FAULTS:
            self.latch(Cause.DRIVE_FAULT)
        elif commanding and status & STATUS_DISABLED:
            self.latch(Cause.DRIVE_STATE)
