"""What commands do with their inputs: analyse them, protect them, report what was wrong."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rigidimeter.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.recording import Recording
    from rigidimeter.records import Analysis, Fit, Notice, Score

__all__ = [
    "analyse_inputs",
    "command_line",
    "keep_inputs",
    "say",
    "status",
]


def analyse_inputs(recording: Recording, method: str) -> Analysis:
    """Fit and score with progress.

    Raises
    ------
    UserError
        If there is no such method.
    """
    from rigidimeter.cli.progress import Meter
    from rigidimeter.estimation import method_names
    from rigidimeter.study import estimate

    if method not in method_names():
        known = ", ".join(method_names())
        raise UserError(f"--method {method}: there is no such method; known: {known}")
    with Meter("estimate", 1.0) as meter:
        return estimate(recording, method, progress=meter.advance)


def command_line() -> str:
    """Return the command as it could be given again."""
    return shlex.join(["rigidimeter", *sys.argv[1:]])


def keep_inputs(outputs: Iterable[Path | None], inputs: Iterable[Path]) -> None:
    """Refuse to write over what is read.

    Raises
    ------
    UserError
        If an output is an input, lies in a session folder, or is named twice.
    """
    kept = {path.resolve() for path in inputs}
    for output in outputs:
        if output is None:
            continue
        place = output.resolve()
        if output.is_dir():
            raise UserError(f"{output}: cannot be written (it is a folder)")
        if not place.parent.is_dir():
            raise UserError(f"{output}: cannot be written (there is no folder {output.parent})")
        if place in kept:
            raise UserError(f"{output}: is read or written already; name another file to write")
        if (place.parent / "manifest.json").exists():
            raise UserError(f"{output}: lies in a session folder, which is never written to again")
        kept.add(place)


def say(notices: tuple[Notice, ...]) -> None:
    """Print notices to the standard error, one sentence a line."""
    for notice in notices:
        typer.echo(f"{notice.level}: {notice.text}", err=True)


def status(recording: Recording, analysis: Analysis) -> int:
    """Say what failed or looks wrong; return 1 if an input was bad or an epoch failed, else 0."""
    from rigidimeter.study import analysis_warnings

    say(analysis_warnings(analysis))
    bad = recording.failed
    results: list[Fit | Score] = [*analysis.fits, *analysis.scores]
    for result in results:
        if result.outcome.kind == "failed":
            bad = True
            typer.echo(
                f"error: {result.source}, epoch {result.epoch}: {result.outcome.reason}", err=True
            )
    return int(bad)
