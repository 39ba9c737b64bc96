"""Checks on an epoch and its fit, each a pure function from numbers to what it saw."""

from rigidimeter.analysis.estimation.diagnostics.check_record import (
    HARMFUL,
    Case,
    Check,
    at_most,
    reconstructed_torque_nm,
)
from rigidimeter.analysis.estimation.diagnostics.diagnose import CHECKS, checked, diagnose
from rigidimeter.analysis.estimation.diagnostics.together import checked_together

__all__ = [
    "CHECKS",
    "HARMFUL",
    "Case",
    "Check",
    "at_most",
    "checked",
    "checked_together",
    "diagnose",
    "reconstructed_torque_nm",
]
