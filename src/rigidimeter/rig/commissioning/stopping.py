"""Whether the rig stops without us: its watchdog, and the emergency stop.

When nothing is written any more, a joint that moves slowly must not go on for longer than the
watchdog allows. A drive that says so by itself must then stay where it is, whatever it is told,
until an operator agrees; and so after the emergency stop, when it is released.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from rigidimeter.core.units import rad_from_deg
from rigidimeter.rig.acquisition import ControlLoop, control_modes
from rigidimeter.rig.commissioning.checks import RigCheck, below, impossible, untried, yes
from rigidimeter.rig.commissioning.commissioning_record import HAND_HELD
from rigidimeter.rig.commissioning.manual_checks import ask_operator
from rigidimeter.rig.commissioning.motion_tests import smooth_motion
from rigidimeter.rig.commissioning.trials import (
    Readings,
    Setup,
    drop_old_samples,
    follow_stretch,
    hold_stretch,
    listen,
    stopped_for,
    trial,
)
from rigidimeter.rig.devices.base import DeviceError, Rig
from rigidimeter.rig.guard import Cause

SETTLE_S = 0.3
STOPPED_S = 0.4
MAX_DEG = 0.2
"""A stopped joint that moves more than this has started again."""

STOPPED_DEG_S = 2.0
REPORTS = (Cause.DRIVE_FAULT, Cause.DRIVE_STATE, Cause.DRIVE_LOST, Cause.EMERGENCY_STOP)
WATCHDOG, REPORT = "watchdog", "watchdog reported"
RESTART = "stays stopped after the watchdog"
AGAIN = "comes back after confirmation"
STOP, POWER = "emergency stop", "hardware enable drops the power"
RELEASE = "stays stopped after the release"
BUTTON = "button_bit"
"""The fact of a drive that has a hand-held stop."""

HAND_HELD_RELEASE = "stays stopped after the hand-held stop"


def watchdog_checks(setup: Setup, watchdog_s: float | None) -> list[RigCheck]:
    """Fall silent, at rest and in a slow motion; the drive must stop by itself and stay so."""
    if watchdog_s is None:
        why = "the drive has no watchdog that could be tried"
        return [impossible(name, "", why) for name in (REPORT, RESTART, AGAIN, WATCHDOG)]
    rig, time = setup.rig, setup.time
    limit_s = watchdog_s + setup.limits.watchdog_margin_s
    reported_s = math.inf
    after_stop: Readings | None = None

    def silence(_: ControlLoop) -> None:
        nonlocal reported_s, after_stop
        before = rig.read().motion_status
        began_s = time.now()
        # A driver may give the drive up by its own clock. Only what comes from the drive counts.
        readings = listen(
            setup,
            limit_s,
            write_rad_s=None,
            until=lambda r: r.cause in REPORTS and r.motion_status != before,
        )
        if rig.read().motion_status != before:
            reported_s = float(readings.time_s[-1]) - began_s
            after_stop = _command_stopped_rig(setup)

    result = trial(setup, hold_stretch(SETTLE_S), silence)
    if result.cause is not Cause.NONE:
        why = "remove the reason and commission again"
        return [yes(WATCHDOG, False, stopped_for(result.cause), "tried", why)]
    if after_stop is None:
        silent = "the drive does not say by itself that it stopped; there is nothing to confirm"
        checks = [impossible(name, "", silent) for name in (REPORT, RESTART, AGAIN)]
    else:
        late = "the drive says too late that it stopped: shorten its watchdog"
        checks = [below(REPORT, reported_s, "s", limit_s, late), _stayed(RESTART, after_stop)]
        checks.append(_again(setup))
        if not checks[-1].passed:
            why = "the drive has no power again after the watchdog"
            return [*checks, impossible(WATCHDOG, "", why)]
    return [*checks, _overrun(setup, watchdog_s)]


def emergency_stop_checks(setup: Setup) -> list[RigCheck]:
    """Let the operator press the emergency stop, tell whether the power went, and release it."""
    rig, operator, wait_s = setup.rig, setup.operator, setup.limits.emergency_stop_wait_s
    limits_of = {STOP: "seen at once", POWER: "yes", RELEASE: f"at most {MAX_DEG:g} deg"}
    if not operator.present:
        return [untried(name, limit) for name, limit in limits_of.items()]

    def none_of(names: tuple[str, ...], why: str) -> list[RigCheck]:
        return [impossible(name, limits_of[name], why) for name in names]

    if not operator.ask(
        f"Emergency stop: after you agree the drive has power for {wait_s:g} s and stands still; "
        "press the emergency stop within that time, and watch the drive's power lamp or contactor. "
        "Ready?"
    ):
        return none_of((STOP, POWER, RELEASE), "the operator did not agree to it")
    before = after = 0

    def wait(loop: ControlLoop) -> None:
        nonlocal before, after
        before = rig.read().motion_status
        control_modes.hold(loop, wait_s)
        after = rig.read().motion_status

    result = trial(setup, wait)
    # A driver may give the drive up by its own clock; one that was switched off says nothing.
    reported = after != before or result.cause is Cause.DRIVE_LOST
    seen = result.cause in REPORTS and reported
    words = result.cause.sentence if result.cause is not Cause.NONE else f"nothing in {wait_s:g} s"
    remedy = "the emergency stop must take the drive's power away: check its wiring"
    checks = [yes(STOP, seen, words, limits_of[STOP], remedy)]
    if not seen:
        return [*checks, *none_of((POWER, RELEASE), "the emergency stop was not seen")]
    checks.append(
        ask_operator(
            operator,
            POWER,
            "Did the drive's power go by itself at the moment you pressed (lamp or contactor), "
            "without this program?",
            "the stop must open the hardware enable or the supply: one that only asks a program "
            "is none",
        )
    )
    if not operator.ask(
        "Release the emergency stop again, and keep hands off the joint. Released?"
    ):
        return [*checks, *none_of((RELEASE,), "the operator did not release it")]
    drop_old_samples(setup)
    return [*checks, _stayed(RELEASE, _command_stopped_rig(setup))]


def hand_held_checks(setup: Setup, facts: Mapping[str, Any]) -> list[RigCheck]:
    """Let somebody press the hand-held stop in the drive's inputs, where the rig file names one."""
    if BUTTON not in facts["drive"]["values"]:
        return []
    operator, wait_s = setup.operator, setup.limits.emergency_stop_wait_s
    limit = "an emergency stop"
    if not operator.present:
        return [untried(HAND_HELD, limit)]
    if not operator.ask(
        f"Hand-held stop: after you agree the drive has power for {wait_s:g} s and stands still; "
        "press the button in the person's hand within that time. Ready?"
    ):
        return [impossible(HAND_HELD, limit, "the operator did not agree to it")]
    result = trial(setup, lambda loop: control_modes.hold(loop, wait_s))
    words = result.cause.sentence if result.cause is not Cause.NONE else f"nothing in {wait_s:g} s"
    remedy = "check the button's wiring, button_bit and button_pressed_level of [drive]"
    seen = result.cause is Cause.EMERGENCY_STOP
    checks = [yes(HAND_HELD, seen, words, limit, remedy)]
    moved = f"at most {MAX_DEG:g} deg"
    if not seen:
        return [*checks, impossible(HAND_HELD_RELEASE, moved, "the button was not seen")]
    if not operator.ask("Release the button, and keep hands off the joint. Released?"):
        return [*checks, impossible(HAND_HELD_RELEASE, moved, "the operator did not release it")]
    drop_old_samples(setup)
    return [*checks, _stayed(HAND_HELD_RELEASE, _command_stopped_rig(setup))]


