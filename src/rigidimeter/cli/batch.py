"""`rigidimeter batch`: thousands of recordings to one table."""

from __future__ import annotations

import sys
from pathlib import Path

import typer

from rigidimeter.cli.help_pages import RUN, WRITE
from rigidimeter.cli.output import echo, keep_inputs
from rigidimeter.cli.progress import Meter
from rigidimeter.cli.reading_options import Recordings, reads_recordings
from rigidimeter.core.errors import UserError

_SHOWN = 20


@reads_recordings
def batch(
    recordings: Recordings,
    out: Path = WRITE.option("--out FILE", "The table, .parquet or .csv.", ...),
    jobs: int = RUN.option("--jobs N", "Processes on this machine.", 1, min=1, max=1024),
    scheduler: str = RUN.option(
        "--scheduler ADDRESS",
        "Dask scheduler, such as tcp://host:8786. Its workers do the work instead of --jobs.",
        "",
    ),
) -> None:
    """Estimate many recordings into one table, a row for each epoch.

    INPUT may also be a folder of recordings, a study folder or a quoted pattern. Each recording is
    estimated on its own, as by estimate. One that fails is a row with the reason, and the exit
    status is then 1; the others are still estimated.

    Given again, the command goes on where it was, also after it was killed: nothing with the same
    content, settings and version is estimated twice. What failed is tried again.

    \b
    For example:
      rigidimeter batch demo-study/sessions --out results.parquet --jobs 4
      rigidimeter batch 'demo-study/el*.csv' --mapping lab.toml --out elbow.csv
      rigidimeter batch demo-study/sessions --out cluster.parquet \\
          --scheduler tcp://host:8786
    """
    from rigidimeter.analysis.batch import batch as run_batch

    _refuse(recordings)
    keep_inputs((out,), recordings.paths)
    with Meter("batch", 1.0, from_first=True) as meter:
        # In a file or a pipe there is nobody to look at progress for hours.
        progress = meter.reach if sys.stderr.isatty() else (lambda _: None)
        done = run_batch(
            recordings.paths,
            out,
            method=recordings.method,
            jobs=jobs,
            scheduler=scheduler,
            condition=(recordings.condition or [""])[0],
            settings=recordings.settings,
            changes=recordings.changes(),
            progress=progress,
            **recordings.of_files(),
        )
    for reason in done.failed[:_SHOWN]:
        echo(f"error: {reason}", err=True)
    if len(done.failed) > _SHOWN:
        echo(f"error: {len(done.failed) - _SHOWN} more, each a row of {out}", err=True)
    if done.lost_workers:
        echo(
            f"warning: ended before the work did: {', '.join(done.lost_workers)}; others have "
            "estimated what was begun there",
            err=True,
        )
    before = f", {done.before} of them estimated before" if done.before else ""
    echo(f"{out}: {done.epochs} epochs of {done.inputs} inputs{before}")
    raise typer.Exit(int(bool(done.failed)))


def _refuse(recordings: Recordings) -> None:
    """Refuse what concerns single recordings.

    Raises
    ------
    UserError
        Naming the option, and what does it instead.
    """
    for option, given in (
        ("--join", recordings.join),
        ("--clock-offset", recordings.clock_offset),
        ("--leave-out", recordings.leave_out),
    ):
        if given:
            raise UserError(f"{option}: is for single recordings; use `rigidimeter estimate`")
    if len(recordings.condition or ()) > 1:
        raise UserError(
            "--condition: is given once to a batch, for all recordings that do not say one; name "
            "several in the sessions.csv of a study folder"
        )
