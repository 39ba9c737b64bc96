"""What every trial of a rig begins with: rest without power, rest with power, a small move.

Nothing larger is tried after one of them went wrong. By itself, `zero_check` reads zero and noise
of the torque sensor at rest, and judges them as a run does when it begins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition import angle_range_deg, bias_and_noise, motion_objection
from rigidimeter.rig.commissioning.checks import RigCheck, impossible, with_unit, yes
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
from rigidimeter.rig.commissioning.trials import (
    Array,
    Setup,
    TrialResult,
    drop_old_samples,
    follow_stretch,
    hold_stretch,
    listen,
    trial,
)
from rigidimeter.rig.devices.base import DeviceError, Reading
from rigidimeter.rig.guard import Cause

SETTLE_S = 0.5


@dataclass
class CheckResults:
    """What came of the trials so far."""

    checks: list[RigCheck] = field(default_factory=list)
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


def power_allowed(setup: Setup, found: CheckResults, question: str) -> bool:
    """Whether nothing failed without power and the operator agrees; else the rest is not tried."""
    if not found.none_failed():
        found.refrain("a check without power failed; put that right first")
        return False
    if not setup.operator.ask(f"Nobody's arm may be in the rig; {question}"):
        found.refrain("the operator did not agree to it")
        return False
    return True


def at_rest(setup: Setup, found: CheckResults, duration_s: float) -> None:
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


def small_move(setup: Setup, found: CheckResults, rest_s: float) -> bool:
    """Give power for a while of rest, then move a little; return whether that went as told."""
    settings, limits = setup.settings, setup.limits
    setup.operator.say(f"A small move of {limits.nudge_deg:g} deg.")
    resting = trial(setup, hold_stretch(rest_s))
    still, rate_hz = resting.readings, settings.rig.motion.rate_hz
    found.checks += rate_checks("motion", still.time_s, still.motion_time_s, rate_hz, settings)
    found.checks.append(drift_check(resting.readings, 0.5 * limits.nudge_deg))
    if resting.cause is not Cause.NONE:
        words = resting.cause.sentence
        found.checks.append(yes(COMPLETED, False, words, "yes", "remove the reason"))
    if not found.none_failed():
        return False
    velocity = swing(settings, limits.nudge_deg, 0.2 * limits.swing_speed_deg_s, 1)
    result = trial(setup, hold_stretch(SETTLE_S), follow_stretch(velocity, setup.rate_hz))
    check = small_move_check(result, settings)
    if not check.passed:
        found.checks.append(check)
    return check.passed


def move(setup: Setup, velocity_rad_s: Array, spread: float = 0.0) -> TrialResult:
    """Stand still, move, and stand still; `spread` is that of `trial`."""
    way = follow_stretch(velocity_rad_s, setup.rate_hz)
    return trial(setup, hold_stretch(SETTLE_S), way, hold_stretch(SETTLE_S), spread=spread)


@dataclass(frozen=True)
class ZeroFound:
    """What the sensors read at rest.

    Attributes
    ----------
    bias_nm, noise_sd_nm : float
        Mean and SD of the torque; NaN if too few samples came.
    range_deg : float
        How far the joint moved.
    objection : str
        Why a run would refuse to begin with it; empty if it would not.
    """

    bias_nm: float
    noise_sd_nm: float
    range_deg: float
    objection: str

    def words(self, settings: Settings) -> str:
        """Return each value beside its limit, to a hundredth of that."""
        limits = settings.zeroing
        rows = (
            ("bias", self.bias_nm, limits.bias_limit_nm, "N·m"),
            ("noise (SD)", self.noise_sd_nm, limits.noise_limit_nm, "N·m"),
            ("motion", self.range_deg, limits.motion_limit_deg, "deg"),
        )
        return ", ".join(
            f"{name} {_rounded(value, limit, unit)} (at most {with_unit(limit, unit)})"
            for name, value, limit, unit in rows
        )


def _rounded(value: float, limit: float, unit: str) -> str:
    """Return a value to a hundredth of its limit.

    >>> _rounded(0.000112, 1.0, "N·m"), _rounded(0.00478, 0.1, "N·m"), _rounded(-0.1, 250.0, "N·m")
    ('0.00 N·m', '0.005 N·m', '0 N·m')
    """
    if not math.isfinite(value):
        return with_unit(None, unit)
    places = max(0, 2 - math.floor(math.log10(limit)))
    return f"{round(value, places) + 0.0:.{places}f} {unit}"  # no -0.00


def zero_check(setup: Setup) -> ZeroFound:
    """Listen for `zeroing.duration_s`; the rig is connected and closed, and never has power.

    A device that does not answer is an objection.
    """
    rig, settings = setup.rig, setup.settings
    readings: list[Reading] = []

    def keep(reading: Reading) -> bool:
        readings.append(reading)
        return False

    try:
        rig.connect()
        rig.configure()
        setup.operator.say(
            f"At rest, without power: {settings.zeroing.duration_s:g} s. Nobody touches the joint; "
            "a subject is relaxed."
        )
        drop_old_samples(setup)
        listen(setup, SETTLE_S)
        listen(setup, settings.zeroing.duration_s, until=keep)
    except DeviceError as error:
        return ZeroFound(math.nan, math.nan, math.nan, str(error))
    finally:
        rig.close()
    bias_nm, noise_sd_nm, why = bias_and_noise(readings, settings.zeroing)
    why = why or motion_objection(readings, settings)
    return ZeroFound(bias_nm, noise_sd_nm, angle_range_deg(readings), why)
