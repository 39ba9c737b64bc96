"""`rigidimeter report`: one page from recordings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from rigidimeter.cli.inputs import analyse_inputs, say, status
from rigidimeter.cli.options import Recordings, reads_recordings
from rigidimeter.cli.study_input import KeyOption, analysed_study, study_of
from rigidimeter.errors import UserError

__all__ = ["report"]

TITLE = "Joint rigidity"


@reads_recordings
def report(
    recordings: Recordings,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the report.")],
    title: Annotated[
        str | None,
        typer.Option(
            "--title",
            metavar="TEXT",
            help="Title of the page. Default: that of the study, else Joint rigidity.",
        ),
    ] = None,
    key: KeyOption = None,
) -> None:
    """Analyse recordings and write one self-contained HTML page, with its tables and figures.

    Of a study folder (with a study.toml) the page shows days, effect sizes, ratings, other methods
    and every exclusion too.

    \b
    For example:
      rigidimeter report demo-study/sessions/day-1 demo-study/sessions/day-2 --out report
      rigidimeter report study --out study/report
      rigidimeter report ankle.csv --reaction --epoch-length-s 20 --out report
    """
    from rigidimeter.cli.reporting import make_report, write_page
    from rigidimeter.recording import is_session, write_estimates_json

    if is_session(out):
        raise UserError(f"--out {out}: is a session folder; name another folder for the report")
    if (folder := study_of(recordings, key)) is not None:
        if out.resolve() in (folder.resolve(), (folder / "analysis").resolve()):
            raise UserError(
                f"--out {out}: is the study or its kept analysis; name another folder, such as "
                f"{folder / 'report'}"
            )
        found = analysed_study(folder, recordings, key)
        study = found.result if title is None else replace(found.result, title=title)
        page = write_page(study, out)
        write_estimates_json(out / "estimates.json", study.analysis)
        typer.echo(str(page))
        raise typer.Exit(found.status)
    read = recordings.read()
    say(read.notices)
    analysis = analyse_inputs(read, recordings.method)
    exit_status = status(read, analysis)
    page = make_report(title or TITLE, read, analysis, out)
    write_estimates_json(out / "estimates.json", analysis)
    typer.echo(str(page))
    raise typer.Exit(exit_status)
