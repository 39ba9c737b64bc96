"""The daily check: sign, gain and delay of the torque, and the drive's motion, in about 20 s.

    read back, without power     facts, rates, losses, noise and bias, lateness
    rest with power              uncommanded motion
    a small move, a slow swing   sign and scale of the encoder against the command
    a quick motion               the torque that the inertia beyond the sensor needs

Nobody's arm is in the rig. The drive has power only while a trial runs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from rigidimeter.rig.commissioning.checks import yes
from rigidimeter.rig.commissioning.commissioning_record import CommissioningRecord
from rigidimeter.rig.commissioning.daily_record import DailyRecord, ReferenceInertia, objection
from rigidimeter.rig.commissioning.drive_side_checks import daily_drive_check
from rigidimeter.rig.commissioning.first_steps import (
    CheckResults,
    at_rest,
    move,
    power_allowed,
    small_move,
)
from rigidimeter.rig.commissioning.inertia_fit import TorqueAnswer, quick_motion, torque_answer
from rigidimeter.rig.commissioning.motion_tests import COMPLETED, swing, swing_checks
from rigidimeter.rig.commissioning.program_identity import boot_clock, program_identity
from rigidimeter.rig.commissioning.static_tests import facts_checks
from rigidimeter.rig.commissioning.torque_checks import (
    NO_ANSWER,
    KnownInertia,
    delay_check,
    gain_check,
    precision_check,
    sign_check,
)
from rigidimeter.rig.commissioning.trials import Setup, stopped_for
from rigidimeter.rig.devices import RigFile
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause

DELAY_NUMBER = "torque_after_motion_s"
"""The delay in the numbers of a commissioning record."""

SPREAD = 0.8
NEW, FIRST = "given by --new-reference", "first check since the rig was commissioned"


@dataclass(frozen=True)
class Compared:
    """To what a check compares the inertia.

    Parameters
    ----------
    known_inertia_kg_m2 : float, optional
        Of everything beyond the sensor; compared in place of the reference, which stays.
    reference : ReferenceInertia, optional
        Of the check before.
    new : bool
        Whether today's inertia is to be the reference from now on.
    """

    known_inertia_kg_m2: float | None = None
    reference: ReferenceInertia | None = None
    new: bool = False

    def known(self, commissioning_digest: str) -> KnownInertia | None:
        """Return what the inertia must be; None where nothing is known yet."""
        if self.known_inertia_kg_m2 is not None:
            return KnownInertia(self.known_inertia_kg_m2, 0.0, "as given")
        reference = self.valid_reference(commissioning_digest)
        if reference is None or self.new:
            return None
        source = f"as on {reference.made_utc[:10]}"
        return KnownInertia(reference.inertia_kg_m2, reference.inertia_se_kg_m2, source)

    def valid_reference(self, commissioning_digest: str) -> ReferenceInertia | None:
        """Return the reference if it is of this commissioning."""
        reference = self.reference
        if reference is None or reference.commissioning_digest != commissioning_digest:
            return None
        return reference

    def after(
        self, answer: TorqueAnswer, commissioning_digest: str, made_utc: str
    ) -> ReferenceInertia | None:
        """Return the reference after a check that passed."""
        reference = self.valid_reference(commissioning_digest)
        if not self.new and (reference is not None or self.known_inertia_kg_m2 is not None):
            return reference
        return ReferenceInertia(
            inertia_kg_m2=answer.inertia_kg_m2,
            inertia_se_kg_m2=answer.inertia_se_kg_m2,
            made_utc=made_utc,
            commissioning_digest=commissioning_digest,
            reason=NEW if self.new else FIRST,
            before_kg_m2=self.reference.inertia_kg_m2 if self.reference is not None else None,
        )


def daily_check(
    setup: Setup,
    rigfile: RigFile,
    approve: Callable[[Mapping[str, Any]], CommissioningRecord],
    *,
    compared: Compared,
    made_utc: str,
    software: str,
) -> DailyRecord:
    """Check a rig with nobody in it; what is found is returned, never raised.

    The rig is connected, checked and closed, whatever happens.

    Parameters
    ----------
    setup : Setup
    rigfile : RigFile
        Which the rig was built from.
    approve : callable
        Takes the facts of the devices and gives the commissioning record that holds for them, or
        refuses with a `UserError`, which passes through.
    compared : Compared
    made_utc, software : str
        For the record.
    """
    rig, found = setup.rig, CheckResults()
    commissioned: CommissioningRecord | None = None
    answer: TorqueAnswer | None = None
    name = "devices read back"
    try:
        rig.connect()
        facts = rig.configure()
        commissioned = approve(facts)
        name = "devices answer"
        found.checks += facts_checks(facts, setup.settings)
        answer = _try(setup, found, commissioned, compared)
    except DeviceError as error:
        found.checks.append(yes(name, False, "refused", "as commissioned", str(error)))
    finally:
        rig.close()
    digest = commissioned.digest if commissioned is not None else ""
    checks = tuple(found.checks)
    passed = answer is not None and not objection(checks)
    reference = compared.reference
    if answer is not None and passed:
        reference = compared.after(answer, digest, made_utc)
    boot_id, boot_s = boot_clock()
    return DailyRecord(
        rig_name=rigfile.name,
        rig_digest=rigfile.digest,
        commissioning_digest=digest,
        checks=checks,
        numbers=found.finite_numbers,
        reference=reference,
        known_inertia_kg_m2=compared.known_inertia_kg_m2,
        validity_h=setup.limits.daily_validity_h,
        software=software,
        made_utc=made_utc,
        identity=program_identity(rigfile),
        boot_id=boot_id,
        boot_s=boot_s,
    )


def _try(
    setup: Setup, found: CheckResults, commissioned: CommissioningRecord, compared: Compared
) -> TorqueAnswer | None:
    """Try rest, a small move and the quick motion; return what the torque answered."""
    settings, limits = setup.settings, setup.limits
    at_rest(setup, found, limits.daily_rest_s)
    if not power_allowed(
        setup,
        found,
        "cuff and handle are mounted as for a session. The drive will get power and move them by a "
        f"few degrees, at up to {limits.daily_speed_deg_s:g} deg/s. The emergency stop is at hand. "
        "Go on?",
    ):
        return None
    if not small_move(setup, found, limits.daily_rest_s):
        found.refrain("the small move went wrong; put that right first")
        return None
    setup.operator.say(f"Slowly by {limits.swing_deg:g} deg to both sides, then small and quick.")
    slow = swing(settings, limits.swing_deg, limits.swing_speed_deg_s, 1)
    swung = move(setup, slow)
    followed, following = swing_checks(swung, settings)
    if swung.cause in NO_ANSWER:
        found.checks.append(sign_check(torque_answer(swung.readings, setup.rate_hz), swung.cause))
    found.checks += followed
    found.numbers["angle_per_command"] = following.scale
    if not found.none_failed():
        found.refrain("the slow motion went wrong; put that right first")
        return None
    quick = quick_motion(setup.rate_hz, limits.daily_motion_s, limits.daily_speed_deg_s)
    result = move(setup, quick, SPREAD)
    if result.cause is not Cause.NONE and result.cause not in NO_ANSWER:
        words = stopped_for(result.cause)
        found.checks.append(yes(COMPLETED, False, words, "yes", "remove the reason and try again"))
        return None
    answer = torque_answer(result.readings, setup.rate_hz)
    found.numbers.update(
        inertia_kg_m2=answer.inertia_kg_m2,
        inertia_se_kg_m2=answer.inertia_se_kg_m2,
        damping_nm_s_rad=answer.damping_nm_s_rad,
        stiffness_nm_rad=answer.stiffness_nm_rad,
        torque_after_motion_s=answer.delay_s,
        explained=answer.explained,
    )
    found.checks.append(sign_check(answer, result.cause))
    if not found.checks[-1].passed:
        return answer
    found.checks.append(precision_check(answer))
    moves = [swung.readings, result.readings]
    daily_drive_check(setup, found, commissioned.numbers, moves)
    known = compared.known(commissioned.digest)
    if known is not None:
        found.checks.append(gain_check(answer, known, settings))
    found.checks.append(delay_check(answer, commissioned.numbers.get(DELAY_NUMBER), settings))
    return answer
