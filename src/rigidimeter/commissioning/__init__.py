"""Whether a rig is fit for a person's arm: checks on the devices, and a record of them."""

from rigidimeter.commissioning.checks import Check
from rigidimeter.commissioning.commissioning_record import (
    CommissioningRecord,
    read_record,
    record_path,
    write_record,
)
from rigidimeter.commissioning.coverage import check_record
from rigidimeter.commissioning.daily_check import Compared, daily_check
from rigidimeter.commissioning.daily_record import (
    DailyRecord,
    as_measured,
    daily_path,
    read_daily,
    require_daily_check,
    write_daily,
)
from rigidimeter.commissioning.sequence import commission
from rigidimeter.commissioning.trial import Operator, Setup, Timebase
from rigidimeter.commissioning.wrong_sign import sign_words
from rigidimeter.commissioning.zero_check import ZeroFound, zero_check
