"""The order in which a rig is tried: what cannot hurt first, and nothing after what went wrong.

    read back, without power     facts, rates, losses, noise, lateness
    by hand, without power       mechanical stops, a known angle
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
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rigidimeter.commissioning.checks import Check, impossible, yes
from rigidimeter.commissioning.commissioning_record import CommissioningRecord
from rigidimeter.commissioning.coverage import covered, kept_facts
from rigidimeter.commissioning.manual_checks import Operator, known_angle, known_torque, told
from rigidimeter.commissioning.margins import margin_checks
from rigidimeter.commissioning.motion_tests import (
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
from rigidimeter.commissioning.static_tests import (
    facts_checks,
    lateness,
    lost_check,
    noise_checks,
    rate_checks,
)
from rigidimeter.commissioning.stopping import emergency_stop_checks, watchdog_checks
from rigidimeter.commissioning.trial import (
    Array,
    Timebase,
    Tried,
    follow,
    freshen,
    hold,
    listen,
    trial,
)
from rigidimeter.devices.base import DeviceError, Rig
from rigidimeter.devices.rigfile import RigFile
from rigidimeter.guard import Cause
from rigidimeter.settings import Settings
from rigidimeter.settings.commissioning_settings import CommissioningSettings

__all__ = ["commission"]

SETTLE_S = 0.5


@dataclass
class _Trials:
    """What is tried, by whom, with which limits; and what came of it so far."""

    rig: Rig
    settings: Settings
    time: Timebase
    operator: Operator
    limits: CommissioningSettings
    checks: list[Check] = field(default_factory=list)
    numbers: dict[str, float] = field(default_factory=dict)

    def good(self, *names: str) -> bool:
        """Return whether all checks of these names passed; without names, whether none failed."""
        if not names:
            return not any(check.outcome == "failed" for check in self.checks)
        return all(check.passed for check in self.checks if check.name in names)

    def refrain(self, why: str) -> None:
        """Say of the rest that it was not tried."""
        self.checks.append(impossible("everything after this", "tried", why))

    def move(self, velocity_rad_s: Array, *, pause_after: bool = True) -> Tried:
        """Enable the rig, stand still, move, and stand still."""
        pause, motion = (
            hold(SETTLE_S),
            follow(angles(velocity_rad_s, self.settings), velocity_rad_s),
        )
        stretches = [pause, motion, pause] if pause_after else [pause, motion]
        return trial(self.rig, self.settings, self.time, stretches)


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
    trials = _Trials(rig, settings, time, operator, limits or CommissioningSettings())
    facts: Mapping[str, Any] = {}
    name, limit = "devices read back", "what the rig file says"
    try:
        rig.connect()
        facts = rig.configure()
        name, limit = "devices answer", "throughout"
        _try_all(trials, facts)
    except DeviceError as error:
        trials.checks.append(yes(name, False, "refused", limit, str(error)))
    finally:
        rig.close()
    return CommissioningRecord(
        rig_name=rigfile.name,
        rig_digest=rigfile.digest,
        emulated=rigfile.emulated,
        facts=kept_facts(facts),
        covered=covered(settings),
        checks=tuple(trials.checks),
        numbers={name: value for name, value in trials.numbers.items() if math.isfinite(value)},
        software=software,
        made_utc=made_utc,
        signed_by=signed_by,
    )


def _try_all(trials: _Trials, facts: Mapping[str, Any]) -> None:
    rig, settings, time, operator, limits = (
        trials.rig,
        trials.settings,
        trials.time,
        trials.operator,
        trials.limits,
    )
    trials.checks += facts_checks(facts, settings, limits)
    _without_power(trials)
    if not trials.good():
        trials.refrain("a check without power failed; put that right first")
        return
    if not operator.ask(
        "Nobody's arm may be in the rig; a spring, or a weight like a relaxed arm's, is fastened "
        f"to the joint. The drive will get power and move it by up to {limits.swing_deg:g} deg at "
        f"{limits.swing_speed_deg_s:g} deg/s. The emergency stop is at hand. Go on?"
    ):
        trials.refrain("the operator did not agree to it")
        return
    if not _moving(trials):
        trials.refrain("the motions went wrong; put that right first")
        return
    trials.checks.append(known_torque(rig, settings, time, operator, limits))
    operator.say("Watchdog: nothing is written for a while; the drive must stop by itself.")
    watchdog_s = facts["drive"]["watchdog_s"]
    trials.checks += watchdog_checks(rig, settings, time, limits, watchdog_s, operator.ask)
    trials.checks += emergency_stop_checks(rig, settings, time, limits, operator)


def _without_power(trials: _Trials) -> None:
    rig, settings, time, operator, limits = (
        trials.rig,
        trials.settings,
        trials.time,
        trials.operator,
        trials.limits,
    )
    rate_hz = settings.rig.tick_rate_hz
    operator.say(f"At rest, without power: {limits.idle_s:g} s. Nobody touches the joint.")
    freshen(rig, time, rate_hz)
    listen(rig, time, rate_hz, SETTLE_S)  # a drive that was never asked has nothing to say yet
    before = dict(rig.counts)
    heard = listen(rig, time, rate_hz, limits.idle_s)
    trials.checks += rate_checks(
        "torque", heard.torque_time_s, settings.rig.torque.rate_hz, settings, limits
    )
    trials.checks.append(lost_check(before, rig.counts, limits))
    trials.checks += noise_checks(heard, settings)
    trials.checks.append(lateness(heard, settings))
    torque = heard.torque_nm[np.isfinite(heard.torque_nm)]
    trials.numbers["torque_bias_nm"] = float(np.mean(torque)) if len(torque) else 0.0
    trials.checks.append(
        told(
            operator,
            "mechanical stops",
            "Without power: lead the joint to both ends by hand, and back. Do mechanical stops end "
            "its way on both sides, where a person's arm still bears it?",
            "fit them; the position limit of the software believes the encoder and is none",
        )
    )
    trials.checks.append(known_angle(rig, settings, time, operator, limits))


def _moving(trials: _Trials) -> bool:
    """Nudge, swing and step; return whether all of it went as told."""
    settings, operator, limits = trials.settings, trials.operator, trials.limits
    operator.say(f"A nudge of {limits.nudge_deg:g} deg.")
    at_rest = trial(trials.rig, settings, trials.time, [hold(SETTLE_S)])
    trials.checks += rate_checks(
        "motion", at_rest.heard.motion_time_s, settings.rig.motion.rate_hz, settings, limits
    )
    trials.checks.append(drift_check(at_rest.heard, 0.5 * limits.nudge_deg))
    if at_rest.cause is not Cause.NONE:
        words = at_rest.cause.sentence
        trials.checks.append(
            yes("motions were completed", False, words, "yes", "remove the reason")
        )
    if not trials.good():
        return False
    nudge = swing(settings, limits.nudge_deg, 0.2 * limits.swing_speed_deg_s, 1)
    check = nudge_check(trials.move(nudge, pause_after=False), settings)
    if not check.passed:
        trials.checks.append(check)
        return False
    return _swing(trials) and _step(trials)


def _swing(trials: _Trials) -> bool:
    settings, operator, limits = trials.settings, trials.operator, trials.limits
    operator.say(f"Slowly by {limits.swing_deg:g} deg to both sides.")
    swung = trials.move(swing(settings, limits.swing_deg, limits.swing_speed_deg_s, limits.swings))
    checks, followed = swing_checks(swung, settings, limits)
    sign, work_j = torque_sign(swung.heard, settings.rig.drive_damping_ratio, followed.scale)
    trials.checks += [*checks, sign]
    trials.numbers.update(
        angle_per_command=followed.scale, slow_delay_s=followed.delay_s, work_j=work_j
    )
    if not trials.good(ANGLE_PER_COMMAND, "motions were completed", sign.name):
        return False
    seen = told(
        operator,
        "the joint moved as said",
        f"Did the joint move first toward positive angles, by about {limits.swing_deg:g} deg, then "
        "as far to the other side, and back?",
        "turn sign, or put right the counts per turn, in the rig file",
    )
    trials.checks.append(seen)
    return seen.outcome != "failed"


def _step(trials: _Trials) -> bool:
    settings = trials.settings
    trials.operator.say("Small quick steps.")
    stepped = trials.move(steps(settings, trials.limits))
    checks, drive, arm = step_checks(stepped, settings)
    delay_s = arm.delay_s if checks[-1].passed else None
    margins, numbers = margin_checks(settings, drive.bandwidth_hz, delay_s)
    trials.checks += [*checks, *margins]
    trials.numbers.update(
        numbers,
        bandwidth_hz=drive.bandwidth_hz,
        motion_delay_s=drive.delay_s,
        torque_delay_s=arm.delay_s,
        torque_after_motion_s=arm.delay_s - drive.delay_s,
        arm_explains=arm.explained,
    )
    return stepped.cause is Cause.NONE
