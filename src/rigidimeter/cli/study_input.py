"""A study folder on the command line: read, analysed and kept, with progress and sentences."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rigidimeter.cli.inputs import command_line, say
from rigidimeter.cli.options import Recordings, adjusted
from rigidimeter.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.records import Fit, Score
    from rigidimeter.study import StudyResult

__all__ = ["Analysed", "KeyOption", "analysed_study", "study_files", "study_of"]

KeyOption = Annotated[
    Path | None,
    typer.Option(
        "--key",
        metavar="FILE",
        help="Blinding key of a study folder (code,condition), where it is kept elsewhere.",
    ),
]

_OF_RECORDINGS = {
    "--column": "column",
    "--rate-hz": "rate_hz",
    "--reaction": "reaction",
    "--epoch-length-s": "epoch_length_s",
    "--condition": "condition",
    "--task": "task",
}


@dataclass(frozen=True)
class Analysed:
    """An analysed study, whether it was kept, and the status: 1 with a bad input."""

    result: StudyResult
    kept: bool
    status: int


def study_of(recordings: Recordings, key: Path | None) -> Path | None:
    """Return the study folder among the inputs; None if there is none.

    Raises
    ------
    UserError
        If a study folder is named beside other inputs, or an option does not go with what is named.
    """
    from rigidimeter.recording.study_folder import is_study
    from rigidimeter.recording.study_toml import STUDY_FILE

    studies = [path for path in recordings.paths if is_study(path)]
    if not studies:
        if key is not None:
            raise UserError(
                f"--key {key}: goes with a study folder, but {recordings.paths[0]} is none: it "
                f"has no {STUDY_FILE}"
            )
        return None
    if len(recordings.paths) > 1:
        raise UserError(
            f"{studies[0]}: is a study folder and names its own recordings; give it alone, or add "
            "the other recordings to its sessions.csv"
        )
    for option, name in _OF_RECORDINGS.items():
        if getattr(recordings, name):
            raise UserError(
                f"{option}: is for single recordings; those of a study folder are session folders, "
                "or files with the standard names"
            )
    return studies[0]


def study_files(folder: Path, key: Path | None) -> tuple[Path, ...]:
    """Return the study's own files, which no other output may be written over."""
    from rigidimeter.recording.study_folder import read_study_folder

    tables = read_study_folder(folder, key).files.values()
    return folder, *tables, *(folder / "analysis").glob("*")


def analysed_study(
    folder: Path,
    recordings: Recordings,
    key: Path | None,
    *,
    pair: tuple[str | None, str | None] = (None, None),
    seed: int = 1,
    resamples: int = 9999,
) -> Analysed:
    """Read and analyse a study folder, keep the analysis in it, and say what is wrong or new.

    Raises
    ------
    UserError
        If there is nothing to analyse.
    """
    from rigidimeter.cli.progress import Meter
    from rigidimeter.settings import load_settings
    from rigidimeter.study import analyse_study, keep, provenance, read_study

    chosen = load_settings(recordings.settings) if recordings.settings is not None else None
    with Meter("read", 1.0) as meter:
        read = read_study(
            folder,
            key=key,
            settings=chosen,
            method=recordings.method,
            pair=pair,
            progress=meter.advance,
        )
    read = replace(read, settings=adjusted(read.settings, recordings))
    with Meter("study", 1.0) as meter:
        result = analyse_study(read, seed=seed, resamples=resamples, progress=meter.advance)
    say(result.notices)
    bad = any(notice.level == "error" for notice in result.notices)
    bad |= _say_failed(result)
    changes, kept = [], True
    try:
        changes = keep(read, result)
    except UserError as error:
        typer.echo(f"error: the analysis is not kept: {error}", err=True)
        kept = False
    sessions = (folder / session.path for session in result.sessions)
    tables = (path for name, path in read.folder.files.items() if name != "key")
    facts = provenance((*tables, *sessions), result.settings, command_line())
    result = replace(result, changes=tuple(changes), provenance=facts)
    return Analysed(result, kept, int(bad or not kept))


def _say_failed(found: StudyResult) -> bool:
    results: list[Fit | Score] = [*found.analysis.fits, *found.analysis.scores]
    failed = [
        (result.source, result.epoch, result.outcome.reason)
        for result in results
        if result.outcome.kind == "failed"
    ]
    for source, epoch, reason in failed:
        typer.echo(f"error: {source}, epoch {epoch}: {reason}", err=True)
    return bool(failed)
