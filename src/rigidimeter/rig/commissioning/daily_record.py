"""The record of a daily check: what was measured today, against what, and whether `run` may go on.

`RIG.checked.json` lies beside `RIG.toml` and the commissioning record, sealed like it. It belongs
to one content of the rig file and to one commissioning record, and holds for some hours.
"""

from __future__ import annotations

import cmath
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import RigSettings, Settings, changed_settings
from rigidimeter.model import DriveModel
from rigidimeter.rig.commissioning.checks import RigCheck
from rigidimeter.rig.commissioning.commissioning_record import CommissioningRecord
from rigidimeter.rig.commissioning.program_identity import boot_clock, program_identity
from rigidimeter.rig.commissioning.repeated_checks import differences
from rigidimeter.rig.commissioning.sealed_record import (
    AHEAD,
    RecordKind,
    read_sealed,
    write_sealed,
)
from rigidimeter.rig.commissioning.torque_checks import DELAY, PRECISION, SIGN
from rigidimeter.rig.devices import RigFile
from rigidimeter.rig.guard import answer_limits

KIND = RecordKind(
    "rigidimeter.check/1", "daily check", "rigidimeter check RIG.toml", "check the rig again"
)
FLOOR_SHARE = 0.5
"""Of what the reference inertia shows, below which a sensor in a session is not believed."""

DAILY_MUST_PASS = ("motion when enabled", "angle per command", SIGN, PRECISION, DELAY)
"""Checks without which a rig is not run; beside them, none may have failed."""


@dataclass(frozen=True)
class ReferenceInertia:
    """The inertia beyond the torque sensor, with nobody in the rig, to which later days compare.

    Parameters
    ----------
    inertia_kg_m2, inertia_se_kg_m2 : float
        With its standard error.
    made_utc : str
        ISO 8601.
    commissioning_digest : str
        The commissioning record that it belongs to.
    reason : str
        Why it was kept then.
    before_kg_m2 : float or None
        The reference that it replaced.
    """

    inertia_kg_m2: float
    inertia_se_kg_m2: float
    made_utc: str
    commissioning_digest: str
    reason: str
    before_kg_m2: float | None = None


@dataclass(frozen=True)
class DailyRecord:
    """What a daily check found.

    Parameters
    ----------
    rig_name, rig_digest : str
        Of the rig file.
    commissioning_digest : str
        Of the commissioning record that held.
    checks : tuple of RigCheck
    numbers : mapping
        What was measured.
    reference : Reference or None
        Kept today or before.
    known_inertia_kg_m2 : float or None
        The true value that was told.
    validity_h : float
        For how many hours it holds.
    software : str
        Version of rigidimeter.
    made_utc : str
        ISO 8601.
    identity : mapping
        Program, computer and kernel, as `program_identity` returned them.
    boot_id : str
        Of the start of the computer; empty where it has no such name.
    boot_s : float
        Seconds from it to the check, on a clock that nobody can set.
    """

    rig_name: str
    rig_digest: str
    commissioning_digest: str
    checks: tuple[RigCheck, ...]
    numbers: Mapping[str, float]
    reference: ReferenceInertia | None
    known_inertia_kg_m2: float | None
    validity_h: float
    software: str
    made_utc: str
    identity: Mapping[str, str] = field(default_factory=dict)
    boot_id: str = ""
    boot_s: float = 0.0
    schema: str = field(default=KIND.schema)

    @property
    def objection(self) -> str:
        """The first reason not to run this rig, in a clause; empty if there is none."""
        return objection(self.checks)

    @property
    def passed(self) -> bool:
        """Whether the rig may be run today."""
        return not self.objection

    @property
    def valid_until(self) -> datetime:
        """When it no longer holds."""
        return datetime.fromisoformat(self.made_utc) + timedelta(hours=self.validity_h)


def objection(checks: tuple[RigCheck, ...]) -> str:
    """Return the first reason among checks not to run a rig, in a clause."""
    failed = [check for check in checks if check.outcome == "failed"]
    if failed:
        return f"a check failed: {failed[0].sentence}"
    passed = {check.name for check in checks if check.passed}
    missing = [name for name in DAILY_MUST_PASS if name not in passed]
    if missing:
        undone = [check.remedy for check in checks if check.remedy]
        return f"the check {missing[0]!r} is missing: {undone[-1] if undone else 'not tried'}"
    return ""


def daily_path(rig: Path) -> Path:
    """Return where the daily check of a rig file lies."""
    return rig.with_name(f"{rig.stem}.checked.json")


def write_daily(path: Path, record: DailyRecord) -> None:
    """Write the record with its seal; a failed write leaves the old record."""
    write_sealed(path, {**asdict(record), "passed": record.passed})


def read_daily(path: Path, kind: RecordKind = KIND) -> DailyRecord:
    """Read a record.

    Raises
    ------
    UserError
        If there is none, it is something else, or it was changed since it was written.
    """
    return read_sealed(path, kind, _record)


