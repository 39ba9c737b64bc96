"""The bounds of `devices.bounds` as objects of a CiA 402 drive.

    torque       0x6072 max torque, else 0x6073 max current, both in thousandths
    position     0x607D software position limits, in position units
    speed        0x607F max profile velocity, in velocity units
    motor speed  0x6080 max motor speed, by CiA 402 in 1/min of the motor
    slippage     0x60F8 max slippage, in velocity units

0x6072 counts in thousandths of the rated torque 0x6076, 0x6073 in those of the rated current
0x6075, at which the motor gives its rated torque: the number is the same. A `sign` of −1 swaps the
ends of 0x607D. The following error window 0x6065 is not written: by CiA 402 it acts in the position
modes, and in profile velocity mode bit 13 of the statusword, which it sets there, means slippage.
0x607D is left alone where the drive has a home offset (0x607C): makers differ in whether the limits
count before or after it; and where sub-indices number axes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, NamedTuple

from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.devices.bounds import (
    LOST,
    MOTOR_SPEED,
    POSITION,
    SLIPPAGE,
    SPEED,
    SPEED_MARGIN,
    TORQUE,
    TORQUE_MARGIN,
    BoundFound,
    DriveBounds,
    Tight,
)
from rigidimeter.rig.devices.cia402.drive_torque import torque_objects
from rigidimeter.rig.devices.cia402.sdo_transfers import read_object, write_object
from rigidimeter.rig.devices.cia402.setup import (
    MAX_PROFILE_VELOCITY,
    Cia402Settings,
    Object,
    scale,
)

HALF = 0.5
"""A tightened bound lets through so much of a move."""

LARGEST_THOUSANDTHS = 0xFFFF


class DriveSays(NamedTuple):
    """What the bounds depend on besides the settings; None where the drive has no such object."""

    position_counts: int
    rated_torque_mnm: int | None
    home_offset_counts: int | None


class Wanted(NamedTuple):
    """A bound: the objects that may hold it, in alternatives, its value in words, or why not."""

    name: str
    alternatives: tuple[tuple[Object, ...], ...]
    words: str
    why_not: str = ""
    torque_nm: float = math.nan
    ramp_rad_s2: float = math.nan


def read_only(settings: Cia402Settings) -> tuple[Object, Object, Object]:
    """Return the objects of `DriveSays`, in its order."""
    offset = Object("home offset", *settings.axis(0x607C), 4, 0, signed=True, optional=True)
    return (
        Object("position actual value", *settings.axis(0x6064), 4, 0, signed=True),
        torque_objects(settings)[0],
        replace(offset, lost="nothing: then it is zero"),
    )


def ask_drive(sdo: Any, settings: Cia402Settings, who: str) -> DriveSays:
    """Read what the bounds depend on.

    Raises
    ------
    DeviceError
        If the drive does not answer.
    """
    position, rated, offset = (read_object(sdo, entry, who) for entry in read_only(settings))
    return DriveSays(position or 0, rated or None, offset)


def wanted_bounds(
    settings: Cia402Settings, bounds: DriveBounds, says: DriveSays, tight: Tight | None = None
) -> tuple[Wanted, ...]:
    """Return every bound for this drive where it stands; one may be tightened so that a move ends.

    Raises
    ------
    DeviceError
        If the joint stands outside of the person's range, or the rig file names a bound of the
        torque that is less than a stop takes.
    """
    return (
        _torque(settings, bounds, says, tight),
        _position(settings, bounds, says, tight),
        _speed(settings, tight),
        _motor_speed(settings, tight),
        _slippage(settings, bounds, tight),
    )


def write_bounds(
    sdo: Any, wanted: Iterable[Wanted], who: str
) -> tuple[tuple[BoundFound, ...], tuple[Object, ...]]:
    """Write bounds; return what came of each, and the objects that are in force.

    Raises
    ------
    DeviceError
        If the drive does not answer, or has the object and refuses the value.
    """
    found: list[BoundFound] = []
    written: list[Object] = []
    for bound in wanted:
        name, alternatives, words, why_not, *torque_and_ramp = bound
        there: tuple[Object, ...] = ()
        if not why_not:
            holds = (each for each in alternatives if _taken(sdo, each, who))
            there = next(holds, ())
            names = " or ".join(f"0x{entries[0].index:04X}" for entries in alternatives)
            why_not = "" if there else f"the drive has no {names}"
        written += there
        where = f"0x{there[0].index:04X}" if there else ""
        found.append(BoundFound(name, where, why_not or words, LOST[name], *torque_and_ramp))
    return tuple(found), tuple(written)


def _taken(sdo: Any, entries: tuple[Object, ...], who: str) -> bool:
    """Write both ends of a bound or its one value; return whether the drive has all of them.

    A lower end above the upper end of before may be refused until the new upper end is there.
    """
    try:
        return all(write_object(sdo, entry, who) for entry in entries)
    except DeviceError:
        if len(entries) == 1:
            raise
    return all(write_object(sdo, entry, who) for entry in reversed(entries))


def bound_objects(settings: Cia402Settings, bounds: DriveBounds) -> tuple[Object, ...]:
    """Return every object that may hold a bound, as of a joint that stands at its zero."""
    wanted = wanted_bounds(settings, bounds, DriveSays(settings.zero_counts, None, None))
    return tuple(o for bound in wanted for entries in bound.alternatives for o in entries)


def ramp_rad_s2(settings: Cia402Settings) -> float:
    """Return the steepest ramp that the drive may follow."""
    return max(
        settings.acceleration_rad_s2, settings.deceleration_rad_s2, settings.quick_stop_rad_s2
    )


def _torque(
    settings: Cia402Settings, bounds: DriveBounds, says: DriveSays, tight: Tight | None
) -> Wanted:
    def alternatives(thousandths: int) -> tuple[tuple[Object, ...], ...]:
        torque = _optional(settings, "max torque", 0x6072, 2, thousandths, TORQUE)
        current = _optional(settings, "max current", 0x6073, 2, thousandths, TORQUE)
        return (
            (replace(torque, lost=f"{torque.lost} (0x6073 will do)"),),
            (replace(current, lost=f"{current.lost} (0x6072 is used where it is there)"),),
        )

    if settings.reflected_inertia_kg_m2 == 0.0:
        why = (
            "the rig file does not name reflected_inertia_kg_m2, the inertia of motor and gear at "
            "the joint, without which nobody knows what a stop takes"
        )
        return Wanted(TORQUE, alternatives(1000), "", why)
    ramp = ramp_rad_s2(settings)
    needed_nm = bounds.torque_nm(settings.reflected_inertia_kg_m2, settings.friction_nm, ramp)
    torque_nm = settings.torque_bound_nm or needed_nm
    if TORQUE_MARGIN * torque_nm < needed_nm:
        raise DeviceError(
            f"drive: torque_bound_nm = {torque_nm:g} N·m is less than a stop of this joint takes, "
            f"{needed_nm / TORQUE_MARGIN:.4g} N·m with its quick_stop_rad_s2; raise it or lower "
            "the drive's ramps"
        )
    if says.rated_torque_mnm is None:
        why = "the drive does not say its rated torque (0x6076), of which 0x6072 and 0x6073 count"
        return Wanted(TORQUE, alternatives(1000), "", why)
    rated_nm = 1e-3 * says.rated_torque_mnm * settings.gear_ratio
    thousandths = 0 if _tightens(tight, TORQUE) else math.ceil(1e3 * torque_nm / rated_nm)
    if thousandths > LARGEST_THOUSANDTHS:
        why = f"{torque_nm:.4g} N·m are more than {LARGEST_THOUSANDTHS} ‰ of the rated torque"
        return Wanted(TORQUE, alternatives(1000), "", why)
    words = f"{torque_nm:.4g} N·m, {thousandths} ‰ of the rated {rated_nm:.4g} N·m"
    return Wanted(TORQUE, alternatives(thousandths), words, "", torque_nm, ramp)


def _position(
    settings: Cia402Settings, bounds: DriveBounds, says: DriveSays, tight: Tight | None
) -> Wanted:
    counts_per_rad = scale(settings).counts_per_rad
    start_rad = (says.position_counts - settings.zero_counts) / counts_per_rad
    low, high = bounds.span_rad(start_rad)
    if not low <= start_rad <= high:
        raise DeviceError(
            f"drive: the joint stands at {math.degrees(start_rad):.1f} deg of the drive's scale, "
            f"outside of {math.degrees(low):.1f} to {math.degrees(high):.1f} deg, the person's "
            "range with its margin; lead it there with the drive's power off"
        )
    if tight is not None and tight.name == POSITION:
        low, high = start_rad - HALF * tight.reach_rad, start_rad + HALF * tight.reach_rad
    # Where `sign` is -1 the upper end of the joint is the lower one of the drive.
    ends = sorted(settings.zero_counts + angle * counts_per_rad for angle in (low, high))
    lowest, highest = math.floor(ends[0]), math.ceil(ends[1])
    entries = tuple(
        _optional(settings, name, 0x607D, 4, value, POSITION, k, signed=True)
        for k, (name, value) in enumerate(
            (("min position limit", lowest), ("max position limit", highest)), 1
        )
    )
    words = (
        f"{math.degrees(low):.4g} to {math.degrees(high):.4g} deg of the drive's scale, "
        f"{lowest} to {highest} counts"
    )
    why = ""
    if settings.axis_subindex:
        why = (
            "its ends are sub-indices of 0x607D, which are those of axes where axis_subindex is "
            "not 0: another axis might get them"
        )
    elif says.home_offset_counts:
        why = f"the drive has a home offset of {says.home_offset_counts} (0x607C); set it to 0"
    elif lowest < -(2**31) or highest >= 2**31:
        why = "the counts of the ends do not fit into 32 bits; move zero_counts"
    return Wanted(POSITION, (entries,), words, why)


def _speed(settings: Cia402Settings, tight: Tight | None) -> Wanted:
    speed = _tightened(tight, SPEED, settings.max_velocity_rad_s)
    units = math.ceil(speed * abs(scale(settings).units_per_rad_s))
    entry = _optional(settings, MAX_PROFILE_VELOCITY, 0x607F, 4, units, SPEED)
    return Wanted(SPEED, ((entry,),), f"{math.degrees(speed):.4g} deg/s, {units} units")


def _motor_speed(settings: Cia402Settings, tight: Tight | None) -> Wanted:
    speed = _tightened(tight, MOTOR_SPEED, SPEED_MARGIN * settings.max_velocity_rad_s)
    turns_per_rad = settings.gear_ratio / (2.0 * math.pi)
    units = math.ceil(speed * turns_per_rad * settings.motor_speed_units_per_rev_s)
    entry = _optional(settings, "max motor speed", 0x6080, 4, units, MOTOR_SPEED)
    return Wanted(MOTOR_SPEED, ((entry,),), f"{math.degrees(speed):.4g} deg/s, {units} units")


def _slippage(settings: Cia402Settings, bounds: DriveBounds, tight: Tight | None) -> Wanted:
    slip = bounds.slip_rad_s(ramp_rad_s2(settings))
    units = (
        1 if _tightens(tight, SLIPPAGE) else math.ceil(slip * abs(scale(settings).units_per_rad_s))
    )
    entry = _optional(settings, "max slippage", 0x60F8, 4, units, SLIPPAGE, signed=True)
    return Wanted(SLIPPAGE, ((entry,),), f"{math.degrees(slip):.4g} deg/s, {units} units")


def _tightens(tight: Tight | None, name: str) -> bool:
    return tight is not None and tight.name == name


def _tightened(tight: Tight | None, name: str, speed_rad_s: float) -> float:
    return HALF * tight.speed_rad_s if tight is not None and tight.name == name else speed_rad_s


def _optional(
    settings: Cia402Settings,
    name: str,
    index: int,
    size: int,
    value: int,
    bound: str,
    subindex: int | None = None,
    *,
    signed: bool = False,
) -> Object:
    where, first = settings.axis(index)
    return Object(
        name,
        where,
        first if subindex is None else subindex,
        size,
        value,
        signed=signed,
        optional=True,
        lost=LOST[bound],
    )
