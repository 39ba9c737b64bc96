"""The commissioning record: what was checked on which rig, for which controller, and how it went.

`RIG.commissioned.json` lies beside `RIG.toml`, sealed. It holds for one content of the
rig file, its devices, the controller, some days (`check_record`). A protocol may ask for less than
the record was made with, never for more: its limits, amplitudes and speeds may be smaller. Where
smaller is not safer, the value must be the same.

A rig of hardware asks for more than an emulated one: what only a person can tell, and a name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import plain_values
from rigidimeter.core.settings import Settings
from rigidimeter.rig.commissioning.checks import RigCheck
from rigidimeter.rig.commissioning.program_identity import program_identity
from rigidimeter.rig.commissioning.repeated_checks import require_repeated
from rigidimeter.rig.commissioning.sealed_record import (
    AHEAD,
    RecordKind,
    digest,
    read_sealed,
    write_sealed,
)
from rigidimeter.rig.devices import BOUND_FACT, RigFile

KIND = RecordKind(
    "rigidimeter.commissioning/1",
    "commissioning record",
    "rigidimeter commission",
    "commission again",
)

MUST_PASS = (
    "devices read back",
    "watchdog configured",
    "loop stalls before the watchdog",
    "braking of the drive",
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
    "delay from command to motion",
    "delay from command to torque",
)
"""Checks without which a rig is not run; beside them, none may have failed."""

A_PERSON_TELLS = (
    "mechanical stops",
    "the joint moved as described",
    "emergency stop",
    "hardware enable drops the power",
    "stays stopped after the release",
)
"""Checks without which nobody is put into a rig of hardware; an emulated one holds no person."""

HAND_HELD = "hand-held stop"
"""The check of a stop that only some rigs have; needed where the rig file names one."""

VOLATILE = {"status", "bias", "cycle_s", "latched_faults_before"}
"""Values that devices report and that change without meaning another calibration."""

LIMITS = ("guard", "loop", "zeroing", "prbs", "sinusoid")
"""Tables whose numbers may be smaller than those a record was made with, never larger."""

EXACT = ("reaction_time_s", "stale_s", "duration_s")
"""Numbers among them that must be the same."""

FLOORS = ("min_inertia_kg_m2",)
"""Numbers among them that may be larger, never smaller."""


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
    checks : tuple of RigCheck
    numbers : mapping
        What was measured besides.
    software : str
        Version of rigidimeter.
    made_utc : str
        ISO 8601.
    signed_by : str
        Who answers for it.
    emulated : bool
        Whether no device of it is one of hardware.
    identity : mapping
        Program, computer and kernel, as `program_identity` returned them.
    """

    rig_name: str
    rig_digest: str
    facts: Mapping[str, Any]
    covered: Mapping[str, Any]
    checks: tuple[RigCheck, ...]
    numbers: Mapping[str, float]
    software: str
    made_utc: str
    signed_by: str = ""
    emulated: bool = False
    identity: Mapping[str, str] = field(default_factory=dict)
    schema: str = field(default=KIND.schema)

    @property
    def digest(self) -> str:
        """Its seal, by which a daily check names the record that it belongs to."""
        return digest(plain_values(_values(self)))

    @property
    def failed(self) -> tuple[RigCheck, ...]:
        """The checks that failed."""
        return tuple(check for check in self.checks if check.outcome == "failed")

    @property
    def missing(self) -> tuple[str, ...]:
        """What must be passed and was not tried, or not even possible."""
        settled = {check.name for check in self.checks if check.outcome in ("passed", "failed")}
        needed = MUST_PASS if self.emulated else (*MUST_PASS, *A_PERSON_TELLS)
        there = {check.name for check in self.checks}
        if HAND_HELD in there and not self.emulated:  # a stop that is fitted and was never pressed
            needed = (*needed, HAND_HELD)
        lacking = [name for name in needed if name not in settled]
        stable = any(name.startswith("stability with") for name in settled)
        return tuple(lacking if stable else [*lacking, "stability"])

    @property
    def not_tried(self) -> tuple[str, ...]:
        """What was not tried or not possible and may be missing; said, not refused."""
        open_ = ("not possible here", "not tried")
        names = (check.name for check in self.checks if check.outcome in open_)
        return tuple(name for name in names if name not in self.missing)

    @property
    def objection(self) -> str:
        """The first reason not to run this rig, in a clause; empty if there is none."""
        if self.failed:
            return f"a check failed: {self.failed[0].sentence}"
        if self.missing:
            name = self.missing[0]
            why = next((check.remedy for check in self.checks if check.name == name), "")
            if not why:
                why = "put right what prevented it, or what failed before it, and commission again"
            return f"the check {name!r} is missing: {why}"
        if not self.emulated and not self.signed_by.strip():
            return "nobody has signed for it: commission again with --signed-by NAME"
        return ""

    @property
    def passed(self) -> bool:
        """Whether the rig may be run: one of hardware with a person in it."""
        return not self.objection


