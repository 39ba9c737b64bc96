"""What commands do with their inputs: read and analyse them, protect them, say what was wrong."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rigidimeter.cli.output import echo
from rigidimeter.cli.reading_options import Recordings
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.analysis.reading import Recording
    from rigidimeter.analysis.study import StudyResult
    from rigidimeter.core.records import Analysis, Fit, Notice, Score
    from rigidimeter.core.study_files import StudyFolder

_OF_STUDIES_TOO = ("paths", "method", "band_hz", "controller", "settings")
"""Fields of `Recordings` that do not say how to read a single recording."""


def analyse_recordings(recordings: Recordings) -> tuple[Recording, Analysis]:
    """Read, fit and score recordings with progress, and say what is wrong with the inputs.

    Raises
    ------
    UserError
        If there is no such method, an option is wrong, or no input can be read.
    """
    from rigidimeter.analysis.estimation import method_names, no_such_method
    from rigidimeter.analysis.study import estimate
    from rigidimeter.cli.progress import Meter

    read = recordings.read()
    say(read.notices)
    if recordings.method not in method_names():
        raise UserError(f"--method {recordings.method}: {no_such_method(recordings.method)}")
    with Meter("estimate", 1.0) as meter:
        return read, estimate(read, recordings.method, progress=meter.advance)


def say_analysed(read: Recording, analysis: Analysis) -> int:
    """Say what is wrong with the results, after they were shown.

    Returns
    -------
    int
        The exit status: 1 if an input was bad or an epoch failed, else 0.
    """
    failed = _say_failed(analysis)
    return int(read.failed or failed)


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
        if not os.access(place.parent, os.W_OK):
            raise UserError(f"{output}: cannot be written ({output.parent} is not writable)")
        if place in kept:
            raise UserError(f"{output}: is read or written already; name another file to write")
        if (place.parent / "manifest.json").exists():
            raise UserError(f"{output}: lies in a session folder, which is never written to again")
        kept.add(place)


def say(notices: Iterable[Notice]) -> None:
    """Print notices to the standard error, one sentence a line.

    What is the same of several files is said once, of the first of them.
    """
    same: dict[tuple[str, str, str], list[str]] = {}
    for notice in notices:
        place, colon, rest = notice.text.partition(": ")
        # A separator marks a path; only what follows it may be the same of other files.
        key = (rest, Path(place).name) if colon and os.sep in place else (notice.text, "")
        same.setdefault((notice.level, *key), []).append(place)
    for (level, text, name), places in same.items():
        if name and len(places) > 1:
            text = f"{places[0]} and {len(places) - 1} more: {text}"
        elif name:
            text = f"{places[0]}: {text}"
        echo(f"{level}: {text}", err=True)


def _say_failed(analysis: Analysis) -> bool:
    """Say which epochs failed, and why; return whether any did."""
    results: list[Fit | Score] = [*analysis.fits, *analysis.scores]
    failed = [result for result in results if result.outcome.kind == "failed"]
    for result in failed:
        echo(f"error: {result.source}, epoch {result.epoch}: {result.outcome.reason}", err=True)
    return bool(failed)


class AnalysedStudy(NamedTuple):
    """An analysed study, and why the analysis was not kept in its folder, if it was not."""

    result: StudyResult
    not_kept: str

    def say(self) -> int:
        """Say what is wrong with it, after it was shown; return the exit status."""
        say(self.result.notices)
        bad = any(notice.level == "error" for notice in self.result.notices)
        # The screen says what could not be tested.
        bad |= any(c.paired and c.test is None and c.remark for c in self.result.comparisons)
        bad |= _say_failed(self.result.analysis)
        if self.not_kept:
            echo(f"error: the analysis is not stored: {self.not_kept}", err=True)
        return int(bad or bool(self.not_kept))


def study_of(recordings: Recordings, key: Path | None) -> Path | None:
    """Return the study folder among the inputs; None if there is none.

    Raises
    ------
    UserError
        If a study folder is named beside other inputs, or an option does not go with what is named.
    """
    from rigidimeter.core.study_files import STUDY_FILE, is_study

    studies = [path for path in recordings.paths if is_study(path)]
    if not studies:
        if key is not None:
            raise UserError(
                f"--key {key}: is for a study folder, but {recordings.paths[0]} is not one: it "
                f"has no {STUDY_FILE}"
            )
        return None
    if len(recordings.paths) > 1:
        raise UserError(
            f"{studies[0]}: is a study folder and names its own recordings; give it alone, or add "
            "the other recordings to its sessions.csv"
        )
    for name, given in vars(recordings).items():
        if given and name not in _OF_STUDIES_TOO:
            raise UserError(
                f"--{name.replace('_', '-')}: is for single recordings; those of a study folder "
                "are session folders or files that a mapping in study.toml describes"
            )
    return studies[0]


def study_files(folder: Path, key: Path | None) -> tuple[Path, ...]:
    """Return the study's own files, which no other output may be written over."""
    from rigidimeter.core.study_files import read_study_folder

    tables = read_study_folder(folder, key).files.values()
    return folder, *tables, *(folder / "analysis").glob("*")


def analyse_study_folder(
    folder: Path,
    recordings: Recordings,
    key: Path | None = None,
    *,
    pair: tuple[str | None, str | None] = (None, None),
    seed: int = 1,
    resamples: int = 9999,
) -> AnalysedStudy:
    """Read and analyse a study folder, and keep the analysis in it.

    Raises
    ------
    UserError
        If there is nothing to analyse.
    """
    from rigidimeter.analysis.study import analyse_study, keep, read_study
    from rigidimeter.cli.progress import Meter
    from rigidimeter.core.settings import load_settings

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
    read = replace(read, settings=recordings.adjust(read.settings))
    with Meter("study", 1.0) as meter:
        result = analyse_study(read, seed=seed, resamples=resamples, progress=meter.advance)
    changes, not_kept = [], ""
    try:
        changes = keep(read, result)
    except UserError as error:
        not_kept = str(error)
    result = replace(result, changes=tuple(changes))
    return AnalysedStudy(_with_provenance(result, read.folder, read.gathered.digests), not_kept)


def _with_provenance(
    result: StudyResult, folder: StudyFolder, digests: Mapping[str, str]
) -> StudyResult:
    """Return a result with where it comes from: the tables and the sessions that count."""
    from rigidimeter.analysis.study import provenance

    sessions = (folder.folder / session.path for session in result.sessions)
    tables = (path for name, path in folder.files.items() if name != "key")
    named = {path: folder.digests[name] for name, path in folder.files.items()}
    below = {folder.folder / name: digest for name, digest in digests.items()}
    facts = provenance((*tables, *sessions), named | below, result.settings, command_line())
    return replace(result, provenance=facts)
