"""Settings of a CiA 402 drive, and the objects that are written.

Angle, velocity and acceleration are those of the joint; the drive counts at its motor:

    position units      counts_per_rev · gear_ratio / 2π              per rad
    velocity units      velocity_units_per_rev_s · gear_ratio / 2π    per rad/s
    acceleration units  acceleration_units_per_rev_s2 · gear_ratio / 2π per rad/s²

`sign` −1 reverses position and velocity.

A drive of several axes has each object of the profile (0x6000 to 0x67FF) once an axis: by CiA 402
at `axis_offset` = 0x800, 0x1000, … more, in some drives at the sub-index `axis_subindex`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, NamedTuple, Self

from pydantic import Field, field_validator, model_validator

from rigidimeter.core.settings import Section, quantity
from rigidimeter.rig.devices.bounds import LOST, SPEED
from rigidimeter.rig.devices.cia402.state_words import PROFILE_VELOCITY, Frames, frames

INVALID = 1 << 31
NO_REMOTE_REQUEST = 1 << 30


class Cia402Settings(Section):
    """A CANopen servo drive, profile CiA 402, in profile-velocity mode.

    `interface` and `channel` are those of python-can; some interfaces number their channels.
    `bitrate` is that of the bus; with socketcan the operating system sets it, and here it only
    limits the loop rate. `port` is used by udp_multicast alone. `axis_offset` and `axis_subindex`
    are those of the axis, 0 for a drive of one. `reads_torque` false leaves the drive's own torque
    out of its answers, where the bus is too slow for it. `command_deadline_s` 0 means no command
    deadline; a drive without one still has its heartbeat watchdog.

    The default decelerations are above the default `guard.acceleration_limit_deg_s2`, since the
    guard relies on a drive that brakes at least that fast; commissioning compares the two.

    `reflected_inertia_kg_m2` and `friction_nm` are of motor and gear, seen at the joint; where
    the first is 0, it is not known, and the drive's torque is not bounded. `torque_bound_nm`
    replaces the bound that is computed (see `devices.bounds`), 0 keeps that. `button_bit` is that
    of a hand-held stop in the drive's digital inputs (0x60FD), -1 for none, and
    `button_pressed_level` what that bit is while it is pressed: 0 for a contact that opens, so
    that a broken wire is a stop too.
    """

    interface: str = Field("socketcan", min_length=1)
    channel: str | int = "can0"
    bitrate: int = quantity(1_000_000, "bit/s", 10_000, 1_000_000)
    port: int = quantity(43113, "1", 1, 65535)
    node_id: int = quantity(1, "1", 1, 127)
    master_id: int = quantity(127, "1", 1, 127)
    axis_offset: Literal[0, 0x800, 0x1000, 0x1800, 0x2000, 0x2800, 0x3000, 0x3800] = 0
    axis_subindex: int = quantity(0, "1", 0, 254)
    counts_per_rev: float = quantity(8192.0, "counts/rev", 1.0, 2.0**31)
    velocity_units_per_rev_s: float = quantity(8192.0, "unit/(rev/s)", 1e-3, 2.0**31)
    acceleration_units_per_rev_s2: float = quantity(8192.0, "unit/(rev/s²)", 1e-3, 2.0**31)
    gear_ratio: float = quantity(100.0, "1", 1e-3, 1e5)
    sign: Literal[1, -1] = 1
    reads_torque: bool = True
    zero_counts: int = quantity(0, "counts", -(2**31), 2**31 - 1)
    max_velocity_rad_s: float = quantity(4.0, "rad/s", 0.0, 100.0, above=True)
    acceleration_rad_s2: float = quantity(60.0, "rad/s²", 0.0, 1e4, above=True)
    deceleration_rad_s2: float = quantity(120.0, "rad/s²", 0.0, 1e4, above=True)
    quick_stop_rad_s2: float = quantity(120.0, "rad/s²", 0.0, 1e4, above=True)
    quick_stop_option: Literal[2, 6] = 2
    reflected_inertia_kg_m2: float = quantity(0.0, "kg·m²", 0.0, 100.0)
    friction_nm: float = quantity(0.0, "N·m", 0.0, 200.0)
    torque_bound_nm: float = quantity(0.0, "N·m", 0.0, 2000.0)
    motor_speed_units_per_rev_s: float = quantity(60.0, "unit/(rev/s)", 1e-3, 2.0**31)
    button_bit: int = quantity(-1, "1", -1, 31)
    button_pressed_level: Literal[0, 1] = 0
    abort_option: Literal[1, 2, 3] = 3
    heartbeat_s: float = quantity(0.02, "s", 0.001, 1.0)
    drive_watchdog_s: float = quantity(0.1, "s", 0.002, 5.0)
    command_deadline_s: float = quantity(0.05, "s", 0.0, 5.0)
    lost_s: float = quantity(0.02, "s", 0.001, 1.0)
    sdo_timeout_s: float = quantity(0.3, "s", 0.01, 5.0)
    enable_timeout_s: float = quantity(2.0, "s", 0.05, 30.0)

    def axis(self, index: int) -> tuple[int, int]:
        """Return index and sub-index at which the axis has an object of the profile."""
        return index + self.axis_offset, self.axis_subindex

    @property
    def emulated(self) -> bool:
        """Whether the bus is virtual, with no hardware connected."""
        return self.interface in ("virtual", "udp_multicast") or (
            self.interface == "socketcan" and str(self.channel).startswith("vcan")
        )

    @property
    def lock_names(self) -> tuple[str, ...]:
        """What the drive is, in whatever rig file; a virtual bus ends with its process."""
        if self.interface == "virtual":
            return ()
        port = f" port {self.port}" if self.interface == "udp_multicast" else ""
        return (f"node {self.node_id} on {self.interface} {self.channel}{port}",)

    @field_validator("channel", mode="before")
    @classmethod
    def _text_or_number(cls, value: Any) -> Any:
        text = isinstance(value, str) and value != ""
        if not text and (isinstance(value, bool) or not isinstance(value, int) or value < 0):
            raise ValueError(
                f'{value!r} names no channel; it must be a text such as "can0", or a whole number '
                "such as 0, as the interface has it"
            )
        return value

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.drive_watchdog_s < 2 * self.heartbeat_s:
            raise ValueError(
                f"drive_watchdog_s = {self.drive_watchdog_s:g} s must be at least twice heartbeat_s"
                f" = {self.heartbeat_s:g} s: one late heartbeat must not stop the drive"
            )
        if self.node_id == self.master_id:
            raise ValueError(
                f"node_id and master_id are both {self.node_id}: drive and computer must differ"
            )
        return self


class Scale(NamedTuple):
    """Units of the drive in one of the joint, with the sign."""

    counts_per_rad: float
    units_per_rad_s: float
    units_per_rad_s2: float


def scale(settings: Cia402Settings) -> Scale:
    """Return the drive's units in the joint's; the sign is in those of angle and velocity."""
    turns_per_rad = settings.gear_ratio / (2 * math.pi)
    return Scale(
        settings.sign * settings.counts_per_rev * turns_per_rad,
        settings.sign * settings.velocity_units_per_rev_s * turns_per_rad,
        settings.acceleration_units_per_rev_s2 * turns_per_rad,
    )


@dataclass(frozen=True)
class Object:
    """One entry of the drive's object dictionary, and the value it must have.

    `optional` entries are skipped if the drive does not have them; `fixed` ones may refuse to be
    written if they read back as they must be; bits outside `mask` belong to the drive. `lost` says
    what is lost without an optional one.
    """

    name: str
    index: int
    subindex: int
    size: int
    value: int
    signed: bool = False
    optional: bool = False
    fixed: bool = False
    mask: int = -1
    lost: str = ""

    @property
    def label(self) -> str:
        """The name, with the address as written in the drive's manual."""
        return f"{self.name} (0x{self.index:04X}:{self.subindex:02X})"