def record_path(rig: Path) -> Path:
    """Return where the record of a rig file lies."""
    return rig.with_name(f"{rig.stem}.commissioned.json")


def write_record(path: Path, record: CommissioningRecord) -> None:
    """Write the record with its digest; a failed write leaves the old record."""
    write_sealed(path, _values(record))


def read_record(path: Path) -> CommissioningRecord:
    """Read a record.

    Raises
    ------
    UserError
        If there is none, it is something else, or it was changed since it was written.
    """
    return read_sealed(path, KIND, _record)


def _values(record: CommissioningRecord) -> dict[str, Any]:
    return {**asdict(record), "passed": record.passed}


def _record(values: dict[str, Any]) -> CommissioningRecord:
    fields = {name: value for name, value in values.items() if name != "passed"}
    fields["checks"] = tuple(RigCheck(**check) for check in values["checks"])
    return CommissioningRecord(**fields)


def stable_facts(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return the facts that must be the same at every run."""
    return {
        role: {
            "model": found["model"],
            "serial": found["serial"],
            "watchdog_s": found["watchdog_s"],
            "values": {
                k: v
                for k, v in found["values"].items()
                if k not in VOLATILE and not k.startswith(BOUND_FACT)
            },
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
    identity: Mapping[str, str] | None = None,
    repeated: bool = True,
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
    identity : mapping, optional
        Of program and computer, where it is not that of this moment.
    repeated : bool
        Whether checks must have been repeated where program or computer is another.

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
        _same_devices(path, record.facts, stable_facts(facts))
    if record.objection:
        raise UserError(f"{path}: {record.objection}")
    days = settings.commissioning.validity_days
    days = min(days, record.covered.get("validity_days", days))
    valid = f"a record holds for {days:g} day{'s' * (days != 1)}"
    today = now_utc or datetime.now(UTC)
    age = today - datetime.fromisoformat(record.made_utc)
    if age < -AHEAD:
        raise UserError(
            f"{path}: is of {record.made_utc[:10]}, which is still to come, and {valid} "
            f"from then; set the computer's clock right, or {again}"
        )
    if age > timedelta(days=days):
        raise UserError(f"{path}: is of {record.made_utc[:10]}, and {valid}; {again}")
    _same_controller(path, record.covered, plain_values(covered(settings)))
    if repeated:
        now = program_identity(rigfile) if identity is None else identity
        require_repeated(rigfile.path, path, record.identity, now, record.digest)
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
            if key not in old:  # the driver did not read it then
                raise UserError(
                    f"{path}: {role} now has {key} = {new[key]!r}, which the record does not "
                    "name; commission the rig again"
                )
            if key not in new or old[key] != new[key]:
                now_has = f"now has {new[key]!r}" if key in new else "no longer names it"
                raise UserError(
                    f"{path}: {role} had {key} = {old[key]!r} and {now_has}; "
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
