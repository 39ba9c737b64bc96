"""What only a person can do or tell: hands on the joint, eyes on the rig.

No program can see that a mechanical stop is there, that a joint went to the side that was meant, or
that a contactor fell off. Where nobody is there these checks are "not tried": consent given
beforehand answers for none of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rigidimeter.core.errors import UserError
from rigidimeter.rig.commissioning.checks import (
    RigCheck,
    impossible,
    untried,
    within_tolerance,
    yes,
)
from rigidimeter.rig.commissioning.motion_tests import swing
from rigidimeter.rig.commissioning.trials import (
    Operator,
    Readings,
    Setup,
    drop_old_samples,
    follow_stretch,
    hold_stretch,
    listen,
    require_no_power,
    trial,
)
from rigidimeter.rig.devices import LEAST_DEG, LED, STOP_HIGH, STOP_LOW, MotionRange

SETTLE_S = 0.5
KNOWN_ANGLE_S = 1.0
ANGLE, TORQUE, STOPS = "known angle", "known torque", "mechanical stops"
PUT_ON = "Put a torque of"
"""So begins what asks for the known torque."""


def ask_operator(operator: Operator, name: str, question: str, remedy: str) -> RigCheck:
    """Return the check of something that the operator says is so or not."""
    if not operator.present:
        return untried(name, "yes")
    good = operator.ask(question)
    return yes(name, good, "yes" if good else "no", "yes", remedy)


def mechanical_stops(setup: Setup, *, emulated: bool) -> tuple[RigCheck, dict[str, float]]:
    """Read where the joint is at both mechanical stops, led there by hand, without power.

    Returns
    -------
    check : RigCheck
        Whether the operator says that they are there, and the angles differ. Where the rig is
        emulated there may be nothing to lead: the operator's word is enough.
    angles : dict
        Both angles on the drive's scale in deg; empty where they could not be read.
    """
    if not setup.operator.present:
        return untried(STOPS, "yes"), {}
    ends_deg = _led_to_both_ends(setup, "its way")
    good = ends_deg is not None and setup.operator.ask(
        "Lead it back to where it was. Did mechanical stops end its way on both sides, where a "
        "person's arm still tolerates it?"
    )
    if not good or ends_deg is None:
        return yes(STOPS, False, "no", "yes", _FIT_STOPS), {}
    low_deg, high_deg = ends_deg
    if high_deg - low_deg > LEAST_DEG:
        found = f"{low_deg:.1f} and {high_deg:.1f} deg"
        return yes(STOPS, True, found, "yes", ""), {STOP_LOW: low_deg, STOP_HIGH: high_deg}
    if emulated:
        return yes(STOPS, True, "yes", "yes", ""), {}
    return yes(STOPS, False, f"{low_deg:.1f} and {high_deg:.1f} deg", "yes", _NOT_LED), {}


def lead_range(setup: Setup) -> MotionRange:
    """Return the range through which a person's arm was led by hand, without power.

    The rig is connected, read and closed, whatever happens; the drive gets no power.

    Raises
    ------
    UserError
        If the operator did not lead it, or both ends were read at one place.
    """
    rig = setup.rig
    try:
        rig.connect()
        rig.configure()
        setup.operator.say(
            "The range of motion of this person, without power. Lead the arm slowly, by hand, no "
            "farther than the person tolerates without pain or resistance."
        )
        ends_deg = _led_to_both_ends(setup, "the range of this person")
        if ends_deg is None:
            raise UserError("the range of motion was not led; nothing was run")
        setup.operator.ask("Lead the arm back to where the session begins. Done?")
    finally:
        rig.close()
    return MotionRange(*ends_deg, how=LED)


def _led_to_both_ends(setup: Setup, what: str) -> tuple[float, float] | None:
    """Return the angles at both ends in deg on the drive's scale; None if they were not led to."""
    require_no_power(setup)
    found: list[float] = []
    for end in ("one end", "the other end"):
        if not setup.operator.ask(
            f"Without power: lead the joint by hand to {end} of {what}, and keep it there until "
            "the next question. Is it there?"
        ):
            return None
        found.append(math.degrees(setup.rig.origin_rad + _angle_rad(setup)))
    return min(found), max(found)


