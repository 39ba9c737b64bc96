"""`rigidimeter export`: recordings and studies in the formats of archives and other programs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rigidimeter.cli.help_pages import HOW_TO_READ, WRITE
from rigidimeter.cli.inputs import analyse_recordings, say, say_analysed, study_of
from rigidimeter.cli.options import KeyOption
from rigidimeter.cli.output import echo
from rigidimeter.cli.reading_options import Recordings, reads_recordings
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.analysis.export import ExportedSession


@reads_recordings
def export(
    recordings: Recordings,
    to: Annotated[
        str,
        typer.Option(
            "--to",
            metavar="FORMAT",
            help="Format: nwb, bids, parquet, csv, mat.",
            rich_help_panel=WRITE,
        ),
    ],
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="PATH",
            help="File, or folder of several files.",
            rich_help_panel=WRITE,
        ),
    ],
    overwrite: Annotated[
        bool,
        typer.Option(
            "--overwrite",
            help="Replace files of the same name.",
            rich_help_panel=WRITE,
            hidden=True,
        ),
    ] = False,
    estimates: Annotated[
        bool,
        typer.Option(
            "--estimates/--no-estimates",
            help="Whether J, B, K and scores travel along.",
            rich_help_panel=WRITE,
            hidden=True,
        ),
    ] = True,
    subject: Annotated[
        str,
        typer.Option(
            "--subject",
            metavar="NAME",
            help="The subject of single recordings.",
            rich_help_panel=HOW_TO_READ,
            hidden=True,
        ),
    ] = "",
    day: Annotated[
        str,
        typer.Option(
            "--day",
            metavar="NAME",
            help="The day of single recordings.",
            rich_help_panel=HOW_TO_READ,
            hidden=True,
        ),
    ] = "",
    joint: Annotated[
        str,
        typer.Option(
            "--joint",
            metavar="NAME",
            help="The joint of single recordings, as elbow.",
            rich_help_panel=HOW_TO_READ,
            hidden=True,
        ),
    ] = "",
    started: Annotated[
        datetime | None,
        typer.Option(
            "--started",
            metavar="TIME",
            formats=["%Y-%m-%dT%H:%M:%S%z", "%Y-%m-%dT%H:%M%z"],
            help="When single recordings began that do not say so, as 2026-03-01T10:30+0100.",
            rich_help_panel=HOW_TO_READ,
            hidden=True,
        ),
    ] = None,
    key: KeyOption = None,
) -> None:
    """Write sessions, recordings or a study in another format.

    Each sensor keeps its own clock, values are in SI units, and settings, stimulation, ratings,
    exclusions, estimates with intervals and the version of the software travel along. A recording
    that was simulated says so. Of a study folder every session that counts is written, with codes
    in place of conditions where there is no key.

    \b
    For example:
      rigidimeter export demo-study --to mat --out matlab
      rigidimeter export elbow.csv --to mat --out elbow.mat --subject S1
    """
    from rigidimeter.analysis.export import export_sessions, format_named
    from rigidimeter.cli.progress import Meter

    format_named(to)
    if any((folder / "manifest.json").exists() for folder in (out, *out.resolve().parents)):
        raise UserError(f"--out {out}: is or lies in a session folder, which never changes again")
    study = study_of(recordings, key)
    said = {
        "subject": subject,
        "day": day,
        "joint": joint,
        "started": "" if started is None else started.isoformat(),
    }
    if study is not None:
        for option, value in said.items():
            if value:
                raise UserError(
                    f"--{option} {value}: is for single recordings; a study says this in its "
                    "study.toml and sessions.csv"
                )
        sessions, status = _of_study(study, recordings, key, estimates=estimates)
    else:
        sessions, status = _of_recordings(recordings, said, estimates=estimates)
    with Meter("export", 1.0) as meter:
        written = export_sessions(sessions, to, out, overwrite=overwrite, progress=meter.advance)
    several = "" if len(sessions) == 1 else f"{len(sessions)} sessions, "
    n_bytes = sum(path.stat().st_size for path in written)
    files = "1 file" if len(written) == 1 else f"{len(written)} files"
    echo(f"{out}: {several}{files}, {n_bytes / 1e6:.3g} MB")
    raise typer.Exit(status)


def _of_recordings(
    recordings: Recordings, said: Mapping[str, str], *, estimates: bool
) -> tuple[list[ExportedSession], int]:
    from rigidimeter.analysis.export import sessions_of_recording

    analysis = None
    if estimates:
        read, analysis = analyse_recordings(recordings)
        status = say_analysed(read, analysis)
    else:
        read = recordings.read()
        say(read.notices)
        status = int(read.failed)
    sessions = sessions_of_recording(
        read,
        analysis,
        subject=said["subject"],
        day=said["day"],
        joint=said["joint"],
        started_utc=said["started"],
        blinded=recordings.blinded,
    )
    return sessions, status


def _of_study(
    folder: Path, recordings: Recordings, key: Path | None, *, estimates: bool
) -> tuple[list[ExportedSession], int]:
    from rigidimeter.analysis.export import sessions_of_study
    from rigidimeter.analysis.study import estimate_study, read_study
    from rigidimeter.cli.progress import Meter
    from rigidimeter.core.settings import load_settings

    chosen = load_settings(recordings.settings) if recordings.settings is not None else None
    with Meter("read", 1.0) as meter:
        read = read_study(
            folder, key=key, settings=chosen, method=recordings.method, progress=meter.advance
        )
    read = replace(read, settings=recordings.adjust(read.settings))
    notices, analysis = list(read.notices), None
    if estimates:
        with Meter("estimate", 1.0) as meter:
            analysis, found = estimate_study(read, meter.advance)
        notices += found
    say(notices)
    return sessions_of_study(read, analysis), int(any(n.level == "error" for n in notices))
