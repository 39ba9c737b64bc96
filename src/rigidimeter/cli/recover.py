"""`rigidimeter recover`: close a session that was killed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["recover"]


def recover(
    session: Annotated[Path, typer.Argument(metavar="SESSION", help="Session folder.")],
    reason: Annotated[
        str, typer.Option("--reason", metavar="TEXT", help="Why it ended, if you know.")
    ] = "the recording process ended without closing the session",
) -> None:
    """Close an interrupted session, keeping everything that was written.

    Open epochs end with `fail` and the reason. Running it on a closed session changes nothing.

    \b
    For example:
      rigidimeter recover session
      rigidimeter recover session --reason "power cut"
    """
    from rigidimeter.recording import recover as close_session

    found = close_session(session, reason)
    extent = f"{found.n_samples} samples up to {found.last_time_s:.3f} s"
    if found.already_closed:
        typer.echo(f"{session} was closed already: {extent}")
        return
    epochs = ", ".join(found.epochs_closed) or "none"
    torn = f"; {found.torn_bytes} torn bytes kept in samples.torn" if found.torn_bytes else ""
    typer.echo(f"{session} is closed: {extent}; open epochs closed as failed: {epochs}{torn}")
