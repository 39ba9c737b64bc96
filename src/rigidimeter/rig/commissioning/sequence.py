"""The order in which a rig is tried: what cannot hurt first, and nothing after what went wrong.

    read back, without power     facts, rates, losses, noise, lateness
    by hand, without power       mechanical stops, a known angle
    a small move                 does it move at all as told
    a swing, and quick steps     directions, scales, delays, bandwidth, margins
    a known torque               by hand
    silence                      watchdog
    emergency stop

Nobody's arm is in the rig meanwhile. The drive has power only while a trial runs, never while a
question waits for its answer.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rigidimeter.rig.commissioning.checks import yes
from rigidimeter.rig.commissioning.commissioning_record import CommissioningRecord
from rigidimeter.rig.commissioning.coverage import covered, kept_facts
from rigidimeter.rig.commissioning.first_steps import (
    SETTLE_S,
    Findings,
    at_rest,
    move,
    power_allowed,
    small_move,
)
from rigidimeter.rig.commissioning.manual_checks import ask_operator, known_angle, known_torque
from rigidimeter.rig.commissioning.margins import margin_checks
from rigidimeter.rig.commissioning.motion_tests import (
    ANGLE_PER_COMMAND,
    COMPLETED,
    step_checks,
    steps,
    swing,
    swing_checks,
    torque_sign,
)
from rigidimeter.rig.commissioning.static_tests import facts_checks
from rigidimeter.rig.commissioning.stopping import emergency_stop_checks, watchdog_checks
from rigidimeter.rig.commissioning.trial import Setup, require_no_power
from rigidimeter.rig.devices import RigFile
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause


def commission(
    setup: Setup,
    rigfile: RigFile,
    *,
    made_utc: str,
    software: str,
    signed_by: str = "",
) -> CommissioningRecord:
    """Try a rig; what is found is returned, never raised.

    The rig is connected, tried and closed, whatever happens.

    Parameters
    ----------
    setup : Setup
        `settings.commissioning` says what is tried.
    rigfile : RigFile
        Which the rig was built from.
    made_utc, software, signed_by : str
        For the record.
    """
    rig, found = setup.rig, Findings()
    facts: Mapping[str, Any] = {}
    name, limit = "devices read back", "what the rig file says"
    try:
        rig.connect()
        facts = rig.configure()
        name, limit = "devices answer", "throughout"
        _try_all(setup, found, facts)
    except DeviceError as error:
        found.checks.append(yes(name, False, "refused", limit, str(error)))
    finally:
        rig.close()
    return CommissioningRecord(
        rig_name=rigfile.name,
        rig_digest=rigfile.digest,
        emulated=rigfile.emulated,
        facts=kept_facts(facts),
        covered=covered(setup.settings),
        checks=tuple(found.checks),
        numbers=found.finite_numbers,
        software=software,
        made_utc=made_utc,
        signed_by=signed_by,
    )


def _try_all(setup: Setup, found: Findings, facts: Mapping[str, Any]) -> None:
    operator, limits = setup.operator, setup.limits
    found.checks += facts_checks(facts, setup.settings)
    at_rest(setup, found, limits.idle_s)
    _by_hand(setup, found)
    if not power_allowed(
        setup,
        found,
        "a spring, or a weight like a relaxed arm's, is fastened to the joint. The drive will get "
        f"power and move it by up to {limits.swing_deg:g} deg at {limits.swing_speed_deg_s:g} "
        "deg/s. The emergency stop is at hand. Go on?",
    ):
        return
    if not (small_move(setup, found, SETTLE_S) and _swing(setup, found) and _steps(setup, found)):
        found.refrain("the motions went wrong; put that right first")
        return
    found.checks.append(known_torque(setup))
    operator.say("Watchdog: nothing is written for a while; the drive must stop by itself.")
    found.checks += watchdog_checks(setup, facts["drive"]["watchdog_s"])
    found.checks += emergency_stop_checks(setup)


def _by_hand(setup: Setup, found: Findings) -> None:
    """Ask for the mechanical stops and a known angle, without power."""
    require_no_power(setup)
    found.checks.append(
        ask_operator(
            setup.operator,
            "mechanical stops",
            "Without power: lead the joint to both ends by hand, and back. Do mechanical stops end "
            "its way on both sides, where a person's arm still bears it?",
            "fit them; the position limit of the software believes the encoder and is none",
        )
    )
    found.checks.append(known_angle(setup))


def _swing(setup: Setup, found: Findings) -> bool:
    settings, operator, limits = setup.settings, setup.operator, setup.limits
    operator.say(f"Slowly by {limits.swing_deg:g} deg to both sides.")
    velocity = swing(settings, limits.swing_deg, limits.swing_speed_deg_s, limits.swings)
    swung = move(setup, velocity)
    checks, followed = swing_checks(swung, settings)
    sign, work_j = torque_sign(swung.readings, settings.rig.drive_damping_ratio, followed.scale)
    found.checks += [*checks, sign]
    found.numbers.update(
        angle_per_command=followed.scale, slow_delay_s=followed.delay_s, work_j=work_j
    )
    needed = (ANGLE_PER_COMMAND, COMPLETED, sign.name)
    if not all(check.passed for check in found.checks if check.name in needed):
        return False
    seen = ask_operator(
        operator,
        "the joint moved as said",
        f"Did the joint move first toward positive angles, by about {limits.swing_deg:g} deg, then "
        "as far to the other side, and back?",
        "turn sign, or put right the counts per turn, in the rig file",
    )
    found.checks.append(seen)
    return seen.outcome != "failed"


def _steps(setup: Setup, found: Findings) -> bool:
    settings = setup.settings
    setup.operator.say("Small quick steps.")
    stepped = move(setup, steps(settings))
    checks, drive, arm = step_checks(stepped, settings)
    delay_s = arm.delay_s if checks[-1].passed else None
    margins, numbers = margin_checks(settings, drive.bandwidth_hz, delay_s)
    found.checks += [*checks, *margins]
    found.numbers.update(
        numbers,
        bandwidth_hz=drive.bandwidth_hz,
        motion_delay_s=drive.delay_s,
        torque_delay_s=arm.delay_s,
        torque_after_motion_s=arm.delay_s - drive.delay_s,
        arm_explains=arm.explained,
    )
    return stepped.cause is Cause.NONE
