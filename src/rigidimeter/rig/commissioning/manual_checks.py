"""What only a person can do or tell: hands on the joint, eyes on the rig.

No program can see that a mechanical stop is there, that a joint went to the side that was meant, or
that a contactor fell off. Where nobody is there these checks are "not tried": consent given
beforehand answers for none of them.
"""

from __future__ import annotations

import math

import numpy as np

from rigidimeter.rig.commissioning.checks import (
    RigCheck,
    impossible,
    untried,
    within_tolerance,
    yes,
)
from rigidimeter.rig.commissioning.trials import (
    Operator,
    Setup,
    drop_old_samples,
    hold_stretch,
    listen,
    require_no_power,
    trial,
)

SETTLE_S = 0.5
KNOWN_ANGLE_S = 1.0
ANGLE, TORQUE = "known angle", "known torque"


def ask_operator(operator: Operator, name: str, question: str, remedy: str) -> RigCheck:
    """Return the check of something that the operator says is so or not."""
    if not operator.present:
        return untried(name, "yes")
    good = operator.ask(question)
    return yes(name, good, "yes" if good else "no", "yes", remedy)


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


def known_torque(setup: Setup) -> RigCheck:
    """Compare a torque put on by hand; the drive holds against it, so it reads the opposite."""
    operator, limits = setup.operator, setup.limits
    known_nm, percent = operator.known_torque_nm, limits.known_tolerance_percent
    limit = f"as known ± {percent:g} %"
    if known_nm is None:
        return impossible(TORQUE, limit, "give --known-torque-nm to compare with")
    if not operator.present:
        return untried(TORQUE, limit)
    before = trial(setup, hold_stretch(SETTLE_S)).readings.torque_nm
    require_no_power(setup)
    held_s = limits.known_torque_s
    if not operator.ask(
        f"Put a torque of {known_nm:g} N·m on the joint, toward positive angles, and keep it for "
        f"{held_s + SETTLE_S:g} s after you agree; the drive will hold against it. Ready?"
    ):
        return impossible(TORQUE, limit, "the operator did not agree to it")
    readings = trial(setup, hold_stretch(SETTLE_S + held_s)).readings
    require_no_power(setup)
    late = readings.torque_nm[readings.time_s > SETTLE_S]
    value = -float(np.nanmedian(late) - np.nanmedian(before)) if len(late) else math.nan
    operator.ask("Take the torque off again. Done?")
    return within_tolerance(TORQUE, value, "N·m", known_nm, percent, _WRONG_SCALE)


_WRONG_SCALE = (
    "sign, units or calibration in the rig file are wrong; nothing inside the rig can show this "
    "but such a comparison"
)


def _angle_rad(setup: Setup) -> float:
    """Return the mean angle over a short while without power."""
    drop_old_samples(setup)
    readings = listen(setup, KNOWN_ANGLE_S)
    return float(np.nanmean(readings.angle_rad[len(readings.angle_rad) // 2 :]))