def _record(values: dict[str, Any]) -> DailyRecord:
    fields = {name: value for name, value in values.items() if name != "passed"}
    fields["checks"] = tuple(RigCheck(**check) for check in values["checks"])
    if values["reference"] is not None:
        fields["reference"] = ReferenceInertia(**values["reference"])
    return DailyRecord(**fields)


def require_daily_check(
    rigfile: RigFile,
    commissioned: CommissioningRecord,
    settings: Settings,
    *,
    settings_path: Path | None = None,
    now_utc: datetime | None = None,
    identity: Mapping[str, str] | None = None,
    boot: tuple[str, float] | None = None,
) -> DailyRecord:
    """Return the daily check if it holds for this rig as it was commissioned, now.

    Parameters
    ----------
    rigfile : RigFile
    commissioned : CommissioningRecord
        That holds for the rig.
    settings : Settings
        They say for how many hours a check holds; so does the record, and the shorter counts.
    settings_path : Path, optional
        Their file, for the command in a refusal.
    now_utc : datetime, optional
        The time, where it is not the clock's.
    identity : mapping, optional
        Of program and computer, where it is not that of this moment.
    boot : tuple of (str, float), optional
        As `boot_clock` returns it, where it is not that of this moment.

    Raises
    ------
    UserError
        With what does not hold and the command to type, in one sentence.
    """
    path = daily_path(rigfile.path)
    command = f"rigidimeter check {rigfile.path}"
    if settings_path is not None:
        command += f" --settings {settings_path}"
    again = f"with nobody in the rig, type `{command}`"
    record = read_daily(path, KIND._replace(command=command, again=again))
    if record.rig_digest != rigfile.digest:
        raise UserError(f"{path}: is for another content of {rigfile.path}; {again}")
    if record.commissioning_digest != commissioned.digest:
        raise UserError(f"{path}: was made before the rig was commissioned again; {again}")
    if record.objection:
        raise UserError(f"{path}: {record.objection}; put that right and, {again}")
    hours = min(settings.commissioning.daily_validity_h, record.validity_h)
    age = (now_utc or datetime.now(UTC)) - datetime.fromisoformat(record.made_utc)
    of = f"is of {record.made_utc}"
    if age < -AHEAD:
        raise UserError(
            f"{path}: {of}, which is still to come; set the computer's clock right, or {again}"
        )
    valid = f"a daily check holds for {hours:g} h"
    if age > timedelta(hours=hours):
        raise UserError(f"{path}: {of}, and {valid}; {again}")
    boot_id, boot_s = boot_clock() if boot is None else boot
    passed_h = (boot_s - record.boot_s) / 3600.0
    if boot_id and boot_id == record.boot_id and passed_h > hours:
        raise UserError(
            f"{path}: {of}, and by the time since the computer started {passed_h:.3g} h have "
            f"passed since, so its clock was set back; {valid}; {again}"
        )
    now = program_identity(rigfile) if identity is None else identity
    if record.identity != now:
        raise UserError(f"{path}: {'; '.join(differences(record.identity, now))}; {again}")
    return record


def as_measured(
    settings: Settings, commissioned: CommissioningRecord, today: DailyRecord
) -> Settings:
    """Return the settings with what the guard goes by as it was measured.

    The bandwidth of the drive is that of the commissioning record. `guard.min_inertia_kg_m2` is
    half of what the reference inertia shows at the ticks, where ticks show it: an arm adds inertia
    to what is mounted beyond the sensor and takes none away. A value that the settings give stays,
    and nothing is lowered.

    Raises
    ------
    UserError
        If the settings do not go together with the drive as it was measured.
    """
    reference, guard, stated_hz = today.reference, settings.guard, settings.rig.drive_bandwidth_hz
    drive_hz = commissioned.numbers.get("bandwidth_hz", stated_hz)
    source = f"{commissioned.rig_name}, as measured"
    measured = changed_settings(settings, {"rig": {"drive_bandwidth_hz": drive_hz}}, source)
    shows_inertia = answer_limits(measured).shows_inertia
    if not shows_inertia and stated_hz > drive_hz:  # no more than that can be measured
        measured = settings
    given = "min_inertia_kg_m2" in guard.model_fields_set
    if reference is None or given or not shows_inertia:
        return measured
    floor = max(
        guard.min_inertia_kg_m2, FLOOR_SHARE * _shown(measured.rig) * reference.inertia_kg_m2
    )
    return changed_settings(measured, {"guard": {"min_inertia_kg_m2": floor}})


def _shown(rig: RigSettings) -> float:
    """Return the share of an inertia that torques read at the ticks show.

    Where the command rises by the same at each tick, each step of it adds its own acceleration
    h(t) = 2 Re(r exp(λt)), and the torque of a tick shows the sum of them over all ticks T, 2 T, …
    after a step, in place of the mean acceleration:

        S = T Σ h(n T) = 2 T Re(r exp(λT) / (1 − exp(λT)))

    It is 1 where a step takes many ticks, and 0 where it is over before the next.
    """
    drive = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    (pole,), (residue,) = drive.poles_rad_s, drive.residues
    left = cmath.exp(pole / rig.tick_rate_hz)
    return 2.0 / rig.tick_rate_hz * (residue * left / (1.0 - left)).real
