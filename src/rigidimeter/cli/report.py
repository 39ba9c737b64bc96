"""`rigidimeter report`: one page from recordings or from a study folder."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rigidimeter.cli.help_pages import WRITE
from rigidimeter.cli.options import GROUP, KEY
from rigidimeter.cli.output import echo
from rigidimeter.cli.progress import Meter
from rigidimeter.cli.reading_options import Recordings, reads_recordings
from rigidimeter.cli.terminal_tables import Heading, show
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.analysis.report import Shown


@reads_recordings
def report(
    recordings: Recordings,
    out: Path = WRITE.option("--out DIR", "Folder of the report.", ...),
    title: str | None = WRITE.option(
        "--title TEXT", "Title of the page. Default: the title of the study, or Joint rigidity."
    ),
    key: Path | None = KEY,
    group: str | None = GROUP,
    overwrite: bool = WRITE.flag(
        "--overwrite",
        "Replace the report of something else, and write beside other files.",
        hidden=True,
    ),
) -> None:
    """Write one HTML page of results, with its tables and figures.

    For a study folder (with a study.toml) the page also shows tests by days, effect sizes, ratings,
    other methods and every exclusion.

    \b
    For example:
      rigidimeter report demo-study --out demo-study/report
      rigidimeter report demo-study/sessions/day-1-OFF --out day-1
      rigidimeter report demo-study/elbow.csv --column epoch=trial --out elbow
    """
    from rigidimeter.analysis.report import Shown, inputs_seen_from, why_not_own
    from rigidimeter.analysis.study import lead
    from rigidimeter.cli.inputs import analyse_recordings, command_line, study_of
    from rigidimeter.cli.study_inputs import analyse_study_folder
    from rigidimeter.core.session import is_session

    if any(is_session(folder) for folder in (out, *out.resolve().parents)):
        raise UserError(
            f"--out {out}: is or lies in a session folder; name another folder for the report"
        )
    can_be_made(out)
    names = inputs_seen_from(out, recordings.paths)
    if not overwrite and (why := why_not_own(out, names)):
        raise UserError(
            f"--out {out}: {why}; name another folder, or write into it with --overwrite"
        )
    if (folder := study_of(recordings, key)) is not None:
        if out.resolve() in (folder.resolve(), (folder / "analysis").resolve()):
            raise UserError(
                f"--out {out}: is the study or its stored analysis; name another folder, such as "
                f"{folder / 'report'}"
            )
        shown, analysed = analyse_study_folder(folder, recordings, key, group=group)
    elif group is not None:
        raise UserError(f"--group {group}: recordings name no group; give a study folder")
    else:
        read, analysed = analyse_recordings(recordings)
        shown = Shown.of_recording(read, analysed.analysis, command_line())
    try:
        page = write_page(shown, out, recordings.paths, title, overwrite=overwrite)
        show([Heading(lead(shown.study, shown.result.comparisons)), ""])
        echo(str(page))
    finally:
        status = analysed.say()
    raise typer.Exit(status)


def can_be_made(out: Path) -> None:
    """Refuse a folder that cannot be written, before anything is computed for it."""
    there = next(path for path in (out.resolve(), *out.resolve().parents) if path.exists())
    if not there.is_dir() or not os.access(there, os.W_OK):
        why = "is not writable" if there.is_dir() else "is no folder"
        raise UserError(f"--out {out}: the report cannot be written ({there} {why})")


def write_page(
    shown: Shown,
    out: Path,
    inputs: Sequence[Path],
    title: str | None = None,
    *,
    overwrite: bool = False,
) -> Path:
    """Write the report of what is shown with progress; return the path of its page."""
    from rigidimeter.analysis import report as reporting
    from rigidimeter.analysis.reading import write_estimates_json

    with Meter("report", 1.0) as meter:
        page = reporting.report(
            shown, out, title, inputs=inputs, overwrite=overwrite, progress=meter.reach
        )
    write_estimates_json(out / "estimates.json", shown.analysis)
    return page