def _command_stopped_rig(setup: Setup) -> Readings:
    """Command a slow motion to a rig that must not move; it ends as soon as it does."""
    start_rad, limit_rad = setup.rig.read().angle_rad, rad_from_deg(MAX_DEG)
    readings = listen(
        setup,
        STOPPED_S,
        write_rad_s=rad_from_deg(STOPPED_DEG_S),
        until=lambda reading: abs(reading.angle_rad - start_rad) > limit_rad,
    )
    setup.rig.write(0.0)
    return readings


def _stayed(name: str, readings: Readings) -> RigCheck:
    angle = readings.angle_rad[np.isfinite(readings.angle_rad)]
    moved = math.degrees(float(np.ptp(angle))) if len(angle) else 0.0
    remedy = "a stopped drive must wait for an operator: check its automatic restart"
    return below(name, moved, "deg", MAX_DEG, remedy)


def _again(setup: Setup) -> RigCheck:
    """Enable the rig again, once the operator agrees."""
    limit = "enabled, at rest"
    question = "The watchdog has stopped the drive. May it be reset and get power again?"
    if not setup.operator.ask(question):
        return impossible(AGAIN, limit, "the operator did not agree to it")
    try:
        _reset(setup.rig)
        result = trial(setup, hold_stretch(SETTLE_S))
    except DeviceError as error:
        return yes(AGAIN, False, "refused", limit, str(error))
    good = result.cause is Cause.NONE
    return yes(AGAIN, good, result.cause.sentence, limit, "check how the drive's fault is reset")


def _reset(rig: Rig) -> None:
    """Take back the fault that the watchdog left, where the rig has a way to."""
    reset = getattr(rig, "reset_fault", None)
    if reset is not None:
        reset()


def _overrun(setup: Setup, watchdog_s: float) -> RigCheck:
    """Fall silent while the joint moves slowly; see how long it went on, and bring it back."""
    rig, rate_hz, limits = setup.rig, setup.rate_hz, setup.limits
    speed_rad_s = rad_from_deg(limits.swing_speed_deg_s)
    limit_s = watchdog_s + limits.watchdog_margin_s
    before = after = math.nan
    n = round(SETTLE_S * rate_hz)
    velocity = np.minimum(np.arange(1, n + 1) / (0.5 * n), 1.0) * speed_rad_s

    def silence(_: ControlLoop) -> None:
        nonlocal before, after
        before = rig.read().angle_rad
        listen(setup, 2.0 * limit_s + SETTLE_S, write_rad_s=None)
        after = float(listen(setup, SETTLE_S).angle_rad[-1])

    result = trial(setup, hold_stretch(SETTLE_S), follow_stretch(velocity, rate_hz), silence)
    if math.isnan(after):
        why = "remove the reason and commission again"
        return yes(WATCHDOG, False, stopped_for(result.cause), "tried", why)
    went_on_s = abs(after - before) / speed_rad_s
    _reset(rig)
    back = smooth_motion(-after, 0.5 * speed_rad_s, 1.0 / rate_hz)
    trial(setup, hold_stretch(SETTLE_S), follow_stretch(back, rate_hz))
    remedy = "the drive keeps moving when the computer stops: set its watchdog and try again"
    limit_s += setup.settings.guard.reaction_time_s
    return below(WATCHDOG, went_on_s, "s", limit_s, remedy)
