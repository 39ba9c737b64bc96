"""Who is there to lead a session: somebody, or in writing nobody, and nobody in the rig."""

from __future__ import annotations

import sys
from pathlib import Path

import typer

from rigidimeter.core.errors import UserError

NOBODY_IN_RIG = "nobody in the rig"
"""What must be written before hardware moves with nobody there."""


def at_terminal() -> bool:
    """Whether somebody can press keys."""
    return sys.stdin is not None and sys.stdin.isatty()


def attendance(rig: Path | None, *, unattended: bool, confirm: str) -> tuple[bool, str]:
    """Return whether somebody is there to lead the session, and what was written if nobody is.

    The virtual rig and emulated devices run without anybody. Hardware does so only where it is
    written that nobody is in it.

    Parameters
    ----------
    rig : Path or None
        RIG.toml; the virtual rig if not given.
    unattended : bool
        Whether nobody shall be there.
    confirm : str
        What was written; asked for at the terminal where it is empty and needed.

    Raises
    ------
    UserError
        If real hardware would move with nobody there, and that was not confirmed.
    """
    from rigidimeter.rig.devices import load_rig

    if confirm and not unattended:
        raise UserError(f"--confirm {confirm!r}: goes with --unattended alone")
    hardware = rig is not None and not load_rig(rig).emulated
    if not unattended:
        if hardware and not at_terminal():
            raise UserError(
                f"{rig}: is real hardware, and the input is no terminal, so nobody could stop it; "
                "use a terminal, or --console; or, with nobody in the rig, --unattended "
                f'--confirm "{NOBODY_IN_RIG}"'
            )
        return at_terminal(), ""
    if not hardware:
        return False, confirm
    if not confirm and at_terminal():
        confirm = typer.prompt(
            f"Nobody can stop {rig} in an unattended session. Type `{NOBODY_IN_RIG}` to go on",
            default="",
            show_default=False,
            err=True,
        )
    if " ".join(confirm.split()).lower() != NOBODY_IN_RIG:
        raise UserError(
            f'{rig}: is real hardware; --unattended needs --confirm "{NOBODY_IN_RIG}", '
            f"not {confirm!r}, and that it is so"
        )
    return False, NOBODY_IN_RIG
