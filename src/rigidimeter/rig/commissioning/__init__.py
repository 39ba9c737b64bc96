"""Whether a rig is fit for a person's arm: checks on the devices, and a record of them."""

from rigidimeter.rig.commissioning.checks import Check, above, below, untried
from rigidimeter.rig.commissioning.commissioning_record import (
    A_PERSON_TELLS,
    MUST_PASS,
    CommissioningRecord,
    read_record,
    record_path,
    write_record,
)
from rigidimeter.rig.commissioning.coverage import FLOORS, LIMITS, check_record, covered, kept_facts
from rigidimeter.rig.commissioning.daily_check import FIRST, NEW, Compared, daily_check
from rigidimeter.rig.commissioning.daily_record import (
    DAILY_MUST_PASS,
    DailyRecord,
    Reference,
    as_measured,
    daily_path,
    read_daily,
    require_daily_check,
    write_daily,
)
from rigidimeter.rig.commissioning.inertia_fit import (
    FREQUENCIES_HZ,
    PERIOD_S,
    WEIGHTS,
    TorqueAnswer,
    quick_motion,
    torque_answer,
)
from rigidimeter.rig.commissioning.response import fit_arm, following, velocity_scale
from rigidimeter.rig.commissioning.sealed_record import digest
from rigidimeter.rig.commissioning.sequence import commission
from rigidimeter.rig.commissioning.static_tests import BRAKING, NOISE
from rigidimeter.rig.commissioning.stopping import watchdog_checks
from rigidimeter.rig.commissioning.torque_checks import KnownInertia, delay_check, gain_check
from rigidimeter.rig.commissioning.trial import Operator, Readings, Setup, Timebase, TrialResult
from rigidimeter.rig.commissioning.wrong_sign import hiding_torque_nm, sign_words
from rigidimeter.rig.commissioning.zero_check import ZeroFound, zero_check
