"""What a commissioning record holds for: the rig file, the devices, the controller, some days.

A protocol may ask for less than the record was made with, never for more: its limits, amplitudes
and speeds may be smaller. Where smaller is not safer, the value must be the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import plain_values
from rigidimeter.core.settings import Settings, with_new_names
from rigidimeter.rig.commissioning.commissioning_record import (
    CommissioningRecord,
    read_record,
    record_path,
)
from rigidimeter.rig.devices import RigFile

VOLATILE = {"status", "bias", "cycle_s", "latched_faults_before"}
"""Values that devices report and that change without meaning another calibration."""


LIMITS = ("guard", "loop", "zeroing", "prbs", "sinusoid")
"""Tables whose numbers may be smaller than those a record was made with, never larger."""

EXACT = ("reaction_time_s", "stale_s", "duration_s")
"""Numbers among them that must be the same."""

FLOORS = ("min_inertia_kg_m2",)
"""Numbers among them that may be larger, never smaller."""


def kept_facts(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return the facts that must be the same at every run."""
    return {
        role: {
            "model": found["model"],
            "serial": found["serial"],
            "watchdog_s": found["watchdog_s"],
            "values": {k: v for k, v in found["values"].items() if k not in VOLATILE},
        }
        for role, found in facts.items()
    }


def covered(settings: Settings) -> dict[str, Any]:
    """Return what of the settings a record holds for."""
    return {
        "tick_rate_hz": settings.rig.tick_rate_hz,
        "controller": settings.controller.model_dump(mode="json"),
        "guard": settings.guard.model_dump(mode="json"),
        "loop": settings.loop.model_dump(mode="json"),
        "zeroing": settings.zeroing.model_dump(mode="json"),
        "validity_days": settings.commissioning.validity_days,
        "prbs": {"amplitude_nm": settings.prbs.amplitude_nm},
        "sinusoid": {
            "amplitude_deg": settings.sinusoid.amplitude_deg,
            "frequency_hz": settings.sinusoid.frequency_hz,
        },
        "arms": {
            name: [arm.inertia_kg_m2, arm.damping_nm_s_rad, arm.stiffness_nm_rad]
            for name, arm in settings.subject.items()
        },
    }


def check_record(
    rigfile: RigFile,
    facts: Mapping[str, Any] | None,
    settings: Settings,
    *,
    now_utc: datetime | None = None,
    path: Path | None = None,
) -> CommissioningRecord:
    """Return the record if it holds for this rig, these devices and these settings, today.

    Parameters
    ----------
    rigfile : RigFile
    facts : mapping or None
        What the rig's `configure` returned; None before it is connected, when the devices are not
        compared yet.
    settings : Settings
        Of the protocol that is to run; they also say for how many days a record holds.
    now_utc : datetime, optional
        Today, where that is not the clock's.
    path : Path, optional
        The record, where it does not lie beside the rig file.

    Raises
    ------
    UserError
        With what does not hold, in one sentence.
    """
    path = path or record_path(rigfile.path)
    record = read_record(path)
    again = "commission the rig again"
    if record.rig_digest != rigfile.digest:
        raise UserError(f"{path}: is for another content of {rigfile.path}; {again}")
    if record.emulated and not rigfile.emulated:
        raise UserError(f"{path}: was made without hardware, and this rig has some; {again}")
    if facts is not None:
        _same_devices(path, record.facts, kept_facts(facts))
    if record.objection:
        raise UserError(f"{path}: {record.objection}")
    days = settings.commissioning.validity_days
    days = min(days, record.covered.get("validity_days", days))
    valid = f"a record holds for {days:g} day{'s' * (days != 1)}"
    today = now_utc or datetime.now(UTC)
    age = today - datetime.fromisoformat(record.made_utc)
    if age < timedelta(days=-1):
        raise UserError(
            f"{path}: is of {record.made_utc[:10]}, which is still to come, and {valid} "
            f"from then; set the computer's clock right, or {again}"
        )
    if age > timedelta(days=days):
        raise UserError(f"{path}: is of {record.made_utc[:10]}, and {valid}; {again}")
    before, _ = with_new_names(record.covered, str(path))
    _same_controller(path, before, plain_values(covered(settings)))
    return record


def _same_devices(path: Path, before: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    now = plain_values(now)
    for role in sorted({*before, *now}):
        old, new = before.get(role, {}), now.get(role, {})
        for key in ("model", "serial", "watchdog_s"):
            if old.get(key) != new.get(key):
                raise UserError(
                    f"{path}: {role} had {key} {old.get(key)!r} and now has {new.get(key)!r}; "
                    "commission the rig again"
                )
        old, new = old.get("values", {}), new.get("values", {})
        for key in sorted({*old, *new}):
            if old.get(key) != new.get(key):
                raise UserError(
                    f"{path}: {role} had {key} = {old.get(key)!r} and now has {new.get(key)!r}; "
                    "set it back, or commission the rig again"
                )


def _same_controller(path: Path, before: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    again = "commission again with --settings of this protocol"
    tried_hz, tick_rate_hz = before.get("tick_rate_hz"), now["tick_rate_hz"]
    if tried_hz != tick_rate_hz:
        raise UserError(
            f"{path}: covers rig.tick_rate_hz = {tried_hz} Hz, not {tick_rate_hz} Hz; {again}"
        )
    for table in ("controller", *LIMITS):
        for key, value in now[table].items():
            tried = before.get(table, {}).get(key)
            if value != tried and not (table in LIMITS and _tighter(key, tried, value)):
                raise UserError(f"{path}: covers {table}.{key} = {tried!r}, not {value!r}; {again}")
    arms = list(before.get("arms", {}).values())
    for name, arm in now["arms"].items():
        if arm not in arms:
            raise UserError(f"{path}: does not cover the arm of [subject.{name}]; {again}")


def _tighter(key: str, tried: float | None, value: float) -> bool:
    if tried is None or key in EXACT:
        return False
    return value >= tried if key in FLOORS else value <= tried
