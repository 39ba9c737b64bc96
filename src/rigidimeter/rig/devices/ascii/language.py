"""The ASCII language of Copley servo drives: registers, replies, and moves of limited length.

    s r0xNN value   set a register        -> ok
    g r0xNN         read a register       -> v value
    t 1 / t 0       start / abort a move  -> ok
                                             e code, if a request is refused

Each line ends with a carriage return. Registers used, in counts of the position encoder:

    0x24 desired state: 0 off, 11 programmed velocity, 21 trajectory generator
    0x2f programmed velocity, 0x18 actual velocity, both in 0.1 counts/s; 0x32 actual position
    0x0c actual current of the motor, 0x22 its continuous limit, both in 0.01 A
    0x36, 0x37 acceleration and deceleration of the velocity loop, in 1000 counts/s²
    0xc8 profile: 0 absolute trapezoid; 0xca target, 0xcb velocity in 0.1 counts/s
    0xcc, 0xcd, 0xcf acceleration, deceleration, deceleration of an abort, in 10 counts/s²
    0x21 peak current in 0.01 A, 0x3a limit of the velocity loop in 0.1 counts/s, 0xb8 and 0xb9
    positive and negative software limit; see `drive_bounds`
    0xa0 event status, 0xa4 latched faults; 0x90 baud rate; 0x81 serial number, 0x92 model

The baud change, the states, the units of 0x18, 0x2f, 0x36, 0x37 and 0xca..0xcd and profile 0 are
taken from published programs for such drives. The rest is from memory of the public programmer's
guide and must be verified at commissioning: the bits of the event status, 0x0c, 0x21, 0x22, 0x3a,
0x81, 0x92 and 0xcf, that `t 1` accepts a changed target and velocity during a move, and that `t 0`
at rest changes nothing.

Moves are absolute, not relative. Sources disagree on whether a relative move started during another
one starts from the present position or from the previous target. In the second case every command
would lengthen the remaining move, and a computer that dies would leave a long move running. An
absolute target can be sent again without harm.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable
from typing import NamedTuple

from rigidimeter.rig.devices.ascii.line import BITS_PER_CHARACTER, Exchange
from rigidimeter.rig.guard import Cause

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
"""Bits of the event status that mean the drive has no power."""

STATUS_FAULTS = sum(1 << bit for bit in FAULT_BITS)
STATUS_DISABLED = sum(1 << bit for bit in DISABLED_BITS)
DAMAGED_IN_A_ROW = 3
"""Of one register: replies of others do not say that this one can be read."""

NUMBER = re.compile(r"-?(?:0x[0-9a-fA-F]{1,8}|[0-9]{1,10})")
LOWEST, HIGHEST = -(2**31), 2**32 - 1
"""A register holds 32 bits, signed or not."""


class Reply(NamedTuple):
    """A parsed reply: `kind` is ok, v, e, or ? for anything else."""

    kind: str
    value: int = 0


def parse(line: str) -> Reply:
    """Parse a reply.

    >>> parse("v -120")
    Reply(kind='v', value=-120)
    >>> parse("ok"), parse("e 33").kind, parse("v 12x").kind, parse("v 9223372036854775808").kind
    (Reply(kind='ok', value=0), 'e', '?', '?')
    """
    if line == "ok":
        return Reply("ok")
    kind, _, number = line.partition(" ")
    if kind not in ("v", "e") or not NUMBER.fullmatch(number):
        return Reply("?")
    try:
        value = int(number, 0)
    except ValueError:  # such as 007
        return Reply("?")
    return Reply(kind, value) if LOWEST <= value <= HIGHEST else Reply("?")


def addressed(request: str) -> str:
    """Return what a request is about, without a value.

    >>> addressed("s r0xca -5"), addressed("g r0x32"), addressed("t 1")
    ('s r0xca', 'g r0x32', 't 1')
    """
    return " ".join(request.split()[:2])


def read_request(register: int) -> str:
    """Return the request that reads a register."""
    return f"g r0x{register:02x}"


def set_request(register: int, value: int) -> str:
    """Return the request that sets a register."""
    return f"s r0x{register:02x} {value}"


def named_bits(status: int, names: dict[int, str]) -> str:
    """Return the names of the bits that are set, separated by commas."""
    return ", ".join(name for bit, name in names.items() if status >> bit & 1)


def line_time_s(characters: int, baud: int) -> float:
    """Return the time in s that so many characters take on the line."""
    return characters * BITS_PER_CHARACTER / baud


def move_target(
    position: float, moving: float, wanted: float, deceleration: float, horizon_s: float
) -> int:
    """Return the target of a move that lasts for `horizon_s` and then brakes to rest.

    The target is where the drive would stop if it braked now, plus the distance covered in the
    horizon, plus the braking distance that the wanted velocity adds. It is never closer than the
    braking distance, since the generator would overshoot such a target and come back.

    Parameters
    ----------
    position : float
        Present position in counts.
    moving, wanted : float
        Present and commanded velocity in counts/s.
    deceleration : float
        Of the trajectory generator, in counts/s².
    horizon_s : float
        How long to hold the velocity.

    Examples
    --------
    From rest at 1000 counts/s: 50 counts in 0.05 s, and 50 more to brake.

    >>> move_target(0.0, 0.0, 1000.0, 10_000.0, 0.05)
    100

    Already at that speed, and commanded to slow down: the braking distance is that of the present
    speed.

    >>> move_target(0.0, 1000.0, 100.0, 10_000.0, 0.05)
    55
    """
    rest = position + moving * abs(moving) / (2.0 * deceleration)
    same_way = moving if moving * wanted > 0.0 else 0.0
    added = max(0.0, wanted * wanted - same_way * same_way) / (2.0 * deceleration)
    target = rest + wanted * horizon_s + math.copysign(added, wanted)
    # Rounded away from the present position: a move rounded to zero would never start.
    return math.ceil(target) if wanted > 0.0 else math.floor(target)


class Feedback:
    """The last position, velocity and status of the drive, and the first cause.

    The time stamp of a position is the end of its request: the end of the reply minus the time that
    its characters take.

    Parameters
    ----------
    baud : int
    jump, fastest : float
        Largest change of position between two samples, in counts and in counts/s: `jump` plus
        `fastest` times the time between them.
    state_on : int
        The desired state of an enabled drive.
    """

    def __init__(self, baud: int, jump: float, fastest: float, state_on: int) -> None:
        self._baud, self._jump, self._fastest, self._state_on = baud, jump, fastest, state_on
        self.position = self.speed = self.status = 0
        """Position in counts, velocity in 0.1 counts/s, and the event status."""
        self.current = math.nan
        """Of the motor, in 0.01 A; NaN before it was read."""
        self.position_s = -math.inf
        self.sequence = -1
        self.cause = Cause.NONE
        self.refused = False
        """Whether a move was refused once; the following replies tell why."""
        self.counts = dict.fromkeys(("received", "lost", "damaged", "refused", "skipped"), 0)
        self._damaged: Counter[str] = Counter()
        self._asked_s: dict[str, float] = {}

    def latch(self, cause: Cause) -> None:
        """Store a cause unless there is one already."""
        if self.cause is Cause.NONE:
            self.cause = cause

    def asked(self, requests: Iterable[str], now_s: float) -> None:
        """Note when requests were sent whose like had all been answered."""
        for request in requests:
            self._asked_s.setdefault(addressed(request), now_s)

    def forget_requests(self) -> None:
        """Expect no replies: those still due were discarded."""
        self._asked_s.clear()

    def unanswered_s(self, now_s: float) -> float:
        """Return for how long some request has been without a valid reply; 0 if none is."""
        return now_s - min(self._asked_s.values(), default=now_s)

    def begin(self, position: int, speed: int, status: int, now_s: float) -> None:
        """Start again from a fresh sample, without the causes of the previous run."""
        self.cause = Cause.NONE
        self.refused = False
        self._damaged.clear()
        self.forget_requests()
        self.position, self.position_s, self.sequence = position, now_s, 0
        self.speed = speed
        self._take_status(status, commanding=False)

    def take(self, exchange: Exchange, *, commanding: bool) -> None:
        """Process one reply; an error is latched as a cause."""
        request, text, at_s = exchange
        if text is None:
            self.counts["lost"] += 1
            self.latch(Cause.DRIVE_LOST)
            return
        about, reply = addressed(request), parse(text)
        if reply.kind in ("e", "v" if request.startswith("g") else "ok"):
            self._damaged[about] = 0
            self._asked_s.pop(about, None)
        if reply.kind == "e":
            self.counts["refused"] += 1
            if request == "t 1" and not self.refused:
                self.refused = True
            else:
                self.latch(Cause.DRIVE_FAULT)
        elif reply.kind != ("v" if request.startswith("g") else "ok"):
            self.counts["damaged"] += 1
            self._damaged[about] += 1
            if self._damaged[about] >= DAMAGED_IN_A_ROW:
                self.latch(Cause.DRIVE_LOST)
        else:
            self.counts["received"] += 1
            self._take_value(
                request, reply, at_s - line_time_s(len(text) + 1, self._baud), commanding
            )

    def _take_value(self, request: str, reply: Reply, asked_s: float, commanding: bool) -> None:
        if request == read_request(0x32):
            reach = self._jump + self._fastest * max(0.0, asked_s - self.position_s)
            if abs(reply.value - self.position) > reach:
                self.latch(Cause.NOT_FOLLOWING)
            self.position, self.position_s = reply.value, asked_s
            self.sequence += 1
        elif request == read_request(0x18):
            self.speed = reply.value
        elif request == read_request(0x0C):
            self.current = reply.value
        elif request == read_request(0xA0):
            self._take_status(reply.value, commanding)
        elif request == read_request(0x24) and commanding and reply.value != self._state_on:
            self.latch(Cause.DRIVE_STATE)

    def _take_status(self, status: int, commanding: bool) -> None:
        self.status = status
        if status & STATUS_FAULTS:
            self.latch(Cause.DRIVE_FAULT)
        elif commanding and status & STATUS_DISABLED:
            self.latch(Cause.DRIVE_STATE)
