"""The commissioning record: what was checked on which rig, for which controller, and how it went.

`RIG.commissioned.json` lies beside `RIG.toml`. It holds for the rig file, the devices and the
controller it was made with, for a number of days. Its digest is a seal against accidents, a file
that was edited or cut short; it is no signature and keeps nobody from forging one.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from rigidimeter.commissioning.checks import Check
from rigidimeter.device.rigfile import RigFile
from rigidimeter.errors import UserError
from rigidimeter.settings import Settings
from rigidimeter.settings.commissioning import CommissioningSettings

__all__ = [
    "MUST_PASS",
    "SCHEMA",
    "CommissioningRecord",
    "check_record",
    "covered",
    "kept_facts",
    "read_record",
    "record_path",
    "write_record",
]

SCHEMA = "rigidimeter.commissioning/1"

MUST_PASS = (
    "devices read back",
    "watchdog configured",
    "watchdog",
    "faults at rest",
    "torque samples",
    "motion samples",
    "torque noise (SD)",
    "lateness of the loop (p99.9)",
    "motion when enabled",
    "angle per command",
    "velocity per change of angle",
    "torque against motion",
    "the joint moved as said",
    "delay from command to motion",
    "delay from command to torque",
)
"""Checks without which nobody is put into the rig; beside them, none may have failed."""

VOLATILE = {"status", "bias", "cycle_s", "latched_faults_before"}
"""Values that devices report and that change without meaning another calibration."""


@dataclass(frozen=True)
class CommissioningRecord:
    """What `commission` found.

    Parameters
    ----------
    rig_name, rig_digest : str
        Of the rig file.
    facts : mapping
        Model, serial, watchdog and calibration by role.
    covered : mapping
        The controller, guard, tick rate and arms that the margins were found for.
    checks : tuple of Check
    numbers : mapping
        What was measured besides.
    software : str
        Version of rigidimeter.
    made_utc : str
        ISO 8601.
    signed_by : str
        Who answers for it.
    """

    rig_name: str
    rig_digest: str
    facts: Mapping[str, Any]
    covered: Mapping[str, Any]
    checks: tuple[Check, ...]
    numbers: Mapping[str, float]
    software: str
    made_utc: str
    signed_by: str = ""
    schema: str = field(default=SCHEMA)

    @property
    def failed(self) -> tuple[Check, ...]:
        """The checks that failed."""
        return tuple(check for check in self.checks if check.outcome == "failed")

    @property
    def missing(self) -> tuple[str, ...]:
        """What must be passed and was not even possible."""
        passed = {check.name for check in self.checks if check.passed}
        failed = {check.name for check in self.failed}
        stable = any(name.startswith("stability with") for name in passed | failed)
        lacking = [name for name in MUST_PASS if name not in passed | failed]
        return tuple(lacking if stable else [*lacking, "stability"])

    @property
    def not_tried(self) -> tuple[str, ...]:
        """What was not possible and may be missing; said, not refused."""
        return tuple(
            check.name
            for check in self.checks
            if check.outcome == "not possible here" and check.name not in self.missing
        )

    @property
    def passed(self) -> bool:
        """Whether a person may be put into the rig as far as the checks go."""
        return not self.failed and not self.missing


LIMITS = ("guard", "loop", "zeroing", "prbs", "sinusoid")
"""Tables whose numbers may be smaller than those a record was made with, never larger."""

EXACT = ("reaction_time_s", "stale_s", "duration_s")
"""Numbers among them that must be the same."""


def record_path(rig: Path) -> Path:
    """Return where the record of a rig file lies."""
    return rig.with_name(f"{rig.stem}.commissioned.json")


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


def write_record(path: Path, record: CommissioningRecord) -> None:
    """Write the record with its digest, whole or not at all."""
    values = _plain({**asdict(record), "passed": record.passed})
    values["digest"] = _digest(values)
    part = path.with_name(path.name + ".part")
    part.write_text(json.dumps(values, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    os.replace(part, path)


def read_record(path: Path) -> CommissioningRecord:
    """Read a record.

    Raises
    ------
    UserError
        If there is none, it is something else, or it was changed since it was written.
    """
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UserError(
            f"{path}: there is no such record; make it with `rigidimeter commission`"
        ) from None
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: cannot be read as a commissioning record ({error})") from None
    if not isinstance(values, dict) or values.get("schema") != SCHEMA:
        raise UserError(f"{path}: is no commissioning record of the schema {SCHEMA}")
    if values.pop("digest", None) != _digest(values):
        raise UserError(
            f"{path}: was changed since it was written, for its digest is another; commission again"
        )
    values.pop("passed")
    values["checks"] = tuple(Check(**check) for check in values["checks"])
    return CommissioningRecord(**values)


def check_record(
    rigfile: RigFile,
    facts: Mapping[str, Any],
    settings: Settings,
    limits: CommissioningSettings | None = None,
    *,
    now_utc: datetime | None = None,
    path: Path | None = None,
) -> CommissioningRecord:
    """Return the record if it holds for this rig, these devices and these settings, today.

    Parameters
    ----------
    rigfile : RigFile
    facts : mapping
        What the rig's `configure` returned.
    settings : Settings
        Of the protocol that is to run.
    limits : CommissioningSettings, optional
        Says for how many days a record holds.
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
    _same_devices(path, record.facts, kept_facts(facts))
    if record.failed:
        raise UserError(f"{path}: a check failed: {record.failed[0].sentence}")
    if record.missing:
        raise UserError(
            f"{path}: the check {record.missing[0]!r} was not possible; put right what prevented "
            f"it and {again}"
        )
    days = (limits or CommissioningSettings()).validity_days
    days = min(days, record.covered.get("validity_days", days))
    today = now_utc or datetime.now(UTC)
    age = today - datetime.fromisoformat(record.made_utc)
    if not timedelta(days=-1) <= age <= timedelta(days=days):
        raise UserError(
            f"{path}: is of {record.made_utc[:10]}, and a record holds for {days:g} days; {again}"
        )
    _same_controller(path, record.covered, _plain(covered(settings)))
    return record


def _same_devices(path: Path, before: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    now = _plain(now)
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
    if before["tick_rate_hz"] != now["tick_rate_hz"]:
        raise UserError(
            f"{path}: covers rig.tick_rate_hz = {before['tick_rate_hz']:g} Hz, not "
            f"{now['tick_rate_hz']:g} Hz; {again}"
        )
    for table in ("controller", *LIMITS):
        for key, value in now[table].items():
            tried = before.get(table, {}).get(key)
            tighter = table in LIMITS and key not in EXACT and tried is not None and value <= tried
            if value != tried and not tighter:
                raise UserError(f"{path}: covers {table}.{key} = {tried!r}, not {value!r}; {again}")
    arms = list(before["arms"].values())
    for name, arm in now["arms"].items():
        if arm not in arms:
            raise UserError(f"{path}: does not cover the arm of [subject.{name}]; {again}")


def _digest(values: Mapping[str, Any]) -> str:
    text = json.dumps(values, sort_keys=True, ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: Any) -> Any:
    """Return what JSON keeps of a value: a number that is not finite becomes null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