CONTROLWORD, TARGET = "controlword", "target velocity"
BRAKING = ("profile deceleration", "quick-stop deceleration")
MAX_PROFILE_VELOCITY = "max profile velocity"

_IDENTITY_LOST = "a drive that was exchanged is not noticed"
IDENTITY = tuple(
    Object(name, 0x1018, k, 4, 0, optional=k > 1, lost=_IDENTITY_LOST if k > 1 else "")
    for k, name in enumerate(("vendor", "product", "revision", "serial"), 1)
)
"""Read, never written."""


def objects(settings: Cia402Settings, with_torque: bool = False) -> tuple[Object, ...]:
    """Return the objects to write, in order; if one is written twice the last value remains.

    `with_torque` adds the drive's torque to the velocity frame.
    """
    units = scale(settings)
    ids = frames(settings.node_id)
    watchdog_ms = round(settings.drive_watchdog_s * 1e3)

    def acceleration(rad_s2: float) -> int:
        return max(1, round(rad_s2 * units.units_per_rad_s2))

    def of_axis(name: str, index: int, size: int, value: int, **more: Any) -> Object:
        return Object(name, *settings.axis(index), size, value, **more)

    max_units = math.ceil(settings.max_velocity_rad_s * abs(units.units_per_rad_s))
    return (
        of_axis(CONTROLWORD, 0x6040, 2, 0),
        of_axis("mode of operation", 0x6060, 1, PROFILE_VELOCITY, signed=True),
        of_axis(TARGET, 0x60FF, 4, 0, signed=True),
        # The drive's own limit is a second one: `write` sends nothing above it.
        of_axis(MAX_PROFILE_VELOCITY, 0x607F, 4, max_units, optional=True, lost=LOST[SPEED]),
        of_axis("profile acceleration", 0x6083, 4, acceleration(settings.acceleration_rad_s2)),
        of_axis(BRAKING[0], 0x6084, 4, acceleration(settings.deceleration_rad_s2)),
        of_axis(BRAKING[1], 0x6085, 4, acceleration(settings.quick_stop_rad_s2)),
        of_axis("quick-stop option", 0x605A, 2, settings.quick_stop_option, signed=True),
        of_axis("abort-connection option", 0x6007, 2, settings.abort_option, signed=True),
        Object("drive's heartbeat in ms", 0x1017, 0, 2, round(settings.heartbeat_s * 1e3)),
        Object("heartbeat watchdog", 0x1016, 1, 4, settings.master_id << 16 | watchdog_ms),
        *_messages(settings, ids, round(settings.command_deadline_s * 1e3), with_torque),
    )


