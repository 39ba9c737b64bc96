"""The steps before a session as the console shows them, from the rig file and its records.

They are found by the functions with which `run` refuses, so the words are the same.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings
from rigidimeter.rig.commissioning import (
    CommissioningRecord,
    DailyRecord,
    check_record,
    daily_path,
    read_daily,
    read_record,
    record_path,
    require_daily_check,
)
from rigidimeter.rig.console.page import RigStep
from rigidimeter.rig.devices import load_rig

COMMISSIONED, CHECKED, ZEROED = (
    "Commissioning record",
    "Check of the day",
    "Zero and noise of the torque sensor",
)
BY_ITSELF = "every session repeats this check and will not start if it fails"


def rig_steps(
    rig: Path | None,
    settings: Settings,
    source: Path | None = None,
    *,
    now_utc: datetime | None = None,
) -> tuple[RigStep, ...]:
    """Return the steps for a session of these settings; `source` is their file.

    Examples
    --------
    >>> from rigidimeter.core.settings import Settings
    >>> [step.state for step in rig_steps(None, Settings())]
    ['not needed', 'not needed', 'optional']
    """
    zero = RigStep(ZEROED, "optional", BY_ITSELF, action="zero", required=False)
    if rig is None:
        nobody = "not required on the virtual rig"
        return (
            RigStep(COMMISSIONED, "not needed", nobody),
            RigStep(CHECKED, "not needed", f"{nobody}; practise it here", action="check"),
            zero,
        )
    return (*_records(rig, settings, source, now_utc), zero)


def _records(
    rig: Path, settings: Settings, source: Path | None, now_utc: datetime | None
) -> tuple[RigStep, ...]:
    try:
        rigfile = load_rig(rig)
    except UserError as error:
        return (RigStep("Rig file", "not done", rig.name, str(error)),)
    said = _of(lambda: _commissioned(read_record(record_path(rig))))
    try:
        record = check_record(rigfile, None, settings, now_utc=now_utc)
    except UserError as error:
        return (
            RigStep(COMMISSIONED, "not done", said, str(error)),
            RigStep(CHECKED, "not done", "", "commission the rig first"),
        )
    first = RigStep(COMMISSIONED, "done", said)
    checked = _of(lambda: _checked(read_daily(daily_path(rig))))
    try:
        require_daily_check(rigfile, record, settings, settings_path=source, now_utc=now_utc)
    except UserError as error:
        return first, RigStep(CHECKED, "not done", checked, str(error), "check")
    return first, RigStep(CHECKED, "done", checked, action="check")


def _of(said: Callable[[], str]) -> str:
    """Return what is said of a record that can be read."""
    try:
        return said()
    except UserError:
        return ""


def _commissioned(record: CommissioningRecord) -> str:
    """Say when, with whom and with which margins the rig was commissioned."""
    if record.emulated:
        who = "an emulated rig, with nobody in it"
    elif set(record.missing):
        who = "without a person"
    else:
        who = f"with a person, signed by {record.signed_by.strip() or 'nobody'}"
    margins = [
        f"{what} {least:.3g} {unit}"
        for what, key, unit in (
            ("smallest gain margin", "gain_margin_db_", "dB"),
            ("phase margin", "phase_margin_deg_", "deg"),
        )
        if (least := _least(record, key)) is not None
    ]
    return "; ".join([f"{_local(record.made_utc)}, {who}", ", ".join(margins)]).rstrip("; ")


def _least(record: CommissioningRecord, key: str) -> float | None:
    found = [value for name, value in record.numbers.items() if name.startswith(key)]
    return min(found, default=None)


def _checked(record: DailyRecord) -> str:
    """Say when the rig was checked, until when that holds, and what it measured."""
    parts = [f"{_local(record.made_utc)}, holds until {_local(record.valid_until.isoformat())}"]
    inertia = record.numbers.get("inertia_kg_m2")
    if inertia is not None:
        parts.append(f"inertia beyond the sensor {inertia:.3g} kg·m²")
    return "; ".join(parts)


def _local(utc: str) -> str:
    """Return a time as the clock on the wall shows it."""
    return f"{datetime.fromisoformat(utc).astimezone():%Y-%m-%d %H:%M}"
