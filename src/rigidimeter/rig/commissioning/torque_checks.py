"""Checks on the torque that answers a motion: its sign, its gain, its delay.

With J = M/θ'' measured and J₀ known, from an earlier day or from a weight, J/J₀ is the gain of the
torque sensor. J may differ from J₀ by the larger of a percentage and three standard errors of the
difference. With both errors at most e = 10 % that is at most 3 √2 e = 42 %, so a gain of a half
never passes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rigidimeter.core.settings import Settings
from rigidimeter.rig.commissioning.checks import RigCheck, below, impossible, with_unit, yes
from rigidimeter.rig.commissioning.inertia_fit import TorqueAnswer
from rigidimeter.rig.commissioning.trials import stopped_for
from rigidimeter.rig.guard import Cause

SIGN, PRECISION, GAIN = "sign of the torque", "error of the inertia", "inertia"
DELAY = "torque behind the angle"
NO_ANSWER = (Cause.TORQUE_SIGN, Cause.TORQUE_SILENT)
"""What the guard stops for where the torque does not answer the motion."""

LARGEST_ERROR_PERCENT = 10.0
CERTAIN = 3.0
"""Standard errors at which a difference is no chance."""

_UNIT = "kg·m²"


class KnownInertia(NamedTuple):
    """What J must be, with its standard error, and where that is from."""

    inertia_kg_m2: float
    inertia_se_kg_m2: float
    source: str


def sign_check(answer: TorqueAnswer, cause: Cause) -> RigCheck:
    """Check that torque and angle have the same sign: an inertia is above zero.

    The guard may have ended the motion because the torque did not answer it.
    """
    J, error = answer.inertia_kg_m2, answer.inertia_se_kg_m2
    words = f"J {J:.3g} {_UNIT}, explains {100 * max(answer.explained, 0.0):.0f} % of the torque"
    if cause is not Cause.NONE:
        words = stopped_for(cause)
    if cause is Cause.TORQUE_SIGN or CERTAIN * error < -J:
        remedy = (
            "the inertia is negative, so torque and angle have opposite signs: sensor, cable or "
            "sign in the rig file were changed; with it the loop would run away"
        )
    else:
        remedy = (
            "the torque does not answer the motion: another axis, no gain, a loose cuff, or "
            "nothing heavy enough beyond the sensor; fasten a weight"
        )
    good = cause is Cause.NONE and CERTAIN * error < J
    return yes(SIGN, good, words, "that of a positive inertia", remedy)


def precision_check(answer: TorqueAnswer) -> RigCheck:
    """Check that the inertia is known well enough to compare it."""
    return below(
        PRECISION,
        100.0 * answer.inertia_se_kg_m2 / abs(answer.inertia_kg_m2),
        "%",
        LARGEST_ERROR_PERCENT,
        "raise commissioning.daily_motion_s or daily_speed_deg_s, or fasten a weight",
    )


def gain_check(answer: TorqueAnswer, known: KnownInertia, settings: Settings) -> RigCheck:
    """Compare the inertia with a known one."""
    J0, percent = known.inertia_kg_m2, settings.commissioning.inertia_tolerance_percent
    error = math.hypot(answer.inertia_se_kg_m2, known.inertia_se_kg_m2)
    allowed = max(0.01 * percent * J0, CERTAIN * error)
    good = abs(answer.inertia_kg_m2 - J0) <= allowed
    return RigCheck(
        GAIN,
        answer.inertia_kg_m2,
        _UNIT,
        f"{J0:.3g} ± {allowed:.2g} {_UNIT}, {known.source}",
        "passed" if good else "failed",
        ""
        if good
        else "gain, units or calibration of the torque sensor have changed, or somebody's arm is "
        "in the rig; if cuff or weight were changed, say so with --new-reference",
    )


def delay_check(answer: TorqueAnswer, expected_s: float | None, settings: Settings) -> RigCheck:
    """Compare how late the torque is with the day the rig was commissioned."""
    allowed_s = max(settings.commissioning.delay_tolerance_s, 1.0 / settings.rig.tick_rate_hz)
    if expected_s is None:
        why = "the commissioning record has no torque_after_motion_s; commission again"
        return impossible(DELAY, "as commissioned", why)
    good = abs(answer.delay_s - expected_s) <= allowed_s
    limit = f"{with_unit(expected_s, 's')} ± {with_unit(allowed_s, 's')}, as commissioned"
    remedy = (
        "the torque arrives later or earlier than the margins were computed for: check the "
        "sensor's filter and the network, or commission again"
    )
    return RigCheck(
        DELAY,
        answer.delay_s,
        "s",
        limit,
        "passed" if good else "failed",
        "" if good else remedy,
    )