def known_angle(setup: Setup) -> RigCheck:
    """Compare an angle by which hands turn the joint, without power."""
    operator, percent = setup.operator, setup.limits.scale_tolerance_percent
    wanted_deg = operator.known_angle_deg
    limit = f"as known ± {percent:g} %"
    if wanted_deg is None:
        return impossible(ANGLE, limit, "give --known-angle-deg to compare with")
    if not operator.present:
        return untried(ANGLE, limit)
    before_rad = _angle_rad(setup)
    if not operator.ask(f"Without power: turn the joint by {wanted_deg:+g} deg by hand. Done?"):
        return impossible(ANGLE, limit, "the operator did not do it")
    turned_deg = math.degrees(_angle_rad(setup) - before_rad)
    operator.ask("Turn it back to where it was. Done?")
    return within_tolerance(ANGLE, turned_deg, "deg", wanted_deg, percent, _WRONG_SCALE)


class Loaded(NamedTuple):
    """The same slow swing without and with a known torque on the joint."""

    without: Readings
    loaded: Readings


def known_torque(setup: Setup) -> tuple[RigCheck, Loaded | None]:
    """Compare a torque put on by hand; the drive holds against it, so it reads the opposite.

    Where the drive reports a torque of its own, the joint is moved a little both times.
    """
    operator, limits = setup.operator, setup.limits
    known_nm, percent = operator.known_torque_nm, limits.known_tolerance_percent
    limit = f"as known ± {percent:g} %"
    if known_nm is None:
        return impossible(TORQUE, limit, "give --known-torque-nm to compare with"), None
    if not operator.present:
        return untried(TORQUE, limit), None
    swung = math.isfinite(setup.rig.read().drive_torque_nm)
    velocity = swing(setup.settings, limits.swing_deg, limits.swing_speed_deg_s, 1)
    after = [follow_stretch(velocity, setup.rate_hz)] if swung else []
    before = trial(setup, hold_stretch(SETTLE_S), *after).readings
    require_no_power(setup)
    held_s = limits.known_torque_s
    lasts_s = held_s + SETTLE_S + (len(velocity) / setup.rate_hz if swung else 0.0)
    moves = f" and move by {limits.swing_deg:g} deg" if swung else ""
    if not operator.ask(
        f"{PUT_ON} {known_nm:g} N·m on the joint, toward positive angles, and keep it for "
        f"{lasts_s:.2g} s after you agree; the drive will hold against it{moves}. Ready?"
    ):
        return impossible(TORQUE, limit, "the operator did not agree to it"), None
    loaded = trial(setup, hold_stretch(SETTLE_S + held_s), *after).readings
    require_no_power(setup)
    held = (loaded.time_s > SETTLE_S) & (loaded.time_s < SETTLE_S + held_s)
    late, early = loaded.torque_nm[held], before.torque_nm[before.time_s < SETTLE_S]
    value = -float(np.nanmedian(late) - np.nanmedian(early)) if len(late) else math.nan
    operator.ask("Take the torque off again. Done?")
    check = within_tolerance(TORQUE, value, "N·m", known_nm, percent, _WRONG_SCALE)
    return check, Loaded(before, loaded) if swung and check.passed else None


_FIT_STOPS = "fit them; the position limit of the software believes the encoder and is none"
_NOT_LED = "the joint was read at one place: lead it to each end, and keep it there"
_WRONG_SCALE = (
    "sign, units or calibration in the rig file are wrong; nothing inside the rig can show this "
    "but such a comparison"
)


def _angle_rad(setup: Setup) -> float:
    """Return the mean angle over a short while without power."""
    drop_old_samples(setup)
    readings = listen(setup, KNOWN_ANGLE_S)
    return float(np.nanmean(readings.angle_rad[len(readings.angle_rad) // 2 :]))
