"""The order in which a rig is tried: what cannot hurt first, and nothing after what went wrong.

    read back, without power     facts, rates, losses, noise, lateness
    a known angle, without power by hand
    a nudge                      does it move at all as told
    a swing, and quick steps     directions, scales, delays, bandwidth, margins
    a known torque               by hand
    silence                      watchdog
    emergency stop

Nobody's arm is in the rig meanwhile. The drive has power only while a trial runs, never while a
question waits for its answer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rigidimeter.commissioning.checks import Check, impossible, yes
from rigidimeter.commissioning.margins import margin_checks
from rigidimeter.commissioning.moving import (
    ANGLE_PER_COMMAND,
    angles,
    drift_check,
    nudge_check,
    step_checks,
    steps,
    swing,
    swing_checks,
    torque_sign,
)
from rigidimeter.commissioning.record import CommissioningRecord, covered, kept_facts
from rigidimeter.commissioning.still import (
    facts_checks,
    known_checks,
    lateness,
    lost_check,
    noise_checks,
    rate_checks,
)
from rigidimeter.commissioning.stopping import emergency_stop_checks, watchdog_checks
from rigidimeter.commissioning.trial import Timebase, follow, freshen, hold, listen, trial
from rigidimeter.device.base import DeviceError, Rig
from rigidimeter.device.rigfile import RigFile
from rigidimeter.guard import Cause
from rigidimeter.settings import Settings
from rigidimeter.settings.commissioning import CommissioningSettings

__all__ = ["Operator", "commission"]

SETTLE_S = 0.5
KNOWN_ANGLE_S = 1.0
MOVED_AS_SAID = "the joint moved as said"


@dataclass(frozen=True)
class Operator:
    """Who is asked and told.

    Parameters
    ----------
    ask : callable
        Puts a question; True is consent. Nothing has power while it waits.
    say : callable
        Is told what comes next.
    presses : bool
        Whether somebody is there to press the emergency stop.
    known_torque_nm, known_angle_deg : float or None
        A torque that hands or a weight put on the joint, toward positive angles; an angle by which
        hands turn the joint.
    """

    ask: Callable[[str], bool]
    say: Callable[[str], None] = lambda _: None
    presses: bool = True
    known_torque_nm: float | None = None
    known_angle_deg: float | None = None


@dataclass
class _Found:
    checks: list[Check] = field(default_factory=list)
    numbers: dict[str, float] = field(default_factory=dict)
    bias_nm: float = 0.0

    def good(self, *names: str) -> bool:
        """Return whether all checks of these names passed; without names, whether none failed."""
        if not names:
            return not any(check.outcome == "failed" for check in self.checks)
        return all(check.passed for check in self.checks if check.name in names)


def commission(
    rig: Rig,
    rigfile: RigFile,
    settings: Settings,
    time: Timebase,
    operator: Operator,
    *,
    limits: CommissioningSettings | None = None,
    made_utc: str,
    software: str,
    signed_by: str = "",
) -> CommissioningRecord:
    """Try a rig; what is found is returned, never raised.

    The rig is connected, tried and closed, whatever happens.

    Parameters
    ----------
    rig : Rig
        Not connected yet.
    rigfile : RigFile
        Which it was built from.
    settings : Settings
        Of the protocol that will run on it.
    time : Timebase
        Of the same clock that the drivers have.
    operator : Operator
    limits : CommissioningSettings, optional
    made_utc, software, signed_by : str
        For the record.
    """
    found = _Found()
    facts: Mapping[str, Any] = {}
    try:
        try:
            rig.connect()
            facts = rig.configure()
        except DeviceError as error:
            what = "what the rig file says"
            found.checks.append(
                yes("devices read back", False, str(error), what, "see the sentence")
            )
        else:
            limits = limits or CommissioningSettings()
            try:
                _try_all(rig, settings, time, operator, limits, facts, found)
            except DeviceError as error:
                found.checks.append(
                    yes("devices answer", False, str(error), "throughout", "see the sentence")
                )
    finally:
        rig.close()
    return CommissioningRecord(
        rig_name=rigfile.name,
        rig_digest=rigfile.digest,
        facts=kept_facts(facts),
        covered=covered(settings),
        checks=tuple(found.checks),
        numbers={name: value for name, value in found.numbers.items() if math.isfinite(value)},
        software=software,
        made_utc=made_utc,
        signed_by=signed_by,
    )


def _try_all(
    rig: Rig,
    settings: Settings,
    time: Timebase,
    operator: Operator,
    limits: CommissioningSettings,
    facts: Mapping[str, Any],
    found: _Found,
) -> None:
    found.checks += facts_checks(facts, limits)
    _without_power(rig, settings, time, operator, limits, found)
    if not found.good():
        _refrain(found, "a check without power failed; put that right first")
        return
    if not operator.ask(
        "Nobody's arm may be in the rig; a spring, or a weight like a relaxed arm's, is fastened "
        f"to the joint. The drive will get power and move it by up to {limits.swing_deg:g} deg at "
        f"{limits.swing_speed_deg_s:g} deg/s. The emergency stop is at hand. Go on?"
    ):
        _refrain(found, "the operator did not agree to it")
        return
    if not _moving(rig, settings, time, operator, limits, found):
        _refrain(found, "the motions went wrong; put that right first")
        return
    if operator.known_torque_nm is not None:
        _known_torque(rig, settings, time, operator, limits, operator.known_torque_nm, found)
    else:
        found.checks.append(
            known_checks("known torque", "N·m", None, None, limits.known_tolerance_percent)
        )
    watchdog_s = facts["drive"]["watchdog_s"]
    operator.say("Watchdog: nothing is written for a while; the drive must stop by itself.")
    found.checks += watchdog_checks(rig, settings, time, limits, watchdog_s, operator.ask)
    ask = operator.ask if operator.presses else None
    found.checks += emergency_stop_checks(rig, settings, time, limits, ask)


def _without_power(
    rig: Rig,
    settings: Settings,
    time: Timebase,
    operator: Operator,
    limits: CommissioningSettings,
    found: _Found,
) -> None:
    rate_hz = settings.rig.tick_rate_hz
    operator.say(f"At rest, without power: {limits.idle_s:g} s. Nobody touches the joint.")
    freshen(rig, time, rate_hz)
    listen(rig, time, rate_hz, SETTLE_S)  # a drive that was never asked has nothing to say yet
    before = dict(rig.counts)
    heard = listen(rig, time, rate_hz, limits.idle_s)
    found.checks += rate_checks(
        "torque", heard.torque_time_s, settings.rig.torque.rate_hz, settings, limits
    )
    found.checks.append(lost_check(before, rig.counts, limits))
    found.checks += noise_checks(heard, settings)
    found.checks.append(lateness(heard, settings))
    torque = heard.torque_nm[np.isfinite(heard.torque_nm)]
    found.bias_nm = float(np.mean(torque)) if len(torque) else 0.0
    found.numbers["torque_bias_nm"] = found.bias_nm
    name, percent = "known angle", limits.scale_tolerance_percent
    wanted_deg = operator.known_angle_deg
    turned_deg = None
    if wanted_deg is not None:
        before_rad = _angle(rig, time, rate_hz)
        if operator.ask(f"Without power: turn the joint by {wanted_deg:+g} deg by hand. Done?"):
            turned_deg = math.degrees(_angle(rig, time, rate_hz) - before_rad)
            operator.ask("Turn it back to where it was. Done?")
    found.checks.append(known_checks(name, "deg", turned_deg, wanted_deg, percent))


def _moving(
    rig: Rig,
    settings: Settings,
    time: Timebase,
    operator: Operator,
    limits: CommissioningSettings,
    found: _Found,
) -> bool:
    """Nudge, swing and step; return whether all of it went as told."""
    speed = limits.swing_speed_deg_s
    nudge = swing(settings, limits.nudge_deg, 0.2 * speed, 1)
    operator.say(f"A nudge of {limits.nudge_deg:g} deg.")
    at_rest = trial(rig, settings, time, [hold(SETTLE_S)])
    found.checks += rate_checks(
        "motion", at_rest.heard.motion_time_s, settings.rig.motion.rate_hz, settings, limits
    )
    found.checks.append(drift_check(at_rest.heard, 0.5 * limits.nudge_deg))
    if at_rest.cause is not Cause.NONE or not found.good():
        if at_rest.cause is not Cause.NONE:
            words = at_rest.cause.sentence
            found.checks.append(yes("motions were completed", False, words, "yes", "see there"))
        return False
    tried = trial(rig, settings, time, [hold(SETTLE_S), follow(angles(nudge, settings), nudge)])
    check = nudge_check(tried, settings)
    if not check.passed:
        found.checks.append(check)
        return False
    operator.say(f"Slowly by {limits.swing_deg:g} deg to both sides.")
    slow = swing(settings, limits.swing_deg, speed, limits.swings)
    pause = hold(SETTLE_S)
    swung = trial(rig, settings, time, [pause, follow(angles(slow, settings), slow), pause])
    checks, followed = swing_checks(swung, settings, limits)
    found.checks += checks
    sign, work_j = torque_sign(swung.heard, settings.rig.drive_damping_ratio, followed.scale)
    found.checks.append(sign)
    found.numbers |= {
        "angle_per_command": followed.scale,
        "slow_delay_s": followed.delay_s,
        "work_j": work_j,
    }
    if not found.good(ANGLE_PER_COMMAND, "motions were completed", sign.name):
        return False
    said = operator.ask(
        f"Did the joint move first toward positive angles, by about {limits.swing_deg:g} deg, then "
        "as far to the other side, and back?"
    )
    answer = "yes" if said else "no"
    remedy = "turn sign, or put right the counts per turn, in the rig file"
    found.checks.append(yes(MOVED_AS_SAID, said, answer, "yes", remedy))
    if not said:
        return False
    operator.say("Small quick steps.")
    quick = steps(settings, limits)
    stepped = trial(rig, settings, time, [pause, follow(angles(quick, settings), quick), pause])
    checks, drive, arm = step_checks(stepped, settings)
    found.checks += checks
    found.numbers |= {
        "bandwidth_hz": drive.bandwidth_hz,
        "motion_delay_s": drive.delay_s,
        "torque_delay_s": arm.delay_s,
        "torque_after_motion_s": arm.delay_s - drive.delay_s,
        "arm_explains": arm.explained,
    }
    delay_s = arm.delay_s if checks[-1].passed else None
    checks, numbers = margin_checks(settings, drive.bandwidth_hz, delay_s)
    found.checks += checks
    found.numbers |= numbers
    return stepped.cause is Cause.NONE


def _known_torque(
    rig: Rig,
    settings: Settings,
    time: Timebase,
    operator: Operator,
    limits: CommissioningSettings,
    known_nm: float,
    found: _Found,
) -> None:
    """Compare a torque put on by hand; the drive holds against it, so it reads the opposite."""
    name, percent = "known torque", limits.known_tolerance_percent
    before = trial(rig, settings, time, [hold(SETTLE_S)]).heard.torque_nm
    held_s = limits.known_torque_s
    agreed = operator.ask(
        f"Put a torque of {known_nm:g} N·m on the joint, toward positive angles, and keep it for "
        f"{held_s + SETTLE_S:g} s after you agree; the drive will hold against it. Ready?"
    )
    value = None
    if agreed:
        heard = trial(rig, settings, time, [hold(SETTLE_S + held_s)]).heard
        late = heard.torque_nm[heard.time_s > SETTLE_S]
        value = -float(np.nanmedian(late) - np.nanmedian(before)) if len(late) else math.nan
        operator.ask("Take the torque off again. Done?")
    found.checks.append(known_checks(name, "N·m", value, known_nm, percent))


def _angle(rig: Rig, time: Timebase, rate_hz: float) -> float:
    """Return the mean angle over a short while without power."""
    freshen(rig, time, rate_hz)
    heard = listen(rig, time, rate_hz, KNOWN_ANGLE_S)
    return float(np.nanmean(heard.angle_rad[len(heard.angle_rad) // 2 :]))


def _refrain(found: _Found, why: str) -> None:
    """Say of the rest that it was not tried."""
    found.checks.append(impossible("what comes after", "tried", why))
