"""Whether a rig is fit for a person's arm: checks on the devices, and a record of them."""

from rigidimeter.rig.commissioning.bound_trials import bound_checks
from rigidimeter.rig.commissioning.checks import RigCheck, above, below, untried
from rigidimeter.rig.commissioning.commissioning_record import (
    A_PERSON_TELLS,
    FLOORS,
    LIMITS,
    MUST_PASS,
    CommissioningRecord,
    check_record,
    covered,
    read_record,
    record_path,
    stable_facts,
    write_record,
)
from rigidimeter.rig.commissioning.daily_record import (
    DAILY_MUST_PASS,
    DailyRecord,
    ReferenceInertia,
    as_measured,
    daily_path,
    read_daily,
    require_daily_check,
    write_daily,
)
from rigidimeter.rig.commissioning.daily_sequence import FIRST, NEW, Compared, daily_check
from rigidimeter.rig.commissioning.drive_side_checks import (
    WITNESS,
    drive_side_of,
    unseen_nm,
    witness_check,
)
from rigidimeter.rig.commissioning.drive_side_fit import as_numbers, model_in, model_of_today
from rigidimeter.rig.commissioning.first_steps import ZeroFound, zero_check
from rigidimeter.rig.commissioning.inertia_fit import (
    FREQUENCIES_HZ,
    PERIOD_S,
    WEIGHTS,
    TorqueAnswer,
    quick_motion,
    torque_answer,
)
from rigidimeter.rig.commissioning.live_readings import HEADING, LiveReading, live_readings
from rigidimeter.rig.commissioning.manual_checks import PUT_ON, lead_range
from rigidimeter.rig.commissioning.program_identity import (
    boot_clock,
    program_identity,
    sources_digest,
)
from rigidimeter.rig.commissioning.repeated_checks import (
    EVERY_PART,
    IDENTITY,
    RepeatedChecks,
    differences,
    parts_to_repeat,
    read_repeated,
    repeated_path,
    write_repeated,
)
from rigidimeter.rig.commissioning.response import fit_arm, following, velocity_per_angle
from rigidimeter.rig.commissioning.sealed_record import digest
from rigidimeter.rig.commissioning.sequence import commission_rig, repeat_checks
from rigidimeter.rig.commissioning.static_tests import BRAKING, NOISE
from rigidimeter.rig.commissioning.stopping import watchdog_checks
from rigidimeter.rig.commissioning.torque_checks import KnownInertia, delay_check, gain_check
from rigidimeter.rig.commissioning.trials import Operator, Readings, Setup, Timebase, TrialResult
from rigidimeter.rig.commissioning.wrong_sign import hiding_torque_nm, sign_words
