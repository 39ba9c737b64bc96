"""`rigidimeter export`: recordings and studies in the formats of archives and other programs."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rigidimeter.cli.help_pages import HOW_TO_READ, WRITE
from rigidimeter.cli.options import KEY
from rigidimeter.cli.output import echo, say
from rigidimeter.cli.progress import Meter
from rigidimeter.cli.reading_options import Recordings, reads_recordings
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.analysis.export import ExportedSession


@reads_recordings
def export(
    recordings: Recordings,
    to: str = WRITE.option("--to FORMAT", "Format: nwb, bids, parquet, csv, mat.", ...),
    out: Path = WRITE.option("--out PATH", "File, or folder of several files.", ...),
    overwrite: bool = WRITE.flag("--overwrite", "Replace files of the same name.", hidden=True),
    estimates: bool = WRITE.further(
        "--estimates/--no-estimates", "Whether J, B, K and scores travel along.", True
    ),
    subject: str = HOW_TO_READ.further("--subject NAME", "The subject of single recordings.", ""),
    day: str = HOW_TO_READ.further("--day NAME", "The day of single recordings.", ""),
    joint: str = HOW_TO_READ.further(
        "--joint NAME", "The joint of single recordings, as elbow.", ""
    ),
    started: datetime | None = HOW_TO_READ.further(
        "--started TIME",
        "When single recordings began that do not say so, as 2026-03-01T10:30+0100.",
        formats=["%Y-%m-%dT%H:%M:%S%z", "%Y-%m-%dT%H:%M%z"],
    ),
    key: Path | None = KEY,
) -> None:
    """Write sessions, recordings or a study in another format.

    Each sensor keeps its own clock, values are in SI units, and settings, stimulation, ratings,
    exclusions, estimates with intervals and the version of the software travel along. A recording
    that was simulated says so. Of a study folder every session that counts is written, with codes
    in place of conditions where there is no key.

    \b
    For example:
      rigidimeter export demo-study --to mat --out matlab
      rigidimeter export demo-study/elbow.csv --column epoch=trial --to mat \\
          --out elbow.mat --subject S1
    """
    from rigidimeter.analysis.export import export_sessions, format_named
    from rigidimeter.cli.inputs import study_of

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
    recordings: Recordings, said: dict[str, str], *, estimates: bool
) -> tuple[list[ExportedSession], int]:
    from rigidimeter.analysis.export import sessions_of_recording
    from rigidimeter.cli.inputs import analyse_recordings

    analysis = None
    if estimates:
        read, analysed = analyse_recordings(recordings)
        analysis, status = analysed.analysis, analysed.say()
    else:
        read = recordings.read()
        say(read.notices)
        status = int(read.failed)
    sessions = sessions_of_recording(
        read,
        analysis,
        started_utc=said.pop("started"),
        blinded=recordings.blinded,
        **said,
    )
    return sessions, status


def _of_study(
    folder: Path, recordings: Recordings, key: Path | None, *, estimates: bool
) -> tuple[list[ExportedSession], int]:
    from rigidimeter.analysis.export import sessions_of_study
    from rigidimeter.cli.study_inputs import estimate_study_inputs, read_study_inputs

    read = read_study_inputs(folder, recordings, key)
    analysis, notices = estimate_study_inputs(read) if estimates else (None, read.notices)
    say(notices)
    return sessions_of_study(read, analysis), int(any(n.level == "error" for n in notices))
