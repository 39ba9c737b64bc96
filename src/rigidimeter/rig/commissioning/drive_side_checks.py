"""What the drive's own torque is worth as a second witness: moves, checks, and the model they give.

After the known torque, and with its two swings, the joint is moved widely and slowly, widely and
fast, and quickly. Without a known torque, or without a torque of the drive, the law is off, and the
record says so.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from rigidimeter.core.settings import Settings
from rigidimeter.rig.commissioning.checks import (
    RigCheck,
    below,
    impossible,
    with_unit,
    within_tolerance,
    yes,
)
from rigidimeter.rig.commissioning.drive_side_fit import (
    ZERO,
    as_numbers,
    fitted,
    found_scale,
    model_in,
    stepped,
    with_scatter,
    with_zero,
)
from rigidimeter.rig.commissioning.first_steps import CheckResults, move
from rigidimeter.rig.commissioning.inertia_fit import quick_motion
from rigidimeter.rig.commissioning.manual_checks import Loaded, known_torque
from rigidimeter.rig.commissioning.motion_tests import COMPLETED, STEP_S, steps, swing
from rigidimeter.rig.commissioning.trials import Readings, Setup, stopped_for
from rigidimeter.rig.guard import TIMES_SCATTER, Cause, DriveModel

SCALE, WITNESS = "scale of the drive's torque", "torque sensor against the drive's torque"
SCALE_PERCENT = 50.0
"""A gear's losses count as scale; a wrong unit, gear or rated torque is more."""

MAX_SCALE_ERROR = 0.02

WIDE = 0.8
"""Of the position limit at most."""

OF_LIMIT = 0.2
"""Of the torque limit: a smaller fault is no danger that a person could not bear."""


def unseen_nm(model: DriveModel) -> float:
    """Return how large a steady difference of the torques remains unseen while the drive moves."""
    return TIMES_SCATTER * model.scatter_nm


def drive_side_checks(setup: Setup, found: CheckResults, loaded: Loaded | None) -> None:
    """Find the drive's side; put its checks and numbers to what was found.

    Parameters
    ----------
    setup : Setup
    found : CheckResults
    loaded : Loaded or None
        A slow swing without and with a known torque, if there was one.
    """
    limit = (
        f"a difference of {with_unit(OF_LIMIT * setup.settings.guard.torque_limit_nm, 'N·m')} found"
    )
    off = "the guard does not compare the two"
    if math.isnan(setup.rig.read().drive_torque_nm):
        why = f"the drive reports no torque of its own: {off}"
        found.checks.append(impossible(WITNESS, limit, why))
        return
    if loaded is None:
        why = f"no torque is known, so that {off}; commission with --known-torque-nm"
        found.checks.append(impossible(WITNESS, limit, why))
        return
    settings = setup.settings
    terms = [stepped(settings, readings).terms for readings in loaded]
    scale = found_scale(*terms)
    if scale is None or not scale.scale_se <= MAX_SCALE_ERROR * abs(scale.scale):
        why = f"the known torque hardly shows in the drive's: {off}; use a larger one"
        found.checks.append(impossible(WITNESS, limit, why))
        return
    found.checks.append(
        within_tolerance(SCALE, scale.scale, "1", 1.0, SCALE_PERCENT, _SCALE_REMEDY)
    )
    if not found.checks[-1].passed:
        return
    moves = _moves(setup, found)
    if moves is None:
        found.checks.append(impossible(WITNESS, limit, f"the moves were not made: {off}"))
        return
    wide, quick = moves
    all_terms = [stepped(settings, readings).terms for readings in (*wide, *quick)]
    model = fitted(scale.scale, all_terms)
    if model is None:
        why = f"the drive hardly slid: {off}; raise commissioning.wide_deg"
        found.checks.append(impossible(WITNESS, limit, why))
        return
    model = with_scatter(settings, model, wide, quick)
    found.numbers.update(as_numbers(model), drive_side_scale_se=scale.scale_se)
    found.checks.append(witness_check(model, settings))


