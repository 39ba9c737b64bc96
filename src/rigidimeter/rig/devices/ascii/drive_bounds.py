"""The bounds of `devices.bounds` in the registers of a serial drive.

    torque    0x21  peak current in 0.01 A                       T / torque_nm_per_a
    position  0xb8, 0xb9  positive and negative software limit, in counts
    speed     0x3a  limit of the velocity loop in 0.1 counts/s

0xb8 and 0xb9 with their unit are in published programs for such drives. 0x21 (beside 0x22, its
continuous limit) and 0x3a are from memory of the public programmer's guide. That the software
limits act in moves only, and in some drives not before a homing, is inferred. So a register that a
drive does not take is no error, and none counts as obeyed until commissioning has moved against it.

There is one limit of the velocity, and the following error (0xba) takes the power away with a
latched fault, so motor speed and slippage are not bounded here.
"""

from __future__ import annotations

import math

from rigidimeter.rig.devices.ascii.language import Reply, read_request, set_request
from rigidimeter.rig.devices.ascii.setup import AsciiDriveSettings, AsciiTalk
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.devices.bounds import (
    LOST,
    MOTOR_SPEED,
    POSITION,
    SLIPPAGE,
    SPEED,
    TORQUE,
    BoundFound,
    DriveBounds,
    Tight,
)

PEAK_CURRENT, VELOCITY_LIMIT, POSITIVE_LIMIT, NEGATIVE_LIMIT = 0x21, 0x3A, 0xB8, 0xB9
HALF = 0.5
"""A tightened bound lets through so much of a move."""


def write_bounds(
    talk: AsciiTalk, settings: AsciiDriveSettings, bounds: DriveBounds, tight: Tight | None
) -> tuple[BoundFound, ...]:
    """Write the bounds about where the joint stands and read them back; return what came of each.

    Raises
    ------
    DeviceError
        If the drive does not answer, or the joint stands outside of the person's range.
    """
    return (
        _torque(talk, settings, bounds, tight),
        _position(talk, settings, bounds, tight),
        _speed(talk, settings, tight),
        BoundFound(MOTOR_SPEED, "", "the drive has one limit of the velocity", LOST[MOTOR_SPEED]),
        BoundFound(
            SLIPPAGE,
            "",
            "its limit of the following error (0xba) acts by a latched fault",
            LOST[SLIPPAGE],
        ),
    )


def _torque(
    talk: AsciiTalk, settings: AsciiDriveSettings, bounds: DriveBounds, tight: Tight | None
) -> BoundFound:
    for key in ("reflected_inertia_kg_m2", "torque_nm_per_a"):
        if getattr(settings, key) == 0.0:
            return BoundFound(TORQUE, "", f"the rig file does not name {key}", LOST[TORQUE])
    ramp_rad_s2 = math.radians(max(settings.acceleration_deg_s2, settings.deceleration_deg_s2))
    torque_nm = bounds.torque_nm(
        settings.reflected_inertia_kg_m2, settings.friction_nm, ramp_rad_s2
    )
    current = math.ceil(100.0 * torque_nm / settings.torque_nm_per_a)
    if tight is not None and tight.name == TORQUE:
        current = 0
    words = f"{torque_nm:.4g} N·m, {0.01 * current:.4g} A"
    found = _written(talk, TORQUE, {PEAK_CURRENT: current}, words)
    return found._replace(torque_nm=torque_nm, ramp_rad_s2=ramp_rad_s2) if found.where else found


def _position(
    talk: AsciiTalk, settings: AsciiDriveSettings, bounds: DriveBounds, tight: Tight | None
) -> BoundFound:
    per_rad = settings.sign * settings.counts_per_turn / (2.0 * math.pi)
    offset_rad = math.radians(settings.angle_offset_deg)
    start_rad = talk.value(0x32) / per_rad + offset_rad
    low, high = bounds.span_rad(start_rad)
    if not low <= start_rad <= high:
        raise DeviceError(
            f"drive: the joint stands at {math.degrees(start_rad):.1f} deg of the drive's scale, "
            f"outside of {math.degrees(low):.1f} to {math.degrees(high):.1f} deg, the person's "
            "range with its margin; lead it there with the drive's power off"
        )
    if tight is not None and tight.name == POSITION:
        low, high = start_rad - HALF * tight.reach_rad, start_rad + HALF * tight.reach_rad
    lowest, highest = sorted((angle - offset_rad) * per_rad for angle in (low, high))
    values = {POSITIVE_LIMIT: math.ceil(highest), NEGATIVE_LIMIT: math.floor(lowest)}
    words = f"{math.degrees(low):.4g} to {math.degrees(high):.4g} deg of the drive's scale"
    return _written(talk, POSITION, values, words)


def _speed(talk: AsciiTalk, settings: AsciiDriveSettings, tight: Tight | None) -> BoundFound:
    deg_s = settings.max_velocity_deg_s
    if tight is not None and tight.name == SPEED:
        deg_s = HALF * math.degrees(tight.speed_rad_s)
    value = math.ceil(10.0 * deg_s * settings.counts_per_turn / 360.0)
    return _written(talk, SPEED, {VELOCITY_LIMIT: value}, f"{deg_s:.4g} deg/s")


def _written(talk: AsciiTalk, name: str, values: dict[int, int], words: str) -> BoundFound:
    """Set registers and read them back; a register that the drive does not take is no error.

    Raises
    ------
    DeviceError
        If there is no answer.
    """
    where = ", ".join(f"0x{register:02x}" for register in values)
    for register, value in values.items():
        replies = [
            _replied(talk, request)
            for request in (set_request(register, value), read_request(register))
        ]
        for reply in replies:
            if reply.kind == "e":
                why = f"register 0x{register:02x} was refused with error {reply.value}"
                return BoundFound(name, "", why, LOST[name])
        if replies[1].value != value:
            why = f"register 0x{register:02x} is {replies[1].value} after {value} was written"
            return BoundFound(name, "", why, LOST[name])
    return BoundFound(name, where, words, LOST[name])


def _replied(talk: AsciiTalk, request: str) -> Reply:
    reply = talk.answer(request)
    if reply is None:
        raise DeviceError(f"drive: no answer to {request!r}; check the cable and the power")
    return reply