def displayed_mode(settings: Cia402Settings) -> Object:
    """Return the mode that the drive reports; read, never written."""
    address = settings.axis(0x6061)
    return Object("mode of operation display", *address, 1, PROFILE_VELOCITY, signed=True)


def inputs(settings: Cia402Settings) -> Object:
    """Return the digital inputs, of which one may be a button; read, never written."""
    lost = "a hand-held stop in the drive's inputs; there are none where `button_bit` is -1"
    address = settings.axis(0x60FD)
    return Object("digital inputs", *address, 4, 0, optional=settings.button_bit < 0, lost=lost)


def is_pressed(settings: Cia402Settings, levels: int) -> bool:
    """Return whether the hand-held stop is pressed, by the digital inputs."""
    bit = settings.button_bit
    return bit >= 0 and levels >> bit & 1 == settings.button_pressed_level


def _messages(
    settings: Cia402Settings, ids: Frames, deadline_ms: int, with_torque: bool
) -> tuple[Object, ...]:
    """Return the PDO mapping: one command frame, two answers to every SYNC, and no others."""

    def mapped(*entries: tuple[int, int]) -> tuple[int, ...]:
        return tuple(
            index << 16 | subindex << 8 | bits
            for of_profile, bits in entries
            for index, subindex in (settings.axis(of_profile),)
        )

    command = mapped((0x6040, 16), (0x60FF, 32))
    position = mapped((0x6041, 16), (0x6061, 8), (0x6064, 32))
    velocity = mapped((0x606C, 32), *([(0x6077, 16)] if with_torque else []))
    deadline = Object(
        *("command deadline in ms", 0x1400, 5, 2, deadline_ms),
        optional=True,
        lost="a loop that hangs is noticed later, by the heartbeat watchdog (0x1016) alone",
    )
    button = _message("button frame", 0x1802, ids.inputs, 1, mapped((0x60FD, 32)))
    return (
        # A command takes effect when it arrives (255), a measurement is taken at every SYNC (1).
        *_message("command frame", 0x1400, ids.command, 255, command, (deadline,)),
        *_message("position frame", 0x1800, ids.position, 1, position),
        *_message("velocity frame", 0x1801, ids.velocity, 1, velocity, needed=1),
        *(button if settings.button_bit >= 0 else ()),
        *(
            Object(
                "unused frame",
                index,
                1,
                4,
                INVALID | id_,
                optional=True,
                fixed=True,
                mask=~NO_REMOTE_REQUEST,
                lost="nothing: then there is no such frame",
            )
            for index, id_ in (
                (0x1401, ids.command + 0x100),
                (0x1402, ids.command + 0x200),
                (0x1403, ids.command + 0x300),
                *([(0x1802, ids.inputs)] if settings.button_bit < 0 else []),
                (0x1803, ids.position + 0x300),
            )
        ),
    )


def _message(
    name: str,
    index: int,
    id_: int,
    transmission: int,
    entries: tuple[int, ...],
    more: tuple[Object, ...] = (),
    needed: int | None = None,
) -> tuple[Object, ...]:
    """Return the steps in which CiA 301 allows a mapping to change: off, emptied, filled, on.

    A drive need not have room for more than the first `needed` entries.
    """
    fixed = partial(Object, fixed=True)
    identifier = fixed(f"{name}'s identifier", index, 1, 4, id_, mask=~NO_REMOTE_REQUEST)
    count = fixed(f"{name}'s number of entries", index + 0x200, 0, 1, len(entries))
    more_room = partial(fixed, optional=True, lost="what the drive measures beside the velocity")
    entry_of = [fixed if k <= (needed or k) else more_room for k in range(1, len(entries) + 1)]
    return (
        replace(identifier, value=INVALID | id_),
        fixed(f"{name}'s transmission type", index, 2, 1, transmission),
        *more,
        replace(count, value=0),
        *(
            make(f"{name}'s entry {k}", index + 0x200, k, 4, e)
            for k, (make, e) in enumerate(zip(entry_of, entries, strict=True), 1)
        ),
        count,
        identifier,
    )
