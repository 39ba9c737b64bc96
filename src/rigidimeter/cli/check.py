"""`rigidimeter check`: the daily check of a rig, with nobody in it."""

from __future__ import annotations

import math
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rigidimeter.cli.help_pages import OPTIONS, argument
from rigidimeter.cli.options import SETTINGS
from rigidimeter.cli.output import echo, keep_inputs
from rigidimeter.cli.terminal_tables import show
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.core.settings import Settings
    from rigidimeter.rig.commissioning import DailyRecord, ZeroFound
    from rigidimeter.rig.devices import RigFile


def check(
    rig: Path | None = argument(
        "[RIG.toml]",
        "The rig file. Without one: the virtual rig on a simulated clock, to see how it is done; "
        "nothing is recorded.",
        None,
    ),
    settings: Path | None = SETTINGS,
    known_inertia: float | None = OPTIONS.option(
        "--known-inertia-kg-m2 J",
        "True inertia beyond the torque sensor. Such as a weight on the cuff; compared in place "
        "of the reference.",
    ),
    new_reference: bool = OPTIONS.flag(
        "--new-reference",
        "Keep today's inertia as the reference. After the cuff or the handle was changed.",
    ),
    zero: bool = OPTIONS.flag(
        "--zero",
        "Only zero and noise of the torque sensor. Without power, by the limits of [zeroing], as "
        "`run` does when it begins; nothing is recorded.",
    ),
    live: bool = OPTIONS.flag(
        "--live",
        "Show what the sensors read, until Ctrl-C. Without power, on the drive's own scale, while "
        "you wire, turn the joint or hang a weight; nothing is asked or recorded.",
    ),
    replay: Path | None = OPTIONS.option(
        "--replay SESSION",
        "Only run the guard over a recorded session. As fast as it goes; no rig is needed.",
    ),
    yes: bool = OPTIONS.flag("--yes", "Consent in advance, for an emulated rig only."),
    piped: bool = OPTIONS.flag(
        "--piped", "A program asks somebody and pipes the answer.", hidden=True
    ),
) -> None:
    """Check a commissioned rig, every day before the first run.

    It takes about 20 s, with nobody in the rig. Without power: device settings, rates, noise and
    zero of the torque. With power: uncommanded motion, a small move, then a motion of a few
    degrees. The torque that it takes to move cuff and handle shows the sign, the gain and the delay
    of the torque sensor. The first check since the rig was commissioned keeps their inertia as the
    reference for the next ones.

    With `--replay` the guard of this version reads a recorded session: it must stop or hold for the
    same causes at the same ticks. The exit status is 1 if it does not.

    \b
    For example:
      rigidimeter check RIG.toml --settings examples/settings/human-elbow.toml
      rigidimeter check RIG.toml --known-inertia-kg-m2 0.012
      rigidimeter check RIG.toml --zero
      rigidimeter check RIG.toml --live
    """
    from rigidimeter.cli.replay_text import say_replayed
    from rigidimeter.cli.rig_checks import claimed, operator, require_answers
    from rigidimeter.cli.virtual_check import virtual_check, virtual_setup
    from rigidimeter.core.settings import load_settings
    from rigidimeter.core.version import __version__
    from rigidimeter.rig.commissioning import (
        Compared,
        check_record,
        daily_check,
        daily_path,
        read_daily,
        write_daily,
        zero_check,
    )
    from rigidimeter.rig.devices import load_rig

    if replay is not None:
        if (
            rig is not None
            or settings is not None
            or zero
            or live
            or new_reference
            or known_inertia
        ):
            raise UserError(
                "--replay SESSION goes alone: settings and limits are those of the session"
            )
        say_replayed(replay)
        return
    rigfile, chosen = None if rig is None else load_rig(rig), load_settings(settings)
    if known_inertia is not None and not (math.isfinite(known_inertia) and known_inertia > 0):
        raise UserError(
            f"--known-inertia-kg-m2 {known_inertia:g}: must be a number above 0, in kg·m²"
        )
    if rigfile is None:
        if known_inertia is not None or new_reference or live:
            raise UserError("--known-inertia-kg-m2, --new-reference and --live need a RIG.toml")
        setup = virtual_setup(chosen, operator(yes=not piped, piped=piped))
        if zero:
            _say_zero(zero_check(setup), chosen)
        else:
            _say_checked(virtual_check(setup), chosen, "the virtual rig")
        return
    path = daily_path(rigfile.path)
    if live:
        _show_live(rigfile, chosen)
        return
    if zero:
        with claimed(rigfile, chosen, path, "do it again", operator(yes=True)) as setup:
            at_rest = zero_check(setup)
        _say_zero(at_rest, chosen)
        return
    if yes and not rigfile.emulated:
        raise UserError(
            f"{rig}: is real hardware; somebody must check that nobody's arm is in it and "
            "answer, so leave out --yes"
        )
    require_answers(yes=yes, piped=piped)
    keep_inputs((path,), filter(None, (rig, settings)))
    check_record(rigfile, None, chosen)
    try:
        before = read_daily(path).reference if path.exists() else None
    except UserError as error:
        if not new_reference:
            raise UserError(f"{error}; its reference is lost, so add --new-reference") from None
        before = None
    asked = operator(yes=yes, piped=piped)
    with claimed(rigfile, chosen, path, "check the rig again", asked) as setup:
        found = daily_check(
            setup,
            rigfile,
            lambda facts: check_record(rigfile, facts, chosen),
            compared=Compared(known_inertia, before, new_reference),
            made_utc=datetime.now(UTC).isoformat(timespec="seconds"),
            software=__version__,
        )
    write_daily(path, found)
    echo(f"Record: {path}")
    _say_checked(found, chosen, f"{rig}")
    kept = found.reference
    if kept is not None and kept.made_utc == found.made_utc:
        was = "" if kept.before_kg_m2 is None else f"; it was {kept.before_kg_m2:.3g} kg·m²"
        echo(f"Stored as the reference: {kept.inertia_kg_m2:.3g} kg·m², {kept.reason}{was}.")
    echo(f"Valid until {found.valid_until:%Y-%m-%d %H:%M} UTC.")


def _show_live(rigfile: RigFile, settings: Settings) -> None:
    """Show the readings in one line that is replaced; in a file or a pipe a line each."""
    from rigidimeter.cli.rig_checks import claimed, operator
    from rigidimeter.rig.commissioning import HEADING, LiveReading, live_readings

    ending = "\r" if sys.stdout.isatty() else "\n"

    def show_line(reading: LiveReading) -> bool:
        sys.stdout.write(f"{reading.words:<79}{ending}")
        sys.stdout.flush()
        return True

    with claimed(rigfile, settings, None, "", operator(yes=True)) as setup:
        echo(f"Live readings, without power. Ctrl-C ends.\n{HEADING}")
        live_readings(setup, show_line)


def _say_checked(found: DailyRecord, settings: Settings, what: str) -> None:
    """Show the checks; a rig that is not fit ends the program with status 1."""
    from rigidimeter.cli.rig_checks import table
    from rigidimeter.rig.commissioning import sign_words

    show([table(found.checks)])
    if found.objection:
        raise UserError(f"{what}: not fit for a person today: {found.objection}")
    show([sign_words(settings, found.checks)])


def _say_zero(found: ZeroFound, settings: Settings) -> None:
    """Show each value beside its limit; one above it ends the program with status 1."""
    echo(f"At rest: {found.words(settings)}.")
    if found.objection:
        raise UserError(f"a session would not begin: {found.objection}")
