"""`rigidimeter commission`: check a rig before a person is attached."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rigidimeter.cli.help_pages import OPTIONS
from rigidimeter.cli.options import SETTINGS
from rigidimeter.cli.output import echo, keep_inputs
from rigidimeter.cli.terminal_tables import Table, show
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.core.settings import Settings
    from rigidimeter.rig.devices import RigFile


def commission(
    rig: Path | None = OPTIONS.option("--rig RIG.toml", "The rig file."),
    settings: Path | None = SETTINGS,
    signed_by: str = OPTIONS.option(
        "--signed-by NAME", "Who is responsible for the rig; recorded.", ""
    ),
    yes: bool = OPTIONS.flag(
        "--yes",
        "Consent to every motion in advance, for an emulated rig only. Checks that need a person "
        "are skipped.",
    ),
    known_torque: float | None = OPTIONS.option(
        "--known-torque-nm NM",
        "Known torque, applied by hand or by a weight. It acts toward positive angles.",
    ),
    known_angle: float | None = OPTIONS.option(
        "--known-angle-deg DEG",
        "Known angle by which you turn the joint. By hand, with the drive off.",
    ),
    out: Path | None = OPTIONS.option(
        "--out FILE", "The record. Default: a file next to the rig file."
    ),
    eds: Path | None = OPTIONS.option(
        "--eds FILE",
        "Only compare a CANopen drive's EDS. With what the rig file writes, or with the driver's "
        "defaults without one; nothing is connected.",
    ),
    again: bool = OPTIONS.flag(
        "--again",
        "Only repeat what another program, computer or kernel asks for. The record stays.",
    ),
) -> None:
    """Check a new rig with nobody in it, before its first run.

    The command writes the record that `run` requires. First without power: device settings, rates,
    noise, timing, mechanical stops. Then, with your consent, with small slow motions: directions,
    units, delays, stability of the protocol's controller, watchdog and emergency stop. Attach a
    spring or a weight similar to a relaxed arm to the joint. On hardware a person must be present,
    and sign.

    The record belongs to the program, the computer and its kernel. When one of them is another,
    `run` and `check` name the checks to repeat, and `--again` repeats them.

    \b
    For example:
      rigidimeter commission --rig RIG.toml --signed-by "A. Weber"
      rigidimeter commission --rig RIG.toml --known-torque-nm 2
      rigidimeter commission --rig RIG.toml --again --signed-by "A. Weber"
      rigidimeter commission --eds drive.eds
    """
    from datetime import UTC, datetime

    from rigidimeter.cli.rig_checks import claimed, operator, require_answers, table
    from rigidimeter.core.settings import load_settings
    from rigidimeter.core.version import __version__
    from rigidimeter.rig.commissioning import commission_rig, record_path, sign_words, write_record
    from rigidimeter.rig.devices import load_rig

    if eds is not None:
        _compare_eds(eds, rig, load_settings(settings))
        return
    if rig is None:
        raise UserError("name the rig file with --rig RIG.toml, or a drive's EDS with --eds FILE")
    rigfile, chosen = load_rig(rig), load_settings(settings)
    path = out or record_path(rig)
    keep_inputs((path,), (rig, settings) if settings is not None else (rig,))
    _check_known({"--known-torque-nm": known_torque, "--known-angle-deg": known_angle})
    require_answers(yes=yes)
    if not rigfile.emulated and not signed_by.strip():
        raise UserError(
            f"{rig}: is real hardware; name the person responsible for it with --signed-by NAME"
        )
    if yes and not rigfile.emulated:
        raise UserError(
            f"{rig}: is real hardware; somebody must check that nobody's arm is in it and "
            "answer, so leave out --yes"
        )
    if again:
        _repeat(rigfile, chosen, path, signed_by, yes=yes)
        return
    asked = operator(yes=yes, known_torque_nm=known_torque, known_angle_deg=known_angle)
    with claimed(rigfile, chosen, path, "commission again", asked) as setup:
        found = commission_rig(
            setup,
            rigfile,
            made_utc=datetime.now(UTC).isoformat(timespec="seconds"),
            software=__version__,
            signed_by=signed_by,
        )
    write_record(path, found)
    show([table(found.checks)])
    echo(f"Record: {path}")
    if found.objection:
        raise UserError(f"{rig}: not fit for a person: {found.objection}")
    if found.not_tried:
        echo(f"Not tried: {', '.join(found.not_tried)}.")
    show([sign_words(chosen, found.checks)])
    what = "this emulated rig, with nobody in it" if found.emulated else "this rig"
    days = chosen.commissioning.validity_days
    echo(f"Valid for {what}, its devices and this controller, for {days:g} day{'s' * (days != 1)}.")


def _repeat(
    rigfile: RigFile, settings: Settings, record: Path, signed_by: str, *, yes: bool
) -> None:
    """Repeat the checks that are asked for, and write them beside the commissioning record."""
    from datetime import UTC, datetime

    from rigidimeter.cli.rig_checks import claimed, operator, table
    from rigidimeter.rig.commissioning import (
        check_record,
        differences,
        parts_to_repeat,
        program_identity,
        repeat_checks,
        repeated_path,
        write_repeated,
    )

    commissioned = check_record(rigfile, None, settings, path=record, repeated=False)
    before, now = commissioned.identity, program_identity(rigfile)
    if not parts_to_repeat(before, now):
        echo("Nothing to repeat: program, computer and kernel are those of the record.")
        return
    for line in differences(before, now):
        echo(f"{line[0].upper()}{line[1:]}.", err=True)
    path = repeated_path(rigfile.path)
    keep_inputs((path,), (rigfile.path, record))
    asked = operator(yes=yes)
    with claimed(rigfile, settings, path, "repeat the checks", asked) as setup:
        found = repeat_checks(
            setup,
            rigfile,
            commissioned,
            lambda facts: check_record(rigfile, facts, settings, path=record, repeated=False),
            made_utc=datetime.now(UTC).isoformat(timespec="seconds"),
            signed_by=signed_by,
        )
    write_repeated(path, found)
    show([table(found.checks)])
    echo(f"Record: {path}")
    if found.objection:
        raise UserError(f"{rigfile.path}: not fit for a person: {found.objection}")
    echo("Valid for this program, computer and kernel, as long as the commissioning record.")


def _compare_eds(eds: Path, rig: Path | None, settings: Settings) -> None:
    from rigidimeter.rig.devices import Cia402Settings, compare_eds, drive_bounds, load_rig

    chosen: object = Cia402Settings()
    if rig is not None:
        _, chosen = load_rig(rig).devices["drive"]
    if not isinstance(chosen, Cia402Settings):
        raise UserError(f'{rig}: its drive has no EDS; --eds is for driver = "cia402"')
    found = compare_eds(eds, chosen, drive_bounds(settings))
    rows = [("ok" if row.fits else "FAIL", row.label, row.found, row.needed) for row in found]
    show([Table(("", "object", "the drive", "the driver"), rows, "=<<<", indent=0)])
    for row in found:
        if row.lost and not row.lost.startswith("nothing"):
            echo(f"Without {row.label}: {row.lost}.")
    wrong = [row.label for row in found if not row.fits]
    if wrong:
        raise UserError(f"{eds}: does not fit: {', '.join(wrong)}")
    echo("Every object fits. What the drive does with them only commissioning shows.")


def _check_known(known: Mapping[str, float | None]) -> None:
    """Refuse a known value with which nothing can be compared."""
    for option, value in known.items():
        if value is not None and not (math.isfinite(value) and value != 0):
            raise UserError(f"{option} {value:g}: must be a number other than 0")
