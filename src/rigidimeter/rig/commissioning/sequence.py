"""The order in which a rig is tried: what cannot hurt first, and nothing after what went wrong.

    read back, without power     facts, rates, losses, noise, lateness
    by hand, without power       mechanical stops, a known angle
    a small move                 does it move at all as told
    a swing, and quick steps     directions, scales, delays, bandwidth, margins
    a known torque               by hand; then wide moves for the drive's own torque
    bounds in the drive          each tightened, in a slow move
    silence                      watchdog
    emergency stop

Nobody's arm is in the rig meanwhile. The drive has power only while a trial runs, never while a
question waits for its answer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rigidimeter.core.settings import Settings
from rigidimeter.model import Margins, loop_stability, near_instability
from rigidimeter.rig.commissioning.bound_trials import bound_checks
from rigidimeter.rig.commissioning.checks import RigCheck, impossible, with_unit, yes
from rigidimeter.rig.commissioning.commissioning_record import (
    CommissioningRecord,
    covered,
    stable_facts,
)
from rigidimeter.rig.commissioning.drive_side_checks import drive_side_checks
from rigidimeter.rig.commissioning.first_steps import (
    SETTLE_S,
    CheckResults,
    at_rest,
    move,
    power_allowed,
    small_move,
)
from rigidimeter.rig.commissioning.manual_checks import (
    ask_operator,
    known_angle,
    known_torque,
    mechanical_stops,
)
from rigidimeter.rig.commissioning.motion_tests import (
    ANGLE_PER_COMMAND,
    COMPLETED,
    step_checks,
    steps,
    swing,
    swing_checks,
    torque_sign,
)
from rigidimeter.rig.commissioning.program_identity import program_identity
from rigidimeter.rig.commissioning.repeated_checks import (
    BOUNDS,
    EVERY_PART,
    STEPS,
    STOP,
    SWING,
    WATCHDOG,
    RepeatedChecks,
    differences,
    parts_to_repeat,
)
from rigidimeter.rig.commissioning.static_tests import facts_checks
from rigidimeter.rig.commissioning.stopping import (
    emergency_stop_checks,
    hand_held_checks,
    watchdog_checks,
)
from rigidimeter.rig.commissioning.trials import Setup, require_no_power
from rigidimeter.rig.devices import RigFile
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause

KNOWN_TORQUE = "known torque"
"""A part that is not repeated: neither program nor computer changes a weight."""


def commission_rig(
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
    rig, found = setup.rig, CheckResults()
    facts: Mapping[str, Any] = {}
    name, limit = "devices read back", "what the rig file says"
    try:
        rig.connect()
        facts = rig.configure()
        name, limit = "devices answer", "throughout"
        _try_all(setup, found, facts, emulated=rigfile.emulated)
    except DeviceError as error:
        found.checks.append(yes(name, False, "refused", limit, str(error)))
    finally:
        rig.close()
    return CommissioningRecord(
        rig_name=rigfile.name,
        rig_digest=rigfile.digest,
        emulated=rigfile.emulated,
        facts=stable_facts(facts),
        covered=covered(setup.settings),
        checks=tuple(found.checks),
        numbers=found.finite_numbers,
        software=software,
        made_utc=made_utc,
        signed_by=signed_by,
        identity=program_identity(rigfile),
    )


def repeat_checks(
    setup: Setup,
    rigfile: RigFile,
    commissioned: CommissioningRecord,
    approve: Callable[[Mapping[str, Any]], object],
    *,
    made_utc: str,
    signed_by: str = "",
) -> RepeatedChecks:
    """Try again what another program or computer asks for; what is found is returned.

    The rig is connected, tried and closed, whatever happens.

    Parameters
    ----------
    setup : Setup
    rigfile : RigFile
        Which the rig was built from.
    commissioned : CommissioningRecord
        That holds for it, but for program and computer.
    approve : callable
        Takes the facts of the devices, or refuses them with a `UserError`, which passes through.
    made_utc, signed_by : str
        For the record.
    """
    rig, found, now = setup.rig, CheckResults(), program_identity(rigfile)
    parts = parts_to_repeat(commissioned.identity, now)
    name = "devices read back"
    try:
        rig.connect()
        facts = rig.configure()
        approve(facts)
        name = "devices answer"
        _try_again(setup, found, facts, parts)
    except DeviceError as error:
        found.checks.append(yes(name, False, "refused", "as commissioned", str(error)))
    finally:
        rig.close()
    return RepeatedChecks(
        rig_name=rigfile.name,
        rig_digest=rigfile.digest,
        commissioning_digest=commissioned.digest,
        identity=now,
        differences=differences(commissioned.identity, now),
        parts=parts,
        checks=tuple(found.checks),
        numbers=found.finite_numbers,
        made_utc=made_utc,
        signed_by=signed_by,
        emulated=rigfile.emulated,
    )


def _try_again(
    setup: Setup, found: CheckResults, facts: Mapping[str, Any], parts: Sequence[str]
) -> None:
    limits = setup.limits
    found.checks += facts_checks(facts, setup.settings)
    at_rest(setup, found, limits.idle_s)
    require_no_power(setup)
    if power_allowed(setup, found, _POWER.format(limits=limits)):
        _with_power(setup, found, facts, parts)


_POWER = (
    "a spring, or a weight like a relaxed arm's, is fastened to the joint. The drive will get "
    "power and move it by up to {limits.swing_deg:g} deg at {limits.swing_speed_deg_s:g} deg/s. "
    "The emergency stop is at hand. Go on?"
)


def _try_all(
    setup: Setup, found: CheckResults, facts: Mapping[str, Any], *, emulated: bool
) -> None:
    limits = setup.limits
    found.checks += facts_checks(facts, setup.settings)
    at_rest(setup, found, limits.idle_s)
    # By hand, without power: the mechanical stops and a known angle.
    require_no_power(setup)
    stops, stop_angles = mechanical_stops(setup, emulated=emulated)
    found.checks.append(stops)
    found.numbers.update(stop_angles)
    found.checks.append(known_angle(setup))
    if power_allowed(setup, found, _POWER.format(limits=limits)):
        _with_power(setup, found, facts, (*EVERY_PART, KNOWN_TORQUE))


def _with_power(
    setup: Setup, found: CheckResults, facts: Mapping[str, Any], parts: Sequence[str]
) -> None:
    """Try a small move, then these parts, nothing after what went wrong."""
    moved = small_move(setup, found, SETTLE_S)
    moved = moved and (SWING not in parts or _swing(setup, found))
    moved = moved and (STEPS not in parts or _steps(setup, found))
    if not moved:
        found.refrain("the motions went wrong; put that right first")
        return
    if KNOWN_TORQUE in parts:
        known, loaded = known_torque(setup)
        found.checks.append(known)
        drive_side_checks(setup, found, loaded)
    if BOUNDS in parts:
        found.checks += bound_checks(setup, found.numbers)
    if WATCHDOG in parts:
        setup.operator.say(
            "Watchdog: nothing is written for a while; the drive must stop by itself."
        )
        found.checks += watchdog_checks(setup, facts["drive"]["watchdog_s"])
    if STOP in parts:
        found.checks += emergency_stop_checks(setup)
        found.checks += hand_held_checks(setup, facts)


def _swing(setup: Setup, found: CheckResults) -> bool:
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
        "the joint moved as described",
        f"Did the joint move first toward positive angles, by about {limits.swing_deg:g} deg, then "
        "as far to the other side, and back?",
        "turn sign, or put right the counts per turn, in the rig file",
    )
    found.checks.append(seen)
    return seen.outcome != "failed"


def _steps(setup: Setup, found: CheckResults) -> bool:
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


def on_measured_rig(settings: Settings, bandwidth_hz: float, delay_s: float) -> Settings:
    """Return the settings with the rig as it was measured.

    The delay around the loop is put on the torque, which is then new at every tick: its age
    is in the delay already.
    """
    rig = settings.rig
    torque = rig.torque.model_copy(
        update={
            "rate_hz": rig.tick_rate_hz,
            "latency_s": delay_s,
            "stamp_latency_s": delay_s,
            "jitter_s": 0.0,
        }
    )
    measured = rig.model_copy(update={"drive_bandwidth_hz": bandwidth_hz, "torque": torque})
    return settings.model_copy(update={"rig": measured})


def margin_checks(
    settings: Settings, bandwidth_hz: float, delay_s: float | None
) -> tuple[list[RigCheck], dict[str, float]]:
    """Check the margins with every condition's arm, and stability with those around it."""
    remedy = "raise the controller's inertia or damping, or shorten the delays"
    if delay_s is None or not (math.isfinite(delay_s) and math.isfinite(bandwidth_hz)):
        limit = f"at least {settings.margins.gain_margin_db:g} dB"
        return [impossible("stability", limit, "the delay of the loop could not be measured")], {}
    measured = on_measured_rig(settings, bandwidth_hz, delay_s)
    stability = loop_stability(measured)
    wanted = settings.margins
    limit = f"at least {wanted.gain_margin_db:g} dB and {wanted.phase_margin_deg:g} deg"
    checks, numbers = [], {}
    for name, margins in stability.conditions.items():
        why = near_instability(f"the loop with subject {name}", margins, measured)
        words = _words(margins)
        checks.append(yes(f"stability with {name}", not why, words, limit, remedy))
        numbers[f"gain_margin_db_{name}"] = margins.gain_margin_db
        numbers[f"phase_margin_deg_{name}"] = margins.phase_margin_deg
        numbers[f"delay_margin_s_{name}"] = margins.delay_margin_s
    for name, margins in stability.worst.items():
        words = _words(margins)
        low, high = settings.margins.joint_factor_low, settings.margins.joint_factor_high
        check = f"stability with arms {low:g} to {high:g} times {name}'s"
        checks.append(yes(check, margins.stable, words, "stable", remedy))
    return checks, numbers


def _words(margins: Margins) -> str:
    if not margins.stable:
        return "unstable"
    return (
        f"{margins.gain_margin_db:.3g} dB, {margins.phase_margin_deg:.3g} deg, "
        f"tolerates {with_unit(float(f'{margins.delay_margin_s:.3g}'), 's')} of extra delay"
    )
