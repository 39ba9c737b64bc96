"""The ASCII language of Copley servo drives: registers, replies, and moves that end by themselves.

    s r0xNN value   set a register        -> ok
    g r0xNN         read a register       -> v value
    t 1 / t 0       start / abort a move  -> ok
                                             e code, where a request is refused

Each line ends with a carriage return. Registers used, in counts of the position encoder:

    0x24 desired state: 0 off, 11 programmed velocity, 21 trajectory generator
    0x2f programmed velocity, 0x18 actual velocity, both in 0.1 counts/s; 0x32 actual position
    0x36, 0x37 acceleration and deceleration of the velocity loop, in 1000 counts/s²
    0xc8 profile: 0 absolute trapezoid; 0xca target, 0xcb velocity in 0.1 counts/s
    0xcc, 0xcd, 0xcf acceleration, deceleration, deceleration of an abort, in 10 counts/s²
    0xa0 event status, 0xa4 latched faults; 0x90 baud rate; 0x81 serial number, 0x92 model

The baud change, the states, the units of 0x18, 0x2f, 0x36, 0x37 and 0xca..0xcd and the profile 0
are those of published programs for such drives. From memory of the public programmer's guide, and
to be verified at commissioning: the bits of the event status, 0x81, 0x92 and 0xcf, that `t 1` takes
a changed target and velocity while a move runs, and that `t 0` at rest changes nothing.

A move is absolute, not relative. What a relative move started during another one is relative *to*
(the place, or the target before) is not said alike everywhere; in the second reading every renewal
would add to the way still to go, and a dead computer would leave a long move behind. The same
absolute target sent twice is the same target.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rigidimeter.devices.ascii.line import BITS_PER_CHARACTER, Exchange
from rigidimeter.guard import Cause

__all__ = [
    "DISABLED_BITS",
    "FAULT_BITS",
    "STATUS_DISABLED",
    "STATUS_FAULTS",
    "Feedback",
    "Reply",
    "get",
    "move_target",
    "named_bits",
    "parse",
    "seconds",
    "set_",
]

FAULT_BITS = {
    0: "short circuit",
    1: "drive too hot",
    2: "supply voltage too high",
    3: "supply voltage too low",
    4: "motor too hot",
    5: "encoder error",
    6: "motor phasing error",
    18: "following error",
    22: "latched fault",
    30: "command input lost",
}
"""Bits of the event status that are faults."""

DISABLED_BITS = {
    11: "enable input not active",
    12: "disabled by software",
    15: "output stage off",
}
"""Bits of the event status of a drive without power."""

STATUS_FAULTS = sum(1 << bit for bit in FAULT_BITS)
STATUS_DISABLED = sum(1 << bit for bit in DISABLED_BITS)
DAMAGED_IN_A_ROW = 3


class Reply(NamedTuple):
    """What a line says: `kind` is ok, v, e, or ? for anything else."""

    kind: str
    value: int = 0


def parse(line: str) -> Reply:
    """Read a reply.

    >>> parse("v -120")
    Reply(kind='v', value=-120)
    >>> parse("ok"), parse("e 33").kind, parse("v 12x").kind
    (Reply(kind='ok', value=0), 'e', '?')
    """
    if line == "ok":
        return Reply("ok")
    kind, _, number = line.partition(" ")
    if kind not in ("v", "e"):
        return Reply("?")
    try:
        return Reply(kind, int(number, 0))
    except ValueError:
        return Reply("?")


def get(register: int) -> str:
    """Return the request that reads a register."""
    return f"g r0x{register:02x}"


def set_(register: int, value: int) -> str:
    """Return the request that sets a register."""
    return f"s r0x{register:02x} {value}"


def named_bits(status: int, names: dict[int, str]) -> str:
    """Name the bits that are set, with commas; empty if none is."""
    return ", ".join(name for bit, name in names.items() if status >> bit & 1)


def seconds(characters: int, baud: int) -> float:
    """Return how long characters take on the wire."""
    return characters * BITS_PER_CHARACTER / baud


def move_target(
    position: float, moving: float, wanted: float, deceleration: float, horizon_s: float
) -> int:
    """Return the target of a move that goes on for `horizon_s` and then brakes to rest.

    The place where the drive would come to rest if it braked now, plus the way of the horizon, plus
    the braking way that the wanted velocity adds. Never shorter than the braking way: the
    generator would run past such a target and come back.

    Parameters
    ----------
    position : float
        Now, in counts.
    moving, wanted : float
        The velocity now and the one commanded, in counts/s.
    deceleration : float
        Of the trajectory generator, in counts/s².
    horizon_s : float
        How long to keep the velocity.

    Examples
    --------
    From rest at 1000 counts/s: 50 counts in 0.05 s, and 50 more to brake.

    >>> move_target(0.0, 0.0, 1000.0, 10_000.0, 0.05)
    100

    At that speed already, and told to go slower: the braking way is that of the speed it has.

    >>> move_target(0.0, 1000.0, 100.0, 10_000.0, 0.05)
    55
    """
    rest = position + moving * abs(moving) / (2.0 * deceleration)
    same_way = moving if moving * wanted > 0.0 else 0.0
    added = max(0.0, wanted * wanted - same_way * same_way) / (2.0 * deceleration)
    target = rest + wanted * horizon_s + math.copysign(added, wanted)
    # Away from the place: a move rounded to nothing would stand still for ever.
    return math.ceil(target) if wanted > 0.0 else math.floor(target)


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