def drive_side_of(setup: Setup) -> DriveModel | None:
    """Return the model of the drive's side alone, by the moves of commissioning; None without one.

    The rig is connected.
    """
    found = CheckResults()
    _, loaded = known_torque(setup)
    drive_side_checks(setup, found, loaded)
    return model_in(found.numbers)


def witness_check(model: DriveModel, settings: Settings) -> RigCheck:
    """Return how large a difference of the torques is found, and what remains unseen."""
    most_nm, value = OF_LIMIT * settings.guard.torque_limit_nm, unseen_nm(model)
    remark = ""
    if value > most_nm:
        remark = (
            f"a fault of up to {value:.2g} N·m remains unseen while the drive moves, and one of "
            f"{value + model.friction_nm:.2g} N·m while it stands still: the friction of this "
            "drive hides it"
        )
    words = (
        f"a difference of {value:.2g} N·m found; scale {model.scale:.3g}, inertia "
        f"{model.inertia_kg_m2:.2g} kg·m², friction {model.friction_nm:.2g} N·m"
    )
    return RigCheck(
        WITNESS, words, "", f"a difference of {most_nm:.3g} N·m found", "passed", remark
    )


def daily_drive_check(
    setup: Setup,
    found: CheckResults,
    commissioned: Mapping[str, float],
    moves: Sequence[Readings],
) -> None:
    """Compare both torques over the moves of a daily check, and find the zero of today.

    Parameters
    ----------
    setup : Setup
    found : CheckResults
        The check and today's zero are put there.
    commissioned : mapping
        The numbers of the commissioning record.
    moves : sequence of Readings
    """
    model, settings = model_in(commissioned), setup.settings
    if model is None:
        why = "the guard does not compare them: the commissioning record has no model of the drive"
        found.checks.append(impossible(WITNESS, "as commissioned", why))
        return
    model = with_zero(settings, model, moves)
    found.numbers[ZERO] = model.zero_nm
    apart_nm = max(
        float(np.sqrt(np.mean(stepped(settings, readings, model).beyond_nm ** 2)))
        for readings in moves
    )
    remedy = (
        "sensor, motor or gear are no longer as they were when the rig was commissioned: check "
        "the sensor's calibration, then commission again"
    )
    found.checks.append(below(WITNESS, apart_nm, "N·m", unseen_nm(model), remedy))


def _moves(
    setup: Setup, found: CheckResults
) -> tuple[Sequence[Readings], Sequence[Readings]] | None:
    """Make the wide and the quick moves; None if nobody wants them or the guard ended one."""
    settings, limits, rate_hz = setup.settings, setup.limits, setup.rate_hz
    wide_deg = min(limits.wide_deg, WIDE * settings.guard.position_limit_deg)
    fast_deg_s = min(limits.wide_speed_deg_s, settings.guard.speed_limit_deg_s)
    if not setup.operator.ask(
        f"Nobody's arm may be in the rig. For the friction of the drive it is moved by "
        f"{wide_deg:g} deg to both sides, at up to {fast_deg_s:g} deg/s. Go on?"
    ):
        return None
    # The steps go as far as six of them in a row.
    step_deg_s = min(0.5 * fast_deg_s, wide_deg / (6.0 * STEP_S))
    moves = (
        # So slowly that the filters let pass how the friction varies with the angle.
        swing(settings, 0.5 * wide_deg, 0.5 * limits.swing_speed_deg_s, 1),
        swing(settings, wide_deg, fast_deg_s, 2),
        quick_motion(rate_hz, limits.daily_motion_s, fast_deg_s),
        steps(settings, step_deg_s),
    )
    done: list[Readings] = []
    for velocity in moves:
        result = move(setup, velocity)
        if result.cause is not Cause.NONE:
            words = stopped_for(result.cause)
            found.checks.append(yes(COMPLETED, False, words, "yes", "remove the reason"))
            return None
        done.append(result.readings)
    return done[:2], done[2:]


_SCALE_REMEDY = (
    "the drive's rated torque, the gear ratio or their units in the rig file are wrong, and so is "
    "every bound of torque that is computed from them"
)
