"""What is tried again when the program, the computer or its kernel is another.

A commissioning record holds for the program and the computer that it was made under. Where one of
them is another, some of the checks are repeated by `rigidimeter commission --again`, and
`RIG.repeated.json` is sealed beside the record, for this program and this computer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.rig.commissioning.checks import RigCheck
from rigidimeter.rig.commissioning.sealed_record import RecordKind, read_sealed, write_sealed

KIND = RecordKind(
    "rigidimeter.repeated/1",
    "record of repeated checks",
    "rigidimeter commission --again",
    "repeat the checks",
)

SWING, STEPS, BOUNDS = "swing", "steps", "bounds of the drive"
WATCHDOG, STOP = "watchdog", "emergency stop"
EVERY_PART = (SWING, STEPS, BOUNDS, WATCHDOG, STOP)
"""Parts of commissioning that can be repeated; the checks at rest and a small move come first."""

IDENTITY: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "version": ("version of rigidimeter", EVERY_PART),
    "guard_sources": ("sources of the guard", EVERY_PART),
    "loop_sources": ("sources of the loop", EVERY_PART),
    "device_sources": ("sources of the device drivers", EVERY_PART),
    "host": ("computer", (WATCHDOG,)),
    "kernel": ("kernel", (WATCHDOG,)),
    "governor": ("processor governor", (WATCHDOG,)),
}
"""By key of `program_identity`: what it is called, and what is repeated if it is another."""

MUST_PASS: Mapping[str, tuple[str, ...]] = {
    "": (
        *("devices read back", "watchdog configured", "loop stalls before the watchdog"),
        *("braking of the drive", "faults at rest", "torque samples", "torque noise (SD)"),
        *("lateness of the loop (p99.9)", "motion samples", "motion when enabled"),
    ),
    SWING: ("angle per command", "velocity per change of angle", "torque against motion"),
    STEPS: ("delay from command to motion", "delay from command to torque"),
    WATCHDOG: ("watchdog",),
}
A_PERSON_TELLS: Mapping[str, tuple[str, ...]] = {
    SWING: ("the joint moved as described",),
    STOP: ("emergency stop", "hardware enable drops the power", "stays stopped after the release"),
}
"""Checks without which repeated parts do not count, the second of a rig of hardware."""


@dataclass(frozen=True)
class RepeatedChecks:
    """What `commission --again` found.

    Parameters
    ----------
    rig_name, rig_digest : str
        Of the rig file.
    commissioning_digest : str
        Of the commissioning record, which stays.
    identity : mapping
        As `program_identity` returned it.
    differences : tuple of str
        From the identity of the commissioning record, in words.
    parts : tuple of str
        That were to be repeated, of `EVERY_PART`.
    checks : tuple of RigCheck
    numbers : mapping
    made_utc, signed_by : str
    emulated : bool
    """

    rig_name: str
    rig_digest: str
    commissioning_digest: str
    identity: Mapping[str, str]
    differences: tuple[str, ...]
    parts: tuple[str, ...]
    checks: tuple[RigCheck, ...]
    numbers: Mapping[str, float]
    made_utc: str
    signed_by: str = ""
    emulated: bool = False
    schema: str = field(default=KIND.schema)

    @property
    def objection(self) -> str:
        """The first reason why it does not count, in a clause; empty if there is none."""
        failed = [check for check in self.checks if check.outcome == "failed"]
        if failed:
            return f"a check failed: {failed[0].sentence}"
        passed = {check.name for check in self.checks if check.passed}
        for part in ("", *self.parts):
            needed = MUST_PASS.get(part, ())
            if not self.emulated:
                needed += A_PERSON_TELLS.get(part, ())
            for name in needed:
                if name not in passed:
                    undone = [check.remedy for check in self.checks if check.name == name]
                    return f"the check {name!r} is missing: {undone[0] if undone else 'not tried'}"
        if not self.emulated and not self.signed_by.strip():
            return "nobody has signed for it: repeat with --signed-by NAME"
        return ""


def repeated_path(rig: Path) -> Path:
    """Return where the repeated checks of a rig file lie."""
    return rig.with_name(f"{rig.stem}.repeated.json")


def write_repeated(path: Path, record: RepeatedChecks) -> None:
    """Write the record with its seal; a failed write leaves the old one."""
    write_sealed(path, {**asdict(record), "passed": not record.objection})


def read_repeated(path: Path) -> RepeatedChecks:
    """Read a record.

    Raises
    ------
    UserError
        If there is none, it is something else, or it was changed since it was written.
    """
    return read_sealed(path, KIND, _record)


def _record(values: dict[str, Any]) -> RepeatedChecks:
    fields = {name: value for name, value in values.items() if name != "passed"}
    fields["checks"] = tuple(RigCheck(**check) for check in values["checks"])
    fields["differences"], fields["parts"] = tuple(values["differences"]), tuple(values["parts"])
    return RepeatedChecks(**fields)


def differences(before: Mapping[str, str], now: Mapping[str, str]) -> tuple[str, ...]:
    """Return in words what is another now."""
    found = []
    for key in _changed(before, now):
        name = IDENTITY[key][0]
        if key.endswith("_sources"):
            found.append(f"the {name} have changed")
        else:
            was, is_now = (values.get(key) or "unknown" for values in (before, now))
            found.append(f"the {name} was {was} and is now {is_now}")
    return tuple(found)


def parts_to_repeat(before: Mapping[str, str], now: Mapping[str, str]) -> tuple[str, ...]:
    """Return which parts are repeated, in their order; all if it is not known what was before."""
    asked = {part for key in _changed(before, now) for part in IDENTITY[key][1]}
    return tuple(part for part in EVERY_PART if part in asked)


def _changed(before: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    return [key for key in IDENTITY if before.get(key) != now.get(key)]


def require_repeated(
    rig: Path,
    source: Path,
    before: Mapping[str, str],
    now: Mapping[str, str],
    commissioning_digest: str,
) -> None:
    """Refuse a record made under another program or computer unless the checks were repeated.

    Parameters
    ----------
    rig, source : Path
        The rig file, and its commissioning record.
    before, now : mapping
        Identity of the record, and of this moment.
    commissioning_digest : str
        Of the record.

    Raises
    ------
    UserError
        With what is another, which checks are asked for, and the command to type.
    """
    parts = parts_to_repeat(before, now)
    if not parts:
        return
    path = repeated_path(rig)
    again = (
        f"with nobody in the rig, repeat the checks at rest, a small move, {', '.join(parts)}: "
        f"type `rigidimeter commission --rig {rig} --again`, with the settings of the protocol"
    )
    why = "; ".join(differences(before, now))
    if not path.exists():
        raise UserError(f"{source}: {why}; {again}")
    found = read_repeated(path)
    if found.commissioning_digest != commissioning_digest:
        raise UserError(f"{path}: is of another commissioning; {why}; {again}")
    if found.identity != now:
        raise UserError(f"{path}: {'; '.join(differences(found.identity, now))}; {again}")
    if found.objection:
        raise UserError(f"{path}: {found.objection}; put that right and, {again}")
