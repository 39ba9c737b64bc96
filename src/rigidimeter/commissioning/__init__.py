"""Whether a rig is fit for a person's arm: checks on the devices, and a record of them."""

from rigidimeter.commissioning.checks import Check, Outcome
from rigidimeter.commissioning.commissioning_record import (
    CommissioningRecord,
    read_record,
    record_path,
    write_record,
)
from rigidimeter.commissioning.coverage import check_record
from rigidimeter.commissioning.sequence import commission
from rigidimeter.commissioning.trial import Operator, Timebase

__all__ = [
    "Check",
    "CommissioningRecord",
    "Operator",
    "Outcome",
    "Timebase",
    "check_record",
    "commission",
    "read_record",
    "record_path",
    "write_record",
]
