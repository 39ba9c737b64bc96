"""`rigidimeter check`: the daily check of a rig, with nobody in it."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Annotated

import typer

from rigidimeter.cli.commission import claimed, table
from rigidimeter.cli.inputs import keep_inputs
from rigidimeter.cli.options import SettingsOption
from rigidimeter.cli.output import echo
from rigidimeter.cli.terminal_tables import show
from rigidimeter.errors import UserError


def check(
    rig: Annotated[
        Path, typer.Argument(metavar="RIG.toml", help="The rig file.", show_default=False)
    ],
    settings: SettingsOption = None,
    known_inertia: Annotated[
        float | None,
        typer.Option(
            "--known-inertia-kg-m2",
            metavar="J",
            help="The true inertia of everything beyond the torque sensor, such as a weight on the "
            "cuff; compared in place of the reference.",
        ),
    ] = None,
    new_reference: Annotated[
        bool,
        typer.Option(
            "--new-reference",
            help="Keep today's inertia as the reference: the cuff or the handle was changed.",
        ),
    ] = False,
    yes: Annotated[
        bool,
        typer.Option("--yes", help="Consent to the motions in advance; for an emulated rig only."),
    ] = False,
) -> None:
    """Check a commissioned rig in about 20 s, with nobody in it; `run` requires it every day.

    Without power: device settings, rates, noise and zero of the torque. With power: uncommanded
    motion, a small move, then a motion of a few degrees. The torque that it takes to move cuff and
    handle shows the sign, the gain and the delay of the torque sensor. The first check since the
    rig was commissioned keeps their inertia as the reference for the next ones.

    \b
    For example:
      rigidimeter check RIG.toml --settings study.toml
      rigidimeter check RIG.toml --known-inertia-kg-m2 0.012
    """
    from datetime import UTC, datetime

    from rigidimeter.cli.sign_text import sign_blocks
    from rigidimeter.commissioning import (
        Compared,
        check_record,
        daily_check,
        daily_path,
        read_daily,
        write_daily,
    )
    from rigidimeter.devices.rigfile import load_rig
    from rigidimeter.settings import load_settings
    from rigidimeter.version import __version__

    rigfile, chosen = load_rig(rig), load_settings(settings)
    path = daily_path(rig)
    keep_inputs((path,), (rig, settings) if settings is not None else (rig,))
    if known_inertia is not None and not (math.isfinite(known_inertia) and known_inertia > 0):
        raise UserError(
            f"--known-inertia-kg-m2 {known_inertia:g}: must be a number above 0, in kg·m²"
        )
    if yes and not rigfile.emulated:
        raise UserError(
            f"{rig}: is real hardware; somebody must look that nobody's arm is in it and answer, "
            "so leave out --yes"
        )
    if not yes and not sys.stdin.isatty():
        raise UserError(
            "nobody can answer the question; use a terminal, or --yes on an emulated rig"
        )
    check_record(rigfile, None, chosen)
    try:
        before = read_daily(path).reference if path.exists() else None
    except UserError as error:
        if not new_reference:
            raise UserError(f"{error}; its reference is lost, so add --new-reference") from None
        before = None
    with claimed(rigfile, chosen, path, "check the rig again", yes) as setup:
        found = daily_check(
            setup,
            rigfile,
            lambda facts: check_record(rigfile, facts, chosen),
            compared=Compared(known_inertia, before, new_reference),
            made_utc=datetime.now(UTC).isoformat(timespec="seconds"),
            software=__version__,
        )
    write_daily(path, found)
    show([table(found.checks)])
    echo(f"Record: {path}")
    if found.objection:
        raise UserError(f"{rig}: not fit for a person today: {found.objection}")
    show(sign_blocks(chosen, found.checks))
    kept = found.reference
    if kept is not None and kept.made_utc == found.made_utc:
        was = "" if kept.before_kg_m2 is None else f"; it was {kept.before_kg_m2:.3g} kg·m²"
        echo(f"Kept as the reference: {kept.inertia_kg_m2:.3g} kg·m², {kept.reason}{was}.")
    echo(f"Valid until {found.valid_until:%Y-%m-%d %H:%M} UTC.")
