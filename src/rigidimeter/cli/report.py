"""`rigidimeter report`: one page from recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rigidimeter.cli.inputs import Recordings, analyse_inputs, say, status
from rigidimeter.cli.options import reads_recordings
from rigidimeter.errors import UserError

__all__ = ["report"]


@reads_recordings
def report(
    recordings: Recordings,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the report.")],
    title: Annotated[
        str, typer.Option("--title", metavar="TEXT", help="Title of the page.")
    ] = "Joint rigidity",
) -> None:
    """Analyse recordings and write one self-contained HTML page, with its tables and figures.

    \b
    For example:
      rigidimeter report demo-study/sessions/day-1 demo-study/sessions/day-2 --out report
      rigidimeter report ankle.csv --reaction --epoch-length-s 20 --out report
    """
    from rigidimeter.cli.reporting import make_report
    from rigidimeter.recording import is_session, write_estimates_json

    if is_session(out):
        raise UserError(f"--out {out}: is a session folder; name another folder for the report")
    read = recordings.read()
    say(read.notices)
    analysis = analyse_inputs(read)
    exit_status = status(read, analysis)
    page = make_report(title, read, analysis, out)
    write_estimates_json(out / "estimates.json", analysis)
    typer.echo(str(page))
    raise typer.Exit(exit_status)
