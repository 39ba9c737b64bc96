"""Whether a drive obeys the bounds that it took: each, tightened in turn, must end a slow move.

That a bound reads back as written says that the drive has it, not that it acts in the mode in which
the rig runs. So one is tightened until a move to one side and back, as slow and as far as the swing
before, must hit it: the torque to none at all, the position to half of the way, a speed to half of
that of the move, the slippage to its smallest. Where three quarters of the move are made all the
same, the bound sleeps: it counts as written, not shown. The drive may end the move as it likes, by
standing still or by a fault, and the guard may end it because the joint does not follow.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from rigidimeter.core.units import rad_from_deg
from rigidimeter.rig.commissioning.checks import RigCheck, above, impossible, yes
from rigidimeter.rig.commissioning.drive_side_fit import model_in
from rigidimeter.rig.commissioning.motion_tests import smooth_motion
from rigidimeter.rig.commissioning.trials import (
    Readings,
    Setup,
    TrialResult,
    follow_stretch,
    hold_stretch,
    listen,
    stopped_for,
    trial,
)
from rigidimeter.rig.devices import (
    MOTOR_SPEED,
    POSITION,
    SPEED,
    TORQUE,
    TORQUE_MARGIN,
    BoundFound,
    Tight,
    drive_bounds,
)
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause

BOUNDS = "bounds in the drive"
LIMIT = "ends a slow move"
WRITTEN = "written, not shown"
ENOUGH = "bound of the torque above a quick stop's"
SETTLE_S = 0.3
MOST = 0.75
"""A move of which the drive makes more than this was not ended; a tightened bound lets half."""

CONSEQUENCES = (
    *(Cause.NONE, Cause.NOT_FOLLOWING, Cause.VELOCITY_WRONG, Cause.MOVED_AT_REST),
    *(Cause.TORQUE_SILENT, Cause.TORQUE_DISAGREES, Cause.DRIVE_FAULT, Cause.DRIVE_STATE),
)
"""What a move may end with that a bound ends."""


def bound_check_name(name: str) -> str:
    """Return what the check of a bound is called."""
    return f"bound of the {name}"


def bound_checks(setup: Setup, numbers: Mapping[str, float]) -> list[RigCheck]:
    """Tighten each bound that the drive took, and move against it.

    `numbers` may hold what was measured of the drive's side: a bound of the torque below what a
    quick stop of that takes is a failure.
    """
    found: tuple[BoundFound, ...] = tuple(getattr(setup.rig, "bounds", ()))
    if not found:
        return [impossible(BOUNDS, LIMIT, "the driver of this drive writes none")]
    written = [bound for bound in found if bound.where]
    checks = {
        bound.name: RigCheck(
            bound_check_name(bound.name),
            "not written",
            "",
            LIMIT,
            "not possible here",
            f"{bound.words}; so {bound.lost}",
        )
        for bound in found
        if not bound.where
    }
    limits = setup.limits
    agreed = bool(written) and setup.operator.ask(
        f"Bounds in the drive: {', '.join(bound.name for bound in written)}. Each is made so tight "
        f"that it must end a move of {limits.swing_deg:g} deg at {limits.swing_speed_deg_s:g} "
        "deg/s; with that of the torque the drive gives none, so a weight that the drive alone "
        "holds falls as it does without power. Go on?"
    )
    for bound in written:
        checks[bound.name] = (
            _tried(setup, bound)
            if agreed
            else _not_shown(bound, "the operator did not agree to the moves")
        )
    enough = [check for bound in written for check in _enough(setup, bound, numbers)]
    return [*(checks[bound.name] for bound in found), *enough]


def _enough(setup: Setup, bound: BoundFound, numbers: Mapping[str, float]) -> list[RigCheck]:
    """Hold a bound of the torque against T of the drive as measured, without its margin.

    The drive counts in its own scale, of which `scale` times is true.
    """
    model = model_in(numbers)
    if bound.name != TORQUE or model is None or math.isnan(bound.torque_nm):
        return []
    needed_nm = drive_bounds(setup.settings).torque_nm(
        model.inertia_kg_m2, model.friction_nm, bound.ramp_rad_s2
    )
    needed_nm /= TORQUE_MARGIN * model.scale
    remedy = (
        f"a quick stop would be longer than its ramp: reflected_inertia_kg_m2 was measured as "
        f"{model.inertia_kg_m2:.3g}, friction_nm as {model.friction_nm:.3g}; correct the rig file"
    )
    return [above(ENOUGH, bound.torque_nm, "N·m", needed_nm, remedy)]


def _tried(setup: Setup, bound: BoundFound) -> RigCheck:
    setup.operator.say(f"A move against the bound of the {bound.name} ({bound.where}).")
    words = ""
    for way in (1.0, -1.0) if bound.name == POSITION else (1.0,):
        try:
            ended, words = _move_against(setup, bound, way)
        except DeviceError as error:
            return yes(bound_check_name(bound.name), False, "refused", LIMIT, str(error))
        if not ended:
            return _not_shown(bound, words)
    return yes(bound_check_name(bound.name), True, f"{words} ({bound.where})", LIMIT, "")


def _not_shown(bound: BoundFound, why: str) -> RigCheck:
    remedy = f"{why}; until it is shown, {bound.lost}"
    return RigCheck(bound_check_name(bound.name), WRITTEN, "", LIMIT, "not possible here", remedy)


def _move_against(setup: Setup, bound: BoundFound, way: float) -> tuple[bool, str]:
    """Return whether a move to one side was ended, and what it came to; the joint is back then."""
    limits, rate_hz = setup.limits, setup.rate_hz
    reach_rad, speed_rad_s = rad_from_deg(limits.swing_deg), rad_from_deg(limits.swing_speed_deg_s)
    there = smooth_motion(way * reach_rad, speed_rad_s, 1.0 / rate_hz)
    rig: Any = setup.rig  # which has bounds, so it has the method too
    rig.tighten(Tight(bound.name, reach_rad, speed_rad_s))
    try:
        result = trial(
            setup,
            hold_stretch(SETTLE_S),
            follow_stretch(np.concatenate([there, -there]), rate_hz),
        )
    finally:
        rig.tighten(None)
    _bring_back(setup)
    return _judged(bound, result, way, reach_rad, speed_rad_s)


def _bring_back(setup: Setup) -> None:
    """Take back a fault that the bound may have left, and return to where the move began."""
    reset = getattr(setup.rig, "reset_fault", None)
    if reset is not None:
        reset()
    angle = listen(setup, SETTLE_S).angle_rad
    rest_rad = float(angle[-1]) if math.isfinite(angle[-1]) else 0.0
    speed_rad_s = 0.5 * rad_from_deg(setup.limits.swing_speed_deg_s)
    back = smooth_motion(-rest_rad, speed_rad_s, 1.0 / setup.rate_hz)
    result = trial(setup, hold_stretch(SETTLE_S), follow_stretch(back, setup.rate_hz))
    if result.cause is not Cause.NONE:
        raise DeviceError(
            f"drive: {result.cause.sentence} on the way back from a bound; check that a tightened "
            "bound is as before, by switching the drive off and on"
        )


def _judged(
    bound: BoundFound, result: TrialResult, way: float, reach_rad: float, speed_rad_s: float
) -> tuple[bool, str]:
    if result.cause not in CONSEQUENCES:
        return False, f"the move tells nothing: {stopped_for(result.cause)}"
    if bound.name in (SPEED, MOTOR_SPEED):
        fastest = _largest(result.readings, "velocity_rad_s", way)
        words = f"at most {math.degrees(fastest):.3g} of {math.degrees(speed_rad_s):.3g} deg/s"
        return fastest <= MOST * speed_rad_s, words
    went = _largest(result.readings, "angle_rad", way)
    words = f"{math.degrees(went):.3g} of {math.degrees(reach_rad):.3g} deg"
    return went <= MOST * reach_rad, words


def _largest(readings: Readings, column: str, way: float) -> float:
    values = way * getattr(readings, column)
    values = values[np.isfinite(values)]
    return float(values.max()) if len(values) else 0.0
