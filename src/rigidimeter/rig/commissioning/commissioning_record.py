"""The commissioning record: what was checked on which rig, for which controller, and how it went.

`RIG.commissioned.json` lies beside `RIG.toml`, sealed. What it holds for is said by `coverage`.

A rig of hardware asks for more than an emulated one: what only a person can tell, and a name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from rigidimeter.core.files import plain_values
from rigidimeter.rig.commissioning.checks import Check
from rigidimeter.rig.commissioning.sealed_record import (
    RecordKind,
    digest,
    read_sealed,
    write_sealed,
)

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
    "the joint moved as said",
    "emergency stop",
    "hardware enable drops the power",
    "stays stopped after the release",
)
"""Checks without which nobody is put into a rig of hardware; an emulated one holds no person."""


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
    emulated : bool
        Whether no device of it is one of hardware.
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
    emulated: bool = False
    schema: str = field(default=KIND.schema)

    @property
    def digest(self) -> str:
        """Its seal, by which a daily check names the record that it belongs to."""
        return digest(plain_values(_values(self)))

    @property
    def failed(self) -> tuple[Check, ...]:
        """The checks that failed."""
        return tuple(check for check in self.checks if check.outcome == "failed")

    @property
    def missing(self) -> tuple[str, ...]:
        """What must be passed and was not tried, or not even possible."""
        settled = {check.name for check in self.checks if check.outcome in ("passed", "failed")}
        needed = MUST_PASS if self.emulated else (*MUST_PASS, *A_PERSON_TELLS)
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
    kept = {name: value for name, value in values.items() if name != "passed"}
    kept["checks"] = tuple(Check(**check) for check in values["checks"])
    return CommissioningRecord(**kept)
