"""What every trial of a rig begins with: rest without power, rest with power, a small move.

Nothing larger is tried after one of them went wrong.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from rigidimeter.rig.commissioning.checks import Check, impossible, yes
from rigidimeter.rig.commissioning.motion_tests import (
    COMPLETED,
    drift_check,
    small_move_check,
    swing,
)
from rigidimeter.rig.commissioning.static_tests import (
    lateness,
    lost_check,
    noise_checks,
    rate_checks,
)
from rigidimeter.rig.commissioning.trial import (
    Array,
    Setup,
    TrialResult,
    drop_old_samples,
    follow,
    hold,
    listen,
    trial,
)
from rigidimeter.rig.guard import Cause

SETTLE_S = 0.5


@dataclass
class Findings:
    """What came of the trials so far."""

    checks: list[Check] = field(default_factory=list)
    numbers: dict[str, float] = field(default_factory=dict)

    def none_failed(self) -> bool:
        """Whether no check failed."""
        return not any(check.outcome == "failed" for check in self.checks)

    def refrain(self, why: str) -> None:
        """Say of the rest that it was not tried."""
        self.checks.append(impossible("everything after this", "tried", why))

    @property
    def finite_numbers(self) -> dict[str, float]:
        """The numbers that could be measured."""
        return {name: value for name, value in self.numbers.items() if math.isfinite(value)}


def power_allowed(setup: Setup, found: Findings, question: str) -> bool:
    """Whether nothing failed without power and the operator agrees; else the rest is not tried."""
    if not found.none_failed():
        found.refrain("a check without power failed; put that right first")
        return False
    if not setup.operator.ask(f"Nobody's arm may be in the rig; {question}"):
        found.refrain("the operator did not agree to it")
        return False
    return True


def at_rest(setup: Setup, found: Findings, duration_s: float) -> None:
    """Listen without power: rates, losses, noise and bias of the torque, lateness."""
    rig, settings = setup.rig, setup.settings
    setup.operator.say(f"At rest, without power: {duration_s:g} s. Nobody touches the joint.")
    drop_old_samples(setup)
    listen(setup, SETTLE_S)  # a drive that was never asked has nothing to say yet
    before = dict(rig.counts)
    readings = listen(setup, duration_s)
    found.checks += rate_checks(
        "torque", readings.time_s, readings.torque_time_s, settings.rig.torque.rate_hz, settings
    )
    found.checks.append(lost_check(before, rig.counts, setup.limits.lost_percent))
    found.checks += noise_checks(readings, settings)
    found.checks.append(lateness(readings, settings))
    torque = readings.torque_nm[np.isfinite(readings.torque_nm)]
    found.numbers["torque_bias_nm"] = float(np.mean(torque)) if len(torque) else 0.0


def small_move(setup: Setup, found: Findings, rest_s: float) -> bool:
    """Give power for a while of rest, then move a little; return whether that went as told."""
    settings, limits = setup.settings, setup.limits
    setup.operator.say(f"A small move of {limits.nudge_deg:g} deg.")
    resting = trial(setup, hold(rest_s))
    still, rate_hz = resting.readings, settings.rig.motion.rate_hz
    found.checks += rate_checks("motion", still.time_s, still.motion_time_s, rate_hz, settings)
    found.checks.append(drift_check(resting.readings, 0.5 * limits.nudge_deg))
    if resting.cause is not Cause.NONE:
        words = resting.cause.sentence
        found.checks.append(yes(COMPLETED, False, words, "yes", "remove the reason"))
    if not found.none_failed():
        return False
    velocity = swing(settings, limits.nudge_deg, 0.2 * limits.swing_speed_deg_s, 1)
    result = trial(setup, hold(SETTLE_S), follow(velocity, setup.rate_hz))
    check = small_move_check(result, settings)
    if not check.passed:
        found.checks.append(check)
    return check.passed


def move(setup: Setup, velocity_rad_s: Array, spread: float = 0.0) -> TrialResult:
    """Stand still, move, and stand still; `spread` is that of `trial`."""
    way = follow(velocity_rad_s, setup.rate_hz)
    return trial(setup, hold(SETTLE_S), way, hold(SETTLE_S), spread=spread)
